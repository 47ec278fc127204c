//! Any bytes on a charger's service line.
#![no_main]

use libfuzzer_sys::fuzz_target;

#[path = "../src/service.rs"]
#[allow(dead_code)]
mod target;

fuzz_target!(|bytes: &[u8]| {
    let _ = target::run(bytes);
});
