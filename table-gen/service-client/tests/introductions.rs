//! Telemetry through [`service_client::introductions`] is as without the service's frames.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::io::Read;
use std::sync::mpsc;

use firmware::telemetry::TableId;
use service::frame::{FRAME_MAX, RECORD_MAX, encode};
use service::message::{Answer, Ask, Identity, UNASKED, write_answer, write_ask};
use service_client::introductions::{Introductions, line};

fn identity() -> Identity {
    Identity {
        build: "0.1.0 12345678".parse().unwrap(),
        serial: 0xABC,
        direction: 0,
        meter: 0,
        table: Some(TableId {
            spec_hash: [0x12; 16],
            crc: 0x34,
        }),
        provisioned: true,
        settings: 1,
    }
}

/// The bytes that pass, and what was found, with the line read in parts of so many bytes.
fn read(line: &[u8], part: usize) -> (Vec<u8>, Vec<String>) {
    let (send, found) = mpsc::channel();
    let told = Box::new(move |who: &Identity| send.send(self::line(who)).unwrap());
    let mut reader = Introductions::new(line, told);
    let mut passed = Vec::new();
    let mut buffer = vec![0; part];
    loop {
        match reader.read(&mut buffer).unwrap() {
            0 => break,
            length => passed.extend_from_slice(&buffer[..length]),
        }
    }
    drop(reader);
    (passed, found.iter().collect())
}

#[test]
fn telemetry_passes_and_the_service_does_not() {
    let answer = |id, answer: &Answer<'_>| {
        let mut record = [0; RECORD_MAX];
        encode(write_answer(id, answer, &mut record), &mut [0; FRAME_MAX]).to_vec()
    };
    let asked = {
        let mut record = [0; RECORD_MAX];
        encode(write_ask(7, &Ask::Status, &mut record), &mut [0; FRAME_MAX]).to_vec()
    };
    let who = Answer::Identity(identity());
    let telemetry = [&[3, 2, 9, 0][..], &[0], &[0x55; 300], &[0], &[2, 1]];
    let mixed = [
        telemetry[0],
        &answer(UNASKED, &who),
        telemetry[1],
        &asked,
        &answer(7, &who),
        telemetry[2],
        telemetry[3],
        &answer(UNASKED, &who),
        telemetry[4],
    ];
    let text = "charger 00000abc, build 0.1.0 12345678, table 00000034, \
                spec 12121212121212121212121212121212, stored settings";
    for part in [1, 7, 5_000] {
        let (passed, found) = read(&mixed.concat(), part);
        assert_eq!(passed, telemetry.concat());
        assert_eq!(found, [text, text]);
    }
    // A stretch without an end passes too.
    assert_eq!(read(&[1; 9_000], 100), (vec![1; 9_000], Vec::new()));
}
