// How a light spreads its power over the directions. The importing file defines a function pattern_number that reads the numbers of the
// pattern.
//
// A measured radiation pattern is interpolated linearly in γ and C. Its numbers are the nodes of γ, the nodes of C, and for each node of C
// an intensity for each node of γ. The numbers of a projector are fx, fy, cx, cy and its pixels.

// A node of γ or of C, and where a value is between it and the next node.
struct PatternPlace {
    node: u32,
    share: f32,
}

// The last node that is not above the value, but never the very last node of the list.
fn pattern_place(light: Light, first: u32, count: u32, value: f32) -> PatternPlace {
    var low = 0u;
    var high = count - 1u;
    loop {
        if (high - low <= 1u) {
            break;
        }
        let middle = (low + high) / 2u;
        let is_before = pattern_number(light, first + middle) <= value;
        low = select(low, middle, is_before);
        high = select(middle, high, is_before);
    }
    let before = pattern_number(light, first + low);
    let after = pattern_number(light, first + low + 1u);
    return PatternPlace(low, clamp((value - before) / (after - before), 0.0, 1.0));
}

// p in a direction, a unit vector: 0 to 1.
fn measured_intensity(light: Light, direction: vec3<f32>) -> f32 {
    let gamma_count = light.pattern_columns;
    let plane_count = light.pattern_rows;
    let along = dot(direction, light.axis);
    let x = dot(direction, light.plane_0);
    let y = dot(direction, cross(light.plane_0, light.axis));
    let gamma = angle_of(length(vec2<f32>(x, y)), along);
    let half_turn = angle_of(abs(y), x);
    let plane = select(half_turn, 2.0 * PI - half_turn, y < 0.0);
    let row = pattern_place(light, 0u, gamma_count, gamma);
    let column = pattern_place(light, gamma_count, plane_count, plane);
    let is_within = gamma >= pattern_number(light, 0u) && gamma <= pattern_number(light, gamma_count - 1u);
    let first = gamma_count + plane_count + column.node * gamma_count + row.node;
    let a = mix(pattern_number(light, first), pattern_number(light, first + 1u), row.share);
    let b = mix(pattern_number(light, first + gamma_count), pattern_number(light, first + gamma_count + 1u), row.share);
    return select(0.0, mix(a, b, column.share), is_within);
}

// The same for a projector. Each pixel lights a screen perpendicular to the axis evenly, so I = E/cos³θ. Off the axis it may exceed 1.
fn projected_intensity(light: Light, direction: vec3<f32>) -> f32 {
    let along = dot(direction, light.axis);
    let right = dot(direction, cross(light.axis, light.plane_0)) / along;
    let down = -dot(direction, light.plane_0) / along;
    let place = vec2<f32>(pattern_number(light, 0u) * right + pattern_number(light, 2u), pattern_number(light, 1u) * down + pattern_number(light, 3u));
    let size = vec2<f32>(f32(light.pattern_columns), f32(light.pattern_rows));
    let is_inside = along > 0.0 && all(place >= vec2<f32>(0.0)) && all(place < size);
    let pixel = vec2<u32>(select(vec2<f32>(0.0), place, is_inside));
    let value = pattern_number(light, 4u + pixel.y * light.pattern_columns + pixel.x);
    let squared = 1.0 + right * right + down * down;
    return select(0.0, value * squared * sqrt(squared), is_inside);
}
