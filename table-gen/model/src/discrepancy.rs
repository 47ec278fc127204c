//! How unevenly offsets lie on a circle.

/// Largest difference between the length of an arc of the circle \[0, 1) and the share of the
/// offsets that lie on it, over all arcs, with their ends or without. Offsets are in units of
/// 2^-32. At least one over their number; 1 for none.
///
/// With F the share below x, an arc holds more or less than its length by a difference of two
/// values of F - x, which are extreme at the offsets.
#[must_use]
pub fn arc_discrepancy(offsets: impl IntoIterator<Item = u32>) -> f64 {
    let mut places: Vec<f64> = offsets
        .into_iter()
        .map(|offset| f64::from(offset) / 2f64.powi(32))
        .collect();
    places.sort_by(f64::total_cmp);
    let share = |count: usize| count as f64 / places.len() as f64;
    let (low, high) = places
        .iter()
        .enumerate()
        .fold((0.0f64, 0.0f64), |(low, high), (below, x)| {
            (low.min(share(below) - x), high.max(share(below + 1) - x))
        });
    if places.is_empty() { 1.0 } else { high - low }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solved_by_hand() {
        let quarters = [0, 1 << 30, 2 << 30, 3 << 30];
        assert!((arc_discrepancy(quarters) - 0.25).abs() < 1e-12);
        // Wherever the circle is cut.
        let turned = quarters.map(|offset| offset + 12_345_678);
        assert!((arc_discrepancy(turned) - 0.25).abs() < 1e-12);
        // All in one place: an arc of no length holds all of them.
        assert!((arc_discrepancy([7; 5]) - 1.0).abs() < 1e-12);
        // Two next to each other on the circle: the arc of 2^-31 around them holds both.
        let near = arc_discrepancy([u32::MAX, 0]);
        assert!((near - 1.0).abs() < 1e-8, "{near}");
        assert!((arc_discrepancy([]) - 1.0).abs() < 1e-12);
    }
}
