//! Scatter plots with two logarithmic axes, as SVG.

use std::f64::consts::TAU;

use plotters::coord::Shift;
use plotters::coord::combinators::WithKeyPoints;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::labels::Labels;
use crate::Failure;

const WIDTH_PX: u32 = 920;
/// Includes the axes, excludes the legend.
const HEIGHT_PX: u32 = 540;
const MARKER_PX: f64 = 6.0;
const LEGEND_COLUMNS: i32 = 3;
const LEGEND_COLUMN_PX: i32 = 280;
const LEGEND_ROW_PX: i32 = 26;

const INK: RGBColor = RGBColor(0x22, 0x22, 0x22);
const GRID: RGBColor = RGBColor(0xdd, 0xdd, 0xdd);
const PAPER: RGBColor = RGBColor(0xff, 0xff, 0xff);
/// Colours that colour-blind readers can tell apart (Okabe & Ito 2008). Each has its own marker.
const COLORS: [RGBColor; 8] = [
    RGBColor(0x00, 0x72, 0xb2),
    RGBColor(0xd5, 0x5e, 0x00),
    RGBColor(0x00, 0x9e, 0x73),
    RGBColor(0x77, 0x77, 0x77),
    RGBColor(0xcc, 0x79, 0xa7),
    RGBColor(0xb0, 0x80, 0x00),
    RGBColor(0x88, 0x22, 0x55),
    RGBColor(0x33, 0xa0, 0xc0),
];
/// Markers as polygons: number of corners, direction of the first corner in turns from the top, and radius factor of every other corner.
const MARKERS: [(u32, f64, f64); 8] = [
    (12, 0.0, 1.0),
    (4, 0.125, 1.0),
    (4, 0.0, 1.0),
    (3, 0.0, 1.0),
    (3, 0.5, 1.0),
    (8, 0.0, 0.4),
    (10, 0.0, 0.4),
    (5, 0.0, 1.0),
];

/// Pareto fronts, drawn as edges of the area that they beat; the second one is dashed.
const FRONTS: [&str; 2] = ["Pareto front of the engine", "Pareto front of all"];

/// The contents of a plot.
pub struct Plot<'a> {
    pub x_title: &'a str,
    /// Formats a round value of the axis.
    pub x_text: fn(f64) -> String,
    pub y_title: &'a str,
    pub y_text: fn(f64) -> String,
    /// Each series has its colour, also if it has no point.
    pub series: Vec<&'a str>,
    /// Points of a series are joined in this order.
    pub points: Vec<Point<'a>>,
    /// Noise of the reference: a dashed horizontal line.
    pub floor: Option<f64>,
}

pub struct Point<'a> {
    pub series: &'a str,
    pub x: f64,
    /// Minimum and maximum.
    pub x_range: [f64; 2],
    pub y: f64,
    /// `y` is an upper bound: drawn hollow, with ≤ before the label.
    pub is_upper_bound: bool,
    /// The entry's own estimate of `y`: drawn as a bar that is joined to the point.
    pub own_estimate: Option<f64>,
    /// One flag for each of `FRONTS`.
    pub is_on_front: [bool; 2],
    pub label: &'a str,
}

type Area<'s> = DrawingArea<SVGBackend<'s>, Shift>;
type Axis = WithKeyPoints<LogCoord<f64>>;
type Field<'s> = DrawingArea<SVGBackend<'s>, Cartesian2d<Axis, Axis>>;

impl Plot<'_> {
    /// The plot as an SVG document; `None` if no point fits on the axes.
    ///
    /// # Errors
    /// If the SVG cannot be put together.
    pub fn into_svg(mut self) -> Result<Option<String>, Failure> {
        self.points
            .retain(|point| is_drawable(&point.x) && is_drawable(&point.y));
        if self.points.is_empty() {
            return Ok(None);
        }
        let rows = (self.series.len() + FRONTS.len()).div_ceil(LEGEND_COLUMNS as usize);
        let size_px = (WIDTH_PX, HEIGHT_PX + rows as u32 * LEGEND_ROW_PX as u32);
        let mut svg = String::new();
        {
            let area = SVGBackend::with_string(&mut svg, size_px).into_drawing_area();
            area.fill(&PAPER)?;
            self.draw_field(&area)?;
            self.draw_legend(&area)?;
            area.present()?;
        }
        Ok(Some(svg))
    }

    fn draw_field(&self, area: &Area) -> Result<(), Failure> {
        let x_values = self.points.iter().flat_map(|point| point.x_range);
        let estimates = self.points.iter().filter_map(|point| point.own_estimate);
        let y_values = self.points.iter().map(|point| point.y);
        let y_values = y_values.chain(estimates).chain(self.floor);
        let (plot, _) = area.split_vertically(HEIGHT_PX);
        let mut chart = ChartBuilder::on(&plot)
            .margin(14)
            .margin_right(24)
            .x_label_area_size(50)
            .y_label_area_size(70)
            .build_cartesian_2d(axis(x_values), axis(y_values))?;
        chart
            .configure_mesh()
            .axis_style(INK)
            .bold_line_style(GRID)
            .light_line_style(GRID.mix(0.45))
            .label_style(text(13))
            .axis_desc_style(text(14))
            .x_desc(self.x_title)
            .y_desc(self.y_title)
            .x_label_formatter(&|&value| (self.x_text)(value))
            .y_label_formatter(&|&value| (self.y_text)(value))
            .draw()?;

        let field = chart.plotting_area();
        let (x, y) = field.get_pixel_range();
        let mut labels = Labels::new(x, y);
        self.draw_floor(area, field, &mut labels)?;
        for front in 0..FRONTS.len() {
            self.draw_front(area, field, front, &mut labels)?;
        }
        for series in 0..self.series.len() {
            self.draw_series(area, field, series, &mut labels)?;
        }
        // Labels are placed after all markers, so that they can avoid them.
        for series in 0..self.series.len() {
            let color = color(series);
            let style = anchored(12, HPos::Center, VPos::Center).color(&color);
            for point in self.of_series(series) {
                let bound = if point.is_upper_bound { "≤ " } else { "" };
                let words = format!("{bound}{}", point.label);
                let at = labels.place(field.map_coordinate(&(point.x, point.y)), &words);
                area.draw(&Text::new(words, at, style.clone()))?;
            }
        }
        Ok(())
    }

    fn draw_floor(&self, area: &Area, field: &Field, labels: &mut Labels) -> Result<(), Failure> {
        let Some(value) = self.floor.filter(is_drawable) else {
            return Ok(());
        };
        let [left, right] = [field.get_x_range().start, field.get_x_range().end]
            .map(|x| field.map_coordinate(&(x, value)));
        let dashes = DashedPathElement::new([left, right], 7, 5, INK);
        area.draw(&dashes)?;
        let above = (right.0 - 6, right.1 - 1);
        labels.avoid_line(&[(above.0 - 100, above.1 - 6), (above.0, above.1 - 6)]);
        let style = anchored(12, HPos::Right, VPos::Bottom);
        Ok(area.draw(&Text::new("noise of the reference", above, style))?)
    }

    /// Draws a front in steps, from the upper edge of the plot area to its right edge.
    fn draw_front(
        &self,
        area: &Area,
        field: &Field,
        front: usize,
        labels: &mut Labels,
    ) -> Result<(), Failure> {
        let mut points = self.on_front(front);
        points.sort_by(|a, b| a.x.total_cmp(&b.x));
        let (mut y, right) = (field.get_y_range().end, field.get_x_range().end);
        let mut steps = Vec::new();
        for point in points {
            steps.extend([(point.x, y), (point.x, point.y)]);
            y = point.y;
        }
        if !steps.is_empty() {
            steps.push((right, y));
        }
        let steps: Vec<_> = steps.iter().map(|at| field.map_coordinate(at)).collect();
        labels.avoid_line(&steps);
        draw_front_line(area, front, steps)
    }

    fn draw_series(
        &self,
        area: &Area,
        field: &Field,
        series: usize,
        labels: &mut Labels,
    ) -> Result<(), Failure> {
        let color = color(series);
        let px = |x: f64, y: f64| field.map_coordinate(&(x, y));
        let path: Vec<_> = self
            .of_series(series)
            .map(|point| px(point.x, point.y))
            .collect();
        labels.avoid_line(&path);
        area.draw(&PathElement::new(path, color.mix(0.6).stroke_width(2)))?;
        for point in self.of_series(series) {
            let at = px(point.x, point.y);
            let whisker = point.x_range.map(|x| px(x, point.y));
            area.draw(&PathElement::new(whisker, color))?;
            if let Some(estimate) = point.own_estimate.filter(is_drawable) {
                let (x, y) = px(point.x, estimate);
                let bar = [(x - 5, y), (x + 5, y)];
                area.draw(&PathElement::new([at, (x, y)], color))?;
                area.draw(&PathElement::new(bar, color.stroke_width(3)))?;
                labels.avoid_line(&[at, (x, y)]);
            }
            draw_marker(area, series, at, point.is_upper_bound)?;
            labels.avoid_point(at);
        }
        Ok(())
    }

    /// The legend: the series and fronts that occur, in rows below the plot.
    fn draw_legend(&self, area: &Area) -> Result<(), Failure> {
        let mut count = 0;
        let mut place = || {
            let (column, row) = (count % LEGEND_COLUMNS, count / LEGEND_COLUMNS);
            count += 1;
            let y = HEIGHT_PX as i32 + row * LEGEND_ROW_PX + LEGEND_ROW_PX / 2;
            (84 + column * LEGEND_COLUMN_PX, y)
        };
        let style = anchored(14, HPos::Left, VPos::Center);
        for (index, name) in self.series.iter().enumerate() {
            if self.of_series(index).next().is_some() {
                let (x, y) = place();
                draw_marker(area, index, (x + 11, y), false)?;
                area.draw(&Text::new(*name, (x + 28, y), style.clone()))?;
            }
        }
        for (index, name) in FRONTS.iter().enumerate() {
            if !self.on_front(index).is_empty() {
                let (x, y) = place();
                draw_front_line(area, index, vec![(x, y), (x + 22, y)])?;
                area.draw(&Text::new(*name, (x + 28, y), style.clone()))?;
            }
        }
        Ok(())
    }

    fn of_series(&self, series: usize) -> impl Iterator<Item = &Point<'_>> {
        let name = self.series[series];
        let points = self.points.iter();
        points.filter(move |point| point.series == name)
    }

    fn on_front(&self, front: usize) -> Vec<&Point<'_>> {
        let points = self.points.iter();
        points.filter(|point| point.is_on_front[front]).collect()
    }
}

/// Whether a value can be shown on a logarithmic axis.
fn is_drawable(value: &f64) -> bool {
    value.is_finite() && *value > 0.0
}

/// An axis that holds the values with a margin and covers at least one decade. It has a line at 1 to 9 of every decade; only a few lines
/// have a number, so that they can be read.
fn axis(values: impl Iterator<Item = f64>) -> Axis {
    let values: Vec<f64> = values.filter(is_drawable).collect();
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(0.0, f64::max);
    let margin = 1.5 * (10.0 * low / high).max(1.0).sqrt();
    let range = low / margin..high * margin;
    let [first, last] = [range.start.log10(), range.end.log10()];
    let numbered: &[i32] = match last - first {
        decades if decades < 2.2 => &[1, 2, 5],
        decades if decades < 4.0 => &[1, 3],
        _ => &[1],
    };
    let (mut bold, mut light) = (Vec::new(), Vec::new());
    for exponent in first.floor() as i32..=last.floor() as i32 {
        for digit in 1..10 {
            let value = f64::from(digit) * 10_f64.powi(exponent);
            if range.contains(&value) {
                light.push(value);
                if numbered.contains(&digit) {
                    bold.push(value);
                }
            }
        }
    }
    range
        .log_scale()
        .with_key_points(bold)
        .with_light_points(light)
}

/// Seconds with one digit.
pub fn seconds_text(seconds: f64) -> String {
    match seconds {
        s if s < 0.99e-3 => format!("{} µs", plain(s * 1e6)),
        s if s < 0.99 => format!("{} ms", plain(s * 1e3)),
        s => format!("{} s", plain(s)),
    }
}

/// A share with one digit, in per cent.
pub fn percent_text(share: f64) -> String {
    match share {
        s if s < 0.99e-5 => number_text(s),
        s => format!("{} %", plain(s * 100.0)),
    }
}

/// A length with one digit.
pub fn metres_text(metres: f64) -> String {
    match metres {
        m if m < 0.99e-3 => format!("{} µm", plain(m * 1e6)),
        m if m < 0.99 => format!("{} mm", plain(m * 1e3)),
        m => format!("{} m", plain(m)),
    }
}

/// A number with one digit, as a power of ten.
pub fn number_text(value: f64) -> String {
    format!("{value:.0e}")
}

/// A number with few digits, without f64 rounding artefacts.
fn plain(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

fn color(series: usize) -> RGBColor {
    COLORS[series % COLORS.len()]
}

fn text(size_px: u32) -> TextStyle<'static> {
    // plotters divides the font size by 1.24 when it writes SVG.
    let font = ("sans-serif", f64::from(size_px) * 1.24).into_font();
    font.color(&INK)
}

fn anchored(size_px: u32, horizontal: HPos, vertical: VPos) -> TextStyle<'static> {
    text(size_px).pos(Pos::new(horizontal, vertical))
}

fn draw_front_line(area: &Area, front: usize, points: Vec<(i32, i32)>) -> Result<(), Failure> {
    let style = INK.mix(0.65);
    match front {
        0 => area.draw(&PathElement::new(points, style))?,
        _ => area.draw(&DashedPathElement::new(points, 3, 4, style))?,
    }
    Ok(())
}

/// The marker of a series: filled, or hollow.
fn draw_marker(
    area: &Area,
    series: usize,
    (x, y): (i32, i32),
    is_hollow: bool,
) -> Result<(), Failure> {
    let (corners, first, inner) = MARKERS[series % MARKERS.len()];
    let corner = |index: u32| {
        let angle = TAU * (first + f64::from(index) / f64::from(corners));
        let radius = if index % 2 == 1 { inner } else { 1.0 } * MARKER_PX;
        let [dx, dy] = [radius * angle.sin(), -radius * angle.cos()].map(|px| px.round() as i32);
        (x + dx, y + dy)
    };
    let outline: Vec<_> = (0..=corners).map(corner).collect();
    let color = color(series);
    let fill = if is_hollow { PAPER } else { color };
    area.draw(&Polygon::new(outline.clone(), fill))?;
    Ok(area.draw(&PathElement::new(outline, color.stroke_width(2)))?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn svg(own_estimate: Option<f64>) -> String {
        let point = |x: f64, y: f64, own_estimate| Point {
            series: "rays",
            x,
            x_range: [0.9 * x, 1.1 * x],
            y,
            is_upper_bound: false,
            own_estimate,
            is_on_front: [false; 2],
            label: "requested 5 %",
        };
        let plot = Plot {
            x_title: "time",
            x_text: seconds_text,
            y_title: "error",
            y_text: percent_text,
            series: vec!["rays"],
            points: vec![point(0.1, 0.2, None), point(0.2, 0.1, own_estimate)],
            floor: None,
        };
        plot.into_svg().unwrap().unwrap()
    }

    #[test]
    fn an_estimate_is_a_bar_joined_to_its_point() {
        let lines = |svg: &str| svg.matches("<polyline").count();
        let without = svg(None);
        // This estimate fits on the axes of the points alone.
        assert_eq!(lines(&svg(Some(0.15))), lines(&without) + 2);
        assert!(svg(Some(0.15)).contains("stroke-width=\"3\""));
        assert!(!without.contains("stroke-width=\"3\""));
        // Values that no axis can hold are left out.
        assert_eq!(svg(Some(0.0)), without);
        // A far value widens the axis.
        assert!(svg(Some(1e-4)).contains("0.01 %") && !without.contains("0.01 %"));
    }

    #[test]
    fn numbers_are_short_and_right() {
        assert_eq!(seconds_text(2e-2), "20 ms");
        assert_eq!(seconds_text(5e-5), "50 µs");
        assert_eq!(seconds_text(100.0), "100 s");
        assert_eq!(percent_text(2e-3), "0.2 %");
        assert_eq!(percent_text(0.5), "50 %");
        assert_eq!(number_text(3e-7), "3e-7");
    }

    #[test]
    fn an_axis_holds_its_values_and_has_numbers() {
        for values in [[0.3, 0.3], [1e-3, 40.0], [2e-7, 9e-7], [1e-9, 1e3]] {
            let axis = axis(values.into_iter());
            let range = axis.range();
            assert!(values.iter().all(|value| range.contains(value)));
            let numbers = axis.bold_points();
            assert!((1..=13).contains(&numbers.len()), "{values:?}: {numbers:?}");
            let mut lines = axis.light_points().iter();
            assert!(lines.all(|line| range.contains(line)));
        }
    }
}
