//! Every container that must not be taken, with its reason; what is in force stays in force.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::flash::Flash;
use common::{CLASS, FLASH_LEN, GB_BI, GB_UNI, SLOT_LEN};
use common::{container, device, header, layout, sealed, signer, trusted};
use ed25519_dalek::SigningKey;
use firmware::charger::Misfits;
use firmware::table::TableError;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use update::class::DeviceClass;
use update::container::{Container, HEADER_LEN, Header, SIGNATURE_LEN, Validity};
use update::key::{DEVELOPMENT_SEED, PublicKey, Verify};
use update::layout::Slot;
use update::marks::TRIALS;
use update::refusal::Refusal;
use update::slots::Slots;

type Charger<'f> = Slots<&'f mut Flash, PublicKey>;

fn start(flash: &mut Flash) -> Charger<'_> {
    Slots::start(flash, layout(), device(trusted()))
}

/// A flash in which version 5 is in force and confirmed.
fn with_version_5() -> Flash {
    let mut flash = Flash::new(FLASH_LEN, 1);
    assert_eq!(start(&mut flash).install(&container(5), None), Ok(()));
    let mut charger = start(&mut flash);
    assert_eq!(charger.confirm(), Ok(()));
    flash
}

/// The reason for which a charger with version 5 refuses a container, whole or in parts; nothing of
/// what is in force has changed.
fn refused(container: &[u8], now_s: Option<u32>) -> Refusal {
    let mut flash = with_version_5();
    let reason = start(&mut flash).install(container, now_s).unwrap_err();
    let mut charger = start(&mut flash);
    let mut in_parts = || {
        let (header, rest) = container.split_first_chunk().ok_or(Refusal::OutOfTurn)?;
        charger.begin(header, now_s)?;
        for part in rest.chunks(7) {
            charger.part(part)?;
        }
        charger.finish()
    };
    let other = in_parts();
    assert!(other.is_err(), "{other:?}");
    let again = start(&mut flash);
    let running = again.running().unwrap();
    assert_eq!((running.version, running.confirmed), (5, true));
    assert_eq!(again.table(), Some(GB_BI));
    reason
}

#[test]
fn a_good_one_is_taken() {
    let mut flash = with_version_5();
    let mut charger = start(&mut flash);
    assert_eq!(charger.install(&container(6), None), Ok(()));
    assert_eq!(charger.waiting(), Some(6));
    assert_eq!(charger.running().unwrap().version, 5);
    let charger = start(&mut flash);
    let running = charger.running().unwrap();
    assert_eq!((running.version, running.confirmed), (6, false));
    assert_eq!(running.slot, Slot::B);
    assert_eq!(charger.table(), Some(GB_BI));
}

#[test]
fn truncated() {
    let whole = container(6);
    let needed = whole.len() as u32;
    for found in 0..whole.len() {
        let reason = refused_quickly(&whole[..found]);
        let least = (HEADER_LEN + SIGNATURE_LEN) as u32;
        let needed = if found < HEADER_LEN { least } else { needed };
        let found = found as u32;
        assert_eq!(reason, Refusal::Truncated { found, needed });
    }
    // In parts that end too soon.
    let mut flash = with_version_5();
    let mut charger = start(&mut flash);
    charger.begin(whole.first_chunk().unwrap(), None).unwrap();
    charger.part(&whole[HEADER_LEN..100]).unwrap();
    let found = 100;
    assert_eq!(charger.finish(), Err(Refusal::Truncated { found, needed }));
    assert_eq!(charger.finish(), Err(Refusal::OutOfTurn));
    let longer = [&whole[..], &[0]].concat();
    let (found, stated) = (needed + 1, needed);
    assert_eq!(refused_quickly(&longer), Refusal::TooMany { found, stated });
}

/// The reason alone.
fn refused_quickly(container: &[u8]) -> Refusal {
    let mut flash = Flash::new(FLASH_LEN, 1);
    let mut charger = start(&mut flash);
    charger.install(container, None).unwrap_err()
}

#[test]
fn forged() {
    // Signed by somebody else, by the key of experiments too.
    for seed in [[8; 32], DEVELOPMENT_SEED] {
        let other = SigningKey::from_bytes(&seed);
        let forged = sealed(header(6, GB_BI), GB_BI, &other);
        assert_eq!(refused(&forged, None), Refusal::BadSignature);
    }
    // A signature over another version is none over this.
    let mut spliced = container(6);
    let header = header(7, GB_BI).write();
    spliced[..HEADER_LEN].copy_from_slice(&header);
    assert_eq!(refused(&spliced, None), Refusal::BadSignature);
}

#[test]
fn every_flipped_bit_is_found() {
    let whole = container(6);
    let mut random = Pcg64::seed_from_u64(1);
    for at in 0..whole.len() {
        let mut changed = whole.clone();
        changed[at] ^= 1 << random.random_range(0..8);
        let reason = refused_quickly(&changed);
        let of_the_form = matches!(
            reason,
            Refusal::NotAContainer { .. }
                | Refusal::UnsupportedFormat { .. }
                | Refusal::BadField { .. }
                | Refusal::Truncated { .. }
                | Refusal::TooMany { .. }
        );
        let in_header = at < HEADER_LEN;
        assert!(
            reason == Refusal::BadSignature || (of_the_form && in_header),
            "{at}: {reason:?}"
        );
    }
}

#[test]
fn a_second_signature_for_the_same_bytes_is_none() {
    // s + L is the same number to a verifier that does not ask for s < L.
    const ORDER: [u8; 32] = [
        0xED, 0xD3, 0xF5, 0x5C, 0x1A, 0x63, 0x12, 0x58, 0xD6, 0x9C, 0xF7, 0xA2, 0xDE, 0xF9, 0xDE,
        0x14, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x10,
    ];
    let whole = container(6);
    let (message, signature) = whole.split_last_chunk::<SIGNATURE_LEN>().unwrap();
    assert!(trusted().verifies(message, signature));
    let mut second = *signature;
    let mut carry = 0;
    for (byte, add) in second[32..].iter_mut().zip(ORDER) {
        let sum = u16::from(*byte) + u16::from(add) + carry;
        *byte = sum as u8;
        carry = sum >> 8;
    }
    assert_eq!(carry, 0);
    assert!(!trusted().verifies(message, &second));
}

#[test]
fn wrong_class() {
    let found = DeviceClass::reference(false, false);
    let other = Header {
        class: found,
        ..header(6, GB_BI)
    };
    let reason = refused(&sealed(other, GB_BI, &signer()), None);
    assert_eq!(reason, Refusal::WrongClass { found, own: CLASS });
}

#[test]
fn older_and_replayed() {
    for found in [1, 4] {
        let running = 5;
        assert_eq!(
            refused(&container(found), None),
            Refusal::Older { found, running }
        );
    }
    assert_eq!(
        refused(&container(5), None),
        Refusal::Replayed { version: 5 }
    );
    // Another table under the version in force is no way round.
    let table = other_table();
    let other = sealed(header(5, &table), &table, &signer());
    assert_eq!(refused(&other, None), Refusal::Replayed { version: 5 });
    // What waits for the next start counts as well.
    let mut flash = with_version_5();
    let mut charger = start(&mut flash);
    charger.install(&container(8), None).unwrap();
    let reason = charger.install(&container(8), None);
    assert_eq!(reason, Err(Refusal::Replayed { version: 8 }));
    let (found, running) = (7, 8);
    let reason = charger.install(&container(7), None);
    assert_eq!(reason, Err(Refusal::Older { found, running }));
}

/// gb-bi with another version in its header, and its checksum.
fn other_table() -> Vec<u8> {
    let mut table = GB_BI.to_vec();
    table[firmware::table::field::TABLE_VERSION.start] ^= 1;
    let body = table.len() - 4;
    let crc = firmware::table::checksum(&table[..body]);
    table[body..].copy_from_slice(&crc.to_le_bytes());
    table
}

#[test]
fn outside_its_time() {
    let timed = Header {
        validity: Validity {
            from_s: 1_000,
            until_s: 2_000,
        },
        ..header(6, GB_BI)
    };
    let timed = sealed(timed, GB_BI, &signer());
    let early = Refusal::NotYetValid {
        from_s: 1_000,
        now_s: 999,
    };
    assert_eq!(refused(&timed, Some(999)), early);
    let late = Refusal::Expired {
        until_s: 2_000,
        now_s: 2_001,
    };
    assert_eq!(refused(&timed, Some(2_001)), late);
    assert_eq!(refused(&timed, None), Refusal::NoTime);
    for now_s in [1_000, 2_000] {
        let mut flash = with_version_5();
        assert_eq!(start(&mut flash).install(&timed, Some(now_s)), Ok(()));
        // What is installed stays, whatever the time is.
        assert_eq!(start(&mut flash).running().unwrap().version, 6);
    }
}

#[test]
fn a_table_that_this_charger_cannot_run() {
    let mut broken = GB_BI.to_vec();
    let last = broken.len() - 1;
    broken[last] ^= 1;
    let reason = refused(&sealed(header(6, &broken), &broken, &signer()), None);
    assert!(
        matches!(reason, Refusal::Table(TableError::BadCrc { .. })),
        "{reason:?}"
    );
    let reason = refused(&sealed(header(6, GB_UNI), GB_UNI, &signer()), None);
    let Refusal::Misfit(misfits) = reason else {
        panic!("{reason:?}");
    };
    assert!(misfits.contains(Misfits::DIRECTION) && misfits.contains(Misfits::POWER));
    assert!(!misfits.contains(Misfits::METER_ERROR));
}

#[test]
fn a_form_that_cannot_be() {
    let good = header(6, GB_BI);
    let resealed = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = good.write().to_vec();
        change(&mut bytes);
        bytes.extend(GB_BI);
        let signature = ed25519_dalek::Signer::sign(&signer(), &bytes);
        bytes.extend(signature.to_bytes());
        refused(&bytes, None)
    };
    let found = *b"HFDT";
    let reason = resealed(&|bytes| bytes[..4].copy_from_slice(&found));
    assert_eq!(reason, Refusal::NotAContainer { found });
    let reason = resealed(&|bytes| bytes[4] = 2);
    let (found, supported) = (2, 1);
    assert_eq!(reason, Refusal::UnsupportedFormat { found, supported });
    for (offset, at, value) in [(6, 7, 1), (28, 31, 1), (16, 16, 0)] {
        let reason = resealed(&|bytes| bytes[at] = value);
        assert_eq!(reason, Refusal::BadField { offset });
    }
    let upside_down = Header {
        validity: Validity {
            from_s: 2,
            until_s: 1,
        },
        ..good
    };
    let reason = refused(&sealed(upside_down, GB_BI, &signer()), Some(1));
    assert_eq!(reason, Refusal::BadField { offset: 24 });
    // Larger than a slot, though whole.
    let long = vec![0; 2 * FLASH_LEN];
    let huge = sealed(header(6, &long), &long, &signer());
    let mut flash = with_version_5();
    let reason = start(&mut flash).begin(huge.first_chunk().unwrap(), None);
    assert!(matches!(reason, Err(Refusal::TooLong { .. })), "{reason:?}");
}

#[test]
fn a_table_that_does_not_run_is_rolled_back_and_not_tried_again() {
    let mut flash = with_version_5();
    start(&mut flash).install(&container(6), None).unwrap();
    for _ in 0..TRIALS {
        let mut charger = start(&mut flash);
        assert_eq!(charger.running().unwrap().version, 6);
        // The other slot is the way back.
        let reason = charger.install(&container(7), None);
        assert_eq!(reason, Err(Refusal::TrialRuns));
    }
    for _ in 0..3 {
        let mut charger = start(&mut flash);
        let running = charger.running().unwrap();
        assert_eq!((running.version, running.confirmed), (5, true));
        let reason = charger.install(&container(6), None);
        assert_eq!(reason, Err(Refusal::RolledBack { version: 6 }));
    }
    start(&mut flash).install(&container(7), None).unwrap();
    let mut charger = start(&mut flash);
    assert_eq!(charger.running().unwrap().version, 7);
    charger.confirm().unwrap();
    assert_eq!(start(&mut flash).running().unwrap().version, 7);
}

#[test]
fn a_damaged_slot_is_left_for_the_other() {
    let mut flash = with_version_5();
    start(&mut flash).install(&container(6), None).unwrap();
    start(&mut flash).confirm().unwrap();
    assert_eq!(start(&mut flash).running().unwrap().version, 6);
    // A bit of the table in slot B, then one in slot A.
    flash.decay(SLOT_LEN as usize + 400);
    assert_eq!(start(&mut flash).running().unwrap().version, 5);
    flash.decay(400);
    assert_eq!(start(&mut flash).running(), None);
    start(&mut flash).install(&container(6), None).unwrap();
    assert_eq!(start(&mut flash).running().unwrap().version, 6);
}

#[test]
fn another_key_or_class_in_the_firmware_leaves_the_slots() {
    let mut flash = with_version_5();
    let other = PublicKey(SigningKey::from_bytes(&[9; 32]).verifying_key().to_bytes());
    let charger = Slots::start(&mut flash, layout(), device(other));
    assert_eq!(charger.running(), None);
    let mut unlike = device(trusted());
    unlike.class = DeviceClass(1);
    let charger = Slots::start(&mut flash, layout(), unlike);
    assert_eq!(charger.running(), None);
}

#[test]
fn reader_and_writer_agree() {
    let header = Header {
        table_len: 0x0102_0304,
        class: DeviceClass(0x0506_0708),
        version: 0x090A_0B0C,
        validity: Validity {
            from_s: 0x0D0E_0F10,
            until_s: 0x1112_1314,
        },
    };
    let bytes = header.write();
    #[rustfmt::skip]
    let by_hand = [
        b'H', b'F', b'S', b'C', 1, 0, 0, 0, 4, 3, 2, 1, 8, 7, 6, 5,
        0x0C, 0x0B, 0x0A, 9, 0x10, 0x0F, 0x0E, 0x0D, 0x14, 0x13, 0x12, 0x11, 0, 0, 0, 0,
    ];
    assert_eq!(bytes, by_hand);
    assert_eq!(Header::read(&bytes), Ok(header));
    let whole = container(3);
    let parsed = Container::parse(&whole).unwrap();
    assert_eq!(
        (parsed.header, parsed.table),
        (common::header(3, GB_BI), GB_BI)
    );
}

#[test]
fn the_key_of_experiments_is_that_of_its_seed() {
    let key = SigningKey::from_bytes(&DEVELOPMENT_SEED);
    assert_eq!(PublicKey::DEVELOPMENT.0, key.verifying_key().to_bytes());
}
