//! The CRC that ends an image.

/// CRC-32 as in Ethernet and zip (polynomial 0x04C11DB7 reflected).
const CRC: crc::Crc<u32, crc::NoTable> = crc::Crc::<u32, crc::NoTable>::new(&crc::CRC_32_ISO_HDLC);

/// CRC-32 of a stretch of bytes, as the table's trailer stores it.
pub fn checksum(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}
