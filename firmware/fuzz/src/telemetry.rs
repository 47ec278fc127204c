//! Any bytes between two delimiters: rejected, or a frame that encodes to a frame that decodes to
//! itself.

use firmware::table::checksum;
use firmware::telemetry::{FRAME_MAX, decode, encode};

/// Takes the bytes as they are, and as a record to which the right CRC is added; whether either was
/// a frame.
pub fn run(bytes: &[u8]) -> bool {
    let mut body = bytes.to_vec();
    body.extend(checksum(bytes).to_le_bytes());
    let mut sealed = vec![0; cobs::max_encoding_length(body.len())];
    let length = cobs::encode(&body, &mut sealed);
    sealed.truncate(length);
    let (raw, sealed) = (is_frame(bytes.to_vec()), is_frame(sealed));
    raw || sealed
}

fn is_frame(mut bytes: Vec<u8>) -> bool {
    let Ok(frame) = decode(&mut bytes) else {
        return false;
    };
    let mut buffer = [0; FRAME_MAX];
    let length = encode(&frame, &mut buffer).len();
    assert_eq!(decode(&mut buffer[..length]), Ok(frame));
    true
}
