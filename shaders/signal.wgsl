// Light per band and, with time of flight, its phasors: what is summed over samples.

#if PHASORS
#import phasor
#endif

struct Signal {
    light: vec3<f32>,
#if PHASORS
    phasors: BandPhasors,
#endif
}

// Squares of differences of signals: all bands together.
struct Squares {
    light: f32,
#if PHASORS
    // Of each frequency.
    phasors: vec4<f32>,
#endif
}

#if PHASORS
// Light that has travelled `turns`. Below 0: it is not modulated.
fn modulated_signal(light: vec3<f32>, turns: vec4<f32>) -> Signal {
    return Signal(light, band_phasors(select(vec3<f32>(0.0), light, turns.x >= 0.0), phasors_of(turns)));
}

fn add_signals(a: Signal, b: Signal) -> Signal {
    return Signal(a.light + b.light, add_phasors(a.phasors, b.phasors));
}

fn scaled_signal(signal: Signal, factor: f32) -> Signal {
    return Signal(factor * signal.light, BandPhasors(factor * signal.phasors.re, factor * signal.phasors.im));
}

fn squared_difference(a: Signal, b: Signal) -> Squares {
    let difference = a.light - b.light;
    return Squares(dot(difference, difference), squared_phasor_difference(a.phasors, b.phasors));
}

// `modulated` is for each frequency that is used.
fn squares_of(light: f32, modulated: f32) -> Squares {
    return Squares(light, modulated * modulation.is_used);
}

fn add_squares(a: Squares, b: Squares) -> Squares {
    return Squares(a.light + b.light, a.phasors + b.phasors);
}

fn scaled_squares(squares: Squares, factor: f32) -> Squares {
    return Squares(factor * squares.light, factor * squares.phasors);
}
#else
fn add_signals(a: Signal, b: Signal) -> Signal {
    return Signal(a.light + b.light);
}

fn scaled_signal(signal: Signal, factor: f32) -> Signal {
    return Signal(factor * signal.light);
}

fn squared_difference(a: Signal, b: Signal) -> Squares {
    let difference = a.light - b.light;
    return Squares(dot(difference, difference));
}

fn squares_of(light: f32, modulated: f32) -> Squares {
    return Squares(light);
}

fn add_squares(a: Squares, b: Squares) -> Squares {
    return Squares(a.light + b.light);
}

fn scaled_squares(squares: Squares, factor: f32) -> Squares {
    return Squares(factor * squares.light);
}
#endif
