//! The emulated boards.

/// An emulated board that the `pil` image runs on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Machine {
    /// Rust target of the code.
    pub target: &'static str,
    /// What a person calls it.
    pub name: &'static str,
    /// The emulator.
    pub(super) qemu: &'static str,
    /// Its arguments that name the board.
    pub(super) board: &'static [&'static str],
}

/// The reference board's STM32F405 with its own code.
pub const CORTEX_M4: Machine = Machine {
    target: crate::images::TARGET,
    name: "Cortex-M4F",
    qemu: "qemu-system-arm",
    board: &["-machine", "netduinoplus2"],
};

/// The same board with code for Cortex-M0+, whose instructions are a subset of its own: floating
/// point is software.
pub const CORTEX_M0: Machine = Machine {
    target: "thumbv6m-none-eabi",
    name: "Cortex-M0+ code",
    ..CORTEX_M4
};

/// A RISC-V core without floating point and without atomics: either would be an illegal instruction
/// there.
pub const RISCV: Machine = Machine {
    target: "riscv32imc-unknown-none-elf",
    name: "RV32IMC",
    qemu: "qemu-system-riscv32",
    board: &[
        "-machine",
        "virt",
        "-cpu",
        "rv32,f=false,d=false,a=false",
        "-bios",
        "none",
    ],
};
