//! Ranks of an MPI job: `mpirun -n 4 table-gen synth SPEC` with a `table-gen` that was built with
//! the feature `mpi`.
//!
//! A package of its own, so that nothing else is compiled anew for the feature, and nobody without
//! it needs MPI. It is written for Open MPI; building it takes its headers and libclang (Debian:
//! `libopenmpi-dev libclang-dev`).
#![forbid(unsafe_code)]

#[cfg(feature = "mpi")]
mod world;
#[cfg(feature = "mpi")]
pub use world::World;
