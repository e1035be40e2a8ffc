//! The Pareto front: the points that no other point beats.

/// The Pareto front of points (cost, error), where smaller is better in both. Returns the indices of the points that no other point beats:
/// a point beats another if it is better in one value and not worse in the other. Sorted by rising cost; of equal points the first. A point
/// with a non-finite value is on no front.
pub fn front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len())
        .filter(|&i| points[i].0.is_finite() && points[i].1.is_finite())
        .collect();
    // A stable sort keeps equal points in order.
    order.sort_by(|&a, &b| {
        let ((cost_a, error_a), (cost_b, error_b)) = (points[a], points[b]);
        cost_a.total_cmp(&cost_b).then(error_a.total_cmp(&error_b))
    });
    let mut lowest_error = f64::INFINITY;
    order.retain(|&i| {
        let is_lower = points[i].1 < lowest_error;
        lowest_error = lowest_error.min(points[i].1);
        is_lower
    });
    order
}

#[cfg(test)]
mod tests {
    use super::front;

    #[test]
    fn keeps_what_nothing_beats() {
        let points = [(4.0, 1.0), (1.0, 8.0), (2.0, 2.0), (3.0, 3.0), (2.5, 9.0)];
        // (3, 3) and (2.5, 9) are beaten by (2, 2).
        assert_eq!(front(&points), [1, 2, 0]);
    }

    #[test]
    fn a_point_that_one_dominates_in_one_coordinate_is_not_on_it() {
        assert_eq!(front(&[(1.0, 2.0), (1.0, 1.0)]), [1]);
        assert_eq!(front(&[(1.0, 1.0), (2.0, 1.0)]), [0]);
    }

    #[test]
    fn of_equal_points_the_first_is_taken() {
        assert_eq!(front(&[(2.0, 2.0), (1.0, 3.0), (2.0, 2.0)]), [1, 0]);
    }

    #[test]
    fn what_is_not_finite_is_left_out() {
        let points = [
            (f64::NAN, 0.1),
            (1.0, f64::NAN),
            (0.1, f64::INFINITY),
            (5.0, 5.0),
        ];
        assert_eq!(front(&points), [3]);
        assert!(front(&[]).is_empty());
    }
}
