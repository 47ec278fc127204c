//! How a run is stopped: noted in a backup register, which a reset leaves alone. Then nothing is
//! done any more, and the watchdog restarts the board: every pin floats, and the contactor opens.

use core::panic::PanicInfo;

use cortex_m_rt::exception;
use firmware::retained::{Ending, Retained, end};
use stm32f4xx_hal::pac;

/// Backup register 0, open for writing.
pub(super) struct Backup;

impl Backup {
    /// Opens the backup registers. They stay open until the next reset.
    pub(super) fn open(rcc: &pac::RCC, power: &pac::PWR) -> Self {
        rcc.apb1enr().modify(|_, w| w.pwren().enabled());
        // Read back, so that the clock is there before the next access.
        let _ = rcc.apb1enr().read();
        power.cr().modify(|_, w| w.dbp().set_bit());
        Self
    }
}

impl Retained for Backup {
    fn load(&self) -> u32 {
        // SAFETY: a register that only this module uses.
        unsafe { (*pac::RTC::ptr()).bkpr(0).read().bits() }
    }

    fn store(&mut self, word: u32) {
        // SAFETY: as above; any word may be stored.
        unsafe { (*pac::RTC::ptr()).bkpr(0).write(|w| w.bits(word)) };
    }
}

/// Notes the ending and waits for the watchdog. Before the registers are open nothing is noted.
fn stop(ending: Ending) -> ! {
    end(&mut Backup, ending);
    loop {
        cortex_m::asm::nop();
    }
}

#[panic_handler]
fn panic(_info: &PanicInfo<'_>) -> ! {
    stop(Ending::Panic)
}

#[exception(trampoline = false)]
unsafe fn HardFault() -> ! {
    stop(Ending::HardFault)
}

/// The clock security system: the crystal has failed.
#[exception]
unsafe fn NonMaskableInt() {
    stop(Ending::Clock)
}
