//! The sample points of the bounce, and those of area lights.

use camlux::internals::{scrambled, sequence};

fn around(a: f32, b: f32) -> f32 {
    let apart = (a - b).abs();
    apart.min(1.0 - apart)
}

#[test]
fn points_keep_their_distance() {
    let points = sequence(4096);
    assert_eq!(points.len(), 4096);
    assert!(points.iter().flatten().all(|x| (0.0..1.0).contains(x)));
    // The first points, and those that a receiver continues with.
    for (first, count) in [
        (0, 64),
        (64, 64),
        (0, 256),
        (256, 256),
        (0, 1024),
        (0, 4096),
    ] {
        let points = &points[first..first + count];
        let mut nearest = f32::INFINITY;
        for (i, a) in points.iter().enumerate() {
            for b in &points[..i] {
                nearest = nearest.min(around(a[0], b[0]).hypot(around(a[1], b[1])));
            }
        }
        // The hexagonal lattice, which is optimal, has sqrt(2/√3) = 1.07; random points have 0.01 to 0.1.
        let spacing = nearest * (count as f32).sqrt();
        println!("{first} + {count}: {spacing}");
        assert!(spacing > 0.75);
    }
}

#[test]
fn each_coordinate_alone_falls_evenly() {
    for count in [64_u32, 128, 1024] {
        for coordinate in 0..2 {
            let mut places: Vec<u32> = sequence(count)
                .iter()
                .map(|point| (point[coordinate] * count as f32).floor() as u32)
                .collect();
            places.sort_unstable();
            assert!(
                places.into_iter().eq(0..count),
                "{count} points, coordinate {coordinate}"
            );
        }
    }
}

#[test]
fn neighbours_in_a_packet_are_neighbours_on_the_square() {
    let points = sequence(1024);
    let packets = points.chunks(64);
    let steps = packets.flat_map(|packet| packet.windows(2)).map(|pair| {
        let [[a, b], [c, d]] = [pair[0], pair[1]];
        (a - c).hypot(b - d)
    });
    // In a random order the mean would be 0.52.
    let mean = steps.sum::<f32>() / (1024.0 - 16.0);
    assert!(mean < 0.2, "{mean}");
}

/// The first 2ⁿ points, and the next 2ⁿ, put one point at a random position in each stratum of any shape. Another seed gives other points.
#[test]
fn scrambled_points_are_one_in_each_stratum() {
    for (seed, first, count) in [(1, 0, 8), (1, 8, 8), (7, 0, 64), (7, 64, 64), (9, 512, 512)] {
        let points: Vec<_> = (first..first + count).map(|i| scrambled(i, seed)).collect();
        let halvings = count.trailing_zeros();
        for columns in (0..=halvings).map(|n| 1_u32 << n) {
            let rows = count / columns;
            let place = |[x, y]: [f64; 2]| {
                let [column, row] = [x * f64::from(columns), y * f64::from(rows)];
                (column as u32 * rows + row as u32) as usize
            };
            let mut strata = vec![0; count as usize];
            points.iter().for_each(|&point| strata[place(point)] += 1);
            assert!(
                strata.iter().all(|&n| n == 1),
                "{columns} x {rows} of {first} + {count}"
            );
        }
        let within = points
            .iter()
            .flatten()
            .map(|x| (x * f64::from(count)).fract());
        let mean = within.sum::<f64>() / f64::from(2 * count);
        assert!((mean - 0.5).abs() < 1.2 / f64::from(count).sqrt(), "{mean}");
    }
    assert_ne!(scrambled(3, 1), scrambled(3, 2));
}
