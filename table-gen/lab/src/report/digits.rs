//! Numbers as people read them: at most four digits, and of a frequency whole millihertz.

/// Digits that are shown.
const DIGITS: i32 = 4;

/// An absolute frequency \[Hz\].
pub fn hz(value: f64) -> String {
    format!("{value:.3}")
}

/// A number with at most four digits, the nearest such number. Whole digits are never dropped.
pub fn four(value: f64) -> String {
    shown(value, f64::round)
}

/// A bound with at most four digits, rounded towards the limit that it must not pass: what is shown
/// is proven too.
pub fn bound(value: f64, limit: Option<f64>) -> String {
    match limit {
        Some(limit) if value < limit => shown(value, f64::ceil),
        Some(limit) if value > limit => shown(value, f64::floor),
        _ => four(value),
    }
}

fn shown(value: f64, round: fn(f64) -> f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let whole = value.abs().log10().floor() as i32 + 1;
    let decimals = (DIGITS - whole.max(0)).max(0) as usize;
    // Below 1 the digits behind the point count, so that a column of such numbers lines up.
    let scale = 10_f64.powi(decimals as i32);
    let scaled = value * scale;
    // What is a number of so many digits already stays it: a product's own error is no digit.
    let nearest = scaled.round();
    let kept = if (scaled - nearest).abs() < 1e-6 {
        nearest
    } else {
        round(scaled)
    };
    let text = format!("{:.decimals$}", kept / scale);
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_digits_and_whole_ones_kept() {
        let shown = [
            (0.0, "0"),
            (49.583_21, "49.58"),
            (-0.486_54, "-0.4865"),
            (12.1, "12.1"),
            (11.8, "11.8"),
            (60.0, "60"),
            (2_358_443.0, "2358443"),
            (99.996, "100"),
            (0.000_04, "0"),
        ];
        for (value, text) in shown {
            assert_eq!(four(value), text);
        }
        assert_eq!(hz(49.4920), "49.492");
    }

    #[test]
    fn a_bound_is_rounded_towards_its_limit() {
        assert_eq!(bound(-0.486_51, Some(-0.5)), "-0.4866");
        assert_eq!(bound(12.1001, Some(60.0)), "12.11");
        assert_eq!(bound(11.8, Some(60.0)), "11.8");
        assert_eq!(bound(-0.4865, Some(-0.5)), "-0.4865");
        assert_eq!(bound(0.002_71, Some(0.003)), "0.0028");
        assert_eq!(bound(0.002_71, None), "0.0027");
    }
}
