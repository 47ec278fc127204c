//! The charger's side.
//!
//! Bytes of the line go in one by one. What they ask is answered at once, and the answer waits
//! until it is sent; what comes meanwhile is dropped, as an asker that has no answer yet asks
//! nothing else. Reading needs no authenticity; whatever changes something does ([`crate::seal`]).
//!
//! Challenges are numbered. Before the first one of a block of [`BLOCK`] is given, the end of the
//! block is written to flash, and a start goes on behind the last block. So no number is given
//! twice in a charger's life, whatever resets it, and the flash is written once in [`BLOCK`]
//! challenges. One challenge is open at a time, for [`OPEN_MS`], and for one attempt.
//!
//! A write to flash may stop the processor: 16 µs a word, and an erasure for half a second or more.
//! An order that writes is carried out where it is taken, between two ticks, and refused while
//! [`Facts::may_write`] says no. Limits and overrides write nothing but a block of challenges, and
//! [`Device::look_ahead`] sets one aside before the last is used up: so they pass in an event, at
//! least [`AHEAD`] of them.

use embedded_storage::nor_flash::MultiwriteNorFlash;
use firmware::dispatch::LimitSource;
use settings::key::Key;
use settings::orders::{LIMIT_MOST_MA, ORDER_MOST_S, Orders, Override};
use settings::store::{Loaded, Origin, Store, StoreError};
use settings::values::{Build, Values};

use crate::facts::Facts;
use crate::frame::{Collector, FRAME_MAX, RECORD_MAX, encode};
use crate::message::{
    Answer, Ask, Identity, Order, Pairs, Refusal, SETTINGS_MAX, Status, UNASKED, read_ask,
    read_order, write_answer,
};
use crate::seal::{Challenge, DeviceKey, MAC_LEN};

/// Challenges for which the flash is written once.
pub const BLOCK: u32 = 64;
/// Challenges that are left when the next block is set aside beforehand.
pub const AHEAD: u32 = 32;
const _: () = assert!(AHEAD < BLOCK);
/// How long a challenge is open \[ms\].
pub const OPEN_MS: u32 = 30_000;
/// Least time between two challenges \[ms\].
pub const GAP_MS: u32 = 500;
/// Settings that are in force at once; the others wait for the next start.
pub const AT_ONCE: [Key; 2] = [Key::UserLimit, Key::SiteLimit];
/// Settings that are in force at once where they are lowered: the charger compares its power with
/// its table's when it starts, so more waits until then.
pub const LOWERED_AT_ONCE: [Key; 2] = [Key::CableLimit, Key::DischargeLimit];

/// The challenge that is open.
#[derive(Debug, Clone, Copy)]
struct Open {
    challenge: Challenge,
    since_ms: u32,
}

/// The answer on its way to the line.
#[derive(Debug)]
struct Outbox {
    frame: [u8; FRAME_MAX],
    sent: usize,
    length: usize,
}

/// The service of a charger.
#[derive(Debug)]
pub struct Device<F: MultiwriteNorFlash> {
    /// `Err` without a memory: then nothing is known and no order is taken.
    store: Result<Store<F>, StoreError>,
    build: Build,
    /// Those in flash, or what stands for them.
    values: Values,
    /// Those in force.
    in_force: Values,
    origin: Origin,
    /// `Err` if the flash does not say: then there may be one.
    key: Result<Option<DeviceKey>, StoreError>,
    /// Number of the next challenge; `None` if the flash does not say.
    next: Option<u32>,
    /// No number from here on was set aside yet.
    ceiling: u32,
    open: Option<Open>,
    last_challenge_ms: Option<u32>,
    orders: Orders,
    restart: bool,
    collector: Collector,
    outbox: Outbox,
}

impl<F: MultiwriteNorFlash> Device<F> {
    /// The service of a charger with this memory.
    pub fn new(store: Store<F>) -> Self {
        let build = store.build();
        Self::opened(Ok(store), build)
    }

    /// The service of a charger whose memory could be opened or not. Without it the charger says
    /// who it is and how; whatever needs a key or a setting is refused by [`Refusal::Flash`], and
    /// the values in force are [`Values::nothing_known`].
    pub fn opened(mut store: Result<Store<F>, StoreError>, build: Build) -> Self {
        let (loaded, key, ceiling) = match &mut store {
            Ok(store) => {
                let key = store.device_key().map(|key| key.map(DeviceKey::new));
                (store.settings(), key, store.ceiling().ok())
            }
            Err(error) => {
                let loaded = Loaded {
                    values: Values::nothing_known(build),
                    origin: Origin::Unreadable(*error),
                };
                (loaded, Err(*error), None)
            }
        };
        Self {
            store,
            build,
            values: loaded.values,
            in_force: loaded.values,
            origin: loaded.origin,
            key,
            next: ceiling,
            ceiling: ceiling.unwrap_or(u32::MAX),
            open: None,
            last_challenge_ms: None,
            orders: Orders::NONE,
            restart: false,
            collector: Collector::EMPTY,
            outbox: Outbox {
                frame: [0; FRAME_MAX],
                sent: 0,
                length: 0,
            },
        }
    }

    /// The settings in force.
    pub const fn in_force(&self) -> &Values {
        &self.in_force
    }

    /// What is ordered.
    pub const fn orders(&self) -> Orders {
        self.orders
    }

    /// Whether a start was ordered and its answer is out: the caller stops feeding the watchdog.
    pub const fn restarts(&self) -> bool {
        self.restart && self.outbox.sent == self.outbox.length
    }

    /// To be called at every tick: what is over is forgotten, for the clock wraps.
    pub fn tick(&mut self, now_ms: u32) {
        self.orders.expire(now_ms);
        self.open
            .take_if(|open| now_ms.wrapping_sub(open.since_ms) >= OPEN_MS);
        self.last_challenge_ms
            .take_if(|at| now_ms.wrapping_sub(*at) >= GAP_MS);
    }

    /// To be called while [`Facts::may_count`] says yes: sets the next block of challenges aside,
    /// if the one in use is used up soon. A charger that was asked for none in this run writes
    /// nothing.
    pub fn look_ahead(&mut self) {
        if let Some(number) = self.next
            && number < self.ceiling
            && self.ceiling - number <= AHEAD
        {
            // A write that fails is tried again when a challenge asks for it.
            let _ = self.set_aside();
        }
    }

    /// Sets a block of challenges aside.
    fn set_aside(&mut self) -> Result<(), Refusal> {
        let ceiling = self.ceiling.checked_add(BLOCK).ok_or(Refusal::Flash)?;
        self.store()?.write_ceiling(ceiling).map_err(flash)?;
        self.ceiling = ceiling;
        Ok(())
    }

    /// Where the settings come from.
    pub const fn origin(&self) -> Origin {
        self.origin
    }

    /// Takes a byte of the line.
    pub fn take(&mut self, byte: u8, now_ms: u32, facts: &mut impl Facts) {
        let Some(record) = self.collector.take(byte) else {
            return;
        };
        if self.outbox.sent < self.outbox.length {
            return;
        }
        // The collector's buffer is the record's; the answer must not borrow from the service.
        let mut copy = [0; RECORD_MAX];
        let Some(copied) = copy.get_mut(..record.len()) else {
            return;
        };
        for (to, from) in copied.iter_mut().zip(record) {
            *to = *from;
        }
        let Some((id, asked)) = read_ask(copied) else {
            return;
        };
        let mut update = [0; UPDATE_MAX];
        let answer = match asked {
            Ok(Ask::Update(sent)) => facts
                .update(sent, &mut update)
                .and_then(|length| update.get(..length))
                .map_or(Answer::Refused(Refusal::NotHere), Answer::Update),
            Ok(ask) => self
                .answer(&ask, now_ms, facts)
                .unwrap_or_else(Answer::Refused),
            Err(refusal) => Answer::Refused(refusal),
        };
        let mut record = [0; RECORD_MAX];
        let record = write_answer(id, &answer, &mut record);
        self.outbox.length = encode(record, &mut self.outbox.frame).len();
        self.outbox.sent = 0;
    }

    /// Says who the charger is without having been asked: an answer of number 0. Nothing is done
    /// while another answer waits; whether it was taken.
    pub fn introduce(&mut self, facts: &impl Facts) -> bool {
        if self.outbox.sent < self.outbox.length {
            return false;
        }
        let identity = Answer::Identity(self.identity(facts));
        let mut record = [0; RECORD_MAX];
        let record = write_answer(UNASKED, &identity, &mut record);
        self.outbox.length = encode(record, &mut self.outbox.frame).len();
        self.outbox.sent = 0;
        true
    }

    /// The next byte for the line, if an answer is under way. An answer is sent without a break.
    pub fn to_send(&self) -> Option<u8> {
        let waiting = self.outbox.frame.get(..self.outbox.length)?;
        waiting.get(self.outbox.sent).copied()
    }

    /// The byte went out.
    pub const fn sent(&mut self) {
        self.outbox.sent += 1;
    }

    fn answer(
        &mut self,
        ask: &Ask<'_>,
        now_ms: u32,
        facts: &impl Facts,
    ) -> Result<Answer<'static>, Refusal> {
        match *ask {
            Ask::Identity => Ok(Answer::Identity(self.identity(facts))),
            Ask::Status => Ok(Answer::Status(self.status(now_ms, facts))),
            Ask::Settings { from } => Ok(self.settings(from)),
            Ask::Challenge => self.challenge(now_ms, facts),
            Ask::Order {
                challenge,
                order,
                mac,
            } => self.order(challenge, order, &mac, now_ms, facts.may_write()),
            Ask::Provision { key } => {
                if self.key()?.is_some() {
                    return Err(Refusal::HasKey);
                }
                writes(facts.may_write())?;
                self.store()?.write_device_key(&key).map_err(flash)?;
                self.key = Ok(Some(DeviceKey::new(key)));
                Ok(Answer::Provisioned)
            }
            Ask::Update(_) => Err(Refusal::NotHere),
        }
    }

    fn identity(&self, facts: &impl Facts) -> Identity {
        let mut build = heapless::String::new();
        for letter in facts.build().chars() {
            if build.push(letter).is_err() {
                break;
            }
        }
        Identity {
            build,
            serial: facts.serial(),
            direction: self.build.direction as u8,
            meter: self.build.meter,
            table: facts.table(),
            provisioned: !matches!(self.key, Ok(None)),
            settings: match self.origin {
                Origin::Default => 0,
                Origin::Stored => 1,
                Origin::Unreadable(_) => 2,
            },
        }
    }

    fn status(&self, now_ms: u32, facts: &impl Facts) -> Status {
        let (owner, owner_s) = match self.orders.override_now(now_ms) {
            None => (0, 0),
            Some((what, u32::MAX)) => (number(what), u32::MAX),
            Some((what, left_ms)) => (number(what), left_ms.div_ceil(1_000)),
        };
        Status {
            frame: facts.frame(),
            limits_ma: self.orders.limits_ma(&self.in_force, now_ms),
            owner,
            owner_s,
            waiting: self.values != self.in_force,
        }
    }

    fn settings(&self, from: u8) -> Answer<'static> {
        let keys = Key::ALL.into_iter().skip(usize::from(from));
        let pairs = keys.take(SETTINGS_MAX);
        Answer::Settings {
            count: Key::ALL.len() as u8,
            pairs: Pairs::from_iter(pairs.map(|key| (key.number(), self.values.get(key)))),
        }
    }

    fn store(&mut self) -> Result<&mut Store<F>, Refusal> {
        self.store.as_mut().map_err(|error| flash(*error))
    }

    fn key(&self) -> Result<Option<DeviceKey>, Refusal> {
        self.key.map_err(flash)
    }

    fn challenge(&mut self, now_ms: u32, facts: &impl Facts) -> Result<Answer<'static>, Refusal> {
        let key = self.key()?.ok_or(Refusal::NoKey)?;
        if self
            .last_challenge_ms
            .is_some_and(|at| now_ms.wrapping_sub(at) < GAP_MS)
        {
            return Err(Refusal::TooSoon);
        }
        self.last_challenge_ms = Some(now_ms);
        let number = self.next.ok_or(Refusal::Flash)?;
        if number == self.ceiling {
            writes(facts.may_count())?;
            self.set_aside()?;
        }
        self.next = Some(number + 1);
        let challenge = key.challenge(facts.serial(), number);
        self.open = Some(Open {
            challenge,
            since_ms: now_ms,
        });
        Ok(Answer::Challenge {
            number,
            nonce: challenge.nonce,
        })
    }

    fn order(
        &mut self,
        number: u32,
        record: &[u8],
        mac: &[u8; MAC_LEN],
        now_ms: u32,
        may_write: bool,
    ) -> Result<Answer<'static>, Refusal> {
        let key = self.key()?.ok_or(Refusal::NoKey)?;
        // One attempt: right or wrong, the challenge is used.
        let open = self.open.take().filter(|open| {
            open.challenge.number == number && now_ms.wrapping_sub(open.since_ms) < OPEN_MS
        });
        let challenge = open.ok_or(Refusal::NoChallenge)?.challenge;
        if !key.is_order_mac(&challenge, record, mac) {
            return Err(Refusal::NotAuthentic);
        }
        let order = read_order(record).ok_or(Refusal::Malformed)?;
        if matches!(
            order,
            Order::Settings(_) | Order::Defaults | Order::NewKey { .. }
        ) {
            writes(may_write)?;
        }
        self.carry_out(&order, &key, &challenge, now_ms)?;
        let mac = key.done_mac(&challenge, record);
        Ok(Answer::Done { mac })
    }

    fn carry_out(
        &mut self,
        order: &Order,
        key: &DeviceKey,
        challenge: &Challenge,
        now_ms: u32,
    ) -> Result<(), Refusal> {
        match order {
            Order::Settings(pairs) => {
                let values = self.values.with(pairs, self.build)?;
                self.write(values)
            }
            Order::Defaults => self.write(Values::defaults(self.build)),
            Order::Limit { source, ma, for_s } => {
                let sources = [LimitSource::User, LimitSource::Site, LimitSource::Cable];
                let source = sources.get(usize::from(*source)).copied();
                let source = source.ok_or(Refusal::Malformed)?;
                within(*for_s, ORDER_MOST_S)?;
                match ma {
                    None => self.orders.lift(source),
                    Some(ma) => {
                        within(*ma, LIMIT_MOST_MA)?;
                        self.orders.limit(source, *ma, *for_s, now_ms);
                    }
                }
                Ok(())
            }
            Order::Override { what, for_s } => {
                within(*for_s, ORDER_MOST_S)?;
                let what = match what {
                    0 => None,
                    1 => Some(Override::Charge),
                    2 => Some(Override::Pause),
                    _ => return Err(Refusal::Malformed),
                };
                self.orders.owner(what, *for_s, now_ms);
                Ok(())
            }
            Order::NewKey { masked } => {
                let new = key.mask(challenge, &DeviceKey::new(*masked));
                self.store()?.write_device_key(new.bytes()).map_err(flash)?;
                self.key = Ok(Some(new));
                Ok(())
            }
            Order::Restart => {
                self.restart = true;
                Ok(())
            }
        }
    }

    /// Writes settings; the limits are in force at once.
    fn write(&mut self, values: Values) -> Result<(), Refusal> {
        self.store()?.write_settings(&values).map_err(flash)?;
        self.values = values;
        let at_once = AT_ONCE.map(|key| (key.number(), values.get(key)));
        let lowered = LOWERED_AT_ONCE.map(|key| {
            let value = values.get(key).min(self.in_force.get(key));
            (key.number(), value)
        });
        for changes in [at_once, lowered] {
            // Allowed values that no other depends on: they are always taken.
            if let Ok(in_force) = self.in_force.with(&changes, self.build) {
                self.in_force = in_force;
            }
        }
        Ok(())
    }
}

/// Longest answer of an update.
const UPDATE_MAX: usize = 160;

/// Whether something that writes the flash may go on.
const fn writes(may_write: bool) -> Result<(), Refusal> {
    if may_write {
        Ok(())
    } else {
        Err(Refusal::NotNow)
    }
}

const fn flash(_: StoreError) -> Refusal {
    Refusal::Flash
}

const fn number(what: Override) -> u8 {
    match what {
        Override::Charge => 1,
        Override::Pause => 2,
    }
}

/// A limit or a time of an order.
const fn within(value: u32, most: u32) -> Result<(), Refusal> {
    if value > most {
        return Err(Refusal::OutOfRange {
            number: 0,
            least: 0,
            most,
        });
    }
    Ok(())
}
