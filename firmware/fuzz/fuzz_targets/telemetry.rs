//! Any bytes between two delimiters.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let _ = firmware_fuzz::telemetry::run(bytes);
});
