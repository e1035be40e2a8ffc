//! Places the labels of points so that they cover neither each other nor the points.

use std::ops::Range;

use embedded_graphics::geometry::{Point, Size};
use embedded_graphics::primitives::{Line, PointsIter, Rectangle};

/// Estimated width of a letter, relative to the font size of labels.
const LETTER_PX: Size = Size::new(7, 14);
/// Distance from a point's centre to its label.
const GAP_PX: i32 = 9;

/// Areas that are already taken.
pub struct Labels {
    field: Rectangle,
    taken: Vec<Rectangle>,
}

impl Labels {
    /// Labels for a plot area of these columns and rows.
    pub fn new(x: Range<i32>, y: Range<i32>) -> Self {
        let (start, end) = (Point::new(x.start, y.start), Point::new(x.end, y.end));
        Labels {
            field: Rectangle::with_corners(start, end),
            taken: Vec::new(),
        }
    }

    /// Keeps a point's marker free.
    pub fn avoid_point(&mut self, at: (i32, i32)) {
        let marker = Rectangle::with_center(at.into(), Size::new_equal(12));
        self.taken.push(marker);
    }

    /// Keeps the line through some points free if possible.
    pub fn avoid_line(&mut self, points: &[(i32, i32)]) {
        for ends in points.windows(2) {
            let line = Line::new(ends[0].into(), ends[1].into());
            let dots = line.points().step_by(4);
            self.taken
                .extend(dots.map(|dot| Rectangle::with_center(dot, Size::new_equal(3))));
        }
    }

    /// The centre of a point's label: the best of ten places around it; near places are tried first.
    pub fn place(&mut self, at: (i32, i32), text: &str) -> (i32, i32) {
        let size = Size::new(text.chars().count() as u32, 1).component_mul(LETTER_PX);
        let (beside, over) = (
            GAP_PX + size.width as i32 / 2,
            GAP_PX + size.height as i32 / 2,
        );
        let places = [
            (0, -over),
            (0, over),
            (beside, 0),
            (-beside, 0),
            (beside, -over),
            (-beside, -over),
            (beside, over),
            (-beside, over),
            (0, -2 * over),
            (0, 2 * over),
        ]
        .map(|offset| Rectangle::with_center(Point::from(at) + Point::from(offset), size));
        let overlap = |a: &Rectangle, b: &Rectangle| area(&a.intersection(b));
        let covered = |label: &Rectangle| {
            let outside = area(label) - overlap(label, &self.field);
            outside + self.taken.iter().map(|t| overlap(label, t)).sum::<u32>()
        };
        // The first of equally good places.
        let best = places.into_iter().min_by_key(covered).unwrap_or(places[0]);
        self.taken.push(best);
        best.center().into()
    }
}

fn area(rectangle: &Rectangle) -> u32 {
    rectangle.size.width * rectangle.size.height
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_of_a_row_of_points_stay_apart() {
        let points: Vec<(i32, i32)> = (0..5).map(|i| (100 + 22 * i, 100)).collect();
        let mut labels = Labels::new(0..400, 0..200);
        for &point in &points {
            labels.avoid_point(point);
        }
        for &point in &points {
            labels.place(point, "64²");
        }
        for (i, a) in labels.taken.iter().enumerate() {
            for b in &labels.taken[..i] {
                assert_eq!(area(&a.intersection(b)), 0);
            }
        }
    }

    #[test]
    fn a_label_stays_in_the_field() {
        let mut labels = Labels::new(0..100, 0..100);
        let (_, y) = labels.place((50, 2), "64²");
        assert!(y > 2);
    }

    #[test]
    fn a_label_keeps_off_a_line() {
        let mut labels = Labels::new(0..100, 0..100);
        labels.avoid_line(&[(0, 34), (100, 34)]);
        let (_, y) = labels.place((50, 50), "64²");
        assert!(y > 50);
    }
}
