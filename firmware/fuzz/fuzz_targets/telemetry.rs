//! Any bytes between two delimiters: rejected, or a frame that encodes to a frame that decodes to itself.
#![no_main]

use firmware::telemetry::{FRAME_MAX, decode, encode};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let mut bytes = bytes.to_vec();
    if let Ok(frame) = decode(&mut bytes) {
        let mut buffer = [0; FRAME_MAX];
        let length = encode(&frame, &mut buffer).len();
        assert_eq!(decode(&mut buffer[..length]), Ok(frame));
    }
});
