//! Plants by which tools of the field are compared, and one of our own field with more states; the
//! engine knows none of them.
//!
//! | yardstick | states | dynamics | game |
//! |---|---|---|---|
//! | [`boost_converter`] | 2 | switched affine, two modes | safety |
//! | [`unicycle`] | 3 | non-linear, growth bound | reach a place, around obstacles |
//! | [`limited_governor`] | 2 | non-linear, growth bound | safety |
//! | [`two_areas`] | 5 | linear, two inputs, two losses | reach and stay |
//!
//! [`boost_converter`] and [`unicycle`] have SCOTS' parameters (version 0.2, `examples/dcdc` and
//! `examples/vehicle`), so that counts can be compared.

pub mod boost_converter;
pub mod limited_governor;
pub mod two_areas;
pub mod unicycle;
