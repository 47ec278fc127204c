//! The fuzz target of containers and slots, on a bounded corpus that is the same each time.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

#[path = "../../tests/bounded/mod.rs"]
mod bounded;
#[path = "../../fuzz/src/container.rs"]
#[allow(unreachable_pub, reason = "the file is part of a library of its own")]
mod container;

use common::{GB_BI, GB_UNI, header, sealed, signer};
use update::container::{Header, Validity};
use update::marks::MARKS_LEN;

#[test]
fn any_container_is_refused_or_runs() {
    let timed = Header {
        validity: Validity {
            from_s: 1,
            until_s: 2,
        },
        ..header(2, GB_BI)
    };
    let mut seeds = vec![
        sealed(header(1, GB_BI), GB_BI, &signer()),
        sealed(header(2, GB_UNI), GB_UNI, &signer()),
        sealed(timed, GB_BI, &signer()),
    ];
    assert!(seeds.iter().all(|seed| container::run(seed)));
    // A slot as a charger has it, on trial and confirmed: no container from its start on.
    let mut slot = vec![0xFF; MARKS_LEN];
    slot[..32].copy_from_slice(b"holdfast: complete and verified\0");
    slot.extend(&seeds[0]);
    let mut confirmed = slot.clone();
    confirmed[32..64].copy_from_slice(b"holdfast: has run, is confirmed\0");
    for seed in [slot, confirmed] {
        assert!(!container::run(&seed));
        seeds.push(seed);
    }
    bounded::bounded(&seeds, 50_000, container::run);
}
