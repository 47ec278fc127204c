//! Which column is the time and which the frequency.

use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;

use super::fields;
use super::time_stamp::Clock;

/// What a value says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// The frequency in Hz.
    Hz,
    /// The deviation from nominal in mHz.
    DeviationMhz,
    /// The deviation from nominal in Hz.
    DeviationHz,
}

impl Unit {
    /// The frequency \[Hz\] that a value says.
    pub fn frequency_hz(self, value: f64, nominal_hz: f64) -> f64 {
        match self {
            Self::Hz => value,
            Self::DeviationMhz => nominal_hz + value / 1000.0,
            Self::DeviationHz => nominal_hz + value,
        }
    }

    /// Lowest and highest value within this much of nominal \[Hz\].
    pub(super) fn range(self, nominal_hz: f64, range_hz: f64) -> (f64, f64) {
        match self {
            Self::Hz => (nominal_hz - range_hz, nominal_hz + range_hz),
            Self::DeviationMhz => (-1000.0 * range_hz, 1000.0 * range_hz),
            Self::DeviationHz => (-range_hz, range_hz),
        }
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Hz => "Hz",
            Self::DeviationMhz => "mHz from nominal",
            Self::DeviationHz => "Hz from nominal",
        })
    }
}

/// Columns named by a person: `TIME,VALUE[:UNIT]`, each a header name or a number from 1.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Choice {
    time: String,
    value: String,
    unit: Option<Unit>,
}

impl FromStr for Choice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let allowed = "allowed: TIME,VALUE or TIME,VALUE:UNIT with a header name or a number from \
                       1 for each and Hz, mHz (deviation) or dHz (deviation in Hz) as the unit";
        let refused = || format!("{text:?}; {allowed}");
        let (time, value) = text.split_once(',').ok_or_else(refused)?;
        let (value, unit) = match value.rsplit_once(':') {
            None => (value, None),
            Some((value, "Hz")) => (value, Some(Unit::Hz)),
            Some((value, "mHz")) => (value, Some(Unit::DeviationMhz)),
            Some((value, "dHz")) => (value, Some(Unit::DeviationHz)),
            Some(_) => return Err(refused()),
        };
        if time.is_empty() || value.is_empty() || value.contains(',') {
            return Err(refused());
        }
        Ok(Self {
            time: time.to_owned(),
            value: value.to_owned(),
            unit,
        })
    }
}

/// Names of columns, without blanks, marks and capitals.
const TIMES: &[&str] = &[
    "dtm",
    "utctime",
    "time",
    "timestamp",
    "datetime",
    "datetimeutc",
    "timeutc",
    "timestamputc",
    "utc",
    "zeitstempel",
    "zeit",
    "horodate",
];
const DATES: &[&str] = &["date", "datum"];
const TIMES_OF_DAY: &[&str] = &["time", "zeit", "uhrzeit", "heure"];
const SECONDS: &[&str] = &[
    "times",
    "timeseconds",
    "seconds",
    "ts",
    "unixs",
    "unixtime",
    "epochs",
];
const FREQUENCIES: &[&str] = &[
    "f",
    "fhz",
    "frequency",
    "frequencyhz",
    "freq",
    "freqhz",
    "hz",
    "gridfrequency",
    "gridfrequencyhz",
    "frequenz",
    "frequenzhz",
    "netzfrequenz",
    "netzfrequenzhz",
    "frequence",
    "frequencehz",
];
const DEVIATIONS_MHZ: &[&str] = &[
    "deviationmhz",
    "fdeviationmhz",
    "frequencydeviationmhz",
    "dfmhz",
    "deltafmhz",
    "abweichungmhz",
    "frequenzabweichungmhz",
];
const DEVIATIONS_HZ: &[&str] = &[
    "deviationhz",
    "fdeviationhz",
    "frequencydeviationhz",
    "dfhz",
    "deltafhz",
    "abweichunghz",
    "frequenzabweichunghz",
];

/// A header's name as it is compared.
fn plain(name: &str) -> String {
    let spelt = name.to_lowercase().replace(['δ', '∆'], "delta");
    spelt.chars().filter(char::is_ascii_alphanumeric).collect()
}

/// The columns of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Columns {
    /// Where the time is: one column, or date and time of day.
    time: Vec<usize>,
    /// How times are written.
    pub clock: Clock,
    /// Where the value is.
    pub value: usize,
    /// What it says.
    pub unit: Unit,
    /// Whether the first line is a header and no sample.
    pub has_header: bool,
}

impl Columns {
    /// The columns of a file with this first line.
    ///
    /// # Errors
    /// What was found and what is allowed.
    pub fn of(first: &[Cow<'_, str>], choice: Option<&Choice>) -> Result<Self, String> {
        match choice {
            None => Self::by_name(first),
            Some(choice) => Self::chosen(first, choice),
        }
    }

    /// A row's time: date and time of day are joined by a blank.
    pub(super) fn time_text<'f>(&self, fields: &'f [Cow<'_, str>]) -> Cow<'f, str> {
        match self.time.as_slice() {
            [one] => Cow::Borrowed(fields[*one].as_ref()),
            several => {
                let parts: Vec<&str> = several.iter().map(|at| fields[*at].as_ref()).collect();
                Cow::Owned(parts.join(" "))
            }
        }
    }

    fn by_name(header: &[Cow<'_, str>]) -> Result<Self, String> {
        let names: Vec<String> = header.iter().map(|name| plain(name)).collect();
        let among = |known: &[&str]| -> Vec<usize> {
            let is_known = |at: &usize| known.contains(&names[*at].as_str());
            (0..names.len()).filter(is_known).collect()
        };
        let shown = header.join(",");
        let one = |what: &str, found: Vec<usize>, example: &str| match found.as_slice() {
            [one] => Ok(*one),
            [] => Err(format!(
                "columns {shown:?}: none is known as the {what}; allowed: {example}, or name them \
                 by --columns TIME,VALUE[:Hz|mHz|dHz]"
            )),
            several => Err(format!(
                "columns {shown:?}: {} may be the {what}; say which by --columns \
                 TIME,VALUE[:Hz|mHz|dHz]",
                several.len()
            )),
        };
        let (time, clock) = match (among(DATES).as_slice(), among(TIMES_OF_DAY).as_slice()) {
            ([date], [time]) => (vec![*date, *time], Clock::Calendar),
            _ => {
                let seconds = among(SECONDS);
                let calendar = among(TIMES);
                let clock = if calendar.is_empty() && !seconds.is_empty() {
                    Clock::Seconds
                } else {
                    Clock::Calendar
                };
                let found = if clock == Clock::Seconds {
                    seconds
                } else {
                    calendar
                };
                (vec![one("time", found, "dtm, utc_time, time_s")?], clock)
            }
        };
        let units = [
            (Unit::Hz, FREQUENCIES),
            (Unit::DeviationMhz, DEVIATIONS_MHZ),
            (Unit::DeviationHz, DEVIATIONS_HZ),
        ];
        let values = units.map(|(unit, known)| (unit, among(known)));
        let all = values.iter().flat_map(|(_, found)| found.clone()).collect();
        let value = one("frequency", all, "f, frequency_hz, deviation_mhz")?;
        let unit = unit_of(&names[value]).unwrap_or(Unit::Hz);
        Ok(Self {
            time,
            clock,
            value,
            unit,
            has_header: true,
        })
    }

    fn chosen(first: &[Cow<'_, str>], choice: &Choice) -> Result<Self, String> {
        let find = |wanted: &str| {
            let by_name = first.iter().position(|name| name.as_ref() == wanted);
            let by_number = || {
                let number = wanted.parse::<usize>().ok()?.checked_sub(1)?;
                (number < first.len()).then_some(number)
            };
            by_name.or_else(by_number).ok_or_else(|| {
                format!(
                    "columns {:?}: there is no {wanted:?}, which --columns names",
                    first.join(",")
                )
            })
        };
        let (time, value) = (find(&choice.time)?, find(&choice.value)?);
        // Without a header the first line is a sample; a header's name is no number.
        let has_header = fields::number(&first[value]).is_err();
        let (time_name, value_name) = (plain(&first[time]), plain(&first[value]));
        let in_seconds = if has_header {
            SECONDS.contains(&time_name.as_str())
        } else {
            fields::number(&first[time]).is_ok()
        };
        Ok(Self {
            time: vec![time],
            clock: if in_seconds {
                Clock::Seconds
            } else {
                Clock::Calendar
            },
            value,
            unit: choice
                .unit
                .or_else(|| unit_of(&value_name))
                .unwrap_or(Unit::Hz),
            has_header,
        })
    }
}

/// The unit that a name says.
fn unit_of(name: &str) -> Option<Unit> {
    if DEVIATIONS_MHZ.contains(&name) {
        Some(Unit::DeviationMhz)
    } else if DEVIATIONS_HZ.contains(&name) {
        Some(Unit::DeviationHz)
    } else if FREQUENCIES.contains(&name) {
        Some(Unit::Hz)
    } else {
        None
    }
}
