//! The table in its flash region.

use crate::table::{HEADER_LEN, field};

/// The table's image at the start of a flash region, which may be larger than the table and may
/// have been erased or written half. The header's length delimits it; a length that cannot be gives
/// the whole region back, for the parser to reject with the reason.
pub fn image(region: &[u8]) -> &[u8] {
    let length = region
        .get(field::LENGTH)
        .and_then(<[u8]>::first_chunk::<4>)
        .map_or(0, |bytes| u32::from_le_bytes(*bytes) as usize);
    if length < HEADER_LEN {
        return region;
    }
    region.get(..length).unwrap_or(region)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::{TableError, TableView};

    #[test]
    fn an_erased_or_foreign_region_is_rejected_with_its_reason() {
        let erased = [0xFF; 1024];
        assert_eq!(image(&erased).len(), 1024);
        let found = [0xFF; 4];
        assert_eq!(
            TableView::parse(image(&erased)).err(),
            Some(TableError::BadMagic { found })
        );
        let zero = [0; 1024];
        assert_eq!(image(&zero).len(), 1024);
        assert_eq!(image(&[]).len(), 0);
    }

    #[test]
    fn the_header_delimits_the_image() {
        let mut region = [0xFF; 1024];
        region[field::LENGTH].copy_from_slice(&300u32.to_le_bytes());
        assert_eq!(image(&region).len(), 300);
        region[field::LENGTH].copy_from_slice(&1025u32.to_le_bytes());
        assert_eq!(image(&region).len(), 1024);
    }
}
