//! The table of keys: the single source of units, ranges and descriptions.

use super::Spec;
use super::allowed::{Allowed, Range};
use super::claims::{Domain, LossProfile};
use super::delay_range::DelayRange;
use super::grid::{Alignment, MICRO_PER_UNIT};
use super::key_value::KeyValue;
use super::meter::MeterKind;
use super::plant::Direction;
use super::sampling::Successor;

/// One key of the spec, for a listing: `table-gen keys` prints these as the reference of the spec
/// file.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyDoc {
    /// Dotted path, such as `plant.damping_gw_per_hz`.
    pub key: &'static str,
    /// Unit of the value; `1` for a pure number, `-` where there is none.
    pub unit: &'static str,
    /// What the key may hold; `Display` gives it as text.
    pub allowed: Allowed,
    /// The default, as TOML writes it; `none` where the key is absent by default.
    pub default: String,
    /// What it is, in one line.
    pub description: &'static str,
}

/// Every key with its default, unit, range and description, in the order of the spec file.
#[must_use]
pub fn reference() -> Vec<KeyDoc> {
    let defaults = Spec::default();
    KEYS.iter()
        .map(|key| KeyDoc {
            key: key.path,
            unit: key.unit,
            allowed: key.allowed,
            default: (key.get)(&defaults).to_string(),
            description: key.description,
        })
        .collect()
}

/// One row of the table: what is known of a key, and how to find its value in a [`Spec`].
pub(super) struct Key {
    pub(super) path: &'static str,
    pub(super) unit: &'static str,
    pub(super) allowed: Allowed,
    pub(super) description: &'static str,
    pub(super) get: Getter,
}

type Getter = for<'a> fn(&'a Spec) -> KeyValue<'a>;

impl Key {
    /// What the key may hold, with its unit: the text of error messages.
    pub(super) fn allowed_text(&self) -> String {
        match self.unit {
            "1" | "-" => self.allowed.to_string(),
            unit => format!("{} ({unit})", self.allowed),
        }
    }

    /// The path without its last part; empty for `name`.
    pub(super) fn section(&self) -> &'static str {
        section_of(self.path)
    }
}

/// The part of a dotted path before its last dot; empty where there is none.
pub(super) fn section_of(path: &str) -> &str {
    path.rsplit_once('.').map_or("", |(section, _)| section)
}

/// The key with this path.
pub(super) fn find(path: &str) -> Option<&'static Key> {
    KEYS.iter().find(|key| key.path == path)
}

/// Whether `path` names a section (a table of keys), such as `plant` or `uncertainty.initial`.
pub(super) fn is_section(path: &str) -> bool {
    KEYS.iter().any(|key| {
        key.path
            .strip_prefix(path)
            .is_some_and(|rest| rest.starts_with('.'))
    })
}

/// Names allowed directly inside a section (the empty path: the top level), in order, each once.
pub(super) fn names_in(section: &str) -> Vec<&'static str> {
    let mut names = Vec::new();
    for key in KEYS {
        let inside = match section {
            "" => Some(key.path),
            _ => key
                .path
                .strip_prefix(section)
                .and_then(|rest| rest.strip_prefix('.')),
        };
        if let Some(name) = inside.and_then(|rest| rest.split('.').next())
            && !names.contains(&name)
        {
            names.push(name);
        }
    }
    names
}

const fn row(
    path: &'static str,
    unit: &'static str,
    allowed: Allowed,
    description: &'static str,
    get: Getter,
) -> Key {
    Key {
        path,
        unit,
        allowed,
        description,
        get,
    }
}

fn optional(value: Option<f64>) -> KeyValue<'static> {
    value.map_or(KeyValue::Absent, KeyValue::Number)
}

fn text(value: Option<&str>) -> KeyValue<'_> {
    value.map_or(KeyValue::Absent, KeyValue::Text)
}

fn optionals(values: Option<&[f64; 2]>) -> KeyValue<'_> {
    values.map_or(KeyValue::Absent, |values| KeyValue::Numbers(values))
}

fn interval(range: &DelayRange) -> KeyValue<'_> {
    range
        .exact_s()
        .map_or(KeyValue::Numbers(range.ends_s()), KeyValue::Number)
}

const SECONDS_2: Allowed = Allowed::Numbers {
    len: 2,
    each: Range::closed(0.0, 60.0),
};
const TIME_CONSTANT: Allowed = Allowed::Number(Range::closed(0.001, 1000.0));
const DURATION: Range = Range::above(0.0, 86_400.0);
const STATE: Allowed = Allowed::Numbers {
    len: 4,
    each: Range::closed(-STATE_MAX, STATE_MAX),
};
const WIDTH: Allowed = Allowed::Numbers {
    len: 4,
    each: Range::closed(1.0 / MICRO_PER_UNIT, WIDTH_MAX),
};
const INTERVAL: Allowed = Allowed::Numbers {
    len: 2,
    each: Range::closed(-10.0, 10.0),
};
/// Past this a double has few digits left for what lies between a probability and 1.
const CONFIDENCE: Range = Range::closed(0.5, 1.0 - 1e-12);
const STATE_UNIT: &str = "Hz, GW, GW, GW";

/// Longest tick \[s\], as the device's reader has it.
const WATCH_MAX_S: f64 = 0.2;
const _: () = assert!(WATCH_MAX_S * 1e3 == firmware::table::TICK_MS_MAX as f64);

const STATE_MAX: f64 = 2000.0;
const WIDTH_MAX: f64 = 100.0;
// The outermost edge, half a cell past the end of the working region, is an i32 in micro-units on
// the device.
const _: () = assert!((STATE_MAX + WIDTH_MAX / 2.0) * MICRO_PER_UNIT <= i32::MAX as f64);

/// The key of the formula, which gives others.
pub(super) const FORMULA: &str = "requirements.formula";
/// Key of the preferred law of games.
pub(super) const RECOVERY: &str = "preference.recovery_per_s";
/// Key of the claim `quiet`.
pub(super) const CHANGES: &str = "requirements.changes_per_300_s";

/// Every key, in the order of the spec file. The hash depends on this order and on the paths.
#[rustfmt::skip] // One key to a group of lines, as a table.
pub(super) const KEYS: &[Key] = &[
    row("name", "-", Allowed::Name,
        "name for reports and file names", |s| KeyValue::Text(&s.name)),

    row("plant.governor_gain_gw_per_hz", "GW/Hz", Allowed::Number(Range::below(-100.0, 0.0)),
        "governor gain 1/R_eq, negative", |s| KeyValue::Number(s.plant.governor_gain_gw_per_hz)),
    row("plant.governor_time_s", "s", TIME_CONSTANT,
        "governor time constant T_G", |s| KeyValue::Number(s.plant.governor_time_s)),
    row("plant.turbine_time_s", "s", TIME_CONSTANT,
        "turbine time constant T_t", |s| KeyValue::Number(s.plant.turbine_time_s)),
    row("plant.lead_time_s", "s", Allowed::Number(Range::closed(0.0, 1000.0)),
        "lead time constant T_1; 0 for a plain lag", |s| KeyValue::Number(s.plant.lead_time_s)),
    row("plant.lag_time_s", "s", TIME_CONSTANT,
        "lag time constant T_2", |s| KeyValue::Number(s.plant.lag_time_s)),
    row("plant.damping_gw_per_hz", "GW/Hz", Allowed::Number(Range::closed(0.0, 1000.0)),
        "load damping D", |s| KeyValue::Number(s.plant.damping_gw_per_hz)),
    row("plant.inertia_gw_s_per_hz", "GW s/Hz", Allowed::Number(Range::closed(0.001, 10_000.0)),
        "inertia H; 2H multiplies f'", |s| KeyValue::Number(s.plant.inertia_gw_s_per_hz)),
    row("plant.governor.deadband_hz", "Hz", Allowed::OptionalNumber(Range::closed(0.0, 5.0)),
        "deviation that the governors do not see; absent: none", |s| optional(s.plant.governor.deadband_hz)),
    row("plant.governor.rate_gw_per_s", "GW/s", Allowed::OptionalNumber(Range::closed(1e-6, 1000.0)),
        "fastest change of the governors' output; absent: no limit", |s| optional(s.plant.governor.rate_gw_per_s)),
    row("plant.governor.lower_gw", "GW", Allowed::OptionalNumber(Range::closed(-1000.0, 0.0)),
        "least output of the governors; absent: no limit", |s| optional(s.plant.governor.lower_gw)),
    row("plant.governor.upper_gw", "GW", Allowed::OptionalNumber(Range::closed(0.0, 1000.0)),
        "greatest output of the governors; absent: no limit", |s| optional(s.plant.governor.upper_gw)),

    row("fleet.chargers", "1", Allowed::Integer { min: 1, max: 100_000_000 },
        "number of chargers N_ev", |s| KeyValue::Integer(s.fleet.chargers)),
    row("fleet.power_per_charger_kw", "kW", Allowed::Number(Range::closed(0.1, 1000.0)),
        "power of one charger at participation 1, p_av", |s| KeyValue::Number(s.fleet.power_per_charger_kw)),
    row("fleet.direction", "-", Allowed::Choice(Direction::NAMES),
        "whether charging only stops or also reverses", |s| KeyValue::Text(s.fleet.direction.name())),

    row("baseline.deadband_hz", "Hz", Allowed::Number(Range::closed(0.0, 5.0)),
        "deviation without a response", |s| KeyValue::Number(s.baseline.deadband_hz)),
    row("baseline.droop_hz", "Hz", Allowed::Number(Range::above(0.0, 10.0)),
        "deviation past the deadband for full participation, R_ev", |s| KeyValue::Number(s.baseline.droop_hz)),
    row("baseline.time_s", "s", TIME_CONSTANT,
        "response time constant T_ev", |s| KeyValue::Number(s.baseline.time_s)),

    row("grid.lower", STATE_UNIT, STATE,
        "lower end of the working region (f, g, l, p)", |s| KeyValue::Numbers(&s.grid.lower)),
    row("grid.upper", STATE_UNIT, STATE,
        "upper end of the working region (f, g, l, p)", |s| KeyValue::Numbers(&s.grid.upper)),
    row("grid.width", STATE_UNIT, WIDTH,
        "width of a cell (f, g, l, p)", |s| KeyValue::Numbers(&s.grid.width)),
    row("grid.alignment", "-", Allowed::Choice(Alignment::NAMES),
        "whether lower and upper are cell centres or cell edges", |s| KeyValue::Text(s.grid.alignment.name())),

    row("input.step", "1", Allowed::Number(Range::closed(0.001, 1.0)),
        "distance between participations; divides 1 into at most 31 steps", |s| KeyValue::Number(s.input.step)),

    row("sampling.period_s", "s", Allowed::Number(Range::closed(0.001, 3600.0)),
        "sampling time tau of C1, C2 and Hold", |s| KeyValue::Number(s.sampling.period_s)),
    row("sampling.watch_s", "s", Allowed::Number(Range::closed(0.001, WATCH_MAX_S)),
        "watch tick of No control and Fixed; divides the period", |s| KeyValue::Number(s.sampling.watch_s)),

    row("preference.always_on", "-", Allowed::Flag,
        "whether the preferred law itself is the table, and no games are played", |s| KeyValue::Flag(s.preference.always_on)),
    row("preference.droop_gw_per_hz", "GW/Hz", Allowed::Number(Range::closed(0.0, 1000.0)),
        "power for each Hz below the set-point", |s| KeyValue::Number(s.preference.droop_gw_per_hz)),
    row("preference.setpoint_hz", "Hz", Allowed::Number(Range::closed(-5.0, 5.0)),
        "deviation at which the droop term is zero", |s| KeyValue::Number(s.preference.setpoint_hz)),
    row("preference.slope_gain_gw_s_per_hz", "GW s/Hz", Allowed::Number(Range::closed(0.0, 1000.0)),
        "power for each Hz/s of fall beyond the threshold", |s| KeyValue::Number(s.preference.slope_gain_gw_s_per_hz)),
    row("preference.slope_threshold_hz_per_s", "Hz/s", Allowed::Number(Range::closed(0.0, 100.0)),
        "fall without an answer to the slope", |s| KeyValue::Number(s.preference.slope_threshold_hz_per_s)),
    row("preference.slope_window_s", "s", Allowed::Number(Range::closed(0.001, 6.4)),
        "time over which the slope is taken; whole ticks, at most 32", |s| KeyValue::Number(s.preference.slope_window_s)),
    row("preference.slope_most_gw", "GW", Allowed::Number(Range::closed(0.0, 1000.0)),
        "largest answer to the slope; at most the fleet's power", |s| KeyValue::Number(s.preference.slope_most_gw)),
    row("preference.slope_release_gw_per_s", "GW/s", Allowed::Number(Range::closed(0.0, 1000.0)),
        "how fast the answer to the slope is let go", |s| KeyValue::Number(s.preference.slope_release_gw_per_s)),
    row("preference.smallest_change", "1", Allowed::Number(Range::closed(0.001, 1.0)),
        "smallest change of a charger's participation", |s| KeyValue::Number(s.preference.smallest_change)),
    row(RECOVERY, "1/s", Allowed::OptionalNumber(Range::closed(0.0, 1000.0)),
        "how fast f should go to the middle of I2 where a game leaves it free; absent: the smallest table", |s| optional(s.preference.recovery_per_s)),

    row("meter.kind", "-", Allowed::Choice(MeterKind::NAMES),
        "what measures the frequency", |s| KeyValue::Text(s.meter.kind.name())),
    row("meter.jitter_us", "µs", Allowed::Number(Range::closed(0.0, 1000.0)),
        "largest error of the time of a zero crossing", |s| KeyValue::Number(s.meter.jitter_us)),
    row("meter.clock_ppm", "ppm", Allowed::Number(Range::closed(0.0, 1000.0)),
        "error of the meter's clock, temperature and ageing included", |s| KeyValue::Number(s.meter.clock_ppm)),
    row("meter.resolution_hz", "Hz", Allowed::Number(Range::closed(0.0, 1.0)),
        "step between two readings", |s| KeyValue::Number(s.meter.resolution_hz)),
    row("meter.window_cycles", "1", Allowed::Integer { min: 1, max: 50 },
        "mains cycles over which a reading is averaged", |s| KeyValue::Integer(s.meter.window_cycles)),
    row("meter.latest_age_ms", "ms", Allowed::Number(Range::closed(0.0, 1000.0)),
        "longest age of a reading when a decision goes by it", |s| KeyValue::Number(s.meter.latest_age_ms)),
    row("meter.bias_hz", "Hz", Allowed::Number(Range::closed(0.0, 0.1)),
        "largest constant error of a reading, the clock's apart", |s| KeyValue::Number(s.meter.bias_hz)),

    row("charger.dead_time_s", "s", SECONDS_2,
        "time until a car begins to answer, each its own", |s| KeyValue::Numbers(&s.charger.dead_time_s)),
    row("charger.ramp_s", "s", SECONDS_2,
        "time in which a car moves by its whole swing, each its own", |s| KeyValue::Numbers(&s.charger.ramp_s)),
    row("charger.pilot_change_s", "s", Allowed::Number(Range::closed(0.0, 60.0)),
        "least time between two changes of a pilot, except to pause", |s| KeyValue::Number(s.charger.pilot_change_s)),
    row("charger.resume_above_floor_a", "A", Allowed::Number(Range::closed(0.0, 26.0)),
        "current above 6 A from which a paused car is charged again", |s| KeyValue::Number(s.charger.resume_above_floor_a)),
    row("charger.draw", "1", Allowed::Numbers { len: 2, each: Range::closed(0.0, 1.0) },
        "largest draw of a car as a share of the rating, each its own", |s| KeyValue::Numbers(&s.charger.draw)),
    row("charger.pausing_share", "1", Allowed::Number(Range::closed(0.0, 1.0)),
        "share of the cars that pause by themselves", |s| KeyValue::Number(s.charger.pausing_share)),
    row("charger.pause_s", "s", Allowed::Numbers { len: 2, each: Range::closed(0.0, 600.0) },
        "length of such a pause", |s| KeyValue::Numbers(&s.charger.pause_s)),
    row("charger.contactor_opens_after_s", "s", Allowed::Number(Range::closed(0.0, 86_400.0)),
        "length of a pause after which the contactor opens", |s| KeyValue::Number(s.charger.contactor_opens_after_s)),
    row("charger.contactor_open_least_s", "s", Allowed::Number(Range::closed(0.0, 86_400.0)),
        "least time for which it then stays open", |s| KeyValue::Number(s.charger.contactor_open_least_s)),
    row("charger.clock_ppm", "ppm", Allowed::Number(Range::closed(0.0, 1000.0)),
        "error of a charger's clock, each its own within this", |s| KeyValue::Number(s.charger.clock_ppm)),

    row("uncertainty.loss_gw", "GW", Allowed::Numbers { len: 2, each: Range::closed(-100.0, 100.0) },
        "band of the lost infeed w", |s| KeyValue::Numbers(&s.uncertainty.loss_gw)),
    row("uncertainty.loss_profile", "-", Allowed::Choice(LossProfile::NAMES),
        "how w moves inside its band", |s| KeyValue::Text(s.uncertainty.loss_profile.name())),
    row("uncertainty.participation", "1", Allowed::Number(Range::below(0.0, 1.0)),
        "relative error of participation", |s| KeyValue::Number(s.uncertainty.participation)),
    row("uncertainty.participation_absolute", "1", Allowed::Number(Range::below(0.0, 1.0)),
        "error of participation beside the relative one", |s| KeyValue::Number(s.uncertainty.participation_absolute)),
    row("uncertainty.participation_confidence", "1", Allowed::OptionalNumber(CONFIDENCE),
        "probability with which participation and participation_absolute must cover chargers that err independently; absent: not asked", |s| optional(s.uncertainty.participation_confidence)),
    row("uncertainty.hostile_share", "1", Allowed::OptionalNumber(Range::closed(0.0, 1.0)),
        "share of the chargers that does as it likes, the opposite or nothing; absent: none", |s| optional(s.uncertainty.hostile_share)),
    row("uncertainty.level_discrepancy", "1", Allowed::OptionalNumber(Range::closed(0.0, 1.0)),
        "how unevenly the chargers' levels may be shifted against each other; absent: as an adversary likes", |s| optional(s.uncertainty.level_discrepancy)),
    row("uncertainty.measurement", STATE_UNIT, Allowed::Numbers { len: 4, each: Range::closed(0.0, 10.0) },
        "bound on the state estimate's error (f, g, l, p)", |s| KeyValue::Numbers(&s.uncertainty.measurement)),
    row("uncertainty.actuation_delay_s", "s", Allowed::NumberOrInterval(Range::closed(0.0, 60.0)),
        "time from a decision to its power; or least and most, each charger's own", |s| interval(&s.uncertainty.actuation_delay_s)),
    row("uncertainty.inertia_gw_s_per_hz", "GW s/Hz", Allowed::OptionalNumbers { len: 2, each: Range::closed(0.001, 10_000.0) },
        "band of H, unknown to the charger; absent: the plant's", |s| optionals(s.uncertainty.inertia_gw_s_per_hz.as_ref())),
    row("uncertainty.inertia_lost_s_per_hz", "s/Hz", Allowed::OptionalNumber(Range::closed(0.0, 10.0)),
        "H that goes with each GW of the loss, at most; absent: none", |s| optional(s.uncertainty.inertia_lost_s_per_hz)),
    row("uncertainty.governor_gain_gw_per_hz", "GW/Hz", Allowed::OptionalNumbers { len: 2, each: Range::below(-100.0, 0.0) },
        "band of 1/R_eq, unknown to the charger; absent: the plant's", |s| optionals(s.uncertainty.governor_gain_gw_per_hz.as_ref())),
    row("uncertainty.damping_gw_per_hz", "GW/Hz", Allowed::OptionalNumbers { len: 2, each: Range::closed(0.0, 1000.0) },
        "band of D, unknown to the charger; absent: the plant's", |s| optionals(s.uncertainty.damping_gw_per_hz.as_ref())),
    row("uncertainty.governor_time_s", "s", Allowed::OptionalNumbers { len: 2, each: Range::closed(0.001, 1000.0) },
        "band of T_G, unknown to the charger; absent: the plant's", |s| optionals(s.uncertainty.governor_time_s.as_ref())),
    row("uncertainty.turbine_time_s", "s", Allowed::OptionalNumbers { len: 2, each: Range::closed(0.001, 1000.0) },
        "band of T_t, unknown to the charger; absent: the plant's", |s| optionals(s.uncertainty.turbine_time_s.as_ref())),
    row("uncertainty.lead_time_s", "s", Allowed::OptionalNumbers { len: 2, each: Range::closed(0.0, 1000.0) },
        "band of T_1, unknown to the charger; absent: the plant's", |s| optionals(s.uncertainty.lead_time_s.as_ref())),
    row("uncertainty.lag_time_s", "s", Allowed::OptionalNumbers { len: 2, each: Range::closed(0.001, 1000.0) },
        "band of T_2, unknown to the charger; absent: the plant's", |s| optionals(s.uncertainty.lag_time_s.as_ref())),
    row("uncertainty.own_clocks", "-", Allowed::Flag,
        "whether each charger decides at moments of its own, on readings of its own", |s| KeyValue::Flag(s.uncertainty.own_clocks)),
    row("uncertainty.initial.lower", STATE_UNIT, STATE,
        "lower corner of the states at the event (f, g, l, p)", |s| KeyValue::Numbers(&s.uncertainty.initial.lower)),
    row("uncertainty.initial.upper", STATE_UNIT, STATE,
        "upper corner of the states at the event (f, g, l, p)", |s| KeyValue::Numbers(&s.uncertainty.initial.upper)),

    row("chance.loss", "-", Allowed::OptionalLoss,
        "sizes of the loss, as a file of sizes and weights or by name; absent: the band", |s| text(s.chance.loss.as_deref())),
    row("chance.participation", "-", Allowed::OptionalParticipation,
        "how the error of the delivered participation is drawn; absent: bounded as above", |s| text(s.chance.participation.as_deref())),
    row("chance.draw_interval_s", "s", Allowed::OptionalNumber(Range::above(0.0, 3600.0)),
        "time from one draw of a response's participation to the next; absent: the period", |s| optional(s.chance.draw_interval_s)),
    row("chance.noise_hz", "Hz", Allowed::OptionalNumber(Range::above(0.0, 1.0)),
        "deviation of a normal error of each reading, beside the meter's; absent: none", |s| optional(s.chance.noise_hz)),

    row(FORMULA, "-", Allowed::OptionalFormula,
        "the requirements as temporal logic; gives the keys it speaks of", |s| text(s.requirements.formula.as_deref())),
    row("requirements.containment_hz", "Hz", Allowed::OptionalNumber(Range::closed(-10.0, 0.0)),
        "f never falls below this; absent: no such claim", |s| optional(s.requirements.containment_hz)),
    row("requirements.outer_hz", "Hz", INTERVAL,
        "larger target I1", |s| KeyValue::Numbers(&s.requirements.outer_hz)),
    row("requirements.inner_hz", "Hz", INTERVAL,
        "smaller target I2, inside I1", |s| KeyValue::Numbers(&s.requirements.inner_hz)),
    row("requirements.settle_within_s", "s", Allowed::Number(DURATION),
        "time from leaving I1 to reaching I2", |s| KeyValue::Number(s.requirements.settle_within_s)),
    row("requirements.stay", "-", Allowed::Flag,
        "whether f stays in I2 for ever", |s| KeyValue::Flag(s.requirements.stay)),
    row("requirements.horizon_s", "s", Allowed::OptionalNumber(DURATION),
        "time from the event over which claims are made; absent: for ever", |s| optional(s.requirements.horizon_s)),
    row(CHANGES, "1", Allowed::OptionalNumber(Range::closed(0.0, 1e6)),
        "most changes of a command by 5 % and more in any 300 s; absent: no such claim", |s| optional(s.requirements.changes_per_300_s)),

    row("table.domain", "-", Allowed::Choice(Domain::NAMES),
        "which cells the table answers for", |s| KeyValue::Text(s.table.domain.name())),
    row("table.version", "1", Allowed::Integer { min: 0, max: u32::MAX },
        "version of the table; one that replaces another has a larger number", |s| KeyValue::Integer(s.table.version)),

    row("method.successor", "-", Allowed::Choice(Successor::NAMES),
        "how the radius of a successor box is bounded", |s| KeyValue::Text(s.method.successor.name())),
    row("method.between_samples", "-", Allowed::Flag,
        "whether the games bound f between the samples too", |s| KeyValue::Flag(s.method.between_samples)),
];
