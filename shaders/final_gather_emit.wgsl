// Emits rays from receivers along directions of their lobes. The directions are a lattice sequence, which is evenly distributed for any
// number of directions. Each receiver shifts it by its own numbers, so it can continue later where it stopped.

#import final_gather_receiver
#import texel_list

// Lattice sequence on the unit square. Each packet is in Morton order. A sampled image, because some devices allow only eight storage
// images per kernel.
var lattice: texture_2d<f32>;
var<storage, read_write> rays: array<Ray>;

fn emit(ray: u32, receiver: Receiver, direction: vec3<f32>, is_wanted: bool) {
    rays[ray] = Ray(receiver.start, select(NO_RAY, NO_END, is_wanted), direction, 0.0);
}

@compute @workgroup_size(64)
fn compute_main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let index = LANES * (group.x + 65535u * group.y) + local / LANES;
    if (index >= parameters.packet_count) {
        return;
    }
    let packet = packets[index];
    let receiver = receiver_of(packet);
    let seed0 = seed_of(packet);
    let shift = vec2<f32>(unit(seed0), unit(hash(seed0)));
    let around_normal = frame_around(receiver.normal);
    let around_lobe = lobe_frame(receiver.lobe);
    for (var sample = local % LANES; sample < SAMPLES; sample += LANES) {
        let place = textureLoad(lattice, list_place(SAMPLES * packet.number + sample), 0).xy;
        let direction = sample_diffuse(fract(place + shift), around_normal);
        emit(direction_ray(index, 0u, sample), receiver, direction, receiver.has_base && dot(receiver.geometric_normal, direction) > 0.0);
        if (GLOSSY) {
            let in_lobe = sample_lobe(fract(place + shift.yx), receiver.lobe, around_lobe);
            let is_above = dot(receiver.geometric_normal, in_lobe) > 0.0 && dot(receiver.normal, in_lobe) > 0.0;
            emit(direction_ray(index, 1u, sample), receiver, in_lobe, is_above);
        }
    }
}
