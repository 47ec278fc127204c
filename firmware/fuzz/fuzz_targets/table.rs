//! Any flash region.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let _ = firmware_fuzz::table::run(bytes);
});
