//! The bytes of the header: reader, writer and the seal of a whole image.
//!
//! Where each field stands is said once, in [`field`].

use super::bytes::{HeaderWords, WORD, array_at, u16_at, u32_at};
use super::checksum::checksum;
use super::error::TableError;
use super::field::{self, Field, SPEC_HASH_LEN, entry};
use super::header::{Header, LEVELS_MAX, LawEntry, PlantParameters, TICK_MS_MAX, Working};
use super::hypotheses::Hypotheses;
use super::law_name::LAWS;
use super::response_part::RESPONSE_LEN;
use crate::droop::Droop;
use crate::grid::Grid;
use crate::prediction::{DELAY_TICKS_MAX, LEVELS_KEPT, prediction_len};
use crate::units::{Band, MICRO};

/// First bytes of every table: "Holdfast decision table".
pub const MAGIC: [u8; 4] = *b"HFDT";
/// Byte-order mark as a little-endian reader must find it.
pub const BYTE_ORDER_MARK: u16 = 0xFEFF;
/// The version of the format that this module reads and writes.
pub const FORMAT_VERSION: u16 = 3;
/// Bytes of the header, directory included.
pub const HEADER_LEN: usize = field::DIRECTORY.end;
/// Bytes of a directory entry.
pub const DIRECTORY_ENTRY_LEN: usize = entry::INPUTS_LEN.end;
/// Bytes of the CRC-32 at the end, over all bytes before it.
pub const CRC_LEN: usize = 4;

/// Flag: Hold follows C1 and C2.
const FLAG_STAY: u8 = 1;
/// Flag: the table is a response.
const FLAG_ALWAYS_ON: u8 = 2;
/// Flag: each charger decides at moments of its own.
const FLAG_OWN_CLOCKS: u8 = 4;
/// All flags.
const FLAGS: u8 = FLAG_STAY | FLAG_ALWAYS_ON | FLAG_OWN_CLOCKS;
/// Kind in the directory of a law that the table does not hold.
const ABSENT: u8 = 255;

// The fields follow one another without gaps, and the directory holds an entry for each law.
const _: () = {
    let mut end = 0;
    let mut index = 0;
    while index < field::ALL.len() {
        assert!(field::ALL[index].start == end && field::ALL[index].end > end);
        end = field::ALL[index].end;
        index += 1;
    }
    assert!(end == HEADER_LEN);
    assert!(HEADER_LEN - field::DIRECTORY.start == LAWS * DIRECTORY_ENTRY_LEN);
};

// Every level fits the memory of the commands under way.
const _: () = assert!(LEVELS_MAX <= LEVELS_KEPT);

/// A directory entry in words.
type EntryWords = [u32; DIRECTORY_ENTRY_LEN / WORD];

/// Where the entry of the law with this index begins.
const fn entry_at(index: usize) -> usize {
    field::DIRECTORY.start + index * DIRECTORY_ENTRY_LEN
}

impl Header {
    /// Reads and checks the header, the length and the CRC.
    ///
    /// # Errors
    /// The first check that fails, in the order magic, byte order, version, length, CRC, fields.
    pub fn parse(bytes: &[u8]) -> Result<Self, TableError> {
        let words = HeaderWords::of_sound(bytes)?;
        let header = Self::decode(&words, read_grid(&words)?);
        header.check(&words, bytes.len())?;
        Ok(header)
    }

    /// The fields as they stand; the grid was read before. A number that means nothing, which
    /// [`Header::check`] refuses, is read as the first of its kind.
    #[inline(never)]
    pub(super) fn decode(words: &HeaderWords, grid: Grid) -> Self {
        let flags = words.byte(field::FLAGS.start);
        let mut spec_hash = [0; SPEC_HASH_LEN];
        let hash = words.0.iter().skip(field::SPEC_HASH.start / WORD);
        for (bytes, word) in spec_hash.as_chunks_mut().0.iter_mut().zip(hash) {
            *bytes = word.to_le_bytes();
        }
        Self {
            spec_hash,
            grid,
            input_step_ppm: words.word(field::INPUT_STEP.start),
            levels: words.byte(field::LEVELS.start),
            stay: flags & FLAG_STAY != 0,
            always_on: flags & FLAG_ALWAYS_ON != 0,
            tick_ms: words.half(field::TICK.start),
            period_ticks: words.half(field::PERIOD.start),
            delay_ticks: words.half(field::DELAY.start),
            outer: read_band(words, &field::OUTER),
            inner: read_band(words, &field::INNER),
            droop: Droop {
                deadband_uhz: words.word(field::DROOP_DEADBAND.start),
                full_uhz: words.word(field::DROOP_FULL.start),
            },
            plant: read_plant(words),
            hypotheses: Hypotheses::decode(words, flags & FLAG_OWN_CLOCKS != 0),
            laws: {
                let mut laws = [None; LAWS];
                for (law, entry) in laws.iter_mut().zip(directory(words)) {
                    let entry = read_entry(entry);
                    *law = (entry.inputs_kind != ABSENT).then_some(entry);
                }
                laws
            },
        }
    }

    /// Whether every field is in its range, for an image of so many bytes.
    fn check(&self, words: &HeaderWords, length: usize) -> Result<(), TableError> {
        check((1..=LEVELS_MAX).contains(&self.levels), &field::LEVELS)?;
        let full = u64::from(self.input_step_ppm) * u64::from(self.levels - 1);
        check(full <= MICRO as u64, &field::INPUT_STEP)?;
        let flags = words.byte(field::FLAGS.start);
        check(flags & !FLAGS == 0, &field::FLAGS)?;
        check((1..=TICK_MS_MAX).contains(&self.tick_ms), &field::TICK)?;
        check(self.period_ticks > 0, &field::PERIOD)?;
        // The prediction part lies between header and blocks. A response predicts nothing.
        let least = HEADER_LEN + prediction_len(self.delay_ticks) + CRC_LEN;
        let has_room = self.delay_ticks <= DELAY_TICKS_MAX && length >= least;
        let predicts = self.always_on && self.delay_ticks > 0;
        check(has_room && !predicts, &field::DELAY)?;
        let response_len = if self.always_on { RESPONSE_LEN } else { 0 };
        check(length >= least + response_len, &field::FLAGS)?;
        let (outer, inner) = (self.outer, self.inner);
        check(outer.low_uhz < outer.high_uhz, &field::OUTER)?;
        let nested = outer.low_uhz <= inner.low_uhz && inner.high_uhz <= outer.high_uhz;
        check(nested && inner.low_uhz < inner.high_uhz, &field::INNER)?;
        check(self.droop.full_uhz > 0, &field::DROOP_FULL)?;
        let plant = &self.plant;
        check(plant.governor_time_us > 0, &field::GOVERNOR_TIME)?;
        check(plant.turbine_time_us > 0, &field::TURBINE_TIME)?;
        check(plant.lag_time_us > 0, &field::LAG_TIME)?;
        check(plant.inertia_kw_s_per_hz > 0, &field::INERTIA)?;
        self.hypotheses.check(words, self.tick_ms)?;
        for (index, entry) in directory(words).iter().enumerate() {
            let at = entry_at(index);
            let read = read_entry(entry);
            let absent = read.inputs_kind == ABSENT;
            let empty = read.domain_kind == ABSENT
                && read.worst_visits == 0
                && read.domain_len == 0
                && read.inputs_len == 0;
            // A table is by games or a response, not both.
            let sound = if absent { empty } else { !self.always_on };
            check(sound, &(at..at + DIRECTORY_ENTRY_LEN))?;
        }
        Ok(())
    }
}

impl HeaderWords {
    /// The header's words of an image whose magic, byte order, version, length and CRC are right.
    fn of_sound(bytes: &[u8]) -> Result<Self, TableError> {
        let needed = HEADER_LEN + CRC_LEN;
        if bytes.len() < needed {
            return Err(TableError::TooShort {
                found: bytes.len() as u32,
                needed: needed as u32,
            });
        }
        let magic = array_at(bytes, field::MAGIC.start).unwrap_or_default();
        if magic != MAGIC {
            return Err(TableError::BadMagic { found: magic });
        }
        match u16_at(bytes, field::BYTE_ORDER.start) {
            BYTE_ORDER_MARK => {}
            swapped if swapped == BYTE_ORDER_MARK.swap_bytes() => {
                return Err(TableError::WrongEndianness);
            }
            found => return Err(TableError::BadByteOrderMark { found }),
        }
        let version = u16_at(bytes, field::VERSION.start);
        if version != FORMAT_VERSION {
            return Err(TableError::UnsupportedVersion {
                found: version,
                supported: FORMAT_VERSION,
            });
        }
        let stated = u32_at(bytes, field::LENGTH.start);
        if stated as usize != bytes.len() {
            return Err(TableError::WrongLength {
                found: bytes.len() as u32,
                stated,
            });
        }
        let (body, trailer) = bytes.split_at(bytes.len() - CRC_LEN);
        let (computed, stored) = (checksum(body), u32_at(trailer, 0));
        if computed != stored {
            return Err(TableError::BadCrc { computed, stored });
        }
        Ok(Self::read(bytes))
    }
}

/// Checks the header, as [`Header::parse`] does, and reads what a charger keeps of it and the
/// directory.
///
/// Not inlined: what it needs must not lie on the stack while the laws are checked.
///
/// # Errors
/// As [`Header::parse`].
#[inline(never)]
pub(super) fn read_working(
    bytes: &[u8],
) -> Result<(Working, [Option<LawEntry>; LAWS]), TableError> {
    let words = HeaderWords::of_sound(bytes)?;
    let header = Header::decode(&words, read_grid(&words)?);
    header.check(&words, bytes.len())?;
    Ok((Working::of(&header), header.laws))
}

fn check(ok: bool, field: &Field) -> Result<(), TableError> {
    if ok {
        Ok(())
    } else {
        Err(TableError::bad_field(field))
    }
}

fn read_grid(words: &HeaderWords) -> Result<Grid, TableError> {
    let [f, g, l, p] = words.four(field::LOWER_EDGE.start);
    let lower_edge = [
        f.cast_signed(),
        g.cast_signed(),
        l.cast_signed(),
        p.cast_signed(),
    ];
    let at = field::COUNT.start;
    let count = [
        words.half(at),
        words.half(at + 2),
        words.half(at + 4),
        words.half(at + 6),
    ];
    Grid::new(lower_edge, words.four(field::WIDTH.start), count).map_err(TableError::BadGrid)
}

fn read_band(words: &HeaderWords, field: &Field) -> Band {
    Band {
        low_uhz: words.signed(field.start),
        high_uhz: words.signed(field.start + WORD),
    }
}

/// The plant.
pub(super) fn read_plant(words: &HeaderWords) -> PlantParameters {
    PlantParameters {
        governor_gain_kw_per_hz: words.signed(field::GOVERNOR_GAIN.start),
        governor_time_us: words.word(field::GOVERNOR_TIME.start),
        turbine_time_us: words.word(field::TURBINE_TIME.start),
        lead_time_us: words.word(field::LEAD_TIME.start),
        lag_time_us: words.word(field::LAG_TIME.start),
        damping_kw_per_hz: words.word(field::DAMPING.start),
        inertia_kw_s_per_hz: words.word(field::INERTIA.start),
        fleet_kw: words.word(field::FLEET.start),
    }
}

/// The words of the directory, an entry for each law.
fn directory(words: &HeaderWords) -> &[EntryWords] {
    let entries = words.0.split_at(field::DIRECTORY.start / WORD).1;
    entries.as_chunks().0
}

/// A directory entry. A law that the table does not hold has kinds that are [`ABSENT`], and all
/// else is 0.
fn read_entry(words: &EntryWords) -> LawEntry {
    let part = |field: Field| words[field.start / WORD] >> (8 * (field.start % WORD));
    LawEntry {
        domain_kind: part(entry::DOMAIN_KIND) as u8,
        inputs_kind: part(entry::INPUTS_KIND) as u8,
        worst_visits: part(entry::WORST_VISITS) as u16,
        domain_len: part(entry::DOMAIN_LEN),
        inputs_len: part(entry::INPUTS_LEN),
    }
}

/// Why a table cannot be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WriteError {
    /// The image is longer than `u32::MAX` bytes, or shorter than header and CRC.
    Length {
        /// Bytes of the image.
        found: u64,
    },
}

/// The bytes of a header; length and CRC are filled in by [`seal`].
pub fn write_header(header: &Header) -> [u8; HEADER_LEN] {
    let mut out = [0u8; HEADER_LEN];
    let mut put = |field: Field, bytes: &[u8]| out[field].copy_from_slice(bytes);
    put(field::MAGIC, &MAGIC);
    put(field::BYTE_ORDER, &BYTE_ORDER_MARK.to_le_bytes());
    put(field::VERSION, &FORMAT_VERSION.to_le_bytes());
    put(field::SPEC_HASH, &header.spec_hash);
    let grid = &header.grid;
    let lower = grid.lower_edge().map(i32::to_le_bytes);
    put(field::LOWER_EDGE, lower.as_flattened());
    let width = grid.width().map(u32::to_le_bytes);
    put(field::WIDTH, width.as_flattened());
    let count = grid.count().map(u16::to_le_bytes);
    put(field::COUNT, count.as_flattened());
    put(field::INPUT_STEP, &header.input_step_ppm.to_le_bytes());
    put(field::LEVELS, &[header.levels]);
    let flag = |on: bool, bit: u8| if on { bit } else { 0 };
    let flags = flag(header.stay, FLAG_STAY)
        | flag(header.always_on, FLAG_ALWAYS_ON)
        | flag(header.hypotheses.own_clocks, FLAG_OWN_CLOCKS);
    put(field::FLAGS, &[flags]);
    put(field::TICK, &header.tick_ms.to_le_bytes());
    put(field::PERIOD, &header.period_ticks.to_le_bytes());
    put(field::DELAY, &header.delay_ticks.to_le_bytes());
    let band = |band: Band| [band.low_uhz, band.high_uhz].map(i32::to_le_bytes);
    put(field::OUTER, band(header.outer).as_flattened());
    put(field::INNER, band(header.inner).as_flattened());
    let droop = header.droop;
    put(field::DROOP_DEADBAND, &droop.deadband_uhz.to_le_bytes());
    put(field::DROOP_FULL, &droop.full_uhz.to_le_bytes());
    let plant = &header.plant;
    let gain = plant.governor_gain_kw_per_hz;
    put(field::GOVERNOR_GAIN, &gain.to_le_bytes());
    put(field::GOVERNOR_TIME, &plant.governor_time_us.to_le_bytes());
    put(field::TURBINE_TIME, &plant.turbine_time_us.to_le_bytes());
    put(field::LEAD_TIME, &plant.lead_time_us.to_le_bytes());
    put(field::LAG_TIME, &plant.lag_time_us.to_le_bytes());
    put(field::DAMPING, &plant.damping_kw_per_hz.to_le_bytes());
    put(field::INERTIA, &plant.inertia_kw_s_per_hz.to_le_bytes());
    put(field::FLEET, &plant.fleet_kw.to_le_bytes());
    header.hypotheses.write(&mut put);
    let entries = header.laws.map(|law| write_entry(law.as_ref()));
    put(field::DIRECTORY, entries.as_flattened());
    out
}

fn write_entry(law: Option<&LawEntry>) -> [u8; DIRECTORY_ENTRY_LEN] {
    let mut out = [0u8; DIRECTORY_ENTRY_LEN];
    let mut put = |field: Field, bytes: &[u8]| out[field].copy_from_slice(bytes);
    let Some(law) = law else {
        put(entry::DOMAIN_KIND, &[ABSENT]);
        put(entry::INPUTS_KIND, &[ABSENT]);
        return out;
    };
    put(entry::DOMAIN_KIND, &[law.domain_kind]);
    put(entry::INPUTS_KIND, &[law.inputs_kind]);
    put(entry::WORST_VISITS, &law.worst_visits.to_le_bytes());
    put(entry::DOMAIN_LEN, &law.domain_len.to_le_bytes());
    put(entry::INPUTS_LEN, &law.inputs_len.to_le_bytes());
    out
}

/// Fills in length and CRC of a whole image (header, blocks, four bytes of room for the CRC).
///
/// # Errors
/// An image that is too long for the length field or too short for a header.
pub fn seal(image: &mut [u8]) -> Result<(), WriteError> {
    let wrong = WriteError::Length {
        found: image.len() as u64,
    };
    let length = u32::try_from(image.len()).map_err(|_| wrong)?;
    if image.len() < HEADER_LEN + CRC_LEN {
        return Err(wrong);
    }
    image[field::LENGTH].copy_from_slice(&length.to_le_bytes());
    let body = image.len() - CRC_LEN;
    let crc = checksum(&image[..body]);
    image[body..].copy_from_slice(&crc.to_le_bytes());
    Ok(())
}
