//! The host's side and the device's code, over a pseudo-terminal with telemetry between.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on fails"
)]

use service::message::{Order, Pairs, Refusal};
use service::seal::DeviceKey;
use service_client::client::{Client, ClientError, refusal};
use service_client::stand_in::{SERIAL, StandIn};
use settings::key::Key;

const KEY: DeviceKey = DeviceKey::new([0x21; 32]);
const OTHER: DeviceKey = DeviceKey::new([0x22; 32]);

fn limit(ma: u32) -> Order {
    Order::Limit {
        source: 1,
        ma: Some(ma),
        for_s: 600,
    }
}

fn refused(result: Result<(), ClientError>) -> Refusal {
    match result {
        Err(ClientError::Refused(refusal)) => refusal,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_charger_is_read_set_and_kept() {
    let charger = StandIn::start().unwrap();
    let mut client = Client::open(charger.path()).unwrap();
    let identity = client.identity().unwrap();
    assert_eq!((identity.serial, identity.settings), (SERIAL, 0));
    let defaults = Key::ALL.map(|key| (key.number(), key.about().default));
    assert_eq!(client.settings().unwrap(), defaults);

    assert_eq!(refused(client.order(&KEY, &limit(10_000))), Refusal::NoKey);
    client.provision(&KEY).unwrap();
    assert_eq!(refused(client.provision(&OTHER)), Refusal::HasKey);
    let wrong = client.order(&OTHER, &limit(10_000));
    assert!(matches!(
        wrong,
        Err(ClientError::WrongKey { serial: SERIAL })
    ));
    client.order(&KEY, &limit(10_000)).unwrap();
    let status = client.status().unwrap();
    assert_eq!(status.limits_ma, [80_000, 10_000, 32_000]);
    // Telemetry went on meanwhile.
    assert!(status.frame.unwrap().sequence > 0);

    let set = |key: Key, value| {
        let pairs: Pairs = [(key.number(), value)].into_iter().collect();
        Order::Settings(pairs)
    };
    client.order(&KEY, &set(Key::RatedCurrent, 16_000)).unwrap();
    assert!(client.status().unwrap().waiting);
    let too_soon = refused(client.order(&KEY, &set(Key::StartFixed, 30)));
    assert_eq!(too_soon, Refusal::StartTooSoon { off_s: 60 });
    assert!(refusal(&too_soon).contains("at least contactor_off_least_s, which is 60"));
    client.order(&KEY, &Order::Restart).unwrap();
    let status = client.status().unwrap();
    assert_eq!(
        (status.waiting, status.limits_ma),
        (false, [80_000, 80_000, 16_000])
    );
    assert_eq!(client.identity().unwrap().settings, 1);

    client.new_key(&KEY, &OTHER).unwrap();
    let wrong = client.order(&KEY, &limit(10_000));
    assert!(matches!(wrong, Err(ClientError::WrongKey { .. })));
    client.order(&OTHER, &Order::Defaults).unwrap();
    client.order(&OTHER, &Order::Restart).unwrap();
    assert_eq!(client.settings().unwrap(), defaults);
}

#[test]
fn what_is_no_charger_is_named() {
    let missing = Client::open("/nonexistent/port".as_ref()).err().unwrap();
    assert!(missing.to_string().contains("/nonexistent/port"));
    let file = Client::open(env!("CARGO_MANIFEST_DIR").as_ref())
        .err()
        .unwrap();
    assert!(matches!(file, ClientError::Port { .. }));
}
