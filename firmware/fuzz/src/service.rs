//! Any bytes on the service line of a charger, and any answers to a tool.

use firmware::telemetry::{Frame, TableId};
use service::device::Device;
use service::facts::Facts;
use service::frame::{ASK, Collector, FRAME_MAX, RECORD_MAX, encode};
use service::message::{Answer, Ask, Order, Refusal, read_answer, read_order, write_answer};
use service::seal::DeviceKey;
use settings::key::Key;
use settings::store::Store;
use settings::testing::{Memory, RANGE, blank};
use settings::values::Build;

/// The charger's key: the corpus may seal with it.
pub const KEY: [u8; 32] = [0x5A; 32];
/// The charger's serial number.
pub const SERIAL: u32 = 7;

struct Around;

impl Facts for Around {
    fn build(&self) -> &str {
        "fuzz"
    }

    fn serial(&self) -> u32 {
        SERIAL
    }

    fn table(&self) -> Option<TableId> {
        None
    }

    fn frame(&self) -> Option<Frame> {
        None
    }
}

/// Plays the bytes to a charger that has a key: as they stand, and each stretch between zero bytes
/// as a record to which the right checksum is added. No order is carried out unless the bytes hold
/// its seal, and the settings stay allowed. Whether something was asked.
pub fn run(bytes: &[u8]) -> bool {
    let cells = blank();
    let Ok(mut store) = Store::open(Memory(&cells), RANGE, Build::REFERENCE) else {
        panic!("blank flash suits");
    };
    assert!(store.write_device_key(&KEY).is_ok());
    let mut device = Device::new(store);
    let mut understood = false;
    let mut now_ms = 0u32;
    let sealed = bytes.split(|byte| *byte == 0).flat_map(|record| {
        let mut buffer = [0; FRAME_MAX];
        let record = &record[..record.len().min(RECORD_MAX)];
        encode(record, &mut buffer).to_vec()
    });
    for byte in bytes.iter().copied().chain([0]).chain(sealed) {
        now_ms = now_ms.wrapping_add(97);
        device.tick(now_ms);
        device.take(byte, now_ms, &mut Around);
        let mut collector = Collector::EMPTY;
        while let Some(byte) = device.to_send() {
            device.sent();
            if let Some(record) = collector.take(byte) {
                let (_, answer) = read_answer(record).expect("answers can be read");
                understood |= !matches!(answer, Answer::Refused(Refusal::Malformed));
                // Nobody who has no key is told that something was done.
                assert!(!matches!(answer, Answer::Provisioned));
                again(&answer);
            }
        }
        for key in Key::ALL {
            let about = key.about();
            let value = device.in_force().get(key);
            assert!((about.least..=about.most).contains(&value));
        }
    }
    // What a tool reads.
    if let Some((_, answer)) = read_answer(bytes) {
        again(&answer);
    }
    let _ = read_order(bytes);
    understood
}

/// An answer that was read is one that can be written and read again.
fn again(answer: &Answer<'_>) {
    let mut buffer = [0; RECORD_MAX];
    let record = write_answer(1, answer, &mut buffer);
    if !record.is_empty() {
        assert_eq!(
            read_answer(record).map(|(_, found)| found).as_ref(),
            Some(answer)
        );
    }
}

/// What a tool with the key sends for the first challenge.
pub fn order_for_the_first_challenge(order: &Order) -> Vec<u8> {
    let key = DeviceKey::new(KEY);
    let challenge = key.challenge(SERIAL, 0);
    let mut record = [0; service::message::ORDER_MAX];
    let order = service::message::write_order(order, &mut record);
    let ask = Ask::Order {
        challenge: 0,
        order,
        mac: key.order_mac(&challenge, order),
    };
    line(&ask)
}

/// Something asked, as bytes of the line.
pub fn line(ask: &Ask<'_>) -> Vec<u8> {
    let mut record = [0; RECORD_MAX];
    let record = service::message::write_ask(1, ask, &mut record);
    assert_eq!(record.first(), Some(&ASK));
    encode(record, &mut [0; FRAME_MAX]).to_vec()
}
