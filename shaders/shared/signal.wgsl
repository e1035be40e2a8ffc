// Light per band and, with time of flight, its phasors: what is summed over samples or over VPLs.

#import phasor

#if PHASORS
struct Signal {
    light: vec3<f32>,
    phasors: BandPhasors,
}

// `modulated` is the part of the light that has phasors, those of its path.
fn modulated_signal(light: vec3<f32>, modulated: vec3<f32>, path: Phasors) -> Signal {
    return Signal(light, band_phasors(modulated, path));
}

// In one step: in the gather's inner loop, a driver takes twice as long to compile two.
fn add_modulated(sum: Signal, light: vec3<f32>, path: Phasors) -> Signal {
    return Signal(sum.light + light,
        BandPhasors(Phasors(sum.phasors.red.re + light.r * path.re, sum.phasors.red.im + light.r * path.im),
            Phasors(sum.phasors.green.re + light.g * path.re, sum.phasors.green.im + light.g * path.im),
            Phasors(sum.phasors.blue.re + light.b * path.re, sum.phasors.blue.im + light.b * path.im)));
}

fn add_signals(a: Signal, b: Signal) -> Signal {
    return Signal(a.light + b.light, add_phasors(a.phasors, b.phasors));
}

// A factor per band.
fn scaled_signal(signal: Signal, factor: vec3<f32>) -> Signal {
    return Signal(factor * signal.light, scaled_phasors(signal.phasors, factor));
}

fn phasors_in(signal: Signal) -> BandPhasors {
    return signal.phasors;
}
#else
struct Signal {
    light: vec3<f32>,
}

fn modulated_signal(light: vec3<f32>, modulated: vec3<f32>, path: Phasors) -> Signal {
    return Signal(light);
}

fn add_modulated(sum: Signal, light: vec3<f32>, path: Phasors) -> Signal {
    return Signal(sum.light + light);
}

fn add_signals(a: Signal, b: Signal) -> Signal {
    return Signal(a.light + b.light);
}

fn scaled_signal(signal: Signal, factor: vec3<f32>) -> Signal {
    return Signal(factor * signal.light);
}

fn phasors_in(signal: Signal) -> BandPhasors {
    return BandPhasors();
}
#endif
