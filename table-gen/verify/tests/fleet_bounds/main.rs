//! The bounds of a fleet under a response, attacked: fleets of single chargers with the firmware's
//! own law, drawn at random and chosen with malice, never leave them.
//!
//! The plant is integrated here by itself (classic Runge-Kutta, 5 ms), the chargers run
//! `firmware::response`; nothing of the verifier is used but the bounds that it gives. Within the
//! hypotheses everything is drawn anew: clocks, delays that change at every tick, ages and errors
//! of readings, delivery, the loss, and the state that the event finds.

mod attack;

use attack::{Malice, Setting, case, plant, run, stages};
use model::governor::Governor;
use model::interval::Interval;
use verify::response::{Found, LossProfile, Resolution, TimeBands, examine, examine_staged};

const RESOLUTION: Resolution = Resolution {
    step_s: 0.05,
    follow_s: 30.0,
    memory_s: 25.0,
};

#[test]
fn no_fleet_leaves_its_bounds() {
    let mut closest = 0.0f64;
    for (number, low) in [0.0, 0.3, 0.8, 1.3, 1.8, 2.16].into_iter().enumerate() {
        let loss = Interval::hull(low, low + 0.04);
        let grid = Setting::honest(loss, Governor::LINEAR);
        let found = examine(&case(grid), RESOLUTION).expect("bounds");
        for draw in 0..6 {
            let seed = (number * 100 + draw) as u64;
            for malice in [
                Malice::Random,
                Malice::LowAndLate,
                Malice::HighAndEarly,
                Malice::Pump,
                Malice::Swing(1.0),
                Malice::Swing(3.0 + draw as f64),
                Malice::TwoGroups,
            ] {
                let chargers = [1, 2, 12][draw % 3];
                closest = closest.max(run(seed, malice, chargers, grid, &found));
            }
        }
        closest = closest.max(run(9, Malice::Random, 300, grid, &found));
    }
    // Bounds that nobody comes near would prove little: someone gets at least half way to the edge.
    assert!(closest > 0.5, "{closest}");
    println!("closest: {closest:.3} of the way to the edge of the bounds");
}

/// Bounds for a person.
fn shown(found: &Found) -> String {
    let end = found.for_ever.map_or("nothing for ever".to_owned(), |f| {
        format!("in the end {:.4} to {:.4}", f.low, f.high)
    });
    format!("f in {:.4} to {:.4} Hz, {end}", found.f.low, found.f.high)
}

/// The same with governors that have a dead band, a limited rate and a limited output, each alone
/// and all together.
#[test]
fn no_fleet_leaves_its_bounds_on_limited_governors() {
    let dead = Governor {
        deadband_hz: 0.015,
        ..Governor::LINEAR
    };
    let slow = Governor {
        rate_gw_per_s: 0.3,
        ..Governor::LINEAR
    };
    let full = Governor {
        output_gw: [-0.3, 1.2],
        ..Governor::LINEAR
    };
    let all = Governor {
        deadband_hz: 0.015,
        rate_gw_per_s: 0.4,
        output_gw: [-0.4, 1.4],
    };
    let losses: [(Governor, &[f64]); 4] = [
        (dead, &[0.0, 0.8, 1.6, 2.16]),
        (slow, &[0.0, 0.8, 1.2, 1.6]),
        (full, &[0.0, 0.8, 1.2, 1.6, 2.0]),
        (all, &[0.0, 0.8, 1.2]),
    ];
    for (number, (governor, losses)) in losses.into_iter().enumerate() {
        let mut closest = 0.0f64;
        for (loss_number, low) in losses.iter().enumerate() {
            let loss = Interval::hull(*low, low + 0.04);
            let setting = Setting::honest(loss, governor);
            let found = examine(&case(setting), RESOLUTION).expect("bounds");
            println!("{governor:?}, {low} GW: {found}", found = shown(&found));
            for draw in 0..4 {
                let seed = (number * 1000 + loss_number * 100 + draw) as u64;
                for malice in [
                    Malice::Random,
                    Malice::LowAndLate,
                    Malice::HighAndEarly,
                    Malice::Pump,
                    Malice::Swing(3.0 + draw as f64),
                    Malice::TwoGroups,
                ] {
                    let chargers = [1, 2, 12][draw % 3];
                    let went = run(seed, malice, chargers, setting, &found);
                    closest = closest.max(went);
                }
            }
        }
        assert!(closest > 0.5, "{governor:?}: {closest}");
        println!("{governor:?}: closest {closest:.3}");
    }
}

/// The same with time constants anywhere within 5 % of the plant's, one by one and all together,
/// with linear governors and with limited ones. That these bounds are needed: they are wider than
/// those of the plant in the middle.
#[test]
fn no_fleet_leaves_its_bounds_whatever_the_time_constants() {
    let around = |time: f64| Interval::hull(0.95 * time, 1.05 * time);
    let known = TimeBands::known(&plant());
    let all = TimeBands {
        governor: around(known.governor.low),
        turbine: around(known.turbine.low),
        lead: around(known.lead.low),
        lag: around(known.lag.low),
    };
    let one = |name| match name {
        0 => TimeBands {
            governor: all.governor,
            ..known
        },
        1 => TimeBands {
            turbine: all.turbine,
            ..known
        },
        2 => TimeBands {
            lead: all.lead,
            ..known
        },
        3 => TimeBands {
            lag: all.lag,
            ..known
        },
        _ => all,
    };
    let limited = Governor {
        deadband_hz: 0.015,
        rate_gw_per_s: 0.4,
        output_gw: [-0.4, 1.4],
    };
    let settings = [
        (0, Governor::LINEAR, 1.2),
        (1, Governor::LINEAR, 1.2),
        (2, Governor::LINEAR, 1.2),
        (3, Governor::LINEAR, 1.2),
        (4, Governor::LINEAR, 0.4),
        (4, Governor::LINEAR, 2.0),
        (4, limited, 0.8),
    ];
    for (number, (name, governor, low)) in settings.into_iter().enumerate() {
        let middle = Setting::honest(Interval::hull(low, low + 0.04), governor);
        let setting = Setting {
            times: one(name),
            ..middle
        };
        let found = examine(&case(setting), RESOLUTION).expect("bounds");
        let narrower = examine(&case(middle), RESOLUTION).expect("bounds");
        println!("{number}: {}; known: {}", shown(&found), shown(&narrower));
        assert!(narrower.f.low > found.f.low);
        let mut closest = 0.0f64;
        // Sixteen corners of the bands, and four draws.
        for seed in 0..20u64 {
            for malice in [
                Malice::LowAndLate,
                Malice::HighAndEarly,
                Malice::Pump,
                Malice::Swing(3.0 + (seed % 5) as f64),
            ] {
                let chargers = [1, 2, 12][seed as usize % 3];
                let seed = 32 * (300 + number as u64) + seed;
                closest = closest.max(run(seed, malice, chargers, setting, &found));
            }
        }
        assert!(closest > 0.5, "{number}: {closest}");
        println!("{number}: closest {closest:.3}");
    }
}

/// The same with chargers that do as they like. That these bounds are needed: bounds for honest
/// fleets are left.
#[test]
fn no_fleet_with_a_hostile_share_leaves_its_bounds() {
    let mut closest = 0.0f64;
    let mut beyond = 0.0f64;
    for (number, low) in [0.0, 0.8, 1.6, 2.16].into_iter().enumerate() {
        let loss = Interval::hull(low, low + 0.04);
        let honest = Setting::honest(loss, Governor::LINEAR);
        let hostile = Setting {
            hostile_share: 0.05,
            ..honest
        };
        let found = examine(&case(hostile), RESOLUTION).expect("bounds");
        let narrower = examine(&case(honest), RESOLUTION).expect("bounds");
        println!("{low} GW: {}", shown(&found));
        assert!(narrower.f.low > found.f.low && narrower.f.high <= found.f.high);
        beyond = beyond.max(found.f.high - narrower.f.high);
        for draw in 0..3 {
            let seed = (5000 + number * 100 + draw) as u64;
            for malice in [
                Malice::Random,
                Malice::LowAndLate,
                Malice::HighAndEarly,
                Malice::Pump,
                Malice::Swing(3.0 + draw as f64),
                Malice::TwoGroups,
            ] {
                let chargers = [20, 41][draw % 2];
                closest = closest.max(run(seed, malice, chargers, hostile, &found));
            }
        }
    }
    assert!(closest > 0.5, "{closest}");
    // At rest 5 % of 1.4 GW push f up by 0.07 / 6 Hz at least; an honest fleet gives nothing there.
    assert!(beyond > 0.07 / 6.0, "{beyond}");
    println!("closest: {closest:.3} of the way to the edge of the bounds");
}

/// Levels 0.12 apart that 200 consecutive serial numbers shift against each other, both ways by at
/// most 2 (1 + 0.7 log2 200)/200 < 0.064 off an even spread. That this is needed: the bounds are
/// narrower than those for levels as an adversary likes.
#[test]
fn no_fleet_of_shifted_levels_leaves_its_bounds() {
    let mut closest = 0.0f64;
    for (number, low) in [0.0, 0.4, 1.0, 1.6, 2.16].into_iter().enumerate() {
        let loss = Interval::hull(low, low + 0.04);
        let shifted = Setting {
            smallest_change_ppm: 120_000,
            mean_step_share: 0.564,
            ..Setting::honest(loss, Governor::LINEAR)
        };
        let anyhow = Setting {
            mean_step_share: 1.0,
            ..shifted
        };
        let found = examine(&case(shifted), RESOLUTION).expect("bounds");
        println!("{low} GW: {}", shown(&found));
        if let Some(wider) = examine(&case(anyhow), RESOLUTION) {
            println!("  levels as an adversary likes: {}", shown(&wider));
            assert!(wider.f.low < found.f.low || wider.f.high > found.f.high);
        }
        for draw in 0..2 {
            let seed = (7000 + number * 100 + draw) as u64;
            for malice in [
                Malice::Random,
                Malice::LowAndLate,
                Malice::HighAndEarly,
                Malice::Pump,
                Malice::Swing(3.0 + draw as f64),
                Malice::TwoGroups,
            ] {
                closest = closest.max(run(seed, malice, 200, shifted, &found));
            }
        }
    }
    assert!(closest > 0.5, "{closest}");
    println!("closest: {closest:.3} of the way to the edge of the bounds");
}

/// Losses in stages, each within half a second of its moment.
#[test]
fn no_fleet_leaves_its_bounds_under_a_loss_in_stages() {
    let full = Governor {
        deadband_hz: 0.015,
        output_gw: [-0.4, 1.0],
        ..Governor::LINEAR
    };
    for (number, governor) in [Governor::LINEAR, full].into_iter().enumerate() {
        let setting = Setting {
            staged: true,
            ..Setting::honest(Interval::hull(0.0, 1.7), governor)
        };
        let found = examine_staged(&case(setting), &stages(), RESOLUTION).expect("bounds");
        println!("{governor:?} in stages: {}", shown(&found));
        let mut closest = 0.0f64;
        for draw in 0..6 {
            for malice in [
                Malice::Random,
                Malice::LowAndLate,
                Malice::HighAndEarly,
                Malice::Pump,
                Malice::Swing(3.0 + draw as f64),
                Malice::TwoGroups,
            ] {
                let seed = (7000 + number * 100 + draw) as u64;
                let chargers = [1, 2, 12][draw / 2];
                closest = closest.max(run(seed, malice, chargers, setting, &found));
            }
        }
        assert!(closest > 0.5, "{governor:?}: {closest}");
        println!("closest: {closest:.3} of the way to the edge of the bounds");
    }
}

/// Before the event nothing is lost. A band that does not hold 0 is entered by a jump, which
/// counts: bounds for a loss that then moves or rises hold every fleet whose loss jumps there and
/// stays.
#[test]
fn a_band_of_losses_that_does_not_hold_zero_is_entered_from_zero() {
    let loss = Interval::hull(0.8, 0.84);
    let setting = Setting::honest(loss, Governor::LINEAR);
    for profile in [LossProfile::NonDecreasing, LossProfile::Band] {
        let mut moving = case(setting);
        moving.assumed.profile = profile;
        let found = examine(
            &moving,
            Resolution {
                step_s: 0.025,
                ..RESOLUTION
            },
        )
        .expect("bounds");
        println!("{profile:?}: {}", shown(&found));
        // Bounds for all times, for the event's course is not told.
        let always = Found {
            tube: vec![found.f; 2400],
            ..found
        };
        for malice in [Malice::LowAndLate, Malice::HighAndEarly, Malice::Pump] {
            run(42, malice, 12, setting, &always);
        }
    }
}
