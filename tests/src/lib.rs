//! What the cross-crate tests and the `fw` tool share.
//!
//! | module | what |
//! |---|---|
//! | [`mod@reference`] | a slow, obvious game solver: the engine's oracle |
//! | [`stand_in`] | a small table made by hand, for tests that need a table but no synthesis |
//! | [`images`] | the Arm images: building, sections, symbols, BIN and HEX |
//! | [`table_fit`] | which table goes into which image, and what is proven of it |
//! | [`pil`] | processor in the loop: QEMU, the lock-step link, scenarios, comparison with the host |
//! | [`costs`] | flash, RAM, stack and instructions, compared with what is committed |
#![forbid(unsafe_code)]

pub mod costs;
pub mod images;
pub mod pil;
pub mod reference;
pub mod scots_examples;
pub mod stand_in;
pub mod table_fit;
pub mod transition_lists;

use std::path::PathBuf;

/// The workspace's root: the folder above this package.
pub fn root() -> PathBuf {
    let package = std::env::var_os("CARGO_MANIFEST_DIR")
        .map_or_else(|| env!("CARGO_MANIFEST_DIR").into(), PathBuf::from);
    package
        .parent()
        .map_or_else(|| package.clone(), PathBuf::from)
}
