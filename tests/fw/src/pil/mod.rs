//! Processor in the loop: the `pil` image in QEMU, the same session on the host, and a grid between
//! them.

pub mod machine;
pub mod mains;
pub mod qemu;
pub mod record;
pub mod run;
pub mod scenario;
