//! The charger behind the link: every driver of the library over pins and buses that the host feeds
//! and reads.

use core::cell::Cell;
use core::convert::Infallible;
use core::num::NonZeroU16;

use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;

use super::{LINK_VERSION, Mains, Pins, Request, Response, Setup, SourceKind};
use crate::charger::{Charger, ChargerConfig, Watchdog};
use crate::control_loop::{ControlLoop, Source};
use crate::dispatch::bidirectional::{Bidirectional, PowerStage};
use crate::dispatch::contactor::ContactorTimes;
use crate::dispatch::fleet::Threshold;
use crate::dispatch::unidirectional::Unidirectional;
use crate::dispatch::{Dispatch, DispatchError, Limits, SetPoint};
use crate::fault::ResetCause;
use crate::frequency::ade7953::{self, Ade7953, BusError, Registers};
use crate::frequency::zero_crossing::ZeroCrossing;
use crate::frequency::{FrequencyError, FrequencySource, Reading};
use crate::table::{Law, TableError, TableView};
use crate::telemetry::{Frame, TableId};
use crate::units::{Participation, State};

/// Timer of the zero-crossing source \[Hz\].
pub const TIMER_HZ: u32 = 1_000_000;
/// Counts of the pilot's period: 1 kHz from the 84 MHz timer clock of the board, divided by two.
pub const PILOT_COUNTS: u16 = 42_000;

/// The wires between the host and the charger's drivers.
#[derive(Debug, Default)]
pub struct Wires {
    pins: Cell<Pins>,
    mains: Cell<Option<Mains>>,
}

impl Wires {
    fn change(&self, edit: impl FnOnce(&mut Pins)) {
        let mut pins = self.pins.get();
        edit(&mut pins);
        self.pins.set(pins);
    }
}

struct PilotWire<'w>(&'w Wires);

impl embedded_hal::pwm::ErrorType for PilotWire<'_> {
    type Error = Infallible;
}

impl SetDutyCycle for PilotWire<'_> {
    fn max_duty_cycle(&self) -> u16 {
        PILOT_COUNTS
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.0.change(|pins| pins.pilot_counts = duty);
        Ok(())
    }
}

struct ContactorWire<'w>(&'w Wires);

impl embedded_hal::digital::ErrorType for ContactorWire<'_> {
    type Error = Infallible;
}

impl OutputPin for ContactorWire<'_> {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.change(|pins| pins.contactor = false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.change(|pins| pins.contactor = true);
        Ok(())
    }
}

struct StageWire<'w>(&'w Wires);

impl PowerStage for StageWire<'_> {
    type Error = Infallible;

    fn set_power_w(&mut self, power_w: i32) -> Result<(), Infallible> {
        self.0.change(|pins| pins.power_w = power_w);
        Ok(())
    }
}

struct WatchdogWire<'w>(&'w Wires);

impl Watchdog for WatchdogWire<'_> {
    fn feed(&mut self) {
        self.0.change(|pins| pins.fed = pins.fed.saturating_add(1));
    }
}

struct BusWire<'w>(&'w Wires);

impl Registers for BusWire<'_> {
    fn write_u8(&mut self, _address: u16, _value: u8) -> Result<(), BusError> {
        self.read_u16(ade7953::PERIOD).map(|_| ())
    }

    fn write_u16(&mut self, _address: u16, _value: u16) -> Result<(), BusError> {
        self.read_u16(ade7953::PERIOD).map(|_| ())
    }

    fn read_u16(&mut self, address: u16) -> Result<u16, BusError> {
        match self.0.mains.get() {
            Some(Mains::Period(_)) if address == ade7953::REQUIRED => Ok(ade7953::REQUIRED_VALUE),
            Some(Mains::Period(period)) => Ok(period),
            _ => Err(BusError),
        }
    }
}

enum AnySource<'w> {
    Deviation(&'w Wires),
    Ade7953(Ade7953<BusWire<'w>>),
    ZeroCrossing(&'w Wires, ZeroCrossing),
}

impl FrequencySource for AnySource<'_> {
    fn error_uhz(&self) -> u32 {
        match self {
            Self::Deviation(_) => 1,
            Self::Ade7953(chip) => chip.error_uhz(),
            Self::ZeroCrossing(_, window) => window.error_uhz(),
        }
    }

    fn lag_ms(&self) -> u16 {
        match self {
            Self::Deviation(_) => 0,
            Self::Ade7953(chip) => chip.lag_ms(),
            Self::ZeroCrossing(_, window) => window.lag_ms(),
        }
    }

    fn stuck_after(&self) -> Option<NonZeroU16> {
        match self {
            // A simulated grid at rest repeats itself for ever.
            Self::Deviation(_) => None,
            Self::Ade7953(chip) => chip.stuck_after(),
            Self::ZeroCrossing(_, window) => window.stuck_after(),
        }
    }

    fn read(&mut self, now_ms: u32) -> Result<Reading, FrequencyError> {
        match self {
            Self::Deviation(wires) => match wires.mains.get() {
                Some(Mains::Deviation { uhz, age_ms }) => Ok(Reading {
                    deviation_uhz: uhz,
                    age_ms,
                }),
                _ => Err(FrequencyError::NoSignal),
            },
            Self::Ade7953(chip) => chip.read(now_ms),
            Self::ZeroCrossing(wires, window) => {
                if let Some(Mains::Crossings { count, stamps }) = wires.mains.get() {
                    for stamp in stamps.iter().take(usize::from(count)) {
                        window.capture(*stamp, now_ms);
                    }
                }
                window.read(now_ms)
            }
        }
    }
}

enum AnyDispatch<'w> {
    Unidirectional(Unidirectional<PilotWire<'w>, ContactorWire<'w>>),
    Bidirectional(Bidirectional<StageWire<'w>>),
}

impl Dispatch for AnyDispatch<'_> {
    fn apply(
        &mut self,
        participation: Participation,
        now_ms: u32,
    ) -> Result<SetPoint, DispatchError> {
        match self {
            Self::Unidirectional(charger) => charger.apply(participation, now_ms),
            Self::Bidirectional(charger) => charger.apply(participation, now_ms),
        }
    }

    fn rest(&mut self, now_ms: u32) -> Result<SetPoint, DispatchError> {
        match self {
            Self::Unidirectional(charger) => charger.rest(now_ms),
            Self::Bidirectional(charger) => charger.rest(now_ms),
        }
    }
}

/// A charger, and a bare control loop, over one table.
pub struct Session<'w> {
    wires: &'w Wires,
    table: &'w [u8],
    view: Option<TableView<'w>>,
    id: Option<TableId>,
    control: ControlLoop<'w>,
    charger: Option<Charger<'w, AnySource<'w>, AnyDispatch<'w>, WatchdogWire<'w>>>,
}

impl<'w> Session<'w> {
    /// A session over this table.
    pub fn new(wires: &'w Wires, table: &'w [u8]) -> Self {
        let view = TableView::parse(table);
        let id = view.as_ref().ok().map(TableId::of);
        Self {
            wires,
            table,
            view: view.clone().ok(),
            id,
            control: ControlLoop::with_table(view),
            charger: None,
        }
    }

    /// Why the table was rejected, if it was.
    pub fn table_error(&self) -> Option<TableError> {
        self.control.table_error()
    }

    /// Answers a request.
    pub fn handle(&mut self, request: &Request) -> Response {
        match *request {
            Request::Hello => Response::Hello {
                version: LINK_VERSION,
                table: self.id,
            },
            Request::Start(setup) => self.start(&setup),
            Request::Tick { now_ms, mains } => {
                let Some(charger) = &mut self.charger else {
                    return Response::Refused;
                };
                self.wires.mains.set(Some(mains));
                let report = charger.tick(now_ms);
                Response::Tick {
                    frame: Frame::new(&report, self.id),
                    pins: self.wires.pins.get(),
                }
            }
            Request::Reset => {
                self.control.reset();
                Response::Done
            }
            Request::State(state) => {
                let action = self.control.step(State(state));
                Response::Action {
                    participation_ppm: action.participation.ppm(),
                    phase: action.phase.number(),
                    from_table: action.source == Source::Table,
                }
            }
            Request::Lookup { law, state } => self.lookup(law, State(state)),
            Request::Stop => Response::Done,
        }
    }

    fn start(&mut self, setup: &Setup) -> Response {
        let wires = self.wires;
        wires.pins.set(Pins::default());
        let source = match setup.source {
            SourceKind::Deviation => AnySource::Deviation(wires),
            SourceKind::Ade7953 => AnySource::Ade7953(Ade7953::new(BusWire(wires))),
            SourceKind::ZeroCrossing => match ZeroCrossing::new(TIMER_HZ, 5, 20) {
                Ok(window) => AnySource::ZeroCrossing(wires, window),
                Err(_) => return Response::Refused,
            },
        };
        let limits = Limits::all(setup.limit);
        let dispatch = if setup.bidirectional {
            AnyDispatch::Bidirectional(Bidirectional::new(StageWire(wires), limits, limits))
        } else {
            AnyDispatch::Unidirectional(Unidirectional::new(
                PilotWire(wires),
                ContactorWire(wires),
                ContactorTimes::DEFAULT,
                Threshold::of_serial(setup.serial),
                limits,
            ))
        };
        let config = ChargerConfig {
            warm_up_ticks: setup.warm_up_ticks,
            ..ChargerConfig::DEFAULT
        };
        let cause = if setup.brown_out {
            ResetCause::BrownOut
        } else {
            ResetCause::PowerOn
        };
        self.charger = Some(Charger::new(
            source,
            dispatch,
            WatchdogWire(wires),
            self.table,
            config,
            cause,
        ));
        Response::Done
    }

    fn lookup(&self, law: u8, state: State) -> Response {
        let Some(law) = Law::ALL.get(usize::from(law)) else {
            return Response::Refused;
        };
        let level = self.view.as_ref().and_then(|table| {
            let cell = table.working().grid.quantise(state)?;
            table.lookup(*law, cell)
        });
        Response::Level(level)
    }
}
