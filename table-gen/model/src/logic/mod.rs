//! Requirements as temporal logic: formulas over the frequency and the loss.
//!
//! ```text
//! G(f >= -0.8) & G(!(f in I1) -> F[<=60s] f in I1) & G((f in I1 & !(f in I2)) -> F[<=60s] f in I2)
//! ```
//!
//! | step | module |
//! |---|---|
//! | text to formula | [`mod@parse`] |
//! | formula to text, so that parsing gives the same formula again | [`formula`] |
//!
//! # The language
//! `f` is the deviation from 50 Hz \[Hz\], `loss` the lost infeed \[GW\]. Atoms compare a signal
//! with a number (`<=`, `>=`, `<`, `>`) or ask for membership in a closed interval, written out (`f
//! in [-0.3, 0]`) or by name (`f in I1`). Operators, from the one that binds least: `->` (to the
//! right), `|`, `&`, `U`, then the prefixes `!`, `G`, `F`. The temporal ones take a bound, as in
//! `F[<=60s]`. Words and symbols of the literature are understood on input: `always`, `eventually`,
//! `not`, `and`, `or`, `implies`, `until`.

pub mod formula;
pub mod parse;

pub use formula::{Comparison, Formula, Interval, Signal};
pub use parse::{ParseError, parse};
