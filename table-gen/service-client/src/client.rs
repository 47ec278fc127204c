//! Questions to a charger, and orders sealed with its key.

use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use service::device::GAP_MS;
use service::frame::RECORD_MAX;
use service::message::{
    Answer, Ask, Identity, ORDER_MAX, Order, Refusal, Status, read_answer, setting_name, write_ask,
    write_order,
};
use service::seal::{Challenge, DeviceKey};
use settings::key::Key;
use update::wire::{PART_MAX, Reason, Said, State, Step, read_said, write_step};

use crate::port::Port;

/// How long a question is waited for.
const READ_WAIT: Duration = Duration::from_millis(1_500);
/// How long an order is: the flash may be erased for it.
const WRITE_WAIT: Duration = Duration::from_secs(8);
/// How often a question is asked.
const ATTEMPTS: usize = 3;

/// Why a charger did not answer as asked.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// The port.
    #[error("{path}: {error}")]
    Port {
        /// Its path.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// Nobody answered.
    #[error("no answer; {}", silence(*.heard))]
    NoAnswer {
        /// Bytes that came meanwhile.
        heard: u64,
    },
    /// No answer to an order: nobody knows whether it was carried out.
    #[error(
        "no answer to the order: it may have been carried out; ask for `settings` and `status`"
    )]
    Unknown,
    /// The charger refused.
    #[error("the charger refused: {}", refusal(.0))]
    Refused(Refusal),
    /// The challenge is not by this key.
    #[error(
        "the key is not this charger's (serial {serial:08x}), or another device answers; nothing was sent"
    )]
    WrongKey {
        /// Serial number that the charger named.
        serial: u32,
    },
    /// The answer to an order is not sealed by the charger.
    #[error(
        "the answer to the order is not the charger's: somebody is on the line; ask for `settings` and `status`"
    )]
    NotTheCharger,
    /// The container is not taken.
    #[error("the charger does not take it: {}", reason(.0))]
    NotTaken(Reason),
    /// An answer of another kind.
    #[error("the charger's answer is to another question; its firmware may be of another version")]
    Unexpected,
}

fn silence(heard: u64) -> &'static str {
    if heard == 0 {
        "nothing came from the port: is the charger on, and is it this port?"
    } else {
        "bytes came, but no answer: is it a charger's port, and does its firmware have the service?"
    }
}

/// The reason of an update's refusal for people.
fn reason(reason: &Reason) -> String {
    let text = reason.text().replace("{a}", &reason.first.to_string());
    text.replace("{b}", &reason.second.to_string())
}

/// A refusal for people.
pub fn refusal(refusal: &Refusal) -> String {
    match *refusal {
        Refusal::Malformed => "it does not know what was asked; its firmware may be older".into(),
        Refusal::NoChallenge => "the challenge is used or too old; try again".into(),
        Refusal::TooSoon => "the last challenge is too young; try again in a second".into(),
        Refusal::NotAuthentic => "the order is not sealed with its key".into(),
        Refusal::NoKey => "it has no device key; give it one with `provision`".into(),
        Refusal::HasKey => "it has a device key; `new-key` replaces it".into(),
        Refusal::UnknownSetting { number } => {
            format!("it knows no setting {number}; its firmware may be older")
        }
        Refusal::OutOfRange {
            number,
            least,
            most,
        } => {
            let name = if number == 0 {
                "the value"
            } else {
                setting_name(number)
            };
            format!("{name} is out of range: {least} to {most}")
        }
        Refusal::NotThisImage { number, built } => {
            let name = setting_name(number);
            format!("{name} is {built} in this image; another needs another image")
        }
        Refusal::StartTooSoon { off_s } => format!(
            "start_fixed_s must be at least contactor_off_least_s, which is {off_s}: a reset opens \
             the contactor"
        ),
        Refusal::Flash => "its flash cannot be read or written; nothing is certain of it".into(),
        Refusal::NotHere => "its firmware cannot do that".into(),
        Refusal::NotNow => {
            "it charges or responds to the grid, and would have to stand still while it \
                            writes; try again later, or pause it (`override pause`)"
                .into()
        }
    }
}

/// A charger on a port.
#[derive(Debug)]
pub struct Client {
    port: Port,
    path: PathBuf,
    id: u8,
}

impl Client {
    /// Opens a port.
    ///
    /// # Errors
    /// [`ClientError::Port`].
    pub fn open(path: &Path) -> Result<Self, ClientError> {
        let port = Port::open(path).map_err(|error| ClientError::Port {
            path: path.to_owned(),
            error,
        })?;
        Ok(Self {
            port,
            path: path.to_owned(),
            id: 0,
        })
    }

    /// Asks once; the answer's record.
    fn once(&mut self, ask: &Ask<'_>, wait: Duration) -> Result<Option<Vec<u8>>, ClientError> {
        // Never 0, which is nobody's question.
        self.id = self.id.checked_add(1).unwrap_or(1);
        let mut buffer = [0; RECORD_MAX];
        let record = write_ask(self.id, ask, &mut buffer);
        let sent = self.port.send(record);
        sent.map_err(|error| ClientError::Port {
            path: self.path.clone(),
            error,
        })?;
        let until = Instant::now() + wait;
        while let Some(record) = self.port.receive(until) {
            if read_answer(&record).is_some_and(|(id, _)| id == self.id) {
                return Ok(Some(record));
            }
        }
        Ok(None)
    }

    /// Asks something that may be asked twice; what `take` makes of the answer.
    fn ask<T>(
        &mut self,
        ask: &Ask<'_>,
        take: impl FnOnce(Answer<'_>) -> Option<T>,
    ) -> Result<T, ClientError> {
        for _ in 0..ATTEMPTS {
            if let Some(record) = self.once(ask, READ_WAIT)? {
                return taken(&record, take);
            }
        }
        let heard = self.port.heard();
        Err(ClientError::NoAnswer { heard })
    }

    /// Who is it?
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn identity(&mut self) -> Result<Identity, ClientError> {
        self.ask(&Ask::Identity, |answer| match answer {
            Answer::Identity(identity) => Some(identity),
            _ => None,
        })
    }

    /// How is it?
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn status(&mut self) -> Result<Status, ClientError> {
        self.ask(&Ask::Status, |answer| match answer {
            Answer::Status(status) => Some(status),
            _ => None,
        })
    }

    /// Every setting and its value; a charger may have some that this program does not know.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn settings(&mut self) -> Result<Vec<(u8, u32)>, ClientError> {
        let mut all = Vec::new();
        loop {
            let from = u8::try_from(all.len()).unwrap_or(u8::MAX);
            let (count, pairs) = self.ask(&Ask::Settings { from }, |answer| match answer {
                Answer::Settings { count, pairs } => Some((count, pairs)),
                _ => None,
            })?;
            all.extend(&pairs);
            if pairs.is_empty() || all.len() >= usize::from(count) {
                return Ok(all);
            }
        }
    }

    /// A step of an update; every step may be asked again.
    fn step(&mut self, step: &Step<'_>, wait: Duration) -> Result<Said, ClientError> {
        let mut buffer = [0; RECORD_MAX];
        let ask = Ask::Update(write_step(step, &mut buffer));
        for _ in 0..ATTEMPTS {
            let Some(record) = self.once(&ask, wait)? else {
                continue;
            };
            let said = taken(&record, |answer| match answer {
                Answer::Update(said) => read_said(said),
                _ => None,
            })?;
            return match said {
                Said::Refused(reason) => Err(ClientError::NotTaken(reason)),
                said => Ok(said),
            };
        }
        let heard = self.port.heard();
        Err(ClientError::NoAnswer { heard })
    }

    /// Which of the tables that came by update is in force.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn update_state(&mut self) -> Result<State, ClientError> {
        match self.step(&Step::State, READ_WAIT)? {
            Said::State(state) => Ok(state),
            _ => Err(ClientError::Unexpected),
        }
    }

    /// Sends a signed container and has it installed; its version, which is in force from the next
    /// start on.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn install(&mut self, container: &[u8], now_s: Option<u32>) -> Result<u32, ClientError> {
        let len = u32::try_from(container.len()).unwrap_or(u32::MAX);
        self.step(&Step::Begin { len }, READ_WAIT)?;
        let mut at = 0;
        for bytes in container.chunks(PART_MAX) {
            self.step(&Step::Part { at, bytes }, READ_WAIT)?;
            at += bytes.len() as u32;
        }
        match self.step(&Step::Install { now_s }, WRITE_WAIT)? {
            Said::Installed { version } => Ok(version),
            _ => Err(ClientError::Unexpected),
        }
    }

    /// Gives the first key to a charger that has none.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn provision(&mut self, key: &DeviceKey) -> Result<(), ClientError> {
        let key = *key.bytes();
        let answer = self.once(&Ask::Provision { key }, WRITE_WAIT)?;
        taken(&answer.ok_or(ClientError::Unknown)?, |answer| {
            matches!(answer, Answer::Provisioned).then_some(())
        })
    }

    /// A challenge, if it is by this key.
    fn challenge(&mut self, key: &DeviceKey) -> Result<Challenge, ClientError> {
        let serial = self.identity()?.serial;
        let ask = |client: &mut Self| {
            client.ask(&Ask::Challenge, |answer| match answer {
                Answer::Challenge { number, nonce } => Some(Challenge {
                    serial,
                    number,
                    nonce,
                }),
                _ => None,
            })
        };
        let challenge = match ask(self) {
            Err(ClientError::Refused(Refusal::TooSoon)) => {
                std::thread::sleep(Duration::from_millis(2 * u64::from(GAP_MS)));
                ask(self)?
            }
            other => other?,
        };
        if challenge == key.challenge(serial, challenge.number) {
            Ok(challenge)
        } else {
            Err(ClientError::WrongKey { serial })
        }
    }

    /// Has an order carried out.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn order(&mut self, key: &DeviceKey, order: &Order) -> Result<(), ClientError> {
        let challenge = self.challenge(key)?;
        self.carry_out(key, &challenge, order)
    }

    /// Replaces the charger's key.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn new_key(&mut self, key: &DeviceKey, new: &DeviceKey) -> Result<(), ClientError> {
        let challenge = self.challenge(key)?;
        let masked = *key.mask(&challenge, new).bytes();
        self.carry_out(key, &challenge, &Order::NewKey { masked })
    }

    fn carry_out(
        &mut self,
        key: &DeviceKey,
        challenge: &Challenge,
        order: &Order,
    ) -> Result<(), ClientError> {
        let mut buffer = [0; ORDER_MAX];
        let order = write_order(order, &mut buffer);
        let ask = Ask::Order {
            challenge: challenge.number,
            order,
            mac: key.order_mac(challenge, order),
        };
        let answer = self.once(&ask, WRITE_WAIT)?;
        let mac = taken(
            &answer.ok_or(ClientError::Unknown)?,
            |answer| match answer {
                Answer::Done { mac } => Some(mac),
                _ => None,
            },
        )?;
        if key.is_done_mac(challenge, order, &mac) {
            Ok(())
        } else {
            Err(ClientError::NotTheCharger)
        }
    }
}

/// What `take` makes of an answer that is no refusal.
fn taken<T>(record: &[u8], take: impl FnOnce(Answer<'_>) -> Option<T>) -> Result<T, ClientError> {
    match read_answer(record) {
        Some((_, Answer::Refused(refusal))) => Err(ClientError::Refused(refusal)),
        Some((_, answer)) => take(answer).ok_or(ClientError::Unexpected),
        None => Err(ClientError::Unexpected),
    }
}

/// The name of a setting, or its number where this program does not know it.
pub fn name(number: u8) -> String {
    Key::of_number(number).map_or_else(
        || format!("setting {number}"),
        |key| key.about().name.to_owned(),
    )
}
