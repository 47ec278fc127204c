//! What was measured on the reference core, as committed by `cargo fw costs --bless`.

use firmware::table::{CRC_LEN, TableView};
use model::budget::Measured;

const SIZES: &str = include_str!("../../../../firmware/expected/sizes.txt");
const RUN: &str = include_str!("../../../../firmware/expected/run.txt");

/// The figures that are known for a table.
pub fn measured(table: &TableView<'_>) -> Measured {
    let crc = table.bytes().last_chunk::<CRC_LEN>();
    let crc = crc.map(|crc| format!("CRC {:08x}", u32::from_le_bytes(*crc)));
    let is_it = crc.is_some_and(|crc| RUN.lines().any(|line| line.ends_with(&crc)));
    Measured {
        core_bytes: figure(SIZES, "bare code and constants"),
        lookup_instructions: figure(RUN, "lookup with quantiser").filter(|_| is_it),
    }
}

/// The number on the line that begins with a name.
fn figure(text: &str, name: &str) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(name))?;
    rest.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_committed_files_have_the_figures() {
        let shipped = include_bytes!("../../../../firmware/tables/paper-bi.bin");
        let found = measured(&TableView::parse(shipped).unwrap());
        assert!(found.core_bytes.unwrap() > 4096);
        assert!(found.lookup_instructions.unwrap() > 100);
        let other = include_bytes!("../../../../firmware/tables/gb-uni.bin");
        let found = measured(&TableView::parse(other).unwrap());
        assert_eq!(found.lookup_instructions, None);
    }

    #[test]
    fn a_figure_is_the_first_number_of_its_line() {
        let text =
            "# bare\nbare .text   17 bytes\nbare code and constants   1234 bytes  goal at most 5\n";
        assert_eq!(figure(text, "bare code and constants"), Some(1234));
        assert_eq!(figure(text, "lookup"), None);
    }
}
