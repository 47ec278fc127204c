//! The ways to write a time.
//!
//! | form | example |
//! |---|---|
//! | RFC 3339, also with a blank | `2019-08-09T15:52:33Z`, `2019-08-09 15:52:33.5+01:00` |
//! | the same with slashes | `2019/08/09 15:52:33` |
//! | NESO since 2023, and Go programs | `2019-08-09 15:52:33 +0000 UTC` |
//! | day first with points | `09.08.2019 15:52:33,5` |
//! | seconds, in columns so named | `93.5` |
//!
//! A time without an offset is taken as it is: only differences count, and a clock that is put back
//! shows as a time that does not rise. `08/09/2019` is refused: nobody can tell day from month.

use jiff::civil::DateTime;

/// Latest number that is read as seconds: the end of the year 2099 since 1970. Larger ones are
/// dates without marks, or milliseconds.
const SECONDS_MAX: f64 = 4_102_444_800.0;

/// How a file's times are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clock {
    /// Calendar date and time of day.
    Calendar,
    /// Seconds since anything.
    Seconds,
}

/// A moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TimeStamp {
    /// By a calendar without offset.
    Local(DateTime),
    /// By a calendar with an offset, in UTC.
    Universal(DateTime),
    /// Seconds.
    Seconds(f64),
}

impl Clock {
    /// Reads a time.
    ///
    /// # Errors
    /// What was found and what is allowed.
    pub fn read(self, text: &str) -> Result<TimeStamp, String> {
        let found = match self {
            Self::Seconds => seconds(text),
            Self::Calendar => calendar(text),
        };
        let allowed = match self {
            Self::Seconds => "seconds, such as 93.5",
            Self::Calendar => {
                "2019-08-09T15:52:33Z, 2019-08-09 15:52:33, with an offset such as +01:00 or \
                 +0000 UTC, 09.08.2019 15:52:33"
            }
        };
        found.ok_or_else(|| format!("time {text:?}; allowed: {allowed}"))
    }
}

impl TimeStamp {
    /// Time from another moment to this one \[s\].
    ///
    /// # Errors
    /// One has an offset and the other has none.
    pub fn seconds_since(&self, zero: &Self) -> Result<f64, String> {
        match (self, zero) {
            (Self::Local(now), Self::Local(then))
            | (Self::Universal(now), Self::Universal(then)) => {
                Ok(now.duration_since(*then).as_secs_f64())
            }
            (Self::Seconds(now), Self::Seconds(then)) => Ok(now - then),
            _ => Err("some times have an offset and some have none".to_owned()),
        }
    }
}

fn seconds(text: &str) -> Option<TimeStamp> {
    let value = super::fields::number(text).ok()?;
    (value.abs() <= SECONDS_MAX).then_some(TimeStamp::Seconds(value))
}

fn calendar(text: &str) -> Option<TimeStamp> {
    let (text, offset_s) = offset(text)?;
    let local = if text.as_bytes().get(2) == Some(&b'.') {
        day_first(text)?
    } else {
        civil(&text.replacen('/', "-", 2).replacen(',', ".", 1))?
    };
    match offset_s {
        None => Some(TimeStamp::Local(local)),
        Some(offset_s) => {
            let universal = local
                .checked_sub(jiff::SignedDuration::from_secs(offset_s))
                .ok()?;
            Some(TimeStamp::Universal(universal))
        }
    }
}

/// `09.08.2019 15:52:33`: day, month, year.
fn day_first(text: &str) -> Option<DateTime> {
    let (date, time) = text.split_once([' ', 'T'])?;
    let mut parts = date.split('.');
    let (day, month, year) = (parts.next()?, parts.next()?, parts.next()?);
    if parts.next().is_some() || [day, month, year].map(str::len) != [2, 2, 4] {
        return None;
    }
    let time = time.replacen(',', ".", 1);
    civil(&format!("{year}-{month}-{day}T{time}"))
}

/// ISO 8601 with nothing but date and time; a date alone would be midnight.
fn civil(text: &str) -> Option<DateTime> {
    let plain = |c: char| c.is_ascii_digit() || matches!(c, '-' | ':' | '.' | 'T' | ' ');
    let whole = text.len() >= "2019-08-09T15:52".len();
    (whole && text.chars().all(plain)).then(|| text.parse().ok())?
}

/// Takes the offset off a time: `Z`, `UTC`, `GMT`, `+01:00`, `+0100`, `+01`, `+0000 UTC`.
/// `None` for a zone that is a name.
fn offset(text: &str) -> Option<(&str, Option<i64>)> {
    let named = ["Z", "z", "UTC", "GMT"];
    let name = named.iter().find_map(|name| text.strip_suffix(name));
    let bare = name.unwrap_or(text).trim_end();
    if bare.ends_with(|c: char| c.is_alphabetic()) {
        return None;
    }
    // A date has dashes as well: an offset stands after the time's first colon.
    let time_at = bare.find(':')?;
    let Some(sign_at) = bare[time_at..].rfind(['+', '-']) else {
        return Some((bare, name.map(|_| 0)));
    };
    let (time, offset) = bare.split_at(time_at + sign_at);
    let (sign, digits) = offset.split_at(1);
    let digits = match digits.split_once(':') {
        Some((hours, minutes)) if hours.len() == 2 && minutes.len() == 2 => {
            format!("{hours}{minutes}")
        }
        Some(_) => return None,
        None if digits.len() == 2 => format!("{digits}00"),
        None => digits.to_owned(),
    };
    if digits.len() != 4 || !digits.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let (hours, minutes): (i64, i64) = (digits[..2].parse().ok()?, digits[2..].parse().ok()?);
    let size_s = 3600 * hours + 60 * minutes;
    // `+0000 UTC` says the same twice; `+0100 UTC` says two things.
    if hours > 14 || minutes > 59 || (name.is_some() && size_s != 0) {
        return None;
    }
    let offset_s = if sign == "-" { -size_s } else { size_s };
    Some((time.trim_end(), Some(offset_s)))
}
