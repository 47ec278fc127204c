//! A recording: calls from C as the replay reads them, and what the library itself answers.
//!
//! The format is that of `firmware/c-api/examples/replay/replay.c`. All numbers are little-endian,
//! as on every core here.

use firmware::frequency::zero_crossing::ZeroCrossing;
use firmware::frequency::{FrequencySource, Nominal};
use firmware::limit_provider::LimitProvider;
use holdfast::numbers::{Reading, Status};
use holdfast::records::{CapturesConfig, Config, Input, Output};
use holdfast::settings;

use super::error::CApiError;

const END: u32 = 0;
const START: u32 = 1;
const WINDOW: u32 = 2;
const TICK: u32 = 3;
const CROSSING: u32 = 4;
const READ: u32 = 5;

/// Words that a target adds behind the answers.
pub const FACTS: usize = 5;

/// Calls and answers so far.
pub struct Recording<'t> {
    tables: &'t [Vec<u8>],
    calls: Vec<u8>,
    answers: Vec<u8>,
    /// Where the answers of each start begin.
    starts: Vec<usize>,
    provider: Option<LimitProvider<'t>>,
    window: Option<ZeroCrossing>,
}

impl<'t> Recording<'t> {
    /// An empty recording over these tables. `measure` makes a target measure every call.
    pub fn new(tables: &'t [Vec<u8>], measure: bool) -> Self {
        let mut recording = Self {
            tables,
            calls: Vec::new(),
            answers: Vec::new(),
            starts: Vec::new(),
            provider: None,
            window: None,
        };
        recording.words(&[u32::from(measure), tables.len() as u32]);
        for table in tables {
            recording.words(&[table.len() as u32]);
            recording.calls.extend(table);
            let whole = recording.calls.len().next_multiple_of(4);
            recording.calls.resize(whole, 0);
        }
        recording
    }

    fn words(&mut self, words: &[u32]) {
        self.calls
            .extend(words.iter().flat_map(|word| word.to_le_bytes()));
    }

    /// A new provider over the table of this number, and a window of crossings if there is a
    /// configuration of one, which fills the meter's fields.
    ///
    /// # Errors
    /// The configuration is one that C would be refused.
    pub fn start(
        &mut self,
        table: usize,
        config: &Config,
        window: Option<&CapturesConfig>,
    ) -> Result<(), CApiError> {
        let refused = |status| CApiError::Failed(format!("a scenario's setting: {status:?}"));
        self.words(&[if window.is_some() { WINDOW } else { START }, table as u32]);
        self.calls.extend(config_bytes(config));
        let mut config = *config;
        self.window = None;
        if let Some(captures) = window {
            self.calls.extend(captures_bytes(captures));
            let nominal = match captures.nominal_hz {
                60 => Nominal::Hz60,
                _ => Nominal::Hz50,
            };
            let window = ZeroCrossing::new(captures.timer_hz, captures.cycles, captures.clock_ppm)
                .map_err(|error| CApiError::Failed(format!("{error:?}")))?
                .with_jitter_ns(captures.jitter_ns)
                .with_nominal(nominal);
            config.meter_error_uhz = window.error_uhz();
            config.meter_lag_ms = window.lag_ms();
            config.stuck_after_ticks = 0;
            self.window = Some(window);
        }
        let (settings, cause) = settings::checked(&config).map_err(refused)?;
        let bytes = self.tables.get(table).map_or(&[][..], Vec::as_slice);
        let provider = LimitProvider::new(bytes, &settings, cause);
        let status = if provider.table_error().is_some() {
            Status::TableRejected
        } else if provider.misfits().is_empty() {
            Status::Ok
        } else {
            Status::Misfit
        };
        self.provider = Some(provider);
        self.starts.push(self.answers.len());
        self.answers.extend((status as u32).to_le_bytes());
        Ok(())
    }

    /// A zero crossing.
    pub fn crossing(&mut self, stamp: u32, now_ms: u32) {
        self.words(&[CROSSING, stamp, now_ms]);
        if let Some(window) = &mut self.window {
            window.capture(stamp, now_ms);
        }
    }

    /// A tick; with a window its reading replaces that of the input.
    pub fn tick(&mut self, input: &Input) -> Output {
        let mut input = *input;
        self.words(&[if self.window.is_some() { READ } else { TICK }]);
        self.calls.extend(input_bytes(&input));
        if let Some(window) = &mut self.window {
            match window.read(input.now_ms) {
                Ok(reading) => {
                    input.reading = Reading::Valid as u8;
                    input.deviation_uhz = reading.deviation_uhz;
                    input.age_ms = reading.age_ms;
                }
                Err(_) => input.reading = Reading::None as u8,
            }
        }
        self.answers.extend((Status::Ok as u32).to_le_bytes());
        let output = self.provider.as_mut().map(|provider| {
            let (report, allowed) = provider.tick(input.now_ms, &settings::inputs(&input));
            Output::of(&report, &allowed)
        });
        let output = output.unwrap_or(Output::NOTHING);
        self.answers.extend(output_bytes(&output));
        output
    }

    /// The file of calls, ended.
    pub fn calls(&self) -> Vec<u8> {
        let end = END.to_le_bytes();
        self.calls.iter().chain(&end).copied().collect()
    }

    /// What the library answers.
    pub fn answers(&self) -> &[u8] {
        &self.answers
    }

    /// Compares a program's answers with the library's; what the program measured.
    ///
    /// # Errors
    /// The first answer that is not equal to the bit.
    pub fn compare(&self, found: &[u8]) -> Result<[u32; FACTS], CApiError> {
        let (answers, facts) = found
            .split_last_chunk::<{ FACTS * 4 }>()
            .ok_or_else(|| CApiError::Differs("the program wrote no answers".into()))?;
        let pairs = answers.iter().zip(&self.answers);
        let same = pairs.take_while(|(a, b)| a == b).count();
        if same < self.answers.len() || answers.len() != self.answers.len() {
            return Err(self.difference(answers, same));
        }
        let mut words = [0; FACTS];
        for (word, bytes) in words.iter_mut().zip(facts.as_chunks::<4>().0) {
            *word = u32::from_le_bytes(*bytes);
        }
        Ok(words)
    }

    /// Where and how answers differ from the byte `at` on.
    fn difference(&self, answers: &[u8], at: usize) -> CApiError {
        const ANSWER: usize = 4 + size_of::<Output>();
        let scenario = self.starts.partition_point(|start| *start <= at).max(1) - 1;
        let start = self.starts.get(scenario).copied().unwrap_or(0);
        // The answer to the start is a status alone.
        let tick = (at - start).saturating_sub(4) / ANSWER;
        let from = start + 4 + tick * ANSWER;
        let words = |bytes: &[u8]| {
            let answer = bytes.get(from..).unwrap_or_default();
            let whole = answer.as_chunks::<4>().0.iter();
            let words = whole.take(ANSWER / 4).map(|word| u32::from_le_bytes(*word));
            words.map(|word| format!("{word:08x} ")).collect::<String>()
        };
        CApiError::Differs(format!(
            "{} bytes of answers, {} expected, equal up to byte {at}: recording {scenario}, tick {tick} \
             (status and output in words)\nlibrary: {}\nprogram: {}",
            answers.len(),
            self.answers.len(),
            words(&self.answers),
            words(answers)
        ))
    }
}

/// Fields, one after the other, as C lays them out: none of the records has a gap.
macro_rules! laid_out {
    ($($field:expr),+ $(,)?) => {{
        let mut bytes = Vec::new();
        $(bytes.extend($field.to_le_bytes());)+
        bytes
    }};
}

fn config_bytes(c: &Config) -> Vec<u8> {
    laid_out![
        c.version,
        c.direction,
        c.phases,
        c.voltage_v,
        c.power_w,
        c.serial,
        c.meter_error_uhz,
        c.meter_lag_ms,
        c.stuck_after_ticks,
        c.tick_most_ms,
        c.hold_ticks,
        c.release_ppm,
        c.range_uhz,
        c.rate_uhz_per_s,
        c.recovered_uhz,
        c.recovered_s,
        c.recovered_release_s,
        c.age_ms,
        c.warm_up_ticks,
        c.start_fixed_s,
        c.start_random_s,
        c.filter_ticks,
        c.reset_cause,
        c.reserved,
    ]
}

fn captures_bytes(c: &CapturesConfig) -> Vec<u8> {
    laid_out![c.timer_hz, c.jitter_ns, c.clock_ppm, c.cycles, c.nominal_hz]
}

fn input_bytes(i: &Input) -> Vec<u8> {
    laid_out![
        i.now_ms,
        i.deviation_uhz,
        i.age_ms,
        i.reading,
        i.car_present,
        i.limit_ma,
        i.charge_limit_w,
        i.discharge_limit_w,
    ]
}

fn output_bytes(o: &Output) -> Vec<u8> {
    let [f, g, l, p] = o.state;
    laid_out![
        o.sequence,
        o.power_w,
        o.current_ma,
        o.participation_ppm,
        f,
        g,
        l,
        p,
        o.loss_kw,
        o.faults,
        o.misfits,
        o.mode,
        o.phase,
        o.energise,
        o.loss_known,
        o.reserved,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recording(tables: &[Vec<u8>]) -> Recording<'_> {
        let mut recording = Recording::new(tables, false);
        let config = settings::defaults(1, 1)
            .map(|config| Config {
                meter_error_uhz: 0,
                ..config
            })
            .unwrap();
        recording.start(0, &config, None).unwrap();
        for tick in 0..3 {
            recording.tick(&Input {
                now_ms: 100 * tick,
                deviation_uhz: 0,
                age_ms: 0,
                reading: 1,
                car_present: 1,
                limit_ma: 32_000,
                charge_limit_w: 22_000,
                discharge_limit_w: 0,
            });
        }
        recording
    }

    #[test]
    fn equal_answers_pass_and_the_first_other_bit_is_named() {
        let tables = [vec![0; 3]];
        let recording = recording(&tables);
        let mut found = recording.answers().to_vec();
        assert_eq!(found.len(), 4 + 3 * 48);
        for fact in 1..=FACTS as u32 {
            found.extend(fact.to_le_bytes());
        }
        assert_eq!(recording.compare(&found).unwrap(), [1, 2, 3, 4, 5]);
        found[4 + 48 + 20] ^= 1;
        let text = recording.compare(&found).unwrap_err().to_string();
        assert!(text.contains("recording 0, tick 1"), "{text}");
        // Answers that stop early differ too.
        let short = &recording.answers()[..100];
        assert!(recording.compare(short).is_err());
        assert!(recording.compare(&[]).is_err());
    }
}
