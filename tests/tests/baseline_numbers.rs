//! The plant and the baseline against numbers that three independent programs agree on.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use lab::simulation::baseline;
use lab::simulation::scenario::Scenario;
use model::spec::Spec;

fn spec(name: &str, deadband: f64) -> Spec {
    Spec::load(name, &[format!("baseline.deadband_hz={deadband:?}")]).unwrap()
}

/// Rounded to a number of digits, as printed.
fn digits(value: f64, digits: usize) -> String {
    format!("{value:.digits$}")
}

#[test]
fn a_loss_of_two_gigawatts() {
    // Spec, response, nadir Hz, at s, final Hz, max u, s below 49.5, containment breached.
    let rows = [
        (
            "paper-bi", false, "49.1285", 6.88, "49.6667", "0.000", 10.70, true,
        ),
        (
            "paper-uni",
            true,
            "49.3696",
            5.64,
            "49.7014",
            "0.961",
            7.16,
            false,
        ),
        (
            "paper-bi", true, "49.4923", 4.84, "49.7250", "0.715", 1.78, false,
        ),
    ];
    for (name, respond, nadir, at, last, max_u, below, breached) in rows {
        let spec = spec(name, 0.15);
        let run = baseline::simulate(&spec, &Scenario::of(&spec), respond);
        let summary = run.summary;
        assert_eq!(digits(summary.nadir_hz, 4), nadir, "{name} {respond}");
        assert_eq!(digits(summary.final_hz, 4), last, "{name} {respond}");
        assert_eq!(
            digits(summary.max_participation, 3),
            max_u,
            "{name} {respond}"
        );
        assert_eq!(
            summary.containment_breached,
            Some(breached),
            "{name} {respond}"
        );
        // The oracle's times come from samples 0.02 s apart (all of them are multiples of it). Its
        // nadir may be one sample off; its time below a limit, counted from first to last sample,
        // misses up to one sample at either end.
        assert!(
            (summary.nadir_time_s - at).abs() <= 0.02,
            "{name} {respond}: {}",
            summary.nadir_time_s
        );
        let missed = summary.seconds_below_49_5 - below;
        assert!(
            (0.0..=0.04).contains(&missed),
            "{name} {respond}: {}",
            summary.seconds_below_49_5
        );
    }
}

#[test]
fn steady_state_for_every_dead_band() {
    for (name, fleet) in [("paper-uni", 0.7), ("paper-bi", 1.4)] {
        for step in 0..8 {
            let deadband = 0.05 * f64::from(step);
            let spec = spec(name, deadband);
            let run = baseline::simulate(&spec, &Scenario::of(&spec), true);
            // At rest p = K f, so 6 f = P u - 2 with u = (-f - deadband) / 0.5; without a response
            // f = -1/3.
            let rest = if deadband < 1.0 / 3.0 {
                50.0 - (2.0 + 2.0 * fleet * deadband) / (6.0 + 2.0 * fleet)
            } else {
                50.0 - 1.0 / 3.0
            };
            assert_eq!(
                digits(run.summary.final_hz, 4),
                digits(rest, 4),
                "{name}, dead band {deadband}"
            );
        }
    }
}
