//! Any frames of the processor-in-the-loop link, and whatever they ask of a charger.

use firmware::link::session::{Session, Wires};
use firmware::link::{FRAME_MAX, LENGTH_LEN, Reply, Request, decode_frame, encode, record_length};

/// Plays the frames in `bytes` to a session; whether one of them was a request.
pub fn run(bytes: &[u8]) -> bool {
    let wires = Wires::default();
    let mut session = Session::new(&wires, super::table::SHIPPED[0]);
    let mut understood = false;
    let mut rest = bytes;
    while let Some(prefix) = rest.first_chunk::<LENGTH_LEN>() {
        if let Ok(request) = decode_frame::<Request>(rest) {
            understood = true;
            let reply = Reply {
                response: session.handle(&request),
                systick: 0,
                stack: 0,
            };
            let mut buffer = [0; FRAME_MAX];
            let frame = encode(&reply, &mut buffer);
            assert_eq!(decode_frame(frame), Ok(reply));
        }
        let _ = decode_frame::<Reply>(rest);
        let length = record_length(*prefix).unwrap_or(1);
        rest = rest.get(LENGTH_LEN + length..).unwrap_or_default();
    }
    understood
}
