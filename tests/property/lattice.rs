//! The points from which the bounce draws.

use camlux::internals::rank1;

#[test]
fn points_keep_their_distance() {
    for count in [32, 64, 192, 256, 1024, 4096] {
        let points = rank1(count);
        assert_eq!(points.len(), count as usize);
        assert!(points.iter().flatten().all(|x| (0.0..1.0).contains(x)));
        let around = |a: f32, b: f32| {
            let apart = (a - b).abs();
            apart.min(1.0 - apart)
        };
        let mut nearest = f32::INFINITY;
        for (i, a) in points.iter().enumerate() {
            for b in &points[..i] {
                nearest = nearest.min(around(a[0], b[0]).hypot(around(a[1], b[1])));
            }
        }
        // The hexagonal lattice, the best there is, has sqrt(2/√3) = 1.07.
        let spacing = nearest * (count as f32).sqrt();
        println!("{count}: {spacing}");
        assert!(spacing > 0.9);
    }
}

/// With a divisor of 16 the bounce of the knot at 320 draws had twice the error of that at 256.
#[test]
fn each_coordinate_alone_falls_evenly() {
    for count in (1..40).map(|packets| 64 * packets) {
        for axis in 0..2 {
            let mut places: Vec<u32> = rank1(count)
                .iter()
                .map(|point| (point[axis] * count as f32).round() as u32)
                .collect();
            places.sort_unstable();
            assert!(
                places.into_iter().eq(0..count),
                "{count} points, axis {axis}"
            );
        }
    }
}

#[test]
fn neighbours_in_the_list_are_neighbours_on_the_square() {
    let points = rank1(1024);
    let steps = points.windows(2).map(|pair| {
        let [[a, b], [c, d]] = [pair[0], pair[1]];
        (a - c).hypot(b - d)
    });
    // In a random order the mean would be 0.52.
    assert!(steps.sum::<f32>() / 1023.0 < 0.06);
}
