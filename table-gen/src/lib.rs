//! The host side of Holdfast.
#![forbid(unsafe_code)]
pub mod abstraction;
pub mod compress;
pub mod flow;
pub mod game;
pub mod grid_shape;
pub mod interval;
pub mod plant;
pub mod spec;
pub mod synthesis;
pub mod usage;
