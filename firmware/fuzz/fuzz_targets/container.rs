//! Any signed container, and any slots.
#![no_main]

use libfuzzer_sys::fuzz_target;

#[path = "../src/container.rs"]
mod container;

fuzz_target!(|bytes: &[u8]| {
    let _ = container::run(bytes);
});
