//! The event: the loss begins between two ticks, and nobody knows where.
//!
//! The first tick after the event comes a time δ in `[0, tick)` later; until then the input is none
//! (level 0). The states at that tick are a curve over δ for each initial state. It is cut into
//! pieces; on each, the curve lies on the chord of its ends but for `h²/8 sup|x''|`.

use super::closed_loop::Model;
use super::held_input::HeldInput;
use super::zonotope::Zonotope;
use model::flow::{apply, product, tube};
use model::interval::Interval;
use model::plant::STATES;

/// Pieces of the curve over δ; with a tick of 0.1 s the chord then errs by less than 0.02 mHz and
/// 0.02 MW.
const PIECES: u32 = 8;

/// Sets that together hold every state at the first tick after the event, in the order of δ.
pub(super) fn first_tick(model: &Model) -> Vec<Zonotope> {
    let start = Zonotope::of_box(&model.initial);
    let Some(drive) = model.drives.first().copied() else {
        return Vec::new();
    };
    let h = (model.tick_s / f64::from(PIECES)).next_up();
    let within = tube(&model.a, h);
    let square = product(&model.a, &model.a);
    let magnitude = model.initial.map(Interval::magnitude);
    let eighth = h * h / 8.0 * (1.0 + 1e-12);
    let mut pieces = Vec::new();
    let mut from = start.clone();
    let mut at = model::flow::Flow::identity();
    for piece in 1..=PIECES {
        let segment = HeldInput::new(&model.a, &model.b, h * f64::from(piece));
        let to = start.flown(&segment, drive);
        let flows = product(&within, &at.phi);
        let bend = product(&square, &flows);
        let turn = apply(&model.a, &apply(&flows, &model.b));
        let mut widen = [0.0; STATES];
        for d in 0..STATES {
            let mut sum = turn[d].magnitude() * drive.mid.abs();
            for j in 0..STATES {
                sum += bend[d][j].magnitude() * magnitude[j];
            }
            // Ten operations on non-negative numbers: relative error below 12 roundings.
            widen[d] = (sum * eighth * (1.0 + 12.0 * f64::EPSILON)).next_up();
        }
        pieces.push(Zonotope::chord(&from, &to, widen));
        at = segment.flow;
        from = to;
    }
    pieces
}
