// Which pixels the rays of a workgroup of 64 invocations stand for.

const TILE_COLUMNS: u32 = 32u;
const TILE_ROWS: u32 = 16u;

// A packet of eight lanes takes 8 x 8 pixels, of which each ray of its lanes takes 4 x 2: neighbours part late.
fn place_of(group: vec2<u32>, local: u32, ray: u32) -> vec2<u32> {
    let packet = vec2<u32>(local >> 3u & 3u, local >> 5u);
    let in_packet = vec2<u32>(4u * (ray & 1u) + (local & 3u), 2u * (ray >> 1u) + (local >> 2u & 1u));
    return vec2<u32>(TILE_COLUMNS, TILE_ROWS) * group + 8u * packet + in_packet;
}

