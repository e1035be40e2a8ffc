//! Where the labels of points go, so that they cover neither each other nor the points.

/// Estimated size of a letter at the size of labels.
const LETTER_PX: [i32; 2] = [7, 14];
/// From a point's centre to its label.
const GAP_PX: i32 = 9;
/// Lines are kept free at points that lie so far apart.
const LINE_STEP_PX: i32 = 4;

/// Edges of a rectangle: left, top, right, bottom.
#[derive(Clone, Copy)]
struct Rect([i32; 4]);

impl Rect {
    fn overlap(&self, other: &Rect) -> i32 {
        let ([al, at, ar, ab], [bl, bt, br, bb]) = (self.0, other.0);
        let width = ar.min(br) - al.max(bl);
        let height = ab.min(bb) - at.max(bt);
        width.max(0) * height.max(0)
    }
}

/// What is taken already.
pub struct Labels {
    field: Rect,
    taken: Vec<Rect>,
}

impl Labels {
    /// For a field between two corners in pixels.
    pub fn new(top_left: [i32; 2], bottom_right: [i32; 2]) -> Self {
        Labels {
            field: Rect([top_left[0], top_left[1], bottom_right[0], bottom_right[1]]),
            taken: Vec::new(),
        }
    }

    /// Keeps a point's marker free.
    pub fn avoid_point(&mut self, [x, y]: [i32; 2]) {
        self.taken.push(Rect([x - 6, y - 6, x + 6, y + 6]));
    }

    /// Keeps the line through some points free, where that can be had.
    pub fn avoid_line(&mut self, points: &[(i32, i32)]) {
        for ends in points.windows(2) {
            let ((x0, y0), (x1, y1)) = (ends[0], ends[1]);
            let steps = ((x1 - x0).abs().max((y1 - y0).abs()) / LINE_STEP_PX).max(1);
            for step in 0..=steps {
                let x = x0 + (x1 - x0) * step / steps;
                let y = y0 + (y1 - y0) * step / steps;
                self.taken.push(Rect([x - 1, y - 1, x + 2, y + 2]));
            }
        }
    }

    /// The centre of the label of a point: the best of eight places around it, near ones first.
    pub fn place(&mut self, [x, y]: [i32; 2], text: &str) -> [i32; 2] {
        let half_width = (text.chars().count() as i32 * LETTER_PX[0]) / 2;
        let half_height = LETTER_PX[1] / 2;
        let beside = GAP_PX + half_width;
        let over = GAP_PX + half_height;
        let places = [
            [0, -over],
            [0, over],
            [beside, 0],
            [-beside, 0],
            [beside, -over],
            [-beside, -over],
            [beside, over],
            [-beside, over],
            [0, -2 * over],
            [0, 2 * over],
        ];
        let rect = |[dx, dy]: [i32; 2]| {
            let [cx, cy] = [x + dx, y + dy];
            Rect([
                cx - half_width,
                cy - half_height,
                cx + half_width,
                cy + half_height,
            ])
        };
        let area = 4 * half_width * half_height;
        let covered = |place: &[i32; 2]| {
            let rect = rect(*place);
            let outside = area - rect.overlap(&self.field);
            outside + self.taken.iter().map(|t| rect.overlap(t)).sum::<i32>()
        };
        // Of equals the first.
        let best = places.into_iter().min_by_key(covered).unwrap_or([0, -over]);
        self.taken.push(rect(best));
        [x + best[0], y + best[1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_of_a_row_of_points_stay_apart() {
        let points: Vec<[i32; 2]> = (0..5).map(|i| [100 + 22 * i, 100]).collect();
        let mut labels = Labels::new([0, 0], [400, 200]);
        for &point in &points {
            labels.avoid_point(point);
        }
        for &point in &points {
            labels.place(point, "64²");
        }
        for (i, a) in labels.taken.iter().enumerate() {
            for b in &labels.taken[..i] {
                assert_eq!(a.overlap(b), 0);
            }
        }
    }

    #[test]
    fn a_label_stays_in_the_field() {
        let mut labels = Labels::new([0, 0], [100, 100]);
        let [_, y] = labels.place([50, 2], "64²");
        assert!(y > 2);
    }

    #[test]
    fn a_label_keeps_off_a_line() {
        let mut labels = Labels::new([0, 0], [100, 100]);
        labels.avoid_line(&[(0, 34), (100, 34)]);
        let [_, y] = labels.place([50, 50], "64²");
        assert!(y > 50);
    }
}
