//! Scatter plots with two logarithmic axes, as SVG.

use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::axis::{LogAxis, Unit, is_drawable};
use super::labels::Labels;
use crate::Failure;

const WIDTH_PX: u32 = 920;
/// The field between the axes.
const LEFT: i32 = 84;
const RIGHT: i32 = 900;
const TOP: i32 = 14;
const BOTTOM: i32 = 480;
const MARKER_PX: i32 = 5;
/// Middle of the legend's first row, and from row to row.
const LEGEND: i32 = BOTTOM + 68;
const LEGEND_ROW_PX: i32 = 26;

pub const INK: RGBColor = RGBColor(0x22, 0x22, 0x22);
pub const GRID: RGBColor = RGBColor(0xdd, 0xdd, 0xdd);
pub const PAPER: RGBColor = RGBColor(0xff, 0xff, 0xff);
/// Colours that stay apart for the colour-blind (Okabe & Ito 2008). Each goes with a shape of its own.
pub const COLORS: [RGBColor; 8] = [
    RGBColor(0x00, 0x72, 0xb2),
    RGBColor(0xd5, 0x5e, 0x00),
    RGBColor(0x00, 0x9e, 0x73),
    RGBColor(0x77, 0x77, 0x77),
    RGBColor(0xcc, 0x79, 0xa7),
    RGBColor(0xb0, 0x80, 0x00),
    RGBColor(0x88, 0x22, 0x55),
    RGBColor(0x33, 0xa0, 0xc0),
];

/// What is plotted.
pub struct Plot<'a> {
    pub x_title: &'a str,
    pub y_title: &'a str,
    pub y_unit: Unit,
    pub series: Vec<Series<'a>>,
    pub fronts: Vec<Front<'a>>,
    /// A dashed line across, with its text.
    pub floor: Option<(f64, String)>,
}

pub struct Series<'a> {
    pub name: &'a str,
    pub points: Vec<Point<'a>>,
}

pub struct Point<'a> {
    pub x: f64,
    /// Least and greatest.
    pub x_range: [f64; 2],
    pub y: f64,
    /// `y` is a bound: drawn hollow, with ≤ before the label.
    pub is_upper_bound: bool,
    /// What the contender itself says of `y`: drawn as a bar, joined to the point.
    pub own_estimate: Option<f64>,
    pub label: &'a str,
}

/// A Pareto front by rising x, drawn as the edge of what it beats.
pub struct Front<'a> {
    pub name: &'a str,
    pub points: Vec<(f64, f64)>,
    pub is_dashed: bool,
}

type Area<'s> = DrawingArea<SVGBackend<'s>, Shift>;

impl Plot<'_> {
    /// The plot as an SVG document; `None` where no point has a place on the axes.
    ///
    /// # Errors
    /// Where the SVG cannot be put together.
    pub fn to_svg(&self) -> Result<Option<String>, Failure> {
        let points = || self.drawable_points();
        let x_values = points().flat_map(|p| [p.x, p.x_range[0], p.x_range[1]]);
        let floor = self.floor.iter().map(|(y, _)| *y);
        let estimates = points().filter_map(|p| p.own_estimate);
        let y_values = points().map(|p| p.y).chain(estimates).chain(floor);
        let x = LogAxis::around(x_values, LEFT, RIGHT, Unit::Seconds);
        let y = LogAxis::around(y_values, BOTTOM, TOP, self.y_unit);
        let (Some(x), Some(y), true) = (x, y, points().next().is_some()) else {
            return Ok(None);
        };
        let mut svg = String::new();
        {
            let (_, legend_end) = self.legend_places().last().copied().unwrap_or((0, LEGEND));
            let size_px = (WIDTH_PX, (legend_end + LEGEND_ROW_PX) as u32);
            let area = SVGBackend::with_string(&mut svg, size_px).into_drawing_area();
            area.fill(&PAPER)?;
            self.draw_axes(&area, &x, &y)?;
            let mut labels = Labels::new([LEFT, TOP], [RIGHT, BOTTOM]);
            self.draw_fronts(&area, &x, &y, &mut labels)?;
            self.draw_points(&area, &x, &y, &mut labels)?;
            self.draw_legend(&area)?;
            area.present()?;
        }
        Ok(Some(svg))
    }

    fn drawable_points(&self) -> impl Iterator<Item = &Point<'_>> {
        let points = self.series.iter().flat_map(|series| &series.points);
        points.filter(|point| point.is_drawable())
    }

    fn draw_axes(&self, area: &Area, x: &LogAxis, y: &LogAxis) -> Result<(), Failure> {
        for tick in x.ticks() {
            let strength = if tick.text.is_some() { 1.0 } else { 0.45 };
            area.draw(&line(
                &[(tick.px, TOP), (tick.px, BOTTOM)],
                GRID.mix(strength).into(),
            ))?;
            if let Some(number) = tick.text {
                let at = (tick.px, BOTTOM + 6);
                area.draw(&Text::new(number, at, text(13, HPos::Center, VPos::Top)))?;
            }
        }
        for tick in y.ticks() {
            let strength = if tick.text.is_some() { 1.0 } else { 0.45 };
            area.draw(&line(
                &[(LEFT, tick.px), (RIGHT, tick.px)],
                GRID.mix(strength).into(),
            ))?;
            if let Some(number) = tick.text {
                let at = (LEFT - 7, tick.px);
                area.draw(&Text::new(number, at, text(13, HPos::Right, VPos::Center)))?;
            }
        }
        area.draw(&Rectangle::new([(LEFT, TOP), (RIGHT, BOTTOM)], INK))?;
        let below = ((LEFT + RIGHT) / 2, BOTTOM + 28);
        let centred = text(14, HPos::Center, VPos::Top);
        area.draw(&Text::new(self.x_title, below, centred.clone()))?;
        let beside = (14, (TOP + BOTTOM) / 2);
        let upwards = centred.transform(FontTransform::Rotate270);
        area.draw(&Text::new(self.y_title, beside, upwards))?;
        if let Some((value, words)) = self.floor.as_ref().filter(|(v, _)| is_drawable(*v)) {
            let at = y.px(*value);
            let ends = [(LEFT, at), (RIGHT, at)];
            area.draw(&DashedPathElement::new(ends, 7, 5, INK.stroke_width(1)))?;
            let style = text(12, HPos::Right, VPos::Bottom);
            area.draw(&Text::new(words.as_str(), (RIGHT - 6, at - 1), style))?;
        }
        Ok(())
    }

    fn draw_fronts(
        &self,
        area: &Area,
        x: &LogAxis,
        y: &LogAxis,
        labels: &mut Labels,
    ) -> Result<(), Failure> {
        for front in &self.fronts {
            let points = front.points.iter();
            let points: Vec<(i32, i32)> = points
                .filter(|(px, py)| is_drawable(*px) && is_drawable(*py))
                .map(|&(px, py)| (x.px(px), y.px(py)))
                .collect();
            let (Some(&(first, _)), Some(&(_, last))) = (points.first(), points.last()) else {
                continue;
            };
            let mut steps = vec![(first, TOP)];
            for (i, &point) in points.iter().enumerate() {
                if i > 0 {
                    steps.push((point.0, points[i - 1].1));
                }
                steps.push(point);
            }
            steps.push((RIGHT, last));
            front.draw_line(area, &steps)?;
            labels.avoid_line(&steps);
        }
        Ok(())
    }

    fn draw_points(
        &self,
        area: &Area,
        x: &LogAxis,
        y: &LogAxis,
        labels: &mut Labels,
    ) -> Result<(), Failure> {
        let at = |point: &Point| (x.px(point.x), y.px(point.y));
        for (index, series) in self.series.iter().enumerate() {
            let color = COLORS[index % COLORS.len()];
            let drawable = || series.points.iter().filter(|point| point.is_drawable());
            let path: Vec<(i32, i32)> = drawable().map(at).collect();
            area.draw(&line(&path, color.mix(0.6).stroke_width(2)))?;
            labels.avoid_line(&path);
            for point in drawable() {
                let (px, py) = at(point);
                let whisker = point.x_range.map(|x_end| (x.px(x_end), py));
                area.draw(&line(&whisker, color.stroke_width(1)))?;
                if let Some(estimate) = point.own_estimate.filter(|e| is_drawable(*e)) {
                    let at = y.px(estimate);
                    let stem = [(px, py), (px, at)];
                    let bar = [(px - MARKER_PX, at), (px + MARKER_PX, at)];
                    area.draw(&line(&stem, color.stroke_width(1)))?;
                    area.draw(&line(&bar, color.stroke_width(3)))?;
                    labels.avoid_line(&stem);
                }
                draw_marker(area, index, (px, py), point.is_upper_bound)?;
                labels.avoid_point([px, py]);
            }
        }
        for (index, series) in self.series.iter().enumerate() {
            let color = COLORS[index % COLORS.len()];
            for point in series.points.iter().filter(|point| point.is_drawable()) {
                let bound = if point.is_upper_bound { "≤ " } else { "" };
                let words = format!("{bound}{}", point.label);
                let [cx, cy] = labels.place(at(point).into(), &words);
                let style = text(12, HPos::Center, VPos::Center).color(&color);
                area.draw(&Text::new(words, (cx, cy), style))?;
            }
        }
        Ok(())
    }

    /// Where the items of the legend go, in rows below the plot: the series, then the fronts.
    fn legend_places(&self) -> Vec<(i32, i32)> {
        let mut at = (LEFT, LEGEND);
        let series = self.series.iter().map(|series| series.name);
        series
            .chain(self.drawn_fronts().map(|front| front.name))
            .map(|name| {
                let width = 44 + 8 * name.chars().count() as i32;
                if at.0 + width > RIGHT {
                    at = (LEFT, at.1 + LEGEND_ROW_PX);
                }
                let place = at;
                at.0 += width;
                place
            })
            .collect()
    }

    fn draw_legend(&self, area: &Area) -> Result<(), Failure> {
        let name_style = text(14, HPos::Left, VPos::Center);
        let mut places = self.legend_places().into_iter();
        for ((index, series), (px, py)) in self.series.iter().enumerate().zip(&mut places) {
            draw_marker(area, index, (px + 8, py), false)?;
            area.draw(&Text::new(series.name, (px + 20, py), name_style.clone()))?;
        }
        for (front, (px, py)) in self.drawn_fronts().zip(places) {
            front.draw_line(area, &[(px, py), (px + 22, py)])?;
            area.draw(&Text::new(front.name, (px + 28, py), name_style.clone()))?;
        }
        Ok(())
    }

    fn drawn_fronts(&self) -> impl Iterator<Item = &Front<'_>> {
        self.fronts.iter().filter(|front| !front.points.is_empty())
    }
}

impl Point<'_> {
    fn is_drawable(&self) -> bool {
        is_drawable(self.x) && is_drawable(self.y)
    }
}

impl Front<'_> {
    fn draw_line(&self, area: &Area, points: &[(i32, i32)]) -> Result<(), Failure> {
        let style = INK.mix(0.65).stroke_width(1);
        if self.is_dashed {
            let dashes = DashedPathElement::new(points.iter().copied(), 3, 4, style);
            Ok(area.draw(&dashes)?)
        } else {
            Ok(area.draw(&line(points, style))?)
        }
    }
}

fn line(points: &[(i32, i32)], style: ShapeStyle) -> PathElement<(i32, i32)> {
    PathElement::new(points.to_vec(), style)
}

fn text(size_px: u32, horizontal: HPos, vertical: VPos) -> TextStyle<'static> {
    // plotters writes the size divided by 1.24.
    ("sans-serif", f64::from(size_px) * 1.24)
        .into_text_style(&(WIDTH_PX, WIDTH_PX))
        .color(&INK)
        .pos(Pos::new(horizontal, vertical))
}

/// The marker of a series: filled, or hollow.
fn draw_marker(
    area: &Area,
    series: usize,
    (x, y): (i32, i32),
    is_hollow: bool,
) -> Result<(), Failure> {
    let r = MARKER_PX;
    let color = COLORS[series % COLORS.len()];
    let corners: &[(i32, i32)] = match series % COLORS.len() {
        0 => {
            let fill = if is_hollow { PAPER } else { color };
            area.draw(&Circle::new((x, y), r, fill.filled()))?;
            area.draw(&Circle::new((x, y), r, color.stroke_width(2)))?;
            return Ok(());
        }
        1 => &[(-r, -r), (r, -r), (r, r), (-r, r)],
        2 => &[(0, -r - 2), (r + 2, 0), (0, r + 2), (-r - 2, 0)],
        3 => &[(0, -r - 1), (r + 2, r), (-r - 2, r)],
        4 => &[(0, r + 1), (r + 2, -r), (-r - 2, -r)],
        5 => &[(-2, -r - 2), (2, -r - 2), (2, r + 2), (-2, r + 2)],
        6 => &[(-r - 2, -2), (r + 2, -2), (r + 2, 2), (-r - 2, 2)],
        _ => &[
            (0, -r - 1),
            (r + 1, -1),
            (r - 1, r),
            (-r + 1, r),
            (-r - 1, -1),
        ],
    };
    let mut outline: Vec<(i32, i32)> = corners.iter().map(|(dx, dy)| (x + dx, y + dy)).collect();
    let fill = if is_hollow { PAPER } else { color };
    area.draw(&Polygon::new(outline.clone(), fill))?;
    outline.extend(outline.first().copied());
    Ok(area.draw(&line(&outline, color.stroke_width(2)))?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn svg(own_estimate: Option<f64>) -> String {
        let point = |x: f64, y: f64, own_estimate| Point {
            x,
            x_range: [0.9 * x, 1.1 * x],
            y,
            is_upper_bound: false,
            own_estimate,
            label: "requested 5 %",
        };
        let points = vec![point(0.1, 0.2, None), point(0.2, 0.1, own_estimate)];
        let series = Series {
            name: "rays",
            points,
        };
        let plot = Plot {
            x_title: "time",
            y_title: "error",
            y_unit: Unit::Percent,
            series: vec![series],
            fronts: Vec::new(),
            floor: None,
        };
        plot.to_svg().unwrap().unwrap()
    }

    #[test]
    fn an_estimate_is_a_bar_joined_to_its_point() {
        let lines = |svg: &str| svg.matches("<polyline").count();
        let without = svg(None);
        // Within the axes that the points alone have.
        assert_eq!(lines(&svg(Some(0.15))), lines(&without) + 2);
        assert!(svg(Some(0.15)).contains("stroke-width=\"3\""));
        assert!(!without.contains("stroke-width=\"3\""));
        // What no axis holds is left out.
        assert_eq!(svg(Some(0.0)), without);
        // Far off, it widens the axis.
        assert!(svg(Some(1e-4)).contains("0.01 %") && !without.contains("0.01 %"));
    }
}
