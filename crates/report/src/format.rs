//! Numbers as readers want them.

/// Returns bytes in binary units, three significant digits.
///
/// ```
/// assert_eq!(afterlight_report::bytes_text(0), "0 B");
/// assert_eq!(afterlight_report::bytes_text(1536), "1.50 KiB");
/// assert_eq!(afterlight_report::bytes_text(300 * 1024 * 1024), "300 MiB");
/// ```
pub fn bytes_text(bytes: u64) -> String {
    const UNITS: [&str; 5] = ["B", "KiB", "MiB", "GiB", "TiB"];
    if bytes < 1024 {
        return format!("{bytes} B");
    }
    let mut value = bytes as f64;
    let mut unit = 0;
    while value >= 999.5 && unit + 1 < UNITS.len() {
        value /= 1024.0;
        unit += 1;
    }
    format!("{} {}", three_digits(value), UNITS[unit])
}

/// Returns milliseconds with three significant digits, without the unit.
///
/// ```
/// assert_eq!(afterlight_report::ms_text(0.01234), "0.0123");
/// assert_eq!(afterlight_report::ms_text(123.4), "123");
/// ```
pub fn ms_text(ms: f64) -> String {
    three_digits(ms)
}

/// Returns a PSNR in dB; equal images read "equal".
pub fn psnr_text(psnr_db: f64) -> String {
    if psnr_db.is_infinite() { "equal".to_owned() } else { format!("{psnr_db:.1}") }
}

pub(crate) fn three_digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let before_point = value.abs().log10().floor() as i32 + 1;
    let decimals = (3 - before_point).clamp(0, 6) as usize;
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_significant_digits() {
        for (value, text) in
            [(0.0, "0"), (1.0, "1.00"), (9.999, "10.00"), (45.678, "45.7"), (1234.5, "1234"), (0.5, "0.500")]
        {
            assert_eq!(three_digits(value), text);
        }
    }

    #[test]
    fn units_change_at_a_thousand() {
        assert_eq!(bytes_text(1023), "1023 B");
        assert_eq!(bytes_text(1024), "1.00 KiB");
        assert_eq!(bytes_text(1023 * 1024), "0.999 MiB");
        assert_eq!(bytes_text(u64::MAX), "16777216 TiB");
    }
}
