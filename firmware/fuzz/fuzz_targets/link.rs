//! Any frames of the processor-in-the-loop link.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let _ = firmware_fuzz::link::run(bytes);
});
