//! The points from which the bounce draws.

use camlux::internals::sequence;

fn around(a: f32, b: f32) -> f32 {
    let apart = (a - b).abs();
    apart.min(1.0 - apart)
}

#[test]
fn points_keep_their_distance() {
    let points = sequence(4096);
    assert_eq!(points.len(), 4096);
    assert!(points.iter().flatten().all(|x| (0.0..1.0).contains(x)));
    // The first ones, and those that a receiver goes on with.
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
        // The hexagonal lattice, the best there is, has sqrt(2/√3) = 1.07; points at random have 0.01 to 0.1.
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
