//! Fleets of single chargers on the plant, each against the bounds that were found for it.

use firmware::response::{LevelOffset, Response, ResponseLaw};
use model::governor::Governor;
use model::interval::Interval;
use model::plant::Plant;
use rand::RngExt;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use verify::response::{
    Assumed, Case, Found, LossProfile, LossStage, PlantBand, RealLaw, TimeBands,
};

const FLEET_GW: f64 = 1.4;
const TICK_S: f64 = 0.1;
/// Integration step \[s\].
const H: f64 = 0.005;
/// Window of the meter \[s\].
const METER_S: f64 = 0.1;
/// Largest age of a reading \[s\].
const AGE_S: f64 = 0.02;
const DELAY_S: [f64; 2] = [0.1, 0.5];
const READING_HZ: f64 = 0.003;
const DELIVERY: f64 = 0.1;

/// The law of gb-bi, as integers.
const LAW: ResponseLaw = ResponseLaw {
    droop_gain_ppm_per_hz: 4_071_429,
    setpoint_uhz: -42_000,
    slope_gain_ppm_s_per_hz: 1_785_714,
    slope_threshold_uhz_per_s: 80_000,
    window_ticks: 5,
    slope_most_ppm: 285_714,
    release_ppm: 3_571,
    smallest_change_ppm: 50_000,
};

pub(crate) fn plant() -> Plant {
    Plant {
        governor_gain: -5.0,
        governor_time: 2.5,
        turbine_time: 0.5,
        lead_time: 2.0,
        lag_time: 12.0,
        damping: 1.0,
        inertia: 4.0,
        fleet: FLEET_GW,
    }
}

/// What fleets are drawn for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Setting {
    pub(crate) loss: Interval,
    pub(crate) governor: Governor,
    /// T_G, T_t, T_1 and T_2, drawn for every fleet.
    pub(crate) times: TimeBands,
    /// Share of the chargers that gives all or nothing, as it suits the adversary.
    pub(crate) hostile_share: f64,
    /// Distance of a charger's levels \[ppm\].
    pub(crate) smallest_change_ppm: u32,
    /// How far the mean command is from its target, as a share of that.
    pub(crate) mean_step_share: f64,
    /// Whether the loss comes in the stages of [`STAGES`] instead.
    pub(crate) staged: bool,
}

/// Moments \[s\] and sizes \[GW\] of a loss in stages.
const STAGES: [(f64, f64); 4] = [(0.0, 0.7), (0.4, 0.5), (12.0, 0.3), (20.0, 0.2)];
/// How far a stage may be from its moment \[s\].
const NEAR_S: f64 = 0.5;

/// The stages as the proof takes them.
pub(crate) fn stages() -> Vec<LossStage> {
    let stage = |(at_s, gw): (f64, f64)| LossStage {
        earliest_s: (at_s - NEAR_S).max(0.0),
        latest_s: at_s + NEAR_S,
        power_gw: Interval::point(gw),
    };
    STAGES.into_iter().map(stage).collect()
}

impl Setting {
    pub(crate) fn honest(loss: Interval, governor: Governor) -> Self {
        Self {
            loss,
            governor,
            times: TimeBands::known(&plant()),
            hostile_share: 0.0,
            smallest_change_ppm: LAW.smallest_change_ppm,
            mean_step_share: 1.0,
            staged: false,
        }
    }
}

pub(crate) fn case(setting: Setting) -> Case {
    let Setting { loss, governor, .. } = setting;
    let known = plant();
    let share = |ppm: u32| f64::from(ppm) / 1e6;
    Case {
        plant: PlantBand {
            known,
            inertia: Interval::point(known.inertia),
            governor_gain: Interval::point(known.governor_gain),
            damping: Interval::point(known.damping),
            times: setting.times,
            governor,
        },
        law: RealLaw {
            droop: share(LAW.droop_gain_ppm_per_hz),
            setpoint_hz: -0.042,
            slope: share(LAW.slope_gain_ppm_s_per_hz),
            slope_threshold_hz_per_s: 0.08,
            slope_window_s: 0.5,
            slope_most: share(LAW.slope_most_ppm),
            release_per_s: share(LAW.release_ppm) / TICK_S,
            release_least_per_s: share(LAW.release_ppm) / TICK_S,
            smallest_change: share(setting.smallest_change_ppm),
            rounding: 6e-6,
        },
        assumed: Assumed {
            late_least_s: DELAY_S[0],
            late_most_s: DELAY_S[1] + METER_S + AGE_S + TICK_S,
            tick_s: TICK_S,
            reading_hz: READING_HZ,
            age_spread_s: METER_S + AGE_S,
            slope_jitter_s: AGE_S,
            participation: DELIVERY,
            participation_absolute: 0.0,
            hostile_share: setting.hostile_share,
            mean_step_share: setting.mean_step_share,
            loss,
            profile: LossProfile::Constant,
            initial: [0.02, 0.1, 0.06, 0.06],
        },
        last: loss,
    }
}

/// Who chooses what the hypotheses leave open.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Malice {
    /// Everything at random, anew each time.
    Random,
    /// As little power as possible, as late as possible.
    LowAndLate,
    /// As much as possible, as early as possible.
    HighAndEarly,
    /// More power while f rises, less while it falls.
    Pump,
    /// More, then less, with a half period \[s\].
    Swing(f64),
    /// Half the fleet early and half late, errors against each other, delivery with f'.
    TwoGroups,
}

/// A plant with time constants from their bands, by its seed: first every corner of them, then
/// anywhere.
fn drawn(times: TimeBands, seed: u64) -> Plant {
    let mut rng = Pcg64::seed_from_u64(seed ^ 0x71ED);
    let mut corner = seed % 32;
    let mut time = |band: Interval| {
        let share = match corner {
            16.. => rng.random::<f64>(),
            corner => (corner & 1) as f64,
        };
        corner = if corner < 16 { corner / 2 } else { corner };
        band.low + (band.high - band.low) * share
    };
    Plant {
        governor_time: time(times.governor),
        turbine_time: time(times.turbine),
        lead_time: time(times.lead),
        lag_time: time(times.lag),
        ..plant()
    }
}

struct Charger {
    response: Response,
    phase: usize,
    /// Commands with the moments at which they were decided.
    commands: Vec<f64>,
    late: usize,
    command: f64,
}

/// Runs one fleet; the largest share of the way from the middle of the bounds to their edge that f
/// took.
pub(crate) fn run(
    seed: u64,
    malice: Malice,
    chargers: usize,
    setting: Setting,
    found: &Found,
) -> f64 {
    let Setting { loss, governor, .. } = setting;
    // The first ones, rounded down: no more than the share.
    let hostile = (setting.hostile_share * chargers as f64 + 1e-9).floor() as usize;
    let mut rng = Pcg64::seed_from_u64(seed);
    let plant = drawn(setting.times, seed);
    let steps_per_tick = (TICK_S / H).round() as usize;
    let corner = rng.random_bool(0.5);
    let mut x = [0.02, 0.1, 0.06, 0.06].map(|r: f64| {
        if corner {
            if rng.random_bool(0.5) { r } else { -r }
        } else {
            r * (2.0 * rng.random::<f64>() - 1.0)
        }
    });
    governor.limit(&mut x);
    let w = loss.low + (loss.high - loss.low) * rng.random::<f64>();
    // Each stage where the adversary wants it, at an end of its time or between.
    let moments: Vec<(f64, f64)> = STAGES
        .iter()
        .map(|(at_s, gw)| {
            let off = NEAR_S * [-1.0, 1.0, 2.0 * rng.random::<f64>() - 1.0][seed as usize % 3];
            ((at_s + off).max(0.0), *gw)
        })
        .collect();
    let lost = |t: f64| {
        if setting.staged {
            moments
                .iter()
                .filter(|(at_s, _)| *at_s <= t)
                .map(|(_, gw)| gw)
                .sum()
        } else {
            w
        }
    };
    // In stages the bounds in time begin at the last stage's latest moment.
    let tube_from_s = if setting.staged {
        stages()
            .iter()
            .map(|stage| stage.latest_s)
            .fold(0.0, f64::max)
    } else {
        0.0
    };
    let law = ResponseLaw {
        smallest_change_ppm: setting.smallest_change_ppm,
        ..LAW
    };
    let mut fleet: Vec<Charger> = (0..chargers)
        .map(|serial| Charger {
            response: Response::new(law, 100, LevelOffset::of_serial(serial as u32)),
            phase: rng.random_range(0..steps_per_tick),
            commands: Vec::new(),
            late: 0,
            command: 0.0,
        })
        .collect();
    // f at every step, with enough of the rest before the event for meter and slope.
    let lead = (2.0 / H) as usize;
    let mut f = vec![x[0]; lead + 1];
    let window = (METER_S / H).round() as usize;
    let longest = (DELAY_S[1] / H).round() as usize;
    let shortest = (DELAY_S[0] / H).round() as usize;
    let age_most = (AGE_S / H).floor() as usize;
    let mut worst = 0.0f64;
    let duration = tube_from_s + found.tube.len() as f64 * found.step_s;
    // The law runs before the event too, so that its window is full.
    for step in 0..((1.0 + duration) / H) as usize {
        let t = step as f64 * H - 1.0;
        let now = f.len() - 1;
        let falling = f[now] < f[now - 1];
        let up = match malice {
            Malice::Random | Malice::TwoGroups => rng.random_bool(0.5),
            Malice::LowAndLate => false,
            Malice::HighAndEarly => true,
            Malice::Pump => !falling,
            Malice::Swing(half_s) => ((t.max(0.0) / half_s) as usize).is_multiple_of(2),
        };
        let mut sum = 0.0;
        for (index, charger) in fleet.iter_mut().enumerate() {
            let first_group = index * 2 < chargers;
            let up = match malice {
                Malice::TwoGroups => first_group == falling,
                _ => up,
            };
            if step % steps_per_tick == charger.phase {
                let age = if rng.random_bool(0.5) {
                    age_most
                } else {
                    rng.random_range(0..=age_most)
                };
                let end = now - age;
                let mean = f[end - window..=end].iter().sum::<f64>() / (window + 1) as f64;
                let error = match malice {
                    Malice::Random => READING_HZ * (2.0 * rng.random::<f64>() - 1.0),
                    _ if up => -READING_HZ,
                    _ => READING_HZ,
                };
                // A reading as large as the errors allow, rounded towards its mean.
                let reading = ((mean + 0.99 * error) * 1e6).floor() as i32;
                charger.command = f64::from(charger.response.step(reading).ppm()) / 1e6;
                charger.late = match malice {
                    Malice::Random => rng.random_range(shortest..=longest),
                    Malice::LowAndLate => longest,
                    Malice::HighAndEarly => shortest,
                    Malice::TwoGroups => {
                        if first_group {
                            shortest
                        } else {
                            longest
                        }
                    }
                    Malice::Pump | Malice::Swing(_) => longest,
                };
            }
            charger.commands.push(charger.command);
            let commands = &charger.commands;
            let back = |late: usize| {
                commands
                    .len()
                    .checked_sub(1 + late)
                    .map_or(0.0, |at| commands[at])
            };
            // An adversary takes whichever command under way suits it.
            let command = match malice {
                Malice::Pump | Malice::Swing(_) | Malice::TwoGroups => {
                    let under_way = (shortest..=longest).map(back);
                    if up {
                        under_way.fold(0.0, f64::max)
                    } else {
                        under_way.fold(1.0, f64::min)
                    }
                }
                _ => back(charger.late),
            };
            let delivery = match malice {
                Malice::Random => 1.0 + DELIVERY * (2.0 * rng.random::<f64>() - 1.0),
                _ if up => 1.0 + DELIVERY,
                _ => 1.0 - DELIVERY,
            };
            // The grid was at rest with what hostile chargers gave before the event: nothing.
            sum += match index < hostile {
                true => f64::from(u8::from(up && t >= 0.0)),
                false => (command * delivery).min(1.0),
            };
        }
        if t < 0.0 {
            // The rest before the event.
            f.push(x[0]);
            continue;
        }
        let net = FLEET_GW * sum / chargers as f64 - lost(t);
        let slope = |x: [f64; 4]| governor.derivative(&plant, &x, net);
        let k1 = slope(x);
        let at = |k: [f64; 4], h: f64| std::array::from_fn(|axis| x[axis] + h * k[axis]);
        let k2 = slope(at(k1, H / 2.0));
        let k3 = slope(at(k2, H / 2.0));
        let k4 = slope(at(k3, H));
        x = std::array::from_fn(|axis| {
            x[axis] + H / 6.0 * (k1[axis] + 2.0 * k2[axis] + 2.0 * k3[axis] + k4[axis])
        });
        governor.limit(&mut x);
        f.push(x[0]);
        let since_s = t + H - tube_from_s;
        let tube = if since_s < 0.0 {
            found.f
        } else {
            let index = ((since_s / found.step_s) as usize).min(found.tube.len() - 1);
            found.tube[index].join(found.tube[index.saturating_sub(1)])
        };
        assert!(
            tube.contains(x[0]),
            "seed {seed} {malice:?} {chargers} chargers, {w} GW, {governor:?}: f = {} at {t:.3} s, bounds {tube:?}",
            x[0]
        );
        let middle = 0.5 * (tube.low + tube.high);
        worst = worst.max((x[0] - middle).abs() / (tube.high - middle));
    }
    worst
}
