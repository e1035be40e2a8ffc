// Squares of differences of signals: all bands together.

#import signal

struct Squares {
    light: f32,
    // Of each frequency.
    phasors: vec4<f32>,
}

fn squared_difference(a: Signal, b: Signal) -> Squares {
    let difference = a.light - b.light;
    return Squares(dot(difference, difference), squared_phasor_difference(phasors_in(a), phasors_in(b)));
}

// |a − b|² of each frequency, summed over the bands that pixels see.
fn squared_phasor_difference(a: BandPhasors, b: BandPhasors) -> vec4<f32> {
    if (PHASORS) {
        let red = squared_magnitude(a.red.re - b.red.re, a.red.im - b.red.im);
        let green = squared_magnitude(a.green.re - b.green.re, a.green.im - b.green.im);
        let blue = squared_magnitude(a.blue.re - b.blue.re, a.blue.im - b.blue.im);
        return mat3x4<f32>(red, green, blue) * modulation.is_seen;
    } else {
        return vec4<f32>(0.0);
    }
}

fn squared_magnitude(re: vec4<f32>, im: vec4<f32>) -> vec4<f32> {
    return re * re + im * im;
}

// `modulated` is for each frequency that is used.
fn squares_of(light: f32, modulated: f32) -> Squares {
    if (PHASORS) {
        return Squares(light, modulated * modulation.is_used);
    } else {
        return Squares(light, vec4<f32>(0.0));
    }
}

fn add_squares(a: Squares, b: Squares) -> Squares {
    return Squares(a.light + b.light, a.phasors + b.phasors);
}

fn scaled_squares(squares: Squares, factor: f32) -> Squares {
    return Squares(factor * squares.light, factor * squares.phasors);
}
