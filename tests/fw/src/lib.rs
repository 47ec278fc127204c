//! The images of Holdfast: what the `fw` command builds, runs and measures.
//!
//! | module | what |
//! |---|---|
//! | [`images`] | the Arm images: building, sections, symbols, BIN and HEX |
//! | [`table_fit`] | which table goes into which image, and what is proven of it |
//! | [`pil`] | processor in the loop: QEMU, the lock-step link, scenarios, the host beside it |
//! | [`c_api`] | the C interface: libraries, the C program in QEMU, costs, the CMake package |
//! | [`board`] | the unmodified images on an emulated board, and the same runs on the host |
//! | [`lookups`] | the dearest lookup of every shipped table |
//! | [`figures`] | figures with goals, as they are committed |
//! | [`costs`] | flash, RAM, stack and instructions, compared with what is committed |
#![forbid(unsafe_code)]

pub mod board;
pub mod c_api;
pub mod costs;
pub mod figures;
pub mod images;
pub mod lookups;
pub mod pil;
pub mod table_fit;

use std::path::PathBuf;

/// The workspace's root: two folders above this package.
pub fn root() -> PathBuf {
    let package = std::env::var_os("CARGO_MANIFEST_DIR")
        .map_or_else(|| env!("CARGO_MANIFEST_DIR").into(), PathBuf::from);
    package
        .ancestors()
        .nth(2)
        .map_or_else(|| package.clone(), PathBuf::from)
}
