//! From laws to flash bytes: header and prediction out of the spec, one block per law, the seal.

pub mod dense;

use firmware::grid::Grid;
use firmware::table::{
    self, Header, Hypotheses, LAWS, LawEntry, TableError, TableView, WriteError,
};
use firmware::units::Band;

use crate::delay;
use crate::problem::Problem;
use model::spec::Spec;
use model::table_fields::{self, FieldError};

/// One law, encoded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EncodedLaw {
    /// What the directory says of it.
    pub entry: LawEntry,
    /// The domain part.
    pub domain: Vec<u8>,
    /// The inputs part.
    pub inputs: Vec<u8>,
}

/// What comes before the laws.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Head {
    /// The header, its directory still empty.
    pub header: Header,
    /// The prediction part; empty without a delay.
    pub prediction: Vec<u8>,
}

/// Why a table cannot be emitted.
#[derive(Debug, thiserror::Error)]
pub enum EmitError {
    /// A number of the spec does not fit the header's field.
    #[error("{key} = {value} does not fit the table's header: {allowed}")]
    Field {
        /// Key of the spec.
        key: &'static str,
        /// Its value.
        value: f64,
        /// What fits.
        allowed: &'static str,
    },
    /// The same, for what the header says was assumed, and for a response.
    #[error(transparent)]
    Hypotheses(#[from] FieldError),
    /// The spec's laws come from games.
    #[error("preference.always_on is false: the laws come from games")]
    NotAlwaysOn,
    /// The image is too long.
    #[error("the table does not fit its length field: {0:?}")]
    Write(WriteError),
    /// The firmware's reader refuses what was written: a defect of the writer.
    #[error("the firmware's reader refuses the table: {0:?}")]
    Rejected(TableError),
}

/// The head of a problem's table.
///
/// # Errors
/// A number that does not fit its field.
pub fn head(problem: &Problem) -> Result<Head, EmitError> {
    let delay = problem.delay.as_ref();
    Ok(Head {
        header: header(&problem.spec, problem.grid)?,
        prediction: delay.map_or_else(Vec::new, |delay| delay.coefficients.bytes()),
    })
}

fn header(spec: &Spec, grid: Grid) -> Result<Header, EmitError> {
    let band = |[low_uhz, high_uhz]: [i32; 2]| Band { low_uhz, high_uhz };
    let ms = "1 to 65535 ms";
    let ticks = spec.sampling.ticks_per_period();
    let step = spec.input.value(1);
    Ok(Header {
        spec_hash: spec.hash(),
        grid,
        input_step_ppm: micro_u32("input.step", step)?,
        levels: spec.input.levels() as u8,
        stay: spec.requirements.stay,
        always_on: spec.preference.always_on,
        tick_ms: narrow("sampling.watch_s", spec.sampling.watch_ms(), ms)?,
        period_ticks: narrow("sampling.period_s", ticks, "1 to 65535 ticks of watch_s")?,
        // The spec allows 64 ticks at most.
        delay_ticks: if spec.preference.always_on {
            0
        } else {
            delay::ticks(spec) as u16
        },
        outer: band(spec.requirements.outer_micro()),
        inner: band(spec.requirements.inner_micro()),
        droop: table_fields::droop(spec)?,
        plant: table_fields::plant(spec)?,
        hypotheses: Hypotheses {
            generator: generator(),
            ..table_fields::hypotheses(spec)?
        },
        laws: [None; LAWS],
    })
}

/// This program's version, as the header holds it: 8 bits of major, 12 of minor and 12 of patch.
fn generator() -> u32 {
    let part = |text: &str| text.parse::<u32>().unwrap_or(0);
    let major = part(env!("CARGO_PKG_VERSION_MAJOR"));
    let minor = part(env!("CARGO_PKG_VERSION_MINOR"));
    let patch = part(env!("CARGO_PKG_VERSION_PATCH"));
    (major << 24) | (minor << 12) | patch
}

/// The table of a spec whose preferred law is always on: a response. No game is played.
///
/// # Errors
/// A spec whose laws come from games, or a number that does not fit its field.
pub fn response(spec: &Spec, grid: Grid) -> Result<Vec<u8>, EmitError> {
    let law = table_fields::response(spec)?.ok_or(EmitError::NotAlwaysOn)?;
    let mut image = table::write_header(&header(spec, grid)?).to_vec();
    image.extend_from_slice(&table::write_response(&law));
    finish(image)
}

/// A number in whole micro-units.
fn micro_u32(key: &'static str, value: f64) -> Result<u32, EmitError> {
    let micro = (value * 1e6).round();
    if (0.0..=f64::from(i32::MAX)).contains(&micro) {
        Ok(micro as u32)
    } else {
        let allowed = "0 to 2147.483647 in the key's unit";
        Err(EmitError::Field {
            key,
            value,
            allowed,
        })
    }
}

fn narrow(key: &'static str, value: u32, allowed: &'static str) -> Result<u16, EmitError> {
    match u16::try_from(value) {
        Ok(narrow) if narrow > 0 => Ok(narrow),
        _ => Err(EmitError::Field {
            key,
            value: f64::from(value),
            allowed,
        }),
    }
}

/// The whole image: head, blocks, CRC. The firmware's reader must accept it.
///
/// # Errors
/// An image that is too long, or that the reader refuses.
pub fn assemble(
    Head {
        mut header,
        prediction,
    }: Head,
    laws: &[Option<EncodedLaw>; LAWS],
) -> Result<Vec<u8>, EmitError> {
    for (entry, law) in header.laws.iter_mut().zip(laws) {
        *entry = law.as_ref().map(|law| law.entry);
    }
    let mut image = table::write_header(&header).to_vec();
    image.extend_from_slice(&prediction);
    for law in laws.iter().flatten() {
        image.extend_from_slice(&law.domain);
        image.extend_from_slice(&law.inputs);
    }
    finish(image)
}

/// Seals what lies before the CRC. The firmware's reader must accept it.
fn finish(mut image: Vec<u8>) -> Result<Vec<u8>, EmitError> {
    image.extend_from_slice(&[0; table::CRC_LEN]);
    table::seal(&mut image).map_err(EmitError::Write)?;
    TableView::parse(&image).map_err(EmitError::Rejected)?;
    Ok(image)
}
