//! What a charger can be asked, and its answers: postcard records.
//!
//! Numbers of variants stand on the line, so variants keep their places; new ones are added at the
//! end. A record of either side starts with its first byte ([`ASK`], [`ANSWER`]) and a number that
//! the asker chose and the answer repeats.

use firmware::telemetry::{Frame, TableId};
use heapless::Vec;
use serde::{Deserialize, Serialize};
use settings::key::Key;
use settings::store::KEY_LEN;
use settings::values::ValueError;

use crate::frame::{ANSWER, ASK, RECORD_MAX};
use crate::seal::{MAC_LEN, NONCE_LEN};

/// Settings in one order or answer.
pub const SETTINGS_MAX: usize = 16;
/// Longest order.
pub const ORDER_MAX: usize = 160;
/// Longest name of a build.
pub const NAME_MAX: usize = 32;

/// Number of an answer that nobody asked for: a charger says by itself who it is. Whoever asks
/// chooses another.
pub const UNASKED: u8 = 0;

/// Number and value of settings.
pub type Pairs = Vec<(u8, u32), SETTINGS_MAX>;

/// What a charger is asked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Ask<'a> {
    /// Who are you?
    Identity,
    /// How are you?
    Status,
    /// The settings from this place in the list of [`Key::ALL`] on.
    Settings {
        /// Place, from 0.
        from: u8,
    },
    /// A number to seal an order for.
    Challenge,
    /// An order, sealed for the last challenge.
    Order {
        /// The challenge's number.
        challenge: u32,
        /// An [`Order`] as a record.
        #[serde(borrow)]
        order: &'a [u8],
        /// [`crate::seal::DeviceKey::order_mac`].
        mac: [u8; MAC_LEN],
    },
    /// The first device key of a charger that has none.
    Provision {
        /// The key.
        key: [u8; KEY_LEN],
    },
    /// A step of a table's update. What is in it is the update's business, and so is whether it is
    /// authentic: a table has a signature of its own. [`crate::facts::Facts::update`] takes it.
    Update(#[serde(borrow)] &'a [u8]),
}

/// What changes how a charger behaves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Order {
    /// These settings, all or none of them; limits at once, the others from the next start on.
    Settings(Pairs),
    /// A limit.
    Limit {
        /// Whose: 0 user, 1 site, 2 cable.
        source: u8,
        /// Current in each phase \[mA\]; `None` gives the limit back to its setting.
        ma: Option<u32>,
        /// For how long \[s\]; 0 until the next start.
        for_s: u32,
    },
    /// The owner's override.
    Override {
        /// 0 none, 1 charge whatever the grid needs, 2 pause.
        what: u8,
        /// For how long \[s\]; 0 until the next start.
        for_s: u32,
    },
    /// Every setting at its default.
    Defaults,
    /// Another device key, masked by [`crate::seal::DeviceKey::mask`].
    NewKey {
        /// New key, exclusive or with the mask.
        masked: [u8; KEY_LEN],
    },
    /// Start again.
    Restart,
}

/// Who a charger is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// Build of the firmware: version and commit.
    pub build: heapless::String<NAME_MAX>,
    /// Serial number.
    pub serial: u32,
    /// 0 can only charge, 1 can discharge the car.
    pub direction: u8,
    /// 0 zero crossings, 1 ADE7953.
    pub meter: u8,
    /// The table, if one was accepted.
    pub table: Option<TableId>,
    /// Whether it has a device key.
    pub provisioned: bool,
    /// Where its settings come from: 0 the defaults, 1 read from flash, 2 not readable, so that it
    /// offers nothing.
    pub settings: u8,
}

/// How a charger is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// The last tick as telemetry has it; none before the first.
    pub frame: Option<Frame>,
    /// Limits in force, of user, site and cable \[mA\].
    pub limits_ma: [u32; 3],
    /// The owner's override: 0 none, 1 charge, 2 pause.
    pub owner: u8,
    /// How long it lasts \[s\]; `u32::MAX` until the next start.
    pub owner_s: u32,
    /// Settings were written that wait for the next start.
    pub waiting: bool,
}

/// Why something was not done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// Not a record of the known version's shape, or a field of an order that means nothing.
    Malformed,
    /// No challenge is open of this number: it was used, it is too old, or another was given since.
    NoChallenge,
    /// The last challenge is too young.
    TooSoon,
    /// The seal is not by the device key over this order and challenge.
    NotAuthentic,
    /// The charger has no device key.
    NoKey,
    /// The charger has a device key already.
    HasKey,
    /// No setting has this number.
    UnknownSetting {
        /// Number found.
        number: u8,
    },
    /// A value outside its range.
    OutOfRange {
        /// The setting; 0 for a limit or a time of an order.
        number: u8,
        /// Least allowed.
        least: u32,
        /// Most allowed.
        most: u32,
    },
    /// The image was built for another value.
    NotThisImage {
        /// The setting.
        number: u8,
        /// The value that this image has.
        built: u32,
    },
    /// `start_fixed_s` is less than `contactor_off_least_s`.
    StartTooSoon {
        /// `contactor_off_least_s`.
        off_s: u32,
    },
    /// The flash cannot be read, or what was to be written is not there: old or new is, to be read
    /// after the next start.
    Flash,
    /// This charger does not know how to do that.
    NotHere,
    /// The order writes the flash, and the charger charges or responds to the grid: later.
    NotNow,
}

impl From<ValueError> for Refusal {
    fn from(error: ValueError) -> Self {
        match error {
            ValueError::Unknown { number } => Self::UnknownSetting { number },
            ValueError::OutOfRange { key, .. } => {
                let about = key.about();
                Self::OutOfRange {
                    number: key.number(),
                    least: about.least,
                    most: about.most,
                }
            }
            ValueError::NotThisImage { key, built } => Self::NotThisImage {
                number: key.number(),
                built,
            },
            ValueError::StartTooSoon { off_s, .. } => Self::StartTooSoon { off_s },
        }
    }
}

/// What a charger answers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Answer<'a> {
    /// Who it is.
    Identity(Identity),
    /// How it is.
    Status(Status),
    /// Settings from a place of the list on.
    Settings {
        /// How many there are in all.
        count: u8,
        /// Numbers and values.
        pairs: Pairs,
    },
    /// A challenge.
    Challenge {
        /// Its number.
        number: u32,
        /// What nobody could know before.
        nonce: [u8; NONCE_LEN],
    },
    /// The order was carried out.
    Done {
        /// [`crate::seal::DeviceKey::done_mac`].
        mac: [u8; MAC_LEN],
    },
    /// The first device key was taken.
    Provisioned,
    /// Something was not done; nothing has changed, but see [`Refusal::Flash`].
    Refused(Refusal),
    /// The update's answer.
    Update(#[serde(borrow)] &'a [u8]),
}

/// The record of something asked, at the start of `buffer`; empty if it does not fit.
pub fn write_ask<'b>(id: u8, ask: &Ask<'_>, buffer: &'b mut [u8; RECORD_MAX]) -> &'b [u8] {
    written(postcard::to_slice(&(ASK, id, ask), buffer))
}

/// The record of an answer, at the start of `buffer`; empty if it does not fit.
pub fn write_answer<'b>(id: u8, answer: &Answer<'_>, buffer: &'b mut [u8; RECORD_MAX]) -> &'b [u8] {
    written(postcard::to_slice(&(ANSWER, id, answer), buffer))
}

/// The record of an order, at the start of `buffer`.
pub fn write_order<'b>(order: &Order, buffer: &'b mut [u8; ORDER_MAX]) -> &'b [u8] {
    written(postcard::to_slice(order, buffer))
}

fn written(result: postcard::Result<&mut [u8]>) -> &[u8] {
    result.map_or(&[], |bytes| bytes)
}

/// What a record asks, with its number. `None` for other records and other versions.
pub fn read_ask(record: &[u8]) -> Option<(u8, Result<Ask<'_>, Refusal>)> {
    let (head, rest) = record.split_first_chunk::<2>()?;
    let [ASK, id] = *head else {
        return None;
    };
    Some((id, whole(rest).ok_or(Refusal::Malformed)))
}

/// What a record answers, with its number. `None` for other records.
pub fn read_answer(record: &[u8]) -> Option<(u8, Answer<'_>)> {
    let (head, rest) = record.split_first_chunk::<2>()?;
    let [ANSWER, id] = *head else {
        return None;
    };
    Some((id, whole(rest)?))
}

/// The order of a record.
pub fn read_order(record: &[u8]) -> Option<Order> {
    whole(record)
}

fn whole<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Option<T> {
    match postcard::take_from_bytes(bytes) {
        Ok((value, [])) => Some(value),
        _ => None,
    }
}

/// The number of a setting's name, for people.
pub fn setting_name(number: u8) -> &'static str {
    Key::of_number(number).map_or("?", |key| key.about().name)
}
