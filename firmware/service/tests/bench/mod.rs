//! A charger's service over flash in memory, and a tool that asks it.

use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

use embedded_storage::nor_flash::{ErrorType, MultiwriteNorFlash, NorFlash, ReadNorFlash};
use firmware::telemetry::{Frame, TableId};
use service::device::{Device, Facts, GAP_MS};
use service::frame::{Collector, FRAME_MAX, RECORD_MAX, encode};
use service::message::{Answer, Ask, ORDER_MAX, Order, read_answer, write_ask, write_order};
use service::seal::{Challenge, DeviceKey, MAC_LEN};
use settings::store::Store;
use settings::values::Build;

const PAGE: usize = 1024;

/// The charger's key.
pub(crate) const KEY: DeviceKey = DeviceKey::new([0x42; 32]);

/// Flash that never fails and outlives a start.
#[derive(Debug, Clone)]
pub(crate) struct Memory(Rc<RefCell<Vec<u8>>>);

impl ErrorType for Memory {
    type Error = Infallible;
}

impl ReadNorFlash for Memory {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Infallible> {
        let at = offset as usize;
        bytes.copy_from_slice(&self.0.borrow()[at..at + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.borrow().len()
    }
}

impl NorFlash for Memory {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Infallible> {
        self.0.borrow_mut()[from as usize..to as usize].fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Infallible> {
        let cells = &mut self.0.borrow_mut()[offset as usize..];
        for (cell, byte) in cells.iter_mut().zip(bytes) {
            *cell &= byte;
        }
        Ok(())
    }
}

impl MultiwriteNorFlash for Memory {}

struct Around;

impl Facts for Around {
    fn build(&self) -> &str {
        "bench"
    }

    fn serial(&self) -> u32 {
        7
    }

    fn table(&self) -> Option<TableId> {
        None
    }

    fn frame(&self) -> Option<Frame> {
        None
    }
}

fn device(memory: &Memory) -> Device<Memory> {
    let range = 0..2 * PAGE as u32;
    Device::new(Store::open(memory.clone(), range, Build::REFERENCE).unwrap())
}

/// The last order sent.
#[derive(Debug, Clone)]
struct Sealed {
    challenge: Challenge,
    order: Vec<u8>,
    mac: [u8; MAC_LEN],
}

/// The charger, the time and the tool.
pub(crate) struct Bench {
    pub(crate) device: Device<Memory>,
    memory: Memory,
    now_ms: u32,
    sealed: Option<Sealed>,
    answer: Vec<u8>,
}

impl Bench {
    /// A charger that was never set, shortly before its clock wraps.
    pub(crate) fn new() -> Self {
        let memory = Memory(Rc::new(RefCell::new(vec![0xFF; 2 * PAGE])));
        Self {
            device: device(&memory),
            memory,
            now_ms: u32::MAX - 20_000,
            sealed: None,
            answer: Vec::new(),
        }
    }

    /// Ticks for so long.
    pub(crate) fn wait(&mut self, ms: u32) {
        let end = self.now_ms.wrapping_add(ms);
        while self.now_ms != end {
            let step = end.wrapping_sub(self.now_ms).min(100);
            self.now_ms = self.now_ms.wrapping_add(step);
            self.device.tick(self.now_ms);
        }
    }

    /// The charger starts again with the same flash.
    pub(crate) fn restart(&mut self) {
        self.device = device(&self.memory);
        self.now_ms = 0;
    }

    pub(crate) fn ask(&mut self, ask: &Ask<'_>) -> Answer<'_> {
        let mut record = [0; RECORD_MAX];
        let record = write_ask(9, ask, &mut record);
        for byte in encode(record, &mut [0; FRAME_MAX]) {
            self.device.take(*byte, self.now_ms, &mut Around);
        }
        let mut collector = Collector::EMPTY;
        while let Some(byte) = self.device.to_send() {
            self.device.sent();
            if let Some(record) = collector.take(byte) {
                self.answer = record.to_vec();
            }
        }
        let (id, answer) = read_answer(&self.answer).unwrap();
        assert_eq!(id, 9);
        answer
    }

    pub(crate) fn provision(&mut self) {
        let key = *KEY.bytes();
        assert_eq!(self.ask(&Ask::Provision { key }), Answer::Provisioned);
    }

    fn challenge(&mut self) -> Challenge {
        let Answer::Challenge { number, nonce } = self.ask(&Ask::Challenge) else {
            panic!("no challenge");
        };
        Challenge {
            serial: 7,
            number,
            nonce,
        }
    }

    /// Seals an order for a new challenge, and keeps it back.
    pub(crate) fn seal(&mut self, key: &DeviceKey, order: &Order) {
        let challenge = self.challenge();
        let order = write_order(order, &mut [0; ORDER_MAX]).to_vec();
        let mac = key.order_mac(&challenge, &order);
        self.sealed = Some(Sealed {
            challenge,
            order,
            mac,
        });
    }

    /// Sends what was sealed last.
    pub(crate) fn repeat(&mut self) -> Answer<'_> {
        let sealed = self.sealed.clone().unwrap();
        self.ask(&Ask::Order {
            challenge: sealed.challenge.number,
            order: &sealed.order,
            mac: sealed.mac,
        })
    }

    /// Sends the same order and challenge with this key's seal.
    pub(crate) fn repeat_with(&mut self, key: &DeviceKey) -> Answer<'_> {
        let sealed = self.sealed.as_mut().unwrap();
        sealed.mac = key.order_mac(&sealed.challenge, &sealed.order);
        self.repeat()
    }

    pub(crate) fn order_with(&mut self, key: &DeviceKey, order: &Order) -> Answer<'_> {
        self.seal(key, order);
        self.repeat()
    }

    /// Sends an order with the key; whether the charger says, with its own seal, that it is done.
    pub(crate) fn order(&mut self, order: &Order) -> bool {
        self.wait(GAP_MS);
        self.seal(&KEY, order);
        let sealed = self.sealed.clone().unwrap();
        match self.repeat() {
            Answer::Done { mac } => KEY.is_done_mac(&sealed.challenge, &sealed.order, &mac),
            _ => false,
        }
    }

    /// Replaces the charger's key.
    pub(crate) fn new_key(&mut self, new: &DeviceKey) -> bool {
        self.wait(GAP_MS);
        let challenge = self.challenge();
        let masked = *KEY.mask(&challenge, new).bytes();
        let order = write_order(&Order::NewKey { masked }, &mut [0; ORDER_MAX]).to_vec();
        let mac = KEY.order_mac(&challenge, &order);
        let number = challenge.number;
        let done = self.ask(&Ask::Order {
            challenge: number,
            order: &order,
            mac,
        });
        matches!(done, Answer::Done { mac } if KEY.is_done_mac(&challenge, &order, &mac))
    }
}
