//! The contactor between mains and car: opened after a pause has lasted, and not closed again too
//! soon. The frequency response does not operate it.
//!
//! A relay wears with every operation, above all with those under load. So a pause is first
//! signalled on the pilot, and the contactor opens only when the pause has lasted for
//! `open_after_ms`, by when the car has stopped drawing current. Once open it stays open for
//! `off_min_ms`.

use embedded_hal::digital::OutputPin;

/// Times of a contactor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ContactorTimes {
    /// How long a pause lasts before the contactor opens \[ms\].
    pub open_after_ms: u32,
    /// How long it then stays open at least \[ms\].
    pub off_min_ms: u32,
}

impl ContactorTimes {
    /// 10 s, twice the delay of a slow car (5 s), and 60 s.
    pub const DEFAULT: Self = Self {
        open_after_ms: 10_000,
        off_min_ms: 60_000,
    };
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Contact {
    Closed,
    /// Closed, and the pilot has signalled a pause since then.
    Pausing {
        since_ms: u32,
    },
    /// Opened after a pause.
    Open {
        since_ms: u32,
    },
    /// Open because no car asks for power: nothing was switched under load, and it may close at
    /// once.
    Idle,
}

/// A contactor on an output pin: high closes.
#[derive(Debug)]
pub struct Contactor<O> {
    pin: O,
    times: ContactorTimes,
    /// `None` while the position is unknown.
    contact: Option<Contact>,
}

impl<O: OutputPin> Contactor<O> {
    /// A contactor in an unknown position; the first call sets it.
    pub const fn new(pin: O, times: ContactorTimes) -> Self {
        Self {
            pin,
            times,
            contact: None,
        }
    }

    /// Whether a request to connect would be granted now.
    pub const fn may_close(&self, now_ms: u32) -> bool {
        match self.contact {
            Some(Contact::Open { since_ms }) => {
                now_ms.wrapping_sub(since_ms) >= self.times.off_min_ms
            }
            _ => true,
        }
    }

    /// Asks for the car to be connected or not; whether current may flow.
    ///
    /// # Errors
    /// That of the pin; the position then counts as unknown.
    pub fn request(&mut self, connect: bool, now_ms: u32) -> Result<bool, O::Error> {
        let next = match self.contact {
            _ if connect && self.may_close(now_ms) => Contact::Closed,
            // The first request after a restart: the car may have been paused for any time, so open
            // at once.
            None => Contact::Open { since_ms: now_ms },
            Some(Contact::Closed) => Contact::Pausing { since_ms: now_ms },
            Some(Contact::Pausing { since_ms }) => {
                if now_ms.wrapping_sub(since_ms) >= self.times.open_after_ms {
                    Contact::Open { since_ms: now_ms }
                } else {
                    Contact::Pausing { since_ms }
                }
            }
            Some(open @ (Contact::Open { .. } | Contact::Idle)) => open,
        };
        self.set(next)
    }

    /// Leaves the contactor as it is, for the pause is the frequency response's and will end: what
    /// is closed stays closed however long it takes. A position that is unknown becomes open.
    ///
    /// # Errors
    /// As [`Contactor::request`].
    pub fn hold(&mut self) -> Result<(), O::Error> {
        let next = match self.contact {
            Some(Contact::Closed | Contact::Pausing { .. }) => Contact::Closed,
            Some(open) => open,
            None => Contact::Idle,
        };
        self.set(next).map(|_closed| ())
    }

    /// Opens at once, for the car does not ask for power. What was open stays as it is.
    ///
    /// # Errors
    /// As [`Contactor::request`].
    pub fn idle(&mut self) -> Result<(), O::Error> {
        let next = match self.contact {
            Some(open @ Contact::Open { .. }) => open,
            _ => Contact::Idle,
        };
        self.set(next).map(|_closed| ())
    }

    fn set(&mut self, next: Contact) -> Result<bool, O::Error> {
        let is_open = |contact| matches!(contact, Contact::Open { .. } | Contact::Idle);
        let open = is_open(next);
        if self.contact.is_none_or(|contact| is_open(contact) != open) {
            self.contact = None;
            if open {
                self.pin.set_low()?;
            } else {
                self.pin.set_high()?;
            }
        }
        self.contact = Some(next);
        Ok(next == Contact::Closed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_hal_mock::eh1::digital::{Mock, State, Transaction};

    #[test]
    fn opens_late_and_closes_no_sooner_than_allowed() {
        let mut pin = Mock::new(&[
            Transaction::set(State::High),
            Transaction::set(State::Low),
            Transaction::set(State::High),
        ]);
        let times = ContactorTimes {
            open_after_ms: 10_000,
            off_min_ms: 60_000,
        };
        let mut contactor = Contactor::new(pin.clone(), times);
        // The clock wraps on the way.
        let start = u32::MAX - 20_000;
        let mut at = |ms: u32, connect| contactor.request(connect, start.wrapping_add(ms));
        assert_eq!(at(0, true), Ok(true));
        assert_eq!(at(1_000, false), Ok(false));
        assert_eq!(at(5_000, true), Ok(true));
        assert_eq!(at(6_000, false), Ok(false));
        assert_eq!(at(15_999, false), Ok(false));
        assert_eq!(at(16_000, false), Ok(false));
        assert_eq!(at(75_999, true), Ok(false));
        assert_eq!(at(76_000, true), Ok(true));
        pin.done();
    }

    #[test]
    fn a_car_that_does_not_ask_is_let_go_at_once_and_taken_back_at_once() {
        let mut pin = Mock::new(&[
            Transaction::set(State::Low),
            Transaction::set(State::High),
            Transaction::set(State::Low),
            Transaction::set(State::High),
            Transaction::set(State::Low),
        ]);
        let mut contactor = Contactor::new(pin.clone(), ContactorTimes::DEFAULT);
        // The first call sets the pin, whatever it was.
        assert_eq!(contactor.idle(), Ok(()));
        assert_eq!(contactor.request(true, 100), Ok(true));
        assert_eq!(contactor.idle(), Ok(()));
        assert!(contactor.may_close(300));
        assert_eq!(contactor.request(true, 300), Ok(true));
        // A pause that has lasted keeps its time off, whatever the car does then.
        assert_eq!(contactor.request(false, 1_000), Ok(false));
        assert_eq!(contactor.request(false, 11_000), Ok(false));
        assert_eq!(contactor.idle(), Ok(()));
        assert!(!contactor.may_close(70_999));
        assert!(contactor.may_close(71_000));
        pin.done();
    }
}
