//! The laws of a table by name.

/// Laws that a table may hold.
pub const LAWS: usize = 3;

/// A law of the table, in the order of the directory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Law {
    /// Reaches I1.
    C1 = 0,
    /// Reaches I2.
    C2 = 1,
    /// Stays in I2.
    Hold = 2,
}

impl Law {
    /// All laws in the order of the directory.
    pub const ALL: [Self; LAWS] = [Self::C1, Self::C2, Self::Hold];

    /// The law's name, as people and JSON read it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::C1 => "C1",
            Self::C2 => "C2",
            Self::Hold => "Hold",
        }
    }
}
