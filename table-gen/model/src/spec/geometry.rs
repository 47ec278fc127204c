//! Relations on the state space: the grid as the device counts it, and what must lie inside it.

use super::grid::{STATE_NAMES, from_micro, to_micro, to_whole_micro};
use super::origin::{Origin, inconsistent};
use super::{Alignment, GridSpec, Spec, SpecError, memory};

/// The device counts cells along an axis in 16 bits.
const CELLS_PER_AXIS_MAX: u32 = u16::MAX as u32;

/// Checks that every cell edge is exact in micro-units, and that the counts fit the device and this
/// machine.
pub(super) fn check_grid(grid: &GridSpec, origin: &Origin) -> Result<(), SpecError> {
    for axis in 0..4 {
        check_order(grid, axis, origin)?;
        check_micro(grid, axis, origin)?;
        check_multiples(grid, axis, origin)?;
        check_count(grid, axis, origin)?;
    }
    check_memory(grid.cells(), memory::available_bytes(), origin)
}

fn check_order(grid: &GridSpec, axis: usize, origin: &Origin) -> Result<(), SpecError> {
    let (lower, upper) = (grid.lower[axis], grid.upper[axis]);
    if lower < upper {
        return Ok(());
    }
    Err(SpecError::Inverted {
        origin: origin.of("grid.upper"),
        key: "grid.upper",
        found: format!("{upper} for {}", STATE_NAMES[axis]),
        allowed: format!(
            "above grid.lower, which is {lower} for {}",
            STATE_NAMES[axis]
        ),
    })
}

fn check_micro(grid: &GridSpec, axis: usize, origin: &Origin) -> Result<(), SpecError> {
    for (key, value) in [
        ("grid.lower", grid.lower[axis]),
        ("grid.upper", grid.upper[axis]),
        ("grid.width", grid.width[axis]),
    ] {
        if to_whole_micro(value).is_none() {
            let found = format!("{value} for {}", STATE_NAMES[axis]);
            return Err(inconsistent(
                origin,
                key,
                found,
                "a whole multiple of 0.000001 (the device counts µHz and kW)",
            ));
        }
    }
    if grid.alignment == Alignment::Centres && to_micro(grid.width[axis]) % 2 != 0 {
        let found = format!("{} for {}", grid.width[axis], STATE_NAMES[axis]);
        let allowed = "an even multiple of 0.000001 with grid.alignment = \"centres\", as edges lie half a width off";
        return Err(inconsistent(origin, "grid.width", found, allowed));
    }
    Ok(())
}

fn check_multiples(grid: &GridSpec, axis: usize, origin: &Origin) -> Result<(), SpecError> {
    let (lower, upper, width) = (grid.lower[axis], grid.upper[axis], grid.width[axis]);
    let state = STATE_NAMES[axis];
    if grid.alignment == Alignment::Centres && to_micro(lower) % to_micro(width) != 0 {
        let allowed = format!(
            "a whole multiple of grid.width, which is {width} for {state}, or grid.alignment = \"edges\""
        );
        return Err(inconsistent(
            origin,
            "grid.lower",
            format!("{lower} for {state}"),
            allowed,
        ));
    }
    if (to_micro(upper) - to_micro(lower)) % to_micro(width) != 0 {
        let found = format!("{upper} for {state}");
        let allowed = format!("grid.lower ({lower}) plus a whole number of widths ({width})");
        return Err(inconsistent(origin, "grid.upper", found, allowed));
    }
    Ok(())
}

fn check_count(grid: &GridSpec, axis: usize, origin: &Origin) -> Result<(), SpecError> {
    let count = grid.cell_counts()[axis];
    if count <= CELLS_PER_AXIS_MAX {
        return Ok(());
    }
    let found = format!(
        "{} for {}, which gives {count} cells",
        grid.width[axis], STATE_NAMES[axis]
    );
    Err(inconsistent(
        origin,
        "grid.width",
        found,
        format!("at most {CELLS_PER_AXIS_MAX} cells along an axis"),
    ))
}

fn check_memory(cells: u64, available_bytes: u64, origin: &Origin) -> Result<(), SpecError> {
    let needed_bytes = memory::needed_bytes(cells);
    if needed_bytes <= available_bytes {
        return Ok(());
    }
    let key = "grid.width";
    Err(SpecError::TooManyCells {
        origin: origin.of(key),
        key,
        cells,
        needed_bytes,
        available_bytes,
    })
}

/// Checks that the states at the event are a box, and that cells cover it.
pub(super) fn check_initial(spec: &Spec, origin: &Origin) -> Result<(), SpecError> {
    let initial = &spec.uncertainty.initial;
    let first = spec
        .grid
        .lower_edges_micro()
        .map(|edge| from_micro(edge.into()));
    let last = spec
        .grid
        .upper_edges_micro()
        .map(|edge| from_micro(edge.into()));
    for axis in 0..4 {
        let (lower, upper, state) = (initial.lower[axis], initial.upper[axis], STATE_NAMES[axis]);
        if lower > upper {
            return Err(SpecError::Inverted {
                origin: origin.of("uncertainty.initial.upper"),
                key: "uncertainty.initial.upper",
                found: format!("{upper} for {state}"),
                allowed: format!(
                    "at least uncertainty.initial.lower, which is {lower} for {state}"
                ),
            });
        }
        let outside = [
            ("uncertainty.initial.lower", lower),
            ("uncertainty.initial.upper", upper),
        ]
        .into_iter()
        .find(|(_, corner)| *corner < first[axis] || *corner > last[axis]);
        if let Some((key, corner)) = outside {
            let allowed = format!(
                "inside the grid, whose cells reach from {} to {}",
                first[axis], last[axis]
            );
            return Err(inconsistent(
                origin,
                key,
                format!("{corner} for {state}"),
                allowed,
            ));
        }
    }
    Ok(())
}

/// Checks that each target lies inside the grid, is exact in µHz, and contains a whole cell of the
/// f axis.
pub(super) fn check_targets(spec: &Spec, origin: &Origin) -> Result<(), SpecError> {
    let requirements = &spec.requirements;
    check_target(
        &spec.grid,
        "requirements.outer_hz",
        requirements.outer_hz,
        origin,
    )?;
    check_target(
        &spec.grid,
        "requirements.inner_hz",
        requirements.inner_hz,
        origin,
    )
}

fn check_target(
    grid: &GridSpec,
    key: &'static str,
    [low_hz, high_hz]: [f64; 2],
    origin: &Origin,
) -> Result<(), SpecError> {
    let interval = || format!("[{low_hz}, {high_hz}] Hz");
    let (Some(low), Some(high)) = (to_whole_micro(low_hz), to_whole_micro(high_hz)) else {
        let allowed = "whole multiples of 0.000001 Hz (the device compares in µHz)";
        return Err(inconsistent(origin, key, interval(), allowed));
    };
    let (first_edge, last_edge) = (
        i64::from(grid.lower_edges_micro()[0]),
        i64::from(grid.upper_edges_micro()[0]),
    );
    if low < first_edge || high > last_edge {
        let allowed = format!(
            "an interval inside the grid, whose cells reach from {} to {} Hz",
            from_micro(first_edge),
            from_micro(last_edge)
        );
        return Err(inconsistent(origin, key, interval(), allowed));
    }
    let width = i64::from(grid.widths_micro()[0]);
    // The first cell that begins inside: as low >= first_edge, rounding up is (n + width - 1) /
    // width.
    let cells_before = (low - first_edge + width - 1) / width;
    if first_edge + (cells_before + 1) * width > high {
        return Err(SpecError::EmptyTarget {
            origin: origin.of(key),
            key,
            low_hz,
            high_hz,
            width_hz: from_micro(width),
            first_edge_hz: from_micro(first_edge),
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_beyond_the_memory_names_both_sizes() {
        let origin = Origin::file("big.toml");
        check_memory(1_000_000, 100 << 20, &origin).unwrap();
        let error = check_memory(10_000_000, 100 << 20, &origin).unwrap_err();
        assert_eq!(error.key(), Some("grid.width"));
        let message = error.to_string();
        // 24 bytes for each of ten million cells and 16 MiB.
        assert!(
            message.contains("256777216 bytes") && message.contains("104857600 bytes"),
            "{message}"
        );
    }
}
