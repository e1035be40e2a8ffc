// Sums over a receiver's samples or VPLs: light that its diffuse and its specular lobe reflect, as if k_d and k_s were 1.

#import refinement
#import signal

// In the refinement's layout.
var<storage, read_write> results: array<vec4<f32>>;

// The light comes with its squared differences. The first addition replaces what was there.
fn add_to_result(receiver: u32, lobe: u32, signal: Signal, squares: f32, is_first: bool) {
    let place = RESULT_VECTORS * receiver;
    add_to_vector(place + lobe, vec4<f32>(signal.light, squares), is_first);
    if (PHASORS) {
        let phasors = phasors_in(signal);
        for (var pair = 0u; pair < PAIRS; pair++) {
            add_to_vector(place + phasor_result(pair, 0u, lobe), phasor_pair(phasors.red, pair), is_first);
            add_to_vector(place + phasor_result(pair, 1u, lobe), phasor_pair(phasors.green, pair), is_first);
            add_to_vector(place + phasor_result(pair, 2u, lobe), phasor_pair(phasors.blue, pair), is_first);
        }
    }
}

fn add_to_vector(place: u32, value: vec4<f32>, is_first: bool) {
    results[place] = select(results[place], vec4<f32>(0.0), is_first) + value;
}
