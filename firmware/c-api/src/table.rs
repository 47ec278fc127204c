//! The functions that ask a table before a provider is made of it.

use firmware::charger::misfits;
use firmware::flash;
use firmware::frequency::filter::Filter;
use firmware::table::{TableError, TableView};
use firmware::telemetry::TableId;

use crate::memory;
use crate::numbers::{Status, TableFault};
use crate::records::{Config, TableInfo};
use crate::settings;

impl TableInfo {
    const fn rejected(error: TableError) -> Self {
        let fault = match error {
            TableError::TooShort { .. } => TableFault::TooShort,
            TableError::BadMagic { .. } => TableFault::BadMagic,
            TableError::WrongEndianness | TableError::BadByteOrderMark { .. } => {
                TableFault::ByteOrder
            }
            TableError::UnsupportedVersion { .. } => TableFault::UnsupportedVersion,
            TableError::WrongLength { .. } => TableFault::WrongLength,
            TableError::BadCrc { .. } => TableFault::BadCrc,
            TableError::ForeignSpec { .. } => TableFault::ForeignSpec,
            TableError::BadGrid(_) => TableFault::BadGrid,
            TableError::BadField { .. } => TableFault::BadField,
            TableError::BadBlock { .. } => TableFault::BadBlock,
        };
        Self {
            spec_hash: [0; 16],
            length: 0,
            crc: 0,
            table_version: 0,
            generator: 0,
            power_per_charger_w: 0,
            chargers: 0,
            meter_error_uhz: 0,
            meter_lag_least_ms: 0,
            meter_lag_most_ms: 0,
            tick_ms: 0,
            direction: 0,
            fault: fault as u8,
        }
    }

    fn accepted(table: &TableView<'_>) -> Self {
        let header = table.header();
        let assumed = &header.hypotheses;
        let [meter_error_uhz, ..] = assumed.estimate_error;
        let [meter_lag_least_ms, meter_lag_most_ms] = assumed.meter_lag_ms;
        let id = TableId::of(table);
        Self {
            spec_hash: id.spec_hash,
            length: table.bytes().len() as u32,
            crc: id.crc,
            table_version: assumed.table_version,
            generator: assumed.generator,
            power_per_charger_w: assumed.power_per_charger_w,
            chargers: assumed.chargers,
            meter_error_uhz,
            meter_lag_least_ms,
            meter_lag_most_ms,
            tick_ms: header.tick_ms,
            direction: assumed.direction as u8,
            fault: TableFault::None as u8,
        }
    }
}

/// Checks a table and says what it is. HOLDFAST_STATUS_TABLE_REJECTED if it is none: `info->fault`
/// says why.
///
/// # Safety
/// Each pointer is NULL or as described, and nobody else uses `info` during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn holdfast_read_table(
    table: *const u8,
    length: usize,
    info: *mut TableInfo,
) -> Status {
    // SAFETY: the caller's promise is that of `bytes`, for this call.
    let region = match unsafe { memory::bytes(table, length) } {
        Ok(region) => region,
        Err(status) => return status,
    };
    let (value, status) = match TableView::parse(flash::image(region)) {
        Ok(view) => (TableInfo::accepted(&view), Status::Ok),
        Err(error) => (TableInfo::rejected(error), Status::TableRejected),
    };
    // SAFETY: the caller's promise is that of `write`.
    match unsafe { memory::write(info, value) } {
        Ok(()) => status,
        Err(unwritten) => unwritten,
    }
}

/// Compares a charger with what the table's proof assumed, before a provider is made.
/// HOLDFAST_STATUS_MISFIT if something is otherwise: `found` holds the bits HOLDFAST_MISFIT_*.
///
/// # Safety
/// Each pointer is NULL or as described, and nobody else uses `found` during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn holdfast_compare(
    table: *const u8,
    length: usize,
    config: *const Config,
    found: *mut u8,
) -> Status {
    // SAFETY: the caller's promises are those of `bytes`, for this call, and `read`.
    let compared = unsafe {
        memory::bytes(table, length).and_then(|region| {
            let config = memory::read(config)?;
            let (config, _) = settings::checked(&config)?;
            let table =
                TableView::parse(flash::image(region)).map_err(|_| Status::TableRejected)?;
            let filter = Filter::new(config.charger.filter_ticks);
            let installation = &config.installation;
            Ok(misfits(
                &table.header(),
                installation,
                config.meter,
                &filter,
            ))
        })
    };
    let (bits, status) = match compared {
        Ok(none) if none.is_empty() => (0, Status::Ok),
        Ok(some) => (some.bits(), Status::Misfit),
        Err(status) => (0, status),
    };
    // SAFETY: the caller's promise is that of `write`.
    match unsafe { memory::write(found, bits) } {
        Ok(()) => status,
        Err(unwritten) => unwritten,
    }
}
