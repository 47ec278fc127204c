//! The signature, and who is believed.
//!
//! Ed25519 by `salty`, which is made for microcontrollers: on a Cortex-M4 it takes a quarter of
//! what `ed25519-dalek` takes. The host signs with the latter, so two implementations agree on
//! every container.

use crate::container::{Container, SIGNATURE_LEN};

/// Bytes of a public key.
pub const KEY_LEN: usize = 32;

/// Says whether a signature is one over these bytes.
pub trait Verify {
    /// Whether the trusted party signed `message`.
    fn verifies(&self, message: &[u8], signature: &[u8; SIGNATURE_LEN]) -> bool;
}

/// A public Ed25519 key that is believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PublicKey(pub [u8; KEY_LEN]);

impl PublicKey {
    /// The key for experiments: its private half, 32 bytes of 0x48, is known to everybody who
    /// reads this line.
    pub const DEVELOPMENT: Self = Self([
        0xD4, 0xEE, 0xC1, 0x86, 0x9F, 0xB1, 0xB8, 0xA4, 0xE8, 0x17, 0x51, 0x6A, 0xD5, 0xA9, 0x31,
        0x55, 0x7C, 0xB5, 0x68, 0x05, 0xC3, 0xEB, 0x16, 0xE8, 0xF3, 0xA8, 0x03, 0xD6, 0x47, 0xDF,
        0x78, 0x69,
    ]);
}

/// The private half of [`PublicKey::DEVELOPMENT`].
pub const DEVELOPMENT_SEED: [u8; KEY_LEN] = [0x48; KEY_LEN];

/// The order of Ed25519's group, least byte first.
const ORDER: [u8; 32] = [
    0xED, 0xD3, 0xF5, 0x5C, 0x1A, 0x63, 0x12, 0x58, 0xD6, 0x9C, 0xF7, 0xA2, 0xDE, 0xF9, 0xDE, 0x14,
    0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x10,
];

/// Whether the second half of a signature is below the group's order, as RFC 8032 asks (5.1.7).
/// `salty` does not ask; without it one container would have several valid signatures.
fn reduced(signature: &[u8; SIGNATURE_LEN]) -> bool {
    let s = signature.iter().skip(KEY_LEN).rev();
    s.lt(ORDER.iter().rev())
}

impl Verify for PublicKey {
    fn verifies(&self, message: &[u8], signature: &[u8; SIGNATURE_LEN]) -> bool {
        let Ok(key) = salty::PublicKey::try_from(&self.0) else {
            return false;
        };
        let parts = salty::Signature::from(signature);
        reduced(signature) && key.verify(message, &parts).is_ok()
    }
}

/// Whether the trusted party signed a container.
pub fn authentic(container: &Container<'_>, trusted: &impl Verify) -> bool {
    trusted.verifies(container.signed, container.signature)
}
