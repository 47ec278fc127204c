//! What the cross-crate tests share.
//!
//! | module | what |
//! |---|---|
//! | [`mod@reference`] | a slow, obvious game solver: the engine's oracle |
//! | [`stand_in`] | a small table made by hand, for tests that need a table but no synthesis |
//! | [`testing`] | specs, their tables, the recorded event |
#![forbid(unsafe_code)]

pub mod reference;
pub mod scots_examples;
pub mod stand_in;
pub mod testing;
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
