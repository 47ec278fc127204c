//! The clock tree: 84 MHz from the crystal, or from the internal oscillator if the crystal is dead.
//!
//! The board starts on the internal oscillator, which always runs, and moves the PLL to the crystal
//! once that runs. Both ways give the same frequencies, so nothing else depends on the outcome but
//! what is believed of them: the internal oscillator is good to 1 % only.

use stm32f4xx_hal::pac;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{Config, Rcc};

/// Core and timer clock \[MHz\].
pub(super) const CORE_MHZ: u32 = 84;
/// Crystal of the board \[MHz\].
const CRYSTAL_MHZ: u32 = 25;
/// Turns for which the crystal is waited for. A turn takes some cycles of the core: 20 ms or more,
/// ten times what a crystal takes.
const CRYSTAL_TURNS: u32 = 400_000;
/// Turns for which a switch of the clock tree is waited for, at 16 MHz: 1 ms or more, where the PLL
/// takes 0.2 ms.
const SWITCH_TURNS: u32 = 4_000;

/// The PLL on the crystal: divided to 1 MHz, multiplied, divided by 4; the USB's clock by 7.
const PLL_TIMES: u32 = 4 * CORE_MHZ;
const PLL_OF_CRYSTAL: u32 = CRYSTAL_MHZ | PLL_TIMES << 6 | 1 << 16 | 1 << 22 | 7 << 24;
// The PLL's own oscillator runs at 100 to 432 MHz.
const _: () = assert!(PLL_TIMES >= 100 && PLL_TIMES <= 432);

/// What the clocks go by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Oscillator {
    /// The crystal; if it fails, the core is told.
    Crystal,
    /// The internal oscillator.
    Internal,
}

/// The clock tree on the internal oscillator.
pub(super) fn internal(rcc: pac::RCC) -> Rcc {
    // One configuration, known when this is compiled: with two, the clock tree is worked out at run
    // time, in 2 KB of code that can panic.
    rcc.freeze(Config::hsi().sysclk(CORE_MHZ.MHz()))
}

/// Moves the PLL to the crystal, if it runs. `None` if the clock tree does not obey: then the clock
/// is unknown.
pub(super) fn to_crystal(rcc: &pac::RCC) -> Option<Oscillator> {
    rcc.cr().modify(|_, w| w.hseon().on());
    let runs = (0..CRYSTAL_TURNS).any(|_| rcc.cr().read().hserdy().is_ready());
    if !runs {
        rcc.cr().modify(|_, w| w.hseon().off());
        return Some(Oscillator::Internal);
    }
    // Without the PLL meanwhile.
    rcc.cfgr().modify(|_, w| w.sw().hsi());
    within(|| rcc.cfgr().read().sws().is_hsi())?;
    rcc.cr().modify(|_, w| w.pllon().off());
    within(|| !rcc.cr().read().pllrdy().is_ready())?;
    // SAFETY: documented values of this register, within the PLL's ranges.
    rcc.pllcfgr().write(|w| unsafe { w.bits(PLL_OF_CRYSTAL) });
    rcc.cr().modify(|_, w| w.pllon().on());
    within(|| rcc.cr().read().pllrdy().is_ready())?;
    rcc.cfgr().modify(|_, w| w.sw().pll());
    within(|| rcc.cfgr().read().sws().is_pll())?;
    // From now on a crystal that fails is an interrupt that cannot be masked.
    rcc.cr().modify(|_, w| w.csson().on());
    Some(Oscillator::Crystal)
}

/// Waits until a switch is done; `None` if it takes too long.
fn within(mut done: impl FnMut() -> bool) -> Option<()> {
    (0..SWITCH_TURNS).any(|_| done()).then_some(())
}
