//! What a service must be told of the charger around it.

use firmware::telemetry::{Frame, TableId};

/// What the charger around it knows.
///
/// The implementation must answer at once.
pub trait Facts {
    /// Build of the firmware: version and commit. What is too long is cut.
    fn build(&self) -> &str;

    /// Serial number.
    fn serial(&self) -> u32;

    /// The table, if one was accepted.
    fn table(&self) -> Option<TableId>;

    /// The last tick.
    fn frame(&self) -> Option<Frame>;

    /// Whether settings and keys may be written now, and the processor stand still for as long as a
    /// page takes to be erased. `false` while that would be missed: what writes is refused then.
    fn may_write(&self) -> bool {
        true
    }

    /// The same for a block of challenges, which is written once in [`crate::device::BLOCK`] orders
    /// and seldom erases a page.
    fn may_count(&self) -> bool {
        self.may_write()
    }

    /// A step of a table's update: takes what was sent, writes its answer into the buffer and gives
    /// its length. The place for an update; `None` where there is none.
    fn update(&mut self, sent: &[u8], answer: &mut [u8]) -> Option<usize> {
        let _ = (sent, answer);
        None
    }
}
