//! Values: each key against its range, then keys against each other.

use firmware::prediction::DELAY_TICKS_MAX;

use crate::participation::Participation;

use super::allowed::{self, Allowed};
use super::key_value::KeyValue;
use super::keys::{KEYS, Key};
use super::origin::{Origin, inconsistent};
use super::plant_bands;
use super::sampling::{to_ms, to_whole_ms};
use super::{
    InputSpec, RequirementsSpec, SamplingSpec, Spec, SpecError, UncertaintySpec, chance, formula,
    geometry, response,
};

/// The allowed inputs of a cell are a mask of 32 bits.
const LEVELS_MAX: usize = 32;

/// The device counts watch ticks in 16 bits.
const TICKS_MAX: u32 = u16::MAX as u32;

impl Spec {
    /// Checks every value and every relation between values; `origin` is what error messages call
    /// the spec.
    ///
    /// [`Spec::load`] and [`Spec::from_toml`] have done it already. Whether the grid fits in memory
    /// depends on the machine and on the moment; all else depends on the spec alone.
    ///
    /// # Errors
    /// The first value that is not finite, out of its key's range, or inconsistent with others.
    pub fn validate(&self, origin: &str) -> Result<(), SpecError> {
        self.validate_from(&Origin::file(origin))
    }

    /// [`Self::validate`] for values that may come from overrides.
    pub(super) fn validate_from(&self, origin: &Origin) -> Result<(), SpecError> {
        for key in KEYS {
            check_range(key, (key.get)(self), origin)?;
        }
        check_input(&self.input, origin)?;
        check_sampling(&self.sampling, origin)?;
        check_uncertainty(&self.uncertainty, origin)?;
        plant_bands::check(self, origin)?;
        check_charger(self, origin)?;
        if !self.preference.always_on {
            check_delay(&self.uncertainty, &self.sampling, origin)?;
        }
        response::check(self, origin)?;
        check_requirements(&self.requirements, origin)?;
        geometry::check_grid(&self.grid, origin)?;
        geometry::check_initial(self, origin)?;
        geometry::check_targets(self, origin)?;
        formula::check(self, origin)
    }
}

fn check_range(key: &'static Key, value: KeyValue<'_>, origin: &Origin) -> Result<(), SpecError> {
    let numbers: &[f64] = match &value {
        KeyValue::Number(x) => std::slice::from_ref(x),
        KeyValue::Numbers(xs) => xs,
        KeyValue::Integer(_) | KeyValue::Flag(_) | KeyValue::Text(_) | KeyValue::Absent => &[],
    };
    if numbers.iter().any(|x| !x.is_finite()) {
        return Err(SpecError::NotFinite {
            origin: origin.of(key.path),
            key: key.path,
            found: value.to_string(),
            allowed: key.allowed_text(),
        });
    }
    let in_range = match (key.allowed, value) {
        (
            Allowed::Number(range)
            | Allowed::OptionalNumber(range)
            | Allowed::NumberOrInterval(range)
            | Allowed::OptionalNumbers { each: range, .. }
            | Allowed::Numbers { each: range, .. },
            _,
        ) => numbers.iter().all(|x| range.contains(*x)),
        (Allowed::Integer { min, max }, KeyValue::Integer(n)) => (min..=max).contains(&n),
        (Allowed::Name, KeyValue::Text(name)) => allowed::is_valid_name(name),
        (Allowed::OptionalParticipation, KeyValue::Text(text)) => {
            text.parse::<Participation>().is_ok()
        }
        (Allowed::OptionalLoss, KeyValue::Text(text)) => chance::is_loss(text),
        // The type leaves no other value.
        _ => true,
    };
    if in_range {
        return Ok(());
    }
    Err(SpecError::OutOfRange {
        origin: origin.of(key.path),
        key: key.path,
        found: value.to_string(),
        allowed: key.allowed_text(),
    })
}

fn check_input(input: &InputSpec, origin: &Origin) -> Result<(), SpecError> {
    /// Relative noise of a step such as 0.03333333333 that was printed with ten digits.
    const TOLERANCE: f64 = 1e-9;
    let inverse = 1.0 / input.step;
    if (inverse - inverse.round()).abs() > TOLERANCE {
        let found = format!("{}, of which 1 holds {inverse}", input.step);
        return Err(inconsistent(
            origin,
            "input.step",
            found,
            "a step that divides 1, such as 0.05, 0.1 or 0.25",
        ));
    }
    if input.levels() > LEVELS_MAX {
        let found = format!("{}, which gives {} levels", input.step, input.levels());
        let allowed =
            format!("at most {LEVELS_MAX} levels (a step of at least 1/31), as masks have 32 bits");
        return Err(inconsistent(origin, "input.step", found, allowed));
    }
    Ok(())
}

fn check_sampling(sampling: &SamplingSpec, origin: &Origin) -> Result<(), SpecError> {
    let Some(watch_ms) = to_whole_ms(sampling.watch_s) else {
        let found = format!("{} s", sampling.watch_s);
        return Err(inconsistent(
            origin,
            "sampling.watch_s",
            found,
            "a whole number of milliseconds",
        ));
    };
    let divides = to_whole_ms(sampling.period_s).is_some_and(|period_ms| period_ms % watch_ms == 0);
    if !divides {
        let found = format!(
            "{} s, beside sampling.watch_s = {} s",
            sampling.period_s, sampling.watch_s
        );
        // The next multiple up; for a period shorter than a tick that is one tick.
        let longer_ms = (to_ms(sampling.period_s) / watch_ms + 1) * watch_ms;
        let allowed = format!(
            "a whole number of watch ticks, such as {} s",
            f64::from(longer_ms) / 1e3
        );
        return Err(inconsistent(origin, "sampling.period_s", found, allowed));
    }
    let ticks = sampling.ticks_per_period();
    if ticks > TICKS_MAX {
        let found = format!(
            "{} s, which makes {ticks} ticks in a period of {} s",
            sampling.watch_s, sampling.period_s
        );
        return Err(inconsistent(
            origin,
            "sampling.watch_s",
            found,
            format!("at most {TICKS_MAX} ticks to the period"),
        ));
    }
    Ok(())
}

fn check_charger(spec: &Spec, origin: &Origin) -> Result<(), SpecError> {
    let charger = &spec.charger;
    for (key, unit, [low, high]) in [
        ("charger.dead_time_s", " s", charger.dead_time_s),
        ("charger.ramp_s", " s", charger.ramp_s),
        ("charger.draw", "", charger.draw),
        ("charger.pause_s", " s", charger.pause_s),
    ] {
        if low > high {
            return Err(SpecError::Inverted {
                origin: origin.of(key),
                key,
                found: format!("[{low}, {high}]{unit}"),
                allowed: "[least, most] with least at most most".to_owned(),
            });
        }
    }
    Ok(())
}

fn check_uncertainty(uncertainty: &UncertaintySpec, origin: &Origin) -> Result<(), SpecError> {
    let intervals = [
        ("uncertainty.loss_gw", Some(uncertainty.loss_gw), "GW"),
        (
            "uncertainty.actuation_delay_s",
            Some(*uncertainty.actuation_delay_s.ends_s()),
            "s",
        ),
    ];
    for (key, interval, unit) in intervals {
        if let Some([low, high]) = interval
            && low > high
        {
            return Err(SpecError::Inverted {
                origin: origin.of(key),
                key,
                found: format!("[{low}, {high}] {unit}"),
                allowed: "[low, high] with low at most high".to_owned(),
            });
        }
    }
    Ok(())
}

/// For laws by games the device remembers the commands of so many ticks, and predicts over the
/// least delay. Every charger has followed a command when the next one is decided.
fn check_delay(
    uncertainty: &UncertaintySpec,
    sampling: &SamplingSpec,
    origin: &Origin,
) -> Result<(), SpecError> {
    let key = "uncertainty.actuation_delay_s";
    let range = uncertainty.actuation_delay_s;
    let watch_ms = sampling.watch_ms().max(1);
    if range.exact_s().is_none() {
        let most_ms = to_whole_ms(range.most_s());
        if most_ms.is_none_or(|most_ms| most_ms > sampling.period_ms()) {
            let found = format!(
                "{:?} s, beside sampling.period_s = {} s",
                range.ends_s(),
                sampling.period_s
            );
            let allowed = format!(
                "whole milliseconds and a most of at most one period, {} s: a law by games decides \
                 when every charger has followed the command before; one number may be longer, and \
                 so may a range for a response (preference.always_on = true)",
                sampling.period_s
            );
            return Err(inconsistent(origin, key, found, allowed));
        }
    }
    let delay_s = range.least_s();
    let whole = to_whole_ms(delay_s).is_some_and(|delay_ms| delay_ms % watch_ms == 0);
    let ticks = sampling.ticks_of(delay_s);
    let most = u32::from(DELAY_TICKS_MAX);
    if whole && ticks <= most {
        return Ok(());
    }
    let found = format!(
        "{delay_s} s, beside sampling.watch_s = {} s",
        sampling.watch_s
    );
    let nearest_ms = ticks.min(most) * watch_ms;
    let allowed = format!(
        "a whole number of watch ticks, at most {most}, such as {} s",
        f64::from(nearest_ms) / 1e3
    );
    let allowed = match range.exact_s() {
        Some(_) => allowed,
        None => format!("as the least of a range {allowed}"),
    };
    Err(inconsistent(origin, key, found, allowed))
}

fn check_requirements(requirements: &RequirementsSpec, origin: &Origin) -> Result<(), SpecError> {
    let (outer, inner) = (requirements.outer_hz, requirements.inner_hz);
    for (key, [low, high]) in [
        ("requirements.outer_hz", outer),
        ("requirements.inner_hz", inner),
    ] {
        if low >= high {
            return Err(SpecError::Inverted {
                origin: origin.of(key),
                key,
                found: format!("[{low}, {high}] Hz"),
                allowed: "[low, high] with low below high".to_owned(),
            });
        }
    }
    if inner[0] < outer[0] || inner[1] > outer[1] {
        let found = format!("[{}, {}] Hz", inner[0], inner[1]);
        let allowed = format!(
            "an interval inside requirements.outer_hz = [{}, {}] Hz",
            outer[0], outer[1]
        );
        return Err(inconsistent(
            origin,
            "requirements.inner_hz",
            found,
            allowed,
        ));
    }
    match requirements.containment_hz {
        Some(containment_hz) if containment_hz >= outer[0] => {
            let found = format!("{containment_hz} Hz");
            let allowed = format!(
                "below {}, the lower end of requirements.outer_hz, or none",
                outer[0]
            );
            Err(inconsistent(
                origin,
                "requirements.containment_hz",
                found,
                allowed,
            ))
        }
        _ => Ok(()),
    }
}
