//! A fallback goes out as messages and comes back as it was; what cannot be followed is named.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use firmware::event::EventEnd;
use model::spec::{Direction, Spec};
use ocpp::export::Messages;
use ocpp::fallback::Fallback;
use ocpp::import::{self, Imported};
use proptest::prelude::*;
use serde_json::{Value, json};

fn calls(fallback: &Fallback) -> Vec<Value> {
    let calls = Messages::of(fallback).calls().unwrap();
    calls.into_iter().map(|(_, call)| call).collect()
}

#[test]
fn every_shipped_spec_comes_back_exactly() {
    for name in Spec::shipped_names() {
        let spec = Spec::load(name, &[]).unwrap();
        let fallback = Fallback::of(&spec, EventEnd::DEFAULT).unwrap();
        let text = Value::Array(calls(&fallback)).to_string();
        let imported = import::read(&text).unwrap();
        assert_eq!(imported.not_taken, Vec::<String>::new(), "{name}");
        // Into a spec whose fallback is another.
        let mut other = spec.clone();
        other.baseline.deadband_hz = 0.3;
        other.baseline.droop_hz = 1.0;
        other.baseline.time_s = 1.0;
        other.fleet.power_per_charger_kw = 7.0;
        other.fleet.direction = match spec.fleet.direction {
            Direction::Bidirectional => Direction::Unidirectional,
            Direction::Unidirectional => Direction::Bidirectional,
        };
        let mut changed = Fallback::of(
            &other,
            EventEnd {
                recovered_s: 1,
                ..EventEnd::DEFAULT
            },
        )
        .unwrap();
        imported.put_into(&mut changed);
        changed.put_into(&mut other).unwrap();
        assert_eq!(other, spec, "{name}");
        assert_eq!(changed.event_end, EventEnd::DEFAULT);
    }
}

proptest! {
    #[test]
    fn any_fallback_comes_back_exactly(
        deadband_uhz in 0u32..1_000_000,
        full_uhz in 1u32..2_000_000,
        time_us in 1_000u32..100_000_000,
        swing_w in 100u32..1_000_000,
        bidirectional in any::<bool>(),
        recovered in (0i32..1_000_000, 0u16..3600, 1u16..3600),
    ) {
        let (below_uhz, recovered_s, release_s) = recovered;
        let fallback = Fallback {
            deadband_uhz,
            full_uhz,
            time_s: f64::from(time_us) / 1e6,
            swing_w: swing_w.into(),
            direction: if bidirectional { Direction::Bidirectional } else { Direction::Unidirectional },
            event_end: EventEnd { recovered_uhz: -below_uhz, recovered_s, release_s },
        };
        let all = calls(&fallback);
        let read = |calls: &[Value]| import::read(&Value::Array(calls.to_vec()).to_string());
        let blank = Fallback { deadband_uhz: 1, full_uhz: 1, time_s: 1.0, swing_w: 1.0, event_end: EventEnd::DEFAULT, ..fallback };
        let mut whole = blank;
        read(&all).unwrap().put_into(&mut whole);
        prop_assert_eq!(whole, fallback);
        // Each message alone says its part.
        for call in &all {
            let imported = import::read(&call.to_string()).unwrap();
            if let Some(droop) = imported.droop_uhz {
                prop_assert_eq!(droop, (deadband_uhz, full_uhz));
            }
            if let Some(time_s) = imported.time_s {
                prop_assert_eq!(time_s, fallback.time_s);
            }
            if let Some(end) = imported.event_end {
                prop_assert_eq!(end, fallback.event_end);
            }
        }
    }
}

/// A profile of this period.
fn profile(unit: &str, period: Value) -> Value {
    json!({"evseId": 1, "chargingProfile": {
        "id": 7, "stackLevel": 0, "chargingProfilePurpose": "TxProfile", "transactionId": "t",
        "chargingProfileKind": "Absolute", "customData": {"vendorId": "x"},
        "chargingSchedule": [{"id": 1, "chargingRateUnit": unit, "startSchedule": "2026-01-01T00:00:00Z",
            "chargingSchedulePeriod": [period]}]}})
}

fn local(curve: Value) -> Value {
    json!({"startPeriod": 0, "operationMode": "LocalFrequency", "v2xBaseline": 7000, "v2xFreqWattCurve": curve})
}

fn point(frequency: f64, power: f64) -> Value {
    json!({"frequency": frequency, "power": power})
}

fn said(document: &Value) -> Imported {
    import::read(&document.to_string()).unwrap()
}

#[test]
fn a_profile_of_a_back_office_is_read() {
    let two = local(json!([point(49.5, -7000.0), point(50.0, 0.0)]));
    let imported = said(&profile("W", two));
    assert_eq!(imported.droop_uhz, Some((0, 500_000)));
    assert_eq!(imported.swing, Some((7000.0, Direction::Unidirectional)));
    assert_eq!(imported.event_end, None);
    // Plateaus and points on the line say the same.
    let five = local(json!([
        point(49.0, -7000.0),
        point(49.5, -7000.0),
        point(49.75, -3500.0),
        point(50.0, 0.0),
        point(51.0, 0.0)
    ]));
    assert_eq!(said(&profile("W", five)), imported);
    // More than is drawn is given: the charger discharges.
    let both_ways = local(json!([point(49.5, -14000.0), point(50.0, 0.0)]));
    let imported = said(&profile("W", both_ways));
    assert_eq!(imported.swing, Some((14000.0, Direction::Bidirectional)));
    // A profile without its message.
    let bare =
        &profile("W", local(json!([point(49.5, -7000.0), point(50.0, 0.0)])))["chargingProfile"];
    assert_eq!(said(bare).droop_uhz, Some((0, 500_000)));
}

#[test]
fn what_cannot_be_followed_is_refused_by_its_field() {
    let refused = |text: &str, field: &str| {
        let error = import::read(text).unwrap_err().to_string();
        assert!(error.starts_with(field), "{field}: {error}");
    };
    let period = "chargingProfile.chargingSchedule[0].chargingSchedulePeriod[0].";
    let with = |curve: Value| profile("W", local(curve)).to_string();
    let good = with(json!([point(49.5, -7000.0), point(50.0, 0.0)]));
    refused(
        &with(json!([point(50.0, 0.0), point(49.5, -7000.0)])),
        &format!("{period}v2xFreqWattCurve[1].frequency"),
    );
    refused(
        &with(json!([point(50.0, 0.0)])),
        &format!("{period}v2xFreqWattCurve: found 1 points"),
    );
    refused(
        &good.replace("\"W\"", "\"A\""),
        "chargingProfile.chargingSchedule[0].chargingRateUnit: found A",
    );
    refused(
        &good.replace("-7000.0", "NaN"),
        &format!("{period}v2xFreqWattCurve[0].power"),
    );
    refused(
        &good.replace("49.5", "-Infinity"),
        &format!("{period}v2xFreqWattCurve[0].frequency"),
    );
    refused(
        &good.replace("LocalFrequency", "CentralFrequency"),
        &format!("{period}operationMode"),
    );
    refused(
        &good.replace("\"startPeriod\"", "\"limit\":5,\"startPeriod\""),
        &format!("{period}limit"),
    );
    // Three levels are no droop.
    let three = json!([point(49.0, -9000.0), point(49.5, -7000.0), point(50.0, 0.0)]);
    refused(&with(three), &format!("{period}v2xFreqWattCurve[1].power"));
    // A rise is not answered.
    let rise = json!([point(50.0, 0.0), point(50.5, 7000.0)]);
    refused(
        &with(rise),
        &format!("{period}v2xFreqWattCurve[1].frequency"),
    );
    let down = json!([point(49.5, 0.0), point(50.0, -7000.0)]);
    refused(&with(down), &format!("{period}v2xFreqWattCurve[1].power"));
    refused("{}", "no SetChargingProfile");
    refused("{", "not JSON");
    refused(
        r#"{"isDefault":true,"controlId":"a","controlType":"VoltVar"}"#,
        "controlType",
    );
    let two = format!("[{good},{}]", good.replace("49.5", "49.6"));
    refused(&two, "droop");
}

#[test]
fn what_is_about_the_way_back_is_named() {
    let service = json!({"isDefault": true, "controlId": "a", "controlType": "EnterService", "enterService": {
        "priority": 0, "highVoltage": 253, "lowVoltage": 207, "highFreq": 50.1, "lowFreq": 49.9,
        "delay": 60, "randomDelay": 300, "rampRate": 900}});
    let imported = said(&service);
    let end = imported.event_end.unwrap();
    assert_eq!(
        (end.recovered_uhz, end.recovered_s, end.release_s),
        (-100_000, 60, 900)
    );
    assert_eq!(imported.not_taken.len(), 2, "{:?}", imported.not_taken);
    assert!(imported.not_taken[1].starts_with("enterService.randomDelay = 300"));
}
