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

    /// A step of a table's update: takes what was sent, writes its answer into the buffer and gives
    /// its length. The place for an update; `None` where there is none.
    fn update(&mut self, sent: &[u8], answer: &mut [u8]) -> Option<usize> {
        let _ = (sent, answer);
        None
    }
}
