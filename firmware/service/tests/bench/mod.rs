//! A charger's service over flash in memory, and a tool that asks it.

use firmware::telemetry::{Frame, TableId};
use service::device::{Device, GAP_MS};
use service::facts::Facts;
use service::frame::{Collector, FRAME_MAX, RECORD_MAX, encode};
use service::message::{Answer, Ask, ORDER_MAX, Order, read_answer, write_ask, write_order};
use service::seal::{Challenge, DeviceKey, MAC_LEN};
use settings::store::{Store, StoreError};
use settings::testing::{Cells, Memory, RANGE, blank};
use settings::values::Build;

/// The charger's key.
pub(crate) const KEY: DeviceKey = DeviceKey::new([0x42; 32]);

struct Around {
    may_write: bool,
}

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

    fn may_write(&self) -> bool {
        self.may_write
    }
}

fn device(cells: &'static Cells) -> Device<Memory<'static>> {
    Device::new(Store::open(Memory(cells), RANGE, Build::REFERENCE).unwrap())
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
    pub(crate) device: Device<Memory<'static>>,
    cells: &'static Cells,
    now_ms: u32,
    sealed: Option<Sealed>,
    answer: Vec<u8>,
    around: Around,
}

impl Bench {
    /// A charger that was never set, shortly before its clock wraps.
    pub(crate) fn new() -> Self {
        let cells: &'static Cells = Box::leak(Box::new(blank()));
        Self {
            device: device(cells),
            cells,
            now_ms: u32::MAX - 20_000,
            sealed: None,
            answer: Vec::new(),
            around: Around { may_write: true },
        }
    }

    /// Whether the flash may be written from now on.
    pub(crate) fn may_write(&mut self, may_write: bool) {
        self.around.may_write = may_write;
    }

    /// The charger goes on without a memory.
    pub(crate) fn without_memory(&mut self) {
        self.device = Device::opened(Err(StoreError::NotOpened), Build::REFERENCE);
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
        self.device = device(self.cells);
        self.now_ms = 0;
    }

    pub(crate) fn ask(&mut self, ask: &Ask<'_>) -> Answer<'_> {
        let mut record = [0; RECORD_MAX];
        let record = write_ask(9, ask, &mut record);
        for byte in encode(record, &mut [0; FRAME_MAX]) {
            self.device.take(*byte, self.now_ms, &mut self.around);
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
