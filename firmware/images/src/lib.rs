//! The product without its board: what the images and their repetition on the host share.
//!
//! | module | holds |
//! |---|---|
//! | [`output`] | what drives the car or the power stage, by the settings |
//! | [`desk`] | the service link beside the charger: settings, orders, updates, who it is |
//!
//! The images are `holdfast.rs` with a board of `boards/`; `pil.rs` and `bare.rs` are for
//! measuring. Nothing here allocates, recurses or panics; nothing is `unsafe`.
#![no_std]
#![forbid(unsafe_code)]

pub mod output;

pub mod desk;
