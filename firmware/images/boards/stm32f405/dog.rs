//! The independent watchdog, which runs on an oscillator of its own.
//!
//! Its time can be changed while it runs, which the flash needs; it cannot be stopped.

use firmware::charger::Watchdog;
use firmware::retained::Proof;
use stm32f4xx_hal::pac::{IWDG, iwdg::RegisterBlock};

use super::ending::Backup;

/// Longest time without a completed tick \[ms\].
pub(super) const USUAL_MS: u16 = 400;
// Two of the longest ticks fit before it bites.
const _: () = assert!(USUAL_MS >= 2 * firmware::table::TICK_MS_MAX);

/// Keys: feed, open, start.
const FEED: u16 = 0xAAAA;
const OPEN: u16 = 0x5555;
const START: u16 = 0xCCCC;
/// Prescaler of 32: a count is a millisecond of its oscillator's nominal 32 kHz.
const BY_32: u16 = 3;
/// Most counts.
const COUNTS_MAX: u16 = 4_096;
/// Turns for which a change is waited for: it takes five cycles of the oscillator, 0.3 ms at most
/// with a prescaler of 4 and 17 kHz; a turn takes eight cycles of the core or more, 1.9 ms in all.
const TURNS: u32 = 20_000;

/// The watchdog, started.
pub(super) struct Running(());

/// Starts the watchdog.
pub(super) fn start(_watchdog: IWDG) -> Running {
    key(START);
    // At first it has 512 ms, whatever becomes of this.
    let _ = allow(USUAL_MS);
    Running(())
}

impl Running {
    /// The watchdog of a start that has yet to come to a run, which is noted in the memory.
    pub(super) const fn of_run(self, kept: Backup) -> Dog {
        Dog {
            kept,
            proof: Proof::NEW,
        }
    }
}

/// The watchdog of a run: fed by completed ticks, which are the run's proof.
pub(crate) struct Dog {
    kept: Backup,
    proof: Proof,
}

impl Watchdog for Dog {
    fn feed(&mut self) {
        feed();
        self.proof.tick(&mut self.kept);
    }
}

fn registers() -> &'static RegisterBlock {
    // SAFETY: only this module uses the peripheral, from one thread.
    unsafe { &*IWDG::ptr() }
}

fn key(key: u16) {
    // SAFETY: documented keys of this register.
    registers().kr().write(|w| unsafe { w.bits(key) });
}

/// Restarts its time.
pub(super) fn feed() {
    key(FEED);
}

/// Whether a change of its time is through.
fn settled() -> bool {
    (0..TURNS).any(|_| registers().sr().read().bits() == 0)
}

/// Gives it another time, 1 to 4 096 ms, and restarts it; whether it took it.
pub(super) fn allow(ms: u16) -> bool {
    let counts = ms.clamp(1, COUNTS_MAX);
    if !settled() {
        return false;
    }
    key(OPEN);
    // SAFETY: documented values of these registers.
    unsafe {
        registers().pr().write(|w| w.bits(BY_32));
        registers().rlr().write(|w| w.bits(counts - 1));
    }
    let taken = settled();
    feed();
    taken
}
