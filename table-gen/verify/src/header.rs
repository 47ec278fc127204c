//! Whether the table's header says what the spec says.
//!
//! The proof takes the firmware's behaviour from the header, whatever it says; this claim is that
//! the header is the one that this spec asks for: another grid, clock, band or plant means a table
//! for another purpose, even where it happens to meet the requirements.

use firmware::observer::ObserverConfig;
use firmware::table::{Header, Law, TableView};

use model::hex::hex;
use model::spec::Spec;
use model::table_fields::{self, FieldError};

/// The header's fields that differ from the spec, and why the device cannot use it; empty if all is
/// well.
pub(super) fn differences(table: &TableView<'_>, spec: &Spec) -> Vec<String> {
    let header = table.header();
    let mut out = geometry(&header, spec);
    if let Err(error) = numbers(table, spec, &mut out) {
        out.push(error.to_string());
    }
    // More visits than a law needs do no harm on the device; the bound is stated all the same.
    for (law, entry) in Law::ALL.into_iter().zip(&header.laws) {
        if let (Some(entry), Some(view)) = (entry, table.law(law))
            && entry.worst_visits != view.worst_visits()
        {
            out.push(format!(
                "{} states {} visits and needs {}",
                law.name(),
                entry.worst_visits,
                view.worst_visits()
            ));
        }
    }
    // The device runs the droop where its observer cannot follow the plant.
    if !header.always_on
        && let Err(error) = ObserverConfig::new(&header.plant, header.tick_ms)
    {
        out.push(format!("the device refuses the plant: {error:?}"));
    }
    out
}

/// Droop, plant, hypotheses, response and identity. The generator's version is no part of the
/// proof, and any will do.
fn numbers(table: &TableView<'_>, spec: &Spec, out: &mut Vec<String>) -> Result<(), FieldError> {
    let header = table.header();
    let mut same = |what: &str, found: String, expected: String| {
        if found != expected {
            out.push(format!("{what} is {found}, the spec says {expected}"));
        }
    };
    same("the spec's hash", hex(&header.spec_hash), hex(&spec.hash()));
    same(
        "the droop",
        format!("{:?}", header.droop),
        format!("{:?}", table_fields::droop(spec)?),
    );
    same(
        "the plant",
        format!("{:?}", header.plant),
        format!("{:?}", table_fields::plant(spec)?),
    );
    let expected = table_fields::hypotheses(spec)?;
    let mut found = header.hypotheses;
    found.generator = expected.generator;
    same(
        "what was assumed",
        format!("{found:?}"),
        format!("{expected:?}"),
    );
    same(
        "the response",
        format!("{:?}", table.response()),
        format!("{:?}", table_fields::response(spec)?.as_ref()),
    );
    Ok(())
}

/// Grid, inputs, clocks and bands.
fn geometry(header: &Header, spec: &Spec) -> Vec<String> {
    let mut out = Vec::new();
    let mut same = |what: &str, found: String, expected: String| {
        if found != expected {
            out.push(format!("{what} is {found}, the spec says {expected}"));
        }
    };
    let grid = &header.grid;
    let counts = spec.grid.cell_counts();
    same(
        "the grid's lower edge",
        format!("{:?}", grid.lower_edge()),
        format!("{:?}", spec.grid.lower_edges_micro()),
    );
    same(
        "the cell width",
        format!("{:?}", grid.width()),
        format!("{:?}", spec.grid.widths_micro()),
    );
    same(
        "the grid's cells",
        format!("{:?}", grid.count()),
        format!("{counts:?}"),
    );
    let levels = spec.input.levels();
    same(
        "the number of inputs",
        header.levels.to_string(),
        levels.to_string(),
    );
    // Steps such as 1/3 are stored as a whole number of ppm. To the nearest, as the spec's own
    // levels are: the device must not differ by one.
    same(
        "the input step [ppm]",
        header.input_step_ppm.to_string(),
        ((spec.input.value(1) * 1e6).round() as u32).to_string(),
    );
    same(
        "the tick [ms]",
        header.tick_ms.to_string(),
        spec.sampling.watch_ms().to_string(),
    );
    let ticks = spec.sampling.ticks_per_period();
    same(
        "ticks a period",
        header.period_ticks.to_string(),
        ticks.to_string(),
    );
    // A response predicts nothing; its delay is among what was assumed.
    let late = if spec.preference.always_on {
        0
    } else {
        spec.sampling
            .ticks_of(spec.uncertainty.actuation_delay_s.least_s())
    };
    same(
        "the delay [ticks]",
        header.delay_ticks.to_string(),
        late.to_string(),
    );
    let band = |band: &firmware::units::Band| format!("{:?}", [band.low_uhz, band.high_uhz]);
    let requirements = &spec.requirements;
    same(
        "I1 [µHz]",
        band(&header.outer),
        format!("{:?}", requirements.outer_micro()),
    );
    same(
        "I2 [µHz]",
        band(&header.inner),
        format!("{:?}", requirements.inner_micro()),
    );
    same(
        "stay",
        header.stay.to_string(),
        requirements.stay.to_string(),
    );
    out
}
