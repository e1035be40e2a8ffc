//! Numbers as a reader wants them: three digits, a fitting unit.

use super::results::ModelError;

/// A time.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 1e-3 => format!("{} µs", three_digits(s * 1e6)),
        s if s < 1.0 => format!("{} ms", three_digits(s * 1e3)),
        s => format!("{} s", three_digits(s)),
    }
}

/// A share in per cent, without its sign.
pub fn percent(share: f64) -> String {
    format!("{} %", three_digits(share * 100.0))
}

/// A share in per cent, with its sign and its uncertainty, in the digits that this leaves, two decimals at most.
pub fn signed_percent(share: f64, uncertainty: f64) -> String {
    let sign = if share < 0.0 { "−" } else { "+" };
    let (value, own) = (share.abs() * 100.0, uncertainty * 100.0);
    let decimals = match own {
        own if own > 0.0 => (-own.log10().floor()).clamp(0.0, 2.0) as usize,
        _ => decimals_of_three_digits(value),
    };
    format!("{sign}{value:.decimals$} ± {own:.decimals$} %")
}

/// The relRMSE, with its uncertainty where the noise leaves one to speak of, or as a bound.
pub fn relative_rmse(error: &ModelError) -> String {
    let value = error.relative_rmse * 100.0;
    if error.is_upper_bound {
        return format!("≤ {} %", three_digits(value));
    }
    let decimals = decimals_of_three_digits(value);
    match error.relative_rmse_uncertainty.map(|own| own * 100.0) {
        // Where it shows in the last digit.
        Some(own) if own > 0.5 * 0.1_f64.powi(decimals as i32) => {
            format!("{value:.decimals$} ± {own:.decimals$} %")
        }
        _ => format!("{value:.decimals$} %"),
    }
}

/// A count or a rate, with a prefix of thousands.
pub fn count(value: f64) -> String {
    match value {
        v if v >= 1e9 => format!("{} G", three_digits(v * 1e-9)),
        v if v >= 1e6 => format!("{} M", three_digits(v * 1e-6)),
        v if v >= 1e4 => format!("{} k", three_digits(v * 1e-3)),
        v => format!("{v:.0}"),
    }
}

/// Three significant digits, no exponent.
fn three_digits(value: f64) -> String {
    let decimals = decimals_of_three_digits(value);
    format!("{value:.decimals$}")
}

fn decimals_of_three_digits(value: f64) -> usize {
    let magnitude = if value > 0.0 && value.is_finite() {
        value.log10().floor() as i32
    } else {
        0
    };
    usize::try_from(2 - magnitude).unwrap_or(0).min(6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_and_a_unit() {
        assert_eq!(duration(0.000_123_4), "123 µs");
        assert_eq!(duration(0.0456), "45.6 ms");
        assert_eq!(duration(12.34), "12.3 s");
        assert_eq!(percent(0.8412), "84.1 %");
        assert_eq!(percent(0.0), "0.00 %");
        assert_eq!(signed_percent(-0.789_01, 0.001_2), "−78.9 ± 0.1 %");
        assert_eq!(signed_percent(0.000_55, 0.004), "+0.1 ± 0.4 %");
        assert_eq!(count(3.77e9), "3.77 G");
        assert_eq!(count(2378.0), "2378");
    }
}
