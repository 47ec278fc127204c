//! A plant that is truly non-linear through the engine: its growth bound checked by sampling, and
//! the game's answer tried on the plant itself.

use model::governor::Governor;
use proptest::prelude::*;
use synth::abstraction::Abstraction;
use synth::abstraction::growth::GrowthBound;
use synth::abstraction::guard::Unguarded;
use synth::game::Unwatched;
use synth::game::safety::safety;
use synth::yardsticks::limited_governor::{
    BAND_HZ, GOVERNOR, INPUTS, LimitedGrid, PERIOD_S, abstraction, derivative, safe, shape,
};

/// The plant itself: steps of 20 µs, which err by at most 1/25 of what the radius allows the
/// centre.
fn exact(governor: &Governor, x: [f64; 2], u: f64) -> [f64; 2] {
    let steps = 25_000;
    let h = PERIOD_S / f64::from(steps);
    let [low, high] = governor.output_gw;
    let mut x = x;
    for _ in 0..steps {
        let [df, dg] = derivative(governor, x, u);
        x = [x[0] + h * df, (x[1] + h * dg).clamp(low, high)];
    }
    x
}

/// Inside a cell, corners included.
fn within(shape: &model::grid_shape::GridShape<2>, cell: [u32; 2], at: [f64; 2]) -> [f64; 2] {
    std::array::from_fn(|d| shape.lower[d] + shape.width[d] * (f64::from(cell[d]) + at[d]))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    /// Any point of a box goes into the box that the growth bound gives, large boxes too.
    #[test]
    fn the_growth_bound_holds_every_sample(
        f in -0.45f64..0.0,
        g in 0.0f64..1.0,
        r in [0.0f64..0.1, 0.0f64..0.3],
        at in [-1.0f64..=1.0, -1.0f64..=1.0],
        corner in any::<bool>(),
        input in 0usize..3,
    ) {
        let plant = LimitedGrid::new(GOVERNOR);
        let at = if corner { at.map(f64::signum) } else { at };
        let [low, high] = GOVERNOR.output_gw;
        let point = [f + r[0] * at[0], (g + r[1] * at[1]).clamp(low, high)];
        let centre = plant.centre([f, g], input);
        let radius = plant.radius([f, g], r, input);
        let found = exact(&GOVERNOR, point, INPUTS[input]);
        for d in 0..2 {
            prop_assert!((found[d] - centre[d]).abs() <= radius[d], "{d}: {found:?} {centre:?} {radius:?}");
        }
    }
}

/// A bound that nothing comes near would prove little. A state above the dead band in a box of f
/// alone: g moves apart by nearly |K|/T_G r τ, which is the bound's first term.
#[test]
fn the_growth_bound_is_not_far_off() {
    let plant = LimitedGrid::new(Governor {
        rate_gw_per_s: f64::INFINITY,
        ..GOVERNOR
    });
    let governor = Governor {
        rate_gw_per_s: f64::INFINITY,
        ..GOVERNOR
    };
    let (x, r) = ([-0.1, 0.2], [0.02, 0.0]);
    let radius = plant.radius(x, r, 1);
    let moved = exact(&governor, [x[0] - r[0], x[1]], INPUTS[1]);
    let share = (moved[1] - plant.centre(x, 1)[1]).abs() / radius[1];
    assert!(share > 0.8, "{share}");
}

#[test]
fn the_game_on_limited_governors_holds_on_the_plant() {
    let engine = abstraction(GOVERNOR);
    let solution = safety(&engine, &safe(), &Unguarded, &Unwatched).unwrap();
    let shape = shape();
    assert!(
        solution.winning > 0 && solution.winning < shape.cells(),
        "{}",
        solution.winning
    );
    // With governors that have no limits more cells can be kept: the limits are in the game.
    let linear = abstraction(Governor {
        output_gw: GOVERNOR.output_gw,
        ..Governor::LINEAR
    });
    let unlimited = safety(&linear, &safe(), &Unguarded, &Unwatched).unwrap();
    assert!(
        unlimited.winning > solution.winning,
        "{}",
        unlimited.winning
    );
    // 30 s of the plant itself from every seventh winning cell, always with the first allowed
    // input.
    let mut tried = 0;
    for index in (0..shape.cells())
        .filter(|index| solution.masks[*index] != 0)
        .step_by(7)
    {
        let mut x = within(&shape, shape.cell(index), [0.9, 0.1]);
        // Cells astride a limit of g have states beyond it, which no grid takes.
        x[1] = x[1].clamp(GOVERNOR.output_gw[0], GOVERNOR.output_gw[1]);
        for _ in 0..60 {
            let cell: [u32; 2] =
                std::array::from_fn(|d| ((x[d] - shape.lower[d]) / shape.width[d]).floor() as u32);
            let mask = solution.masks[shape.index(cell)];
            assert_ne!(mask, 0, "{x:?}");
            let input = mask.trailing_zeros() as usize;
            x = engine_step(x, input);
            assert!(x[0] >= BAND_HZ[0] && x[0] <= BAND_HZ[1], "{x:?}");
        }
        tried += 1;
    }
    assert!(tried > 10, "{tried}");
    assert_eq!(engine.inputs(), INPUTS.len());
}

fn engine_step(x: [f64; 2], input: usize) -> [f64; 2] {
    LimitedGrid::new(GOVERNOR).centre(x, input)
}
