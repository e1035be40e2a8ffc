//! Numbers for readers: three digits and a fitting unit.

/// Three digits, in plain notation unless that takes many zeros.
pub fn number(value: f64) -> String {
    let scientific = format!("{value:.2e}");
    let exponent = scientific.rsplit_once('e');
    match exponent.and_then(|(_, exponent)| exponent.parse().ok()) {
        _ if value == 0.0 => "0".into(),
        Some(exponent @ -3..=3_i32) => format!("{value:.*}", (2 - exponent).max(0) as usize),
        _ => scientific,
    }
}

/// A share in per cent.
pub fn percent(share: f64) -> String {
    format!("{} %", number(share * 100.0))
}

/// A share in per cent: the uncertainty with two digits, and the value with the same number of decimal places.
pub fn with_uncertainty(share: f64, standard_error: f64) -> String {
    let [value, uncertainty] = [share, standard_error].map(|share| share * 100.0);
    if uncertainty <= 0.0 {
        return percent(share);
    }
    let places = (1 - uncertainty.log10().floor() as i32).clamp(0, 6) as usize;
    format!("{value:.places$} ± {uncertainty:.places$} %")
}

/// A time.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 1e-3 => format!("{} µs", number(s * 1e6)),
        s if s < 1.0 => format!("{} ms", number(s * 1e3)),
        s => format!("{} s", number(s)),
    }
}

/// A length.
pub fn length(metres: f64) -> String {
    match metres {
        m if m < 1e-3 => format!("{} µm", number(m * 1e6)),
        m if m < 1.0 => format!("{} mm", number(m * 1e3)),
        m => format!("{} m", number(m)),
    }
}

/// A count or a rate, with a prefix where it is large.
pub fn count(value: f64) -> String {
    match value {
        v if v >= 1e9 => format!("{} G", number(v * 1e-9)),
        v if v >= 1e6 => format!("{} M", number(v * 1e-6)),
        v => format!("{v:.0}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_and_a_unit() {
        assert_eq!(duration(0.000_123_4), "123 µs");
        assert_eq!(duration(0.0456), "45.6 ms");
        assert_eq!(duration(12.34), "12.3 s");
        assert_eq!(length(0.000_289), "289 µm");
        assert_eq!(length(0.007_94), "7.94 mm");
        assert_eq!(percent(0.8412), "84.1 %");
        assert_eq!(percent(0.0), "0 %");
        assert_eq!(with_uncertainty(-0.789_01, 0.001_2), "-78.90 ± 0.12 %");
        assert_eq!(with_uncertainty(0.000_55, 0.004), "0.06 ± 0.40 %");
        assert_eq!(count(3.77e9), "3.77 G");
        assert_eq!(count(2378.0), "2378");
    }
}
