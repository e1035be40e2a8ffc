//! Logarithmic axes: where a value lies, which values get a line and a number.

/// A logarithmic axis from one pixel to another.
pub struct LogAxis {
    low: f64,
    high: f64,
    low_px: i32,
    high_px: i32,
    unit: Unit,
}

/// How the numbers of an axis are written.
#[derive(Clone, Copy)]
pub enum Unit {
    /// Seconds, small ones as ms or µs.
    Seconds,
    /// A share, as per cent.
    Percent,
    /// The bare number, as a power of ten.
    Number,
}

/// A value with a grid line.
pub struct Tick {
    pub px: i32,
    /// `None` between the numbered ones.
    pub text: Option<String>,
}

impl LogAxis {
    /// An axis that holds the values with a margin, over at least a decade. `None` without a positive finite value.
    pub fn around(
        values: impl Iterator<Item = f64>,
        low_px: i32,
        high_px: i32,
        unit: Unit,
    ) -> Option<LogAxis> {
        let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
        for value in values.filter(|&value| is_drawable(value)) {
            low = low.min(value);
            high = high.max(value);
        }
        if low > high {
            return None;
        }
        let missing = (10.0 / (high / low)).max(1.0).sqrt();
        Some(LogAxis {
            low: low / (missing * 1.5),
            high: high * (missing * 1.5),
            low_px,
            high_px,
            unit,
        })
    }

    pub fn px(&self, value: f64) -> i32 {
        let share = (value / self.low).ln() / (self.high / self.low).ln();
        self.low_px + (share * f64::from(self.high_px - self.low_px)).round() as i32
    }

    /// 1 to 9 of every decade. Those with a number are few enough to be read.
    pub fn ticks(&self) -> Vec<Tick> {
        let decades = (self.high / self.low).log10();
        let numbered: &[i32] = match decades {
            d if d < 2.2 => &[1, 2, 5],
            d if d < 4.0 => &[1, 3],
            _ => &[1],
        };
        let exponents = self.low.log10().floor() as i32..=self.high.log10().floor() as i32;
        exponents
            .flat_map(|exponent| (1..10).map(move |mantissa| (mantissa, exponent)))
            .filter_map(|(mantissa, exponent)| {
                let value = f64::from(mantissa) * 10_f64.powi(exponent);
                (self.low..=self.high).contains(&value).then(|| Tick {
                    px: self.px(value),
                    text: numbered
                        .contains(&mantissa)
                        .then(|| self.unit.text(mantissa, exponent)),
                })
            })
            .collect()
    }
}

/// Whether a value has a place on such an axis.
pub fn is_drawable(value: f64) -> bool {
    value.is_finite() && value > 0.0
}

impl Unit {
    /// mantissa · 10^exponent as text, from whole numbers, so that no digit is made up.
    fn text(self, mantissa: i32, exponent: i32) -> String {
        match self {
            Unit::Seconds if exponent < -3 => format!("{} µs", plain(mantissa, exponent + 6)),
            Unit::Seconds if exponent < 0 => format!("{} ms", plain(mantissa, exponent + 3)),
            Unit::Seconds => format!("{} s", plain(mantissa, exponent)),
            Unit::Percent if exponent > -6 => format!("{} %", plain(mantissa, exponent + 2)),
            Unit::Percent | Unit::Number => format!("{mantissa}e{exponent}"),
        }
    }
}

fn plain(mantissa: i32, exponent: i32) -> String {
    let value = f64::from(mantissa) * 10_f64.powi(exponent);
    let decimals = usize::try_from(-exponent).unwrap_or(0);
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_right() {
        assert_eq!(Unit::Seconds.text(2, -2), "20 ms");
        assert_eq!(Unit::Seconds.text(5, -5), "50 µs");
        assert_eq!(Unit::Seconds.text(1, 2), "100 s");
        assert_eq!(Unit::Percent.text(2, -3), "0.2 %");
        assert_eq!(Unit::Percent.text(5, -1), "50 %");
        assert_eq!(Unit::Number.text(3, -7), "3e-7");
    }

    #[test]
    fn an_axis_holds_its_values_and_has_numbers() {
        for values in [[0.3, 0.3], [1e-3, 40.0], [2e-7, 9e-7], [1e-9, 1e3]] {
            let axis = LogAxis::around(values.into_iter(), 100, 500, Unit::Number).unwrap();
            for value in values {
                assert!((100..=500).contains(&axis.px(value)), "{values:?}");
            }
            let ticks = axis.ticks();
            let numbers = ticks.iter().filter(|tick| tick.text.is_some()).count();
            assert!((1..=13).contains(&numbers), "{values:?}: {numbers}");
            assert!(ticks.iter().all(|tick| (100..=500).contains(&tick.px)));
        }
        assert!(LogAxis::around([0.0, f64::NAN].into_iter(), 0, 1, Unit::Number).is_none());
    }
}
