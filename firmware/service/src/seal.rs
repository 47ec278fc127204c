//! Who may change what a charger does: HMAC-SHA-256 with the charger's own key.
//!
//! Every seal is over a word for what it is, the charger's serial number, the challenge's number,
//! its nonce, and the bytes concerned. The words have the same length, so that no two inputs of
//! different kinds are the same bytes. A number is given once in a charger's life, so a seal is
//! good for one order, on one charger, once.
//!
//! The nonce is the key's own function of the number. Nobody without the key can tell it before the
//! charger does, so no order can be sealed before its challenge, even with the help of a tool that
//! seals whatever it is asked to. No source of random numbers is needed.

use hmac::{Hmac, KeyInit, Mac};
use settings::store::KEY_LEN;
use sha2::Sha256;

/// Bytes of a seal.
pub const MAC_LEN: usize = 32;
/// Bytes of a nonce.
pub const NONCE_LEN: usize = 16;

/// Words of the kinds of seals.
const NONCE: &[u8; 8] = b"HfNonce1";
const ORDER: &[u8; 8] = b"HfOrder1";
const DONE: &[u8; 8] = b"HfDone 1";
const MASK: &[u8; 8] = b"HfMask 1";

/// A charger's key.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct DeviceKey([u8; KEY_LEN]);

impl core::fmt::Debug for DeviceKey {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("DeviceKey(..)")
    }
}

/// What an order is sealed for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Challenge {
    /// The charger's serial number.
    pub serial: u32,
    /// Number of the challenge.
    pub number: u32,
    /// Its nonce.
    pub nonce: [u8; NONCE_LEN],
}

impl DeviceKey {
    /// A key.
    pub const fn new(bytes: [u8; KEY_LEN]) -> Self {
        Self(bytes)
    }

    /// Its bytes.
    pub const fn bytes(&self) -> &[u8; KEY_LEN] {
        &self.0
    }

    fn hmac(&self, parts: &[&[u8]]) -> Hmac<Sha256> {
        // A key of a block or less is padded with zeros, as HMAC has it; 64 bytes always suit.
        let mut block = hmac::digest::Key::<Hmac<Sha256>>::default();
        for (to, from) in block.iter_mut().zip(self.0) {
            *to = from;
        }
        let mut mac = Hmac::<Sha256>::new(&block);
        for part in parts {
            mac.update(part);
        }
        mac
    }

    fn over(&self, word: &[u8; 8], challenge: &Challenge, bytes: &[u8]) -> Hmac<Sha256> {
        let serial = challenge.serial.to_le_bytes();
        let number = challenge.number.to_le_bytes();
        self.hmac(&[word, &serial, &number, &challenge.nonce, bytes])
    }

    /// The challenge of a number.
    pub fn challenge(&self, serial: u32, number: u32) -> Challenge {
        let mac = self.hmac(&[NONCE, &serial.to_le_bytes(), &number.to_le_bytes()]);
        let whole: [u8; MAC_LEN] = mac.finalize().into_bytes().into();
        let mut nonce = [0; NONCE_LEN];
        for (to, from) in nonce.iter_mut().zip(whole) {
            *to = from;
        }
        Challenge {
            serial,
            number,
            nonce,
        }
    }

    /// The seal of an order's record.
    pub fn order_mac(&self, challenge: &Challenge, order: &[u8]) -> [u8; MAC_LEN] {
        self.over(ORDER, challenge, order)
            .finalize()
            .into_bytes()
            .into()
    }

    /// Whether a seal is an order's, compared in constant time.
    pub fn is_order_mac(&self, challenge: &Challenge, order: &[u8], mac: &[u8; MAC_LEN]) -> bool {
        self.over(ORDER, challenge, order).verify_slice(mac).is_ok()
    }

    /// The charger's word that the order was carried out.
    pub fn done_mac(&self, challenge: &Challenge, order: &[u8]) -> [u8; MAC_LEN] {
        self.over(DONE, challenge, order)
            .finalize()
            .into_bytes()
            .into()
    }

    /// Whether the word is the charger's, compared in constant time.
    pub fn is_done_mac(&self, challenge: &Challenge, order: &[u8], mac: &[u8; MAC_LEN]) -> bool {
        self.over(DONE, challenge, order).verify_slice(mac).is_ok()
    }

    /// Another key under this challenge's mask; a second time it takes the mask off.
    #[must_use]
    pub fn mask(&self, challenge: &Challenge, other: &Self) -> Self {
        let mask: [u8; KEY_LEN] = self
            .over(MASK, challenge, &[])
            .finalize()
            .into_bytes()
            .into();
        let mut masked = other.0;
        for (byte, mask) in masked.iter_mut().zip(mask) {
            *byte ^= mask;
        }
        Self(masked)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The second test case of RFC 4231 with a key that is shorter than a block, and this one's
    /// length: the key of its fourth case, 25 bytes, ended with zeros, is the same block.
    #[test]
    fn it_is_hmac_sha_256() {
        let mut key = [0; KEY_LEN];
        for (n, byte) in key.iter_mut().take(25).enumerate() {
            *byte = n as u8 + 1;
        }
        let mac: [u8; MAC_LEN] = DeviceKey::new(key)
            .hmac(&[&[0xCD; 50]])
            .finalize()
            .into_bytes()
            .into();
        let expected = [
            0x82, 0x55, 0x8A, 0x38, 0x9A, 0x44, 0x3C, 0x0E, 0xA4, 0xCC, 0x81, 0x98, 0x99, 0xF2,
            0x08, 0x3A, 0x85, 0xF0, 0xFA, 0xA3, 0xE5, 0x78, 0xF8, 0x07, 0x7A, 0x2E, 0x3F, 0xF4,
            0x67, 0x29, 0x66, 0x5B,
        ];
        assert_eq!(mac, expected);
    }

    #[test]
    fn a_seal_is_good_for_its_order_challenge_charger_and_kind_alone() {
        let key = DeviceKey::new([7; KEY_LEN]);
        let challenge = key.challenge(1, 2);
        let mac = key.order_mac(&challenge, b"order");
        assert!(key.is_order_mac(&challenge, b"order", &mac));
        assert!(!key.is_order_mac(&challenge, b"orde", &mac));
        assert!(!key.is_order_mac(&key.challenge(1, 3), b"order", &mac));
        assert!(!key.is_order_mac(&key.challenge(2, 2), b"order", &mac));
        assert!(!key.is_done_mac(&challenge, b"order", &mac));
        assert!(!DeviceKey::new([8; KEY_LEN]).is_order_mac(&challenge, b"order", &mac));
        for bit in 0..8 * MAC_LEN {
            let mut forged = mac;
            forged[bit / 8] ^= 1 << (bit % 8);
            assert!(!key.is_order_mac(&challenge, b"order", &forged));
        }
        let other = DeviceKey::new([9; KEY_LEN]);
        let masked = key.mask(&challenge, &other);
        assert!(masked != other);
        assert_eq!(key.mask(&challenge, &masked), other);
        assert_eq!(std::format!("{key:?}"), "DeviceKey(..)");
    }
}
