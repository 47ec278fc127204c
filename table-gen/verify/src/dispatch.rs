//! The claim `dispatch`: what stands between a command and the grid errs by no more than the proof
//! allows.
//!
//! Pilot, contactor and car ([`model::spec::ChargerSpec`]) do three kinds of things to a command u:
//!
//! | what | where it is counted |
//! |---|---|
//! | dead time, ramp, wait of the pilot | in the delay of the header, [`Spec::command_delay_s`] |
//! | the floor of 6 A | nowhere: chargers pause or draw 6 A by serial, so that the mean is right |
//! | a paused charger waits for its margin m | too much: `m / rating`, where `6 A + m` is wanted |
//! | a paused car waits for 6 A and more | too much: `1 - u`, from `1 - (6 A + wait) / rating` on |
//! | a car draws less than its charger's rating | too little: `min(u, 1 - draw)` |
//! | a share of cars pauses by itself | too much: `share (1 - u)` |
//! | the contactor | nothing: a pause of the response leaves it as it is |
//!
//! m is `RESUME_MA`, of this repository's firmware: it counts from `1 - (6 A + m) / rating` on. A
//! spec with an ideal meter is about no product (the claim `image` says the same), and its chargers
//! have no margin either.
//! The chargers' mean at the floor is `firmware::dispatch::fleet`'s. The proof allows
//! `participation u + participation_absolute`. All are straight lines in u between the places where
//! they begin, so the worst place is one of those.

use firmware::dispatch::unidirectional::RESUME_MA;
use model::spec::{ChargerSpec, Direction, MeterKind, Spec};
use model::verdict::{Claim, ClaimName};

/// Lowest current that a pilot offers \[A\].
const FLOOR_A: f64 = 6.0;
/// Voltage between phase and neutral times the phases of a three-phase charger \[V\].
const THREE_PHASE_V: f64 = 3.0 * 230.0;
/// What the arithmetic of a few numbers near 1 is off by, at most.
const ROUNDING: f64 = 1e-12;

/// The worst that was found.
#[derive(Debug, Clone, PartialEq)]
struct Worst {
    /// Error of the participation.
    error: f64,
    /// What is allowed at that command.
    allowed: f64,
    /// The command.
    command: f64,
    /// What it comes from, and for how long.
    what: String,
}

/// The claim.
pub(super) fn claim(spec: &Spec) -> Claim {
    let worst = worst(spec);
    let reason = late(spec).or_else(|| {
        (worst.error > worst.allowed + ROUNDING).then(|| {
            format!(
                "at a command of {:.3} the fleet may be off by {:.3}, and {:.3} is allowed: {}",
                worst.command, worst.error, worst.allowed, worst.what
            )
        })
    });
    Claim {
        name: ClaimName::Dispatch,
        holds: reason.is_none(),
        bound: Some(worst.error),
        limit: Some(worst.allowed),
        unit: "of the fleet".into(),
        statement: "pilot, contactor and cars err by no more than is assumed; their times count \
                    as delay"
            .to_owned(),
        reason,
    }
}

/// Laws by games know the delay of the spec alone; a car that answers later has another.
fn late(spec: &Spec) -> Option<String> {
    let assumed = *spec.uncertainty.actuation_delay_s.ends_s();
    let found = spec.command_delay_s();
    (!spec.preference.always_on && found != assumed).then(|| {
        let known = match spec.uncertainty.actuation_delay_s.exact_s() {
            Some(exact) => format!("{exact} s alone"),
            None => format!("{} to {} s", assumed[0], assumed[1]),
        };
        format!(
            "a command acts after {} to {} s (charger.dead_time_s, ramp_s, pilot_change_s), and \
             laws by games know {known}",
            found[0], found[1]
        )
    })
}

/// The command at which the error exceeds most what is allowed.
fn worst(spec: &Spec) -> Worst {
    let charger = &spec.charger;
    let uncertainty = &spec.uncertainty;
    let pilot = spec.fleet.direction == Direction::Unidirectional;
    let rating_a = spec.fleet.power_per_charger_kw * 1000.0 / THREE_PHASE_V;
    let resume = 1.0 - (FLOOR_A + charger.resume_above_floor_a) / rating_a;
    let missing = if pilot { 1.0 - charger.draw[0] } else { 0.0 };
    let waits = pilot && charger.resume_above_floor_a > 0.0;
    let real = pilot && spec.meter.kind != MeterKind::Ideal;
    // The charger's own hysteresis: at most so many of the chargers whose threshold lies within the
    // margin pause though they should draw 6 A, or so much of the current is not drawn.
    let margin_a = f64::from(RESUME_MA) * 1e-3;
    let own = 1.0 - (FLOOR_A + margin_a) / rating_a;
    [
        0.0,
        missing,
        resume.clamp(0.0, 1.0),
        own.clamp(0.0, 1.0),
        1.0,
    ]
    .into_iter()
    .flat_map(|command: f64| {
        let allowed = uncertainty.participation * command + uncertainty.participation_absolute;
        let at = |error: f64, what: String| Worst {
            error,
            allowed,
            command,
            what,
        };
        let waiting = if waits && command >= resume {
            1.0 - command
        } else {
            0.0
        };
        let pausing = charger.pausing_share * (1.0 - command);
        let own = if real && command >= own {
            margin_a / rating_a
        } else {
            0.0
        };
        [
            at(command.min(missing), too_little(charger)),
            at(
                (waiting + pausing + own).min(1.0 - command),
                too_much(charger, waits, real),
            ),
        ]
    })
    .max_by(|a, b| (a.error - a.allowed).total_cmp(&(b.error - b.allowed)))
    .unwrap_or(Worst {
        error: 0.0,
        allowed: 0.0,
        command: 0.0,
        what: String::new(),
    })
}

fn too_little(charger: &ChargerSpec) -> String {
    format!(
        "cars that draw {} of the rating, for as long as the command stays (charger.draw)",
        charger.draw[0]
    )
}

fn too_much(charger: &ChargerSpec, waits: bool, real: bool) -> String {
    let mut causes = Vec::new();
    if real {
        causes.push(format!(
            "paused chargers that wait for {} A more than their threshold asks for",
            f64::from(RESUME_MA) * 1e-3
        ));
    }
    if waits {
        causes.push(format!(
            "paused cars that wait for {} A more than 6 A, for as long as the command stays \
             (charger.resume_above_floor_a)",
            charger.resume_above_floor_a
        ));
    }
    if charger.pausing_share > 0.0 {
        causes.push(format!(
            "{} of the cars pausing by themselves, for {} s at most (charger.pausing_share)",
            charger.pausing_share, charger.pause_s[1]
        ));
    }
    causes.join("; ")
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]
mod tests {
    use super::*;

    fn of(set: &[&str]) -> Claim {
        let set: Vec<String> = set.iter().map(|s| (*s).to_owned()).collect();
        claim(&Spec::load("gb-uni", &set).unwrap())
    }

    #[test]
    fn cars_that_follow_err_by_nothing() {
        let found = of(&[]);
        assert!(found.holds);
        assert_eq!(found.bound, Some(0.0));
    }

    #[test]
    fn a_charger_waits_for_its_own_margin() {
        // 0.2 A of 32 A, where 6.2 A are wanted: at u = 0.80625, of which half a percent is less.
        let exact = ["uncertainty.participation=0.005"];
        let found = of(&exact);
        assert!(!found.holds);
        assert!((found.bound.unwrap() - 0.2 / 32.0).abs() < 1e-9);
        assert!((found.limit.unwrap() - 0.005 * 0.80625).abs() < 1e-9);
        assert!(found.reason.unwrap().contains("0.2 A more"));
        let ideal = [&exact[..], &["meter.kind=\"ideal\""]].concat();
        assert!(of(&ideal).holds);
    }

    #[test]
    fn by_hand() {
        // Cars at 90 % of the rating: at u = 0.1 all of the response is missing, and 0.01 is
        // allowed.
        let found = of(&["charger.draw=[0.9,1]"]);
        assert!(!found.holds);
        assert!((found.bound.unwrap() - 0.1).abs() < 1e-9);
        assert!((found.limit.unwrap() - 0.01).abs() < 1e-9);
        assert!(found.reason.unwrap().contains("charger.draw"));
        // With 0.09 beside the relative error it is allowed.
        let set = [
            "charger.draw=[0.9,1]",
            "uncertainty.participation_absolute=0.09",
        ];
        assert!(of(&set).holds);
        // A twentieth of the cars: all of it at u = 0.
        let found = of(&["charger.pausing_share=0.05"]);
        assert!((found.bound.unwrap() - 0.05).abs() < 1e-9);
        assert_eq!(found.limit, Some(0.0));
        assert!(found.reason.unwrap().contains("60 s at most"));
        // 32 A of three phases: a car that waits for 10 A is off by 10 / 32 from u = 22 / 32 on.
        let set = [
            "fleet.power_per_charger_kw=22.08",
            "charger.resume_above_floor_a=4",
        ];
        let found = of(&set);
        assert!((found.bound.unwrap() - 0.3125).abs() < 1e-9);
        assert!((found.limit.unwrap() - 0.06875).abs() < 1e-9);
        // A power stage has neither pilot nor floor.
        let both = [&set[..], &["fleet.direction=bidirectional"]].concat();
        assert!(of(&both).holds);
    }
}
