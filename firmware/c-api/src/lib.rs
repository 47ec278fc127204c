//! The limit provider of [`firmware::limit_provider`] for C and C++.
//!
//! | module | holds |
//! |---|---|
//! | [`numbers`] | enumerations and bits, as C sees them |
//! | [`records`] | what is passed: configuration, input, output, facts of a table |
//! | [`settings`] | a configuration, checked |
//! | [`provider`] | the functions of the provider |
//! | [`captures`] | the functions of a window of zero crossings |
//! | [`table`] | the functions that ask a table |
//!
//! All memory is the caller's. There are no globals, nothing is allocated and nothing panics. The
//! functions may be called from any one context at a time for each piece of memory.
//!
//! This package is the only place of the library with `unsafe`: it begins where a pointer comes
//! from C, and ends in `memory`. The static library for a bare core brings a panic handler, which C
//! needs and nothing reaches. A Rust program for such a core takes `firmware` instead.
#![cfg_attr(target_os = "none", no_std)]

pub mod captures;
mod memory;
pub mod numbers;
pub mod provider;
pub mod records;
pub mod settings;
pub mod table;

/// Nothing panics; a static library must say all the same what would happen.
#[cfg(target_os = "none")]
#[panic_handler]
fn panic(_info: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
