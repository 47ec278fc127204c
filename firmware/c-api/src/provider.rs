//! The functions of the provider.

use core::ffi::c_void;

use firmware::fault::ResetCause;
use firmware::flash;
use firmware::limit_provider::{LimitProvider, ProviderConfig};
use firmware::table::{TableError, TableView};

use crate::memory::{self, Resident};
use crate::numbers::Status;
use crate::records::{Config, Input, Output};
use crate::settings;

/// Memory of a provider: the caller's, zeroed or initialised before it is used. Nothing in it may
/// be changed by the caller. It may be moved between calls.
///
/// Counted in words of the core's own size, for most of it is numbers and pointers.
#[derive(Debug)]
#[repr(C)]
pub struct Provider {
    /// Not for the caller.
    pub words: [usize; 256],
}

impl Resident for LimitProvider<'static> {
    type Memory = Provider;
    const MARK: u32 = 0x486C_6450;
}

/// Bytes of a holdfast_provider, as the library has it.
#[unsafe(no_mangle)]
pub extern "C" fn holdfast_size() -> usize {
    size_of::<Provider>()
}

/// Alignment of a holdfast_provider, as the library has it.
#[unsafe(no_mangle)]
pub extern "C" fn holdfast_align() -> usize {
    align_of::<Provider>()
}

/// Fills a configuration with the defaults of the reference charger: 3 phases of 230 V, 22 kW in
/// one direction or 28 kW in both. The meter's error has no default, for nobody knows it but you.
///
/// # Safety
/// `config` is NULL, or may be written and is not used by anybody else during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn holdfast_default_config(
    config: *mut Config,
    direction: u8,
    serial: u32,
) -> Status {
    let filled = settings::defaults(direction, serial);
    // SAFETY: the caller's promise is that of `write`.
    match filled.and_then(|defaults| unsafe { memory::write(config, defaults) }) {
        Ok(()) => Status::Ok,
        Err(status) => status,
    }
}

/// Makes a provider in the caller's memory of `size` bytes. `table` is the table, or a region of
/// flash that begins with it; `length` are its bytes. It is checked here, and read at every tick:
/// it must stay where it is, and as it is, for as long as the provider is used.
///
/// HOLDFAST_STATUS_TABLE_REJECTED and HOLDFAST_STATUS_MISFIT leave a provider that works and runs
/// the droop; numbers from 16 on leave none.
///
/// # Safety
/// Each pointer is NULL or as described, and nobody else uses the memory during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn holdfast_init(
    provider: *mut c_void,
    size: usize,
    table: *const u8,
    length: usize,
    config: *const Config,
) -> Status {
    // SAFETY: the caller's promises are those of `bytes` (for as long as the provider is used),
    // `read` and `place`.
    let made = unsafe {
        memory::bytes(table, length).and_then(|region| {
            let config = memory::read(config)?;
            let (config, cause) = settings::checked(&config)?;
            let table = TableView::parse(flash::image(region));
            make(provider, size, table, &config, cause)
        })
    };
    match made {
        Ok(status) | Err(status) => status,
    }
}

/// Makes a provider of a table that was parsed. Not inlined: the stack is deepest while a table is
/// parsed.
///
/// # Safety
/// As for [`memory::place`].
#[inline(never)]
unsafe fn make(
    memory: *mut c_void,
    size: usize,
    table: Result<TableView<'static>, TableError>,
    config: &ProviderConfig,
    cause: ResetCause,
) -> Result<Status, Status> {
    let value = LimitProvider::with_table(table, config, cause);
    // SAFETY: the caller's promise is that of `place`.
    let provider = unsafe { memory::place(memory, size, value)? };
    Ok(if provider.table_error().is_some() {
        Status::TableRejected
    } else if provider.misfits().is_empty() {
        Status::Ok
    } else {
        Status::Misfit
    })
}

/// One tick, to be called every holdfast_tick_ms by a clock of milliseconds that may wrap. Late
/// ticks are caught up. `output` is what is allowed until the next tick; where the call fails,
/// nothing is.
///
/// # Safety
/// `provider` is NULL, or zeroed or initialised memory of that type; `input` is NULL or an input;
/// `output` is NULL or may be written. Nobody else uses them during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn holdfast_tick(
    provider: *mut Provider,
    input: *const Input,
    output: *mut Output,
) -> Status {
    // SAFETY: the caller's promises are those of `resident` and `read`.
    let ticked = unsafe {
        memory::resident::<LimitProvider<'static>>(provider).and_then(|provider| {
            let input = memory::read(input)?;
            let (report, allowed) = provider.tick(input.now_ms, &settings::inputs(&input));
            Ok(Output::of(&report, &allowed))
        })
    };
    let (value, status) = match ticked {
        Ok(value) => (value, Status::Ok),
        Err(status) => (Output::NOTHING, status),
    };
    // SAFETY: the caller's promise is that of `write`.
    match unsafe { memory::write(output, value) } {
        Ok(()) => status,
        Err(_) if status != Status::Ok => status,
        Err(unwritten) => unwritten,
    }
}

/// Length of a tick in ms; 0 if there is no provider.
///
/// # Safety
/// `provider` is NULL, or zeroed or initialised memory of that type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn holdfast_tick_ms(provider: *mut Provider) -> u16 {
    // SAFETY: the caller's promise is that of `resident`.
    unsafe { memory::resident::<LimitProvider<'static>>(provider) }
        .map_or(0, |provider| provider.tick_ms())
}
