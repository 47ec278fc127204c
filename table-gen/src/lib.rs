//! The host side of Holdfast.
#![forbid(unsafe_code)]
