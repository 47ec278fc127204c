//! Any register values, time stamps and clocks.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let _ = firmware_fuzz::readings::run(bytes);
});
