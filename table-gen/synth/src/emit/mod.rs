//! From laws to flash bytes: header and prediction out of the spec, one block per law, the seal.

pub mod dense;

use firmware::droop::Droop;
use firmware::grid::Grid;
use firmware::table::{
    self, Header, LAWS, LawEntry, PlantParameters, TableError, TableView, WriteError,
};
use firmware::units::Band;

use crate::delay::{self, Delay, DelayError};
use model::spec::Spec;

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
    /// A delay that the device cannot predict over.
    #[error(transparent)]
    Delay(#[from] DelayError),
    /// The image is too long.
    #[error("the table does not fit its length field: {0:?}")]
    Write(WriteError),
    /// The firmware's reader refuses what was written: a defect of the writer.
    #[error("the firmware's reader refuses the table: {0:?}")]
    Rejected(TableError),
}

/// The head of a spec's table.
///
/// # Errors
/// A number that does not fit its field.
pub fn head(spec: &Spec, grid: Grid) -> Result<Head, EmitError> {
    let delay = Delay::of(spec)?;
    Ok(Head {
        header: header(spec, grid)?,
        prediction: delay.map_or_else(Vec::new, |delay| delay.coefficients.bytes()),
    })
}

fn header(spec: &Spec, grid: Grid) -> Result<Header, EmitError> {
    let band = |[low_uhz, high_uhz]: [i32; 2]| Band { low_uhz, high_uhz };
    let ms = "1 to 65535 ms";
    let ticks = spec.sampling.ticks_per_period();
    let baseline = &spec.baseline;
    // The droop of the baseline rests at e / (R_ev D); with D = 0 its integrator saturates at once.
    let full_hz = baseline.droop_hz * spec.plant.damping_gw_per_hz;
    let step = spec.input.value(1);
    Ok(Header {
        spec_hash: spec.hash(),
        grid,
        input_step_ppm: micro_u32("input.step", step)?,
        levels: spec.input.levels() as u8,
        stay: spec.requirements.stay,
        tick_ms: narrow("sampling.watch_s", spec.sampling.watch_ms(), ms)?,
        period_ticks: narrow("sampling.period_s", ticks, "1 to 65535 ticks of watch_s")?,
        // The spec allows 64 ticks at most.
        delay_ticks: delay::ticks(spec) as u16,
        outer: band(spec.requirements.outer_micro()),
        inner: band(spec.requirements.inner_micro()),
        droop: Droop {
            deadband_uhz: micro_u32("baseline.deadband_hz", baseline.deadband_hz)?,
            full_uhz: micro_u32("baseline.droop_hz", full_hz)?.max(1),
        },
        plant: plant_parameters(spec)?,
        laws: [None; LAWS],
    })
}

fn plant_parameters(spec: &Spec) -> Result<PlantParameters, EmitError> {
    let plant = &spec.plant;
    Ok(PlantParameters {
        governor_gain_kw_per_hz: -(micro_u32(
            "plant.governor_gain_gw_per_hz",
            -plant.governor_gain_gw_per_hz,
        )? as i32),
        governor_time_us: micro_u32("plant.governor_time_s", plant.governor_time_s)?,
        turbine_time_us: micro_u32("plant.turbine_time_s", plant.turbine_time_s)?,
        lead_time_us: micro_u32("plant.lead_time_s", plant.lead_time_s)?,
        lag_time_us: micro_u32("plant.lag_time_s", plant.lag_time_s)?,
        damping_kw_per_hz: micro_u32("plant.damping_gw_per_hz", plant.damping_gw_per_hz)?,
        inertia_kw_s_per_hz: micro_u32("plant.inertia_gw_s_per_hz", plant.inertia_gw_s_per_hz)?,
        fleet_kw: micro_u32("fleet.chargers", spec.fleet_power_gw())?,
    })
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
    image.extend_from_slice(&[0; table::CRC_LEN]);
    table::seal(&mut image).map_err(EmitError::Write)?;
    TableView::parse(&image).map_err(EmitError::Rejected)?;
    Ok(image)
}
