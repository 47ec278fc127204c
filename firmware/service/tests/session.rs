//! A charger and a tool on one line: what is answered, what is refused, and that no order counts
//! twice.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on fails"
)]

#[path = "../../fuzz/src/service.rs"]
#[allow(unreachable_pub, reason = "the file is a fuzz target's")]
mod fuzz;

mod bench;

use bench::{Bench, KEY};
use firmware::dispatch::LimitSource;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use service::device::{AHEAD, BLOCK, GAP_MS, OPEN_MS};
use service::message::{Answer, Ask, Order, Pairs, Refusal, Status};
use service::seal::DeviceKey;
use settings::key::Key;

fn pairs(of: &[(Key, u32)]) -> Pairs {
    of.iter()
        .map(|(key, value)| (key.number(), *value))
        .collect()
}

fn limit(ma: u32) -> Order {
    Order::Limit {
        source: LimitSource::Site as u8,
        ma: Some(ma),
        for_s: 60,
    }
}

fn site_limit(bench: &mut Bench) -> u32 {
    let Answer::Status(Status { limits_ma, .. }) = bench.ask(&Ask::Status) else {
        panic!("no status");
    };
    limits_ma[LimitSource::Site as usize]
}

#[test]
fn reading_needs_no_key() {
    let mut bench = Bench::new();
    let Answer::Identity(identity) = bench.ask(&Ask::Identity) else {
        panic!("no identity");
    };
    assert_eq!((identity.build.as_str(), identity.serial), ("bench", 7));
    assert!(!identity.provisioned && identity.settings == 0);
    let mut found = Vec::new();
    loop {
        let from = found.len() as u8;
        let Answer::Settings { count, pairs } = bench.ask(&Ask::Settings { from }) else {
            panic!("no settings");
        };
        found.extend(pairs);
        if found.len() == usize::from(count) {
            break;
        }
    }
    let defaults = Key::ALL.map(|key| (key.number(), key.about().default));
    assert_eq!(found, defaults);
    let beyond = bench.ask(&Ask::Settings { from: 255 });
    let none = Answer::Settings {
        count: 23,
        pairs: Pairs::new(),
    };
    assert_eq!(beyond, none);
    assert_eq!(
        bench.ask(&Ask::Update(&[1, 2])),
        Answer::Refused(Refusal::NotHere)
    );
}

#[test]
fn nothing_changes_without_the_key() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask(&Ask::Challenge), Answer::Refused(Refusal::NoKey));
    bench.provision();
    let again = bench.ask(&Ask::Provision { key: [1; 32] });
    assert_eq!(again, Answer::Refused(Refusal::HasKey));
    let wrong = DeviceKey::new([0; 32]);
    let refused = bench.order_with(&wrong, &limit(10_000));
    assert_eq!(refused, Answer::Refused(Refusal::NotAuthentic));
    // The challenge is used up: the right seal comes too late.
    assert_eq!(
        bench.repeat_with(&KEY),
        Answer::Refused(Refusal::NoChallenge)
    );
    assert_eq!(site_limit(&mut bench), 80_000);
}

#[test]
fn an_order_counts_once_and_in_time() {
    let mut bench = Bench::new();
    bench.provision();
    assert!(bench.order(&limit(10_000)));
    assert_eq!(site_limit(&mut bench), 10_000);
    // Replayed at once, and for the next challenge, and after a start.
    assert_eq!(bench.repeat(), Answer::Refused(Refusal::NoChallenge));
    bench.wait(GAP_MS);
    assert!(matches!(
        bench.ask(&Ask::Challenge),
        Answer::Challenge { .. }
    ));
    assert_eq!(bench.repeat(), Answer::Refused(Refusal::NoChallenge));
    bench.restart();
    bench.wait(GAP_MS);
    assert!(matches!(
        bench.ask(&Ask::Challenge),
        Answer::Challenge { .. }
    ));
    assert_eq!(bench.repeat(), Answer::Refused(Refusal::NoChallenge));
    // Kept back by somebody between.
    bench.wait(GAP_MS);
    bench.seal(&KEY, &limit(9_000));
    bench.wait(OPEN_MS);
    assert_eq!(bench.repeat(), Answer::Refused(Refusal::NoChallenge));
    // A start forgets orders.
    assert_eq!(site_limit(&mut bench), 80_000);
}

#[test]
fn a_challenge_is_never_given_twice() {
    let mut bench = Bench::new();
    bench.provision();
    let mut random = Pcg64::seed_from_u64(1);
    let (mut last, mut writes) = (None, 0);
    for _ in 0..1_000 {
        if random.random_range(0..20) == 0 {
            bench.restart();
            writes += 1;
        }
        bench.wait(GAP_MS);
        let Answer::Challenge { number, .. } = bench.ask(&Ask::Challenge) else {
            panic!("no challenge");
        };
        assert!(last.is_none_or(|last| number > last));
        last = Some(number);
    }
    assert!(last.unwrap() <= 1_000 + writes * BLOCK);
    assert_eq!(
        bench.ask(&Ask::Challenge),
        Answer::Refused(Refusal::TooSoon)
    );
}

#[test]
fn in_an_event_nothing_is_written_and_limits_pass() {
    let mut bench = Bench::new();
    bench.may_write(false);
    let key = *KEY.bytes();
    let refused = Answer::Refused(Refusal::NotNow);
    assert_eq!(bench.ask(&Ask::Provision { key }), refused);
    bench.may_write(true);
    bench.provision();
    // The first block is set aside at rest, the next one before it is used up.
    for _ in 0..BLOCK {
        bench.device.look_ahead();
        assert!(bench.order(&limit(20_000)));
    }
    bench.device.look_ahead();
    bench.may_write(false);
    for ma in 0..AHEAD {
        assert!(bench.order(&limit(10_000 + ma)));
        assert_eq!(site_limit(&mut bench), 10_000 + ma);
    }
    bench.wait(GAP_MS);
    let user = pairs(&[(Key::UserLimit, 9_000)]);
    for order in [Order::Settings(user), Order::Defaults] {
        assert_eq!(bench.order_with(&KEY, &order), refused);
        bench.wait(GAP_MS);
    }
    assert!(!bench.new_key(&DeviceKey::new([9; 32])));
    // Without looking ahead a block ends where it ends.
    let mut given = 0;
    loop {
        bench.wait(GAP_MS);
        match bench.ask(&Ask::Challenge) {
            Answer::Challenge { .. } => given += 1,
            other => break assert_eq!(other, refused),
        }
    }
    assert!(given < BLOCK, "{given}");
    bench.may_write(true);
    bench.wait(GAP_MS);
    assert!(bench.order(&limit(7_000)));
    assert_eq!(site_limit(&mut bench), 7_000);
}

#[test]
fn settings_are_checked_and_kept() {
    let mut bench = Bench::new();
    bench.provision();
    let set = Order::Settings(pairs(&[
        (Key::RatedCurrent, 16_000),
        (Key::SiteLimit, 12_000),
    ]));
    assert!(bench.order(&set));
    assert_eq!(site_limit(&mut bench), 12_000);
    let Answer::Status(status) = bench.ask(&Ask::Status) else {
        panic!("no status");
    };
    // The rating waits for the next start.
    assert!(status.waiting && status.limits_ma[2] == 32_000);
    bench.restart();
    let Answer::Status(status) = bench.ask(&Ask::Status) else {
        panic!("no status");
    };
    assert!(!status.waiting && status.limits_ma == [80_000, 12_000, 16_000]);
    let refused = [
        (
            Key::Phases,
            4,
            Refusal::OutOfRange {
                number: 2,
                least: 1,
                most: 3,
            },
        ),
        (
            Key::Direction,
            1,
            Refusal::NotThisImage {
                number: 4,
                built: 0,
            },
        ),
        (Key::StartFixed, 30, Refusal::StartTooSoon { off_s: 60 }),
    ];
    for (key, value, refusal) in refused {
        // All or none.
        let order = Order::Settings(pairs(&[(Key::UserLimit, 6_000), (key, value)]));
        bench.wait(GAP_MS);
        assert_eq!(bench.order_with(&KEY, &order), Answer::Refused(refusal));
        assert_eq!(bench.device.in_force().get(Key::UserLimit), 80_000);
    }
    bench.wait(GAP_MS);
    let mut unknown = Pairs::new();
    unknown.push((99, 0)).unwrap();
    let refused = bench.order_with(&KEY, &Order::Settings(unknown));
    let expected = Refusal::UnknownSetting { number: 99 };
    assert_eq!(refused, Answer::Refused(expected));
    bench.wait(GAP_MS);
    assert!(bench.order(&Order::Defaults));
    bench.restart();
    assert_eq!(bench.device.in_force(), &settings::values::Values::DEFAULT);
}

#[test]
fn orders_that_mean_nothing_are_refused() {
    let mut bench = Bench::new();
    bench.provision();
    let most = |most| Refusal::OutOfRange {
        number: 0,
        least: 0,
        most,
    };
    let limit = |source, ma, for_s| Order::Limit { source, ma, for_s };
    let cases = [
        (limit(3, Some(0), 0), Refusal::Malformed),
        (limit(0, Some(80_001), 0), most(80_000)),
        (limit(0, None, 86_401), most(86_400)),
        (Order::Override { what: 3, for_s: 0 }, Refusal::Malformed),
        (
            Order::Override {
                what: 1,
                for_s: 86_401,
            },
            most(86_400),
        ),
    ];
    for (order, refusal) in cases {
        bench.wait(GAP_MS);
        assert_eq!(
            bench.order_with(&KEY, &order),
            Answer::Refused(refusal),
            "{order:?}"
        );
    }
}

/// Without a memory: who and how it is, nothing offered, nothing taken.
#[test]
fn without_a_memory_a_charger_answers_and_takes_nothing() {
    let mut bench = Bench::new();
    bench.provision();
    bench.without_memory();
    let Answer::Identity(who) = bench.ask(&Ask::Identity) else {
        panic!("no identity");
    };
    assert_eq!((who.settings, who.provisioned), (2, true));
    let Answer::Status(status) = bench.ask(&Ask::Status) else {
        panic!("no status");
    };
    assert_eq!(status.limits_ma.iter().min(), Some(&0));
    let key = *KEY.bytes();
    let order = [1, 2, 3];
    let mac = [0; 32];
    let asks = [
        Ask::Challenge,
        Ask::Provision { key },
        Ask::Order {
            challenge: 0,
            order: &order,
            mac,
        },
    ];
    for ask in asks {
        bench.wait(GAP_MS);
        assert_eq!(bench.ask(&ask), Answer::Refused(Refusal::Flash), "{ask:?}");
    }
    assert_eq!(bench.device.in_force().borne_ma(), 0);
    bench.restart();
    assert!(bench.order(&limit(6_000)));
}

#[test]
fn the_owner_and_the_restart() {
    let mut bench = Bench::new();
    bench.provision();
    let owner = |bench: &mut Bench| {
        let Answer::Status(status) = bench.ask(&Ask::Status) else {
            panic!("no status");
        };
        (status.owner, status.owner_s)
    };
    assert!(bench.order(&Order::Override { what: 1, for_s: 60 }));
    assert_eq!(owner(&mut bench).0, 1);
    bench.wait(59_000);
    assert_eq!(owner(&mut bench), (1, 1));
    bench.wait(1_000);
    assert_eq!(owner(&mut bench), (0, 0));
    assert!(!bench.device.restarts());
    assert!(bench.order(&Order::Restart));
    assert!(bench.device.restarts());
}

#[test]
fn another_key_takes_the_place_of_the_first() {
    let mut bench = Bench::new();
    bench.provision();
    let new = DeviceKey::new([3; 32]);
    assert!(bench.new_key(&new));
    bench.restart();
    bench.wait(GAP_MS);
    let refused = bench.order_with(&KEY, &limit(7_000));
    assert_eq!(refused, Answer::Refused(Refusal::NotAuthentic));
    bench.wait(GAP_MS);
    let done = bench.order_with(&new, &limit(7_000));
    assert!(matches!(done, Answer::Done { .. }));
}

/// Every message, and mutations of lines of them: the charger answers, and what it holds is
/// allowed.
#[test]
fn any_bytes_on_the_line() {
    let orders = [
        limit(16_000),
        Order::Override { what: 2, for_s: 9 },
        Order::Settings(pairs(&[(Key::Phases, 1), (Key::SiteLimit, 9_000)])),
        Order::Defaults,
        Order::NewKey { masked: [9; 32] },
        Order::Restart,
    ];
    let asks = [
        Ask::Identity,
        Ask::Status,
        Ask::Settings { from: 3 },
        Ask::Provision { key: [1; 32] },
        Ask::Update(&[1, 2, 3]),
    ];
    let mut seeds: Vec<Vec<u8>> = asks.iter().map(fuzz::line).collect();
    for order in &orders {
        let mut bytes = fuzz::line(&Ask::Challenge);
        bytes.extend(fuzz::order_for_the_first_challenge(order));
        seeds.push(bytes);
    }
    assert!(seeds.iter().all(|seed| fuzz::run(seed)));
    let mut random = Pcg64::seed_from_u64(1);
    let (mut past, runs) = (0, 20_000);
    for _ in 0..runs {
        let mut bytes = Vec::new();
        for _ in 0..random.random_range(1..4) {
            bytes.extend(&seeds[random.random_range(0..seeds.len())]);
        }
        for _ in 0..random.random_range(1..6) {
            let at = random.random_range(0..bytes.len());
            match random.random_range(0..4) {
                0 => bytes[at] ^= 1 << random.random_range(0..8),
                1 => bytes[at] = random.random(),
                2 => bytes.truncate(at.max(1)),
                _ => bytes.insert(at, [0, 1, 0x7F, 0x80, 0xFF][random.random_range(0..5)]),
            }
        }
        past += u32::from(fuzz::run(&bytes));
    }
    println!("{past} of {runs} asked something");
    assert!(past > runs / 100 && past < runs - runs / 100);
}
