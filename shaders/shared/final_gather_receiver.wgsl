// A receiver P and the seeds of its samples.

#import final_gather

var position_instance: texture_2d<f32>;
var normal_geometric: texture_2d<f32>;
var lobe_parameters: texture_2d<f32>;
var<storage, read> receivers: array<u32>;
var<storage, read> packets: array<Packet>;

fn pixel_of(packet: Packet) -> vec2<u32> {
    let packed = receivers[packet.receiver];
    return vec2<u32>(packed & 0xffffu, packed >> 16u);
}

fn receiver_of(packet: Packet) -> Receiver {
    var receiver: Receiver;
    receiver.pixel = pixel_of(packet);
    receiver.position = textureLoad(position_instance, receiver.pixel, 0).xyz;
    let normal = textureLoad(normal_geometric, receiver.pixel, 0);
    receiver.normal = normal.xyz;
    receiver.geometric_normal = unpack_direction(normal.w);
    // If P is also in a second surface, as in the corner of two walls, the ray starts on the side that the camera sees: nothing is between
    // P and the camera.
    let to_camera = normalize(parameters.camera_position - receiver.position);
    receiver.start = before_surface(receiver.position, receiver.geometric_normal, ORIGIN_SHIFT) + ORIGIN_SHIFT * to_camera;
    receiver.has_base = true;
    if (GLOSSY) {
        let lobe = textureLoad(lobe_parameters, receiver.pixel, 0);
        receiver.lobe = lobe_of(to_camera, receiver.normal, lobe);
        receiver.has_base = !is_bare(lobe);
    }
    return receiver;
}

// The set of VPLs that a receiver takes.
fn set_of(packet: Packet) -> u32 {
    return packet.receiver % parameters.set_count;
}

fn seed_of(packet: Packet) -> u32 {
    return hash(receivers[packet.receiver] ^ hash(parameters.seed + set_of(packet)));
}
