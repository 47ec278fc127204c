//! Command-line interface.
fn main() {}
