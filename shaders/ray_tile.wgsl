// Assigns pixels to the rays of a workgroup of 64 invocations.

const TILE_COLUMNS: u32 = 32u;
const TILE_ROWS: u32 = 2u * RAYS;

// Eight lanes take 8 x RAYS pixels. One ray of each lane covers 4 x 2 of them, so that neighbouring rays diverge late.
fn place_of(group: vec2<u32>, local: u32, ray: u32) -> vec2<u32> {
    let packet = vec2<u32>(local >> 3u & 3u, local >> 5u);
    let in_packet = vec2<u32>(4u * (ray & 1u) + (local & 3u), 2u * (ray >> 1u) + (local >> 2u & 1u));
    return vec2<u32>(TILE_COLUMNS, TILE_ROWS) * group + vec2<u32>(8u, RAYS) * packet + in_packet;
}

