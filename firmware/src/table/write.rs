//! The writer's side of the format: header into a buffer, then the seal over header and blocks.

use super::checksum;
use super::header::{
    ABSENT, BYTE_ORDER_MARK, CRC_LEN, DIRECTORY_AT, DIRECTORY_ENTRY_LEN, FORMAT_VERSION,
    HEADER_LEN, Header, MAGIC,
};
use crate::units::STATES;

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
    let mut put = |at: usize, bytes: &[u8]| out[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, &MAGIC);
    put(4, &BYTE_ORDER_MARK.to_le_bytes());
    put(6, &FORMAT_VERSION.to_le_bytes());
    put(12, &header.spec_hash);
    for axis in 0..STATES {
        put(28 + 4 * axis, &header.grid.lower_edge()[axis].to_le_bytes());
        put(44 + 4 * axis, &header.grid.width()[axis].to_le_bytes());
        put(60 + 2 * axis, &header.grid.count()[axis].to_le_bytes());
    }
    put(68, &header.input_step_ppm.to_le_bytes());
    put(72, &[header.levels, u8::from(header.stay)]);
    put(74, &header.tick_ms.to_le_bytes());
    put(76, &header.period_ticks.to_le_bytes());
    put(78, &header.delay_ticks.to_le_bytes());
    let bands = [header.outer, header.inner];
    for (index, band) in bands.iter().enumerate() {
        put(80 + 8 * index, &band.low_uhz.to_le_bytes());
        put(84 + 8 * index, &band.high_uhz.to_le_bytes());
    }
    put(96, &header.droop.deadband_uhz.to_le_bytes());
    put(100, &header.droop.full_uhz.to_le_bytes());
    let plant = &header.plant;
    put(104, &plant.governor_gain_kw_per_hz.to_le_bytes());
    let unsigned = [
        plant.governor_time_us,
        plant.turbine_time_us,
        plant.lead_time_us,
        plant.lag_time_us,
        plant.damping_kw_per_hz,
        plant.inertia_kw_s_per_hz,
        plant.fleet_kw,
    ];
    for (index, value) in unsigned.iter().enumerate() {
        put(108 + 4 * index, &value.to_le_bytes());
    }
    for (index, entry) in header.laws.iter().enumerate() {
        let at = DIRECTORY_AT + index * DIRECTORY_ENTRY_LEN;
        match entry {
            None => put(at, &[ABSENT, ABSENT]),
            Some(entry) => {
                put(at, &[entry.domain_kind, entry.inputs_kind]);
                put(at + 2, &entry.worst_visits.to_le_bytes());
                put(at + 4, &entry.domain_len.to_le_bytes());
                put(at + 8, &entry.inputs_len.to_le_bytes());
            }
        }
    }
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
    image[8..12].copy_from_slice(&length.to_le_bytes());
    let body = image.len() - CRC_LEN;
    let crc = checksum(&image[..body]);
    image[body..].copy_from_slice(&crc.to_le_bytes());
    Ok(())
}
