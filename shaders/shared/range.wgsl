// How errors of Z become errors of range.

#import modulation

fn metres_per_radian(pair: u32) -> vec2<f32> {
    return select(modulation.metres_per_radian.xy, modulation.metres_per_radian.zw, pair == 1u);
}

// Mean squared error of range, m², over that of Z; 0 where there is no Z.
fn squared_range_per_phasor(pair: u32, squares: vec2<f32>) -> vec2<f32> {
    let metres = metres_per_radian(pair);
    let share = select(modulation.turning_shares.xy, modulation.turning_shares.zw, pair == 1u);
    return select(vec2<f32>(0.0), share * metres * metres / squares, squares > vec2<f32>(0.0));
}
