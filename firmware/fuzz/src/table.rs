//! Any flash region: found, rejected or accepted; an accepted table answers every cell.

use firmware::flash;
use firmware::grid::Cell;
use firmware::table::{CRC_LEN, Law, TableView, checksum, field};

/// Tables of the chargers that the other targets play to: laws from games, and a law that is always
/// on.
pub const SHIPPED: [&[u8]; 2] = [
    include_bytes!("../../tables/paper-bi.bin"),
    include_bytes!("../../tables/gb-bi.bin"),
];

/// Reads the region, its length and CRC made right; whether the table was accepted.
pub fn run(region: &[u8]) -> bool {
    let mut image = flash::image(region).to_vec();
    // A right length and CRC let the fuzzer past the first checks.
    if image.len() > field::LENGTH.end + CRC_LEN {
        let length = image.len() as u32;
        image[field::LENGTH].copy_from_slice(&length.to_le_bytes());
        let body = image.len() - CRC_LEN;
        let crc = checksum(&image[..body]);
        image[body..].copy_from_slice(&crc.to_le_bytes());
    }
    let Ok(table) = TableView::parse(&image) else {
        return false;
    };
    let count = table.header().grid.count();
    for n in 0..64u16 {
        let cell = Cell([0, 1, 2, 3].map(|axis| n.wrapping_mul(7919 + axis as u16) % count[axis]));
        for law in Law::ALL {
            let level = table.lookup(law, cell);
            assert!(level.is_none_or(|level| level < table.header().levels));
        }
    }
    for law in Law::ALL {
        let far = Cell([u16::MAX; 4]);
        assert_eq!(table.lookup(law, far), None);
    }
    true
}
