//! The list of microcontrollers: `data/microcontrollers.csv`, with the source of every flash size.

use model::budget::Microcontroller;

/// The list as it is shipped.
const LIST: &str = include_str!("../../../data/microcontrollers.csv");

/// All of them, in the order of the list.
pub fn all() -> Vec<Microcontroller> {
    // A row that cannot be read is left out; a test keeps the shipped list whole.
    csv::Reader::from_reader(LIST.as_bytes())
        .deserialize()
        .filter_map(Result::ok)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_is_read_and_has_a_source() {
        let all = all();
        assert_eq!(all.len(), LIST.lines().count() - 1);
        assert!(
            all.iter()
                .all(|part| part.flash_kib > 0 && !part.source.is_empty())
        );
    }
}
