//! What the tests share: a flash whose supply fails, keys, containers, a charger.
#![allow(dead_code, reason = "each test uses its part")]

pub(crate) mod flash;

use ed25519_dalek::{Signer as _, SigningKey};
use firmware::charger::reference::products;
use update::class::DeviceClass;
use update::container::{Header, Validity};
use update::device::Device;
use update::key::{PublicKey, Verify};
use update::layout::Layout;

pub(crate) const GB_BI: &[u8] = include_bytes!("../../../tables/gb-bi.bin");
pub(crate) const GB_UNI: &[u8] = include_bytes!("../../../tables/gb-uni.bin");

/// Two slots of two pages each.
pub(crate) const SLOT_LEN: u32 = 2 * flash::PAGE as u32;
pub(crate) const FLASH_LEN: usize = 2 * SLOT_LEN as usize;

pub(crate) fn layout() -> Layout {
    Layout::new(0, SLOT_LEN, SLOT_LEN).unwrap()
}

/// The class of the charger of these tests.
pub(crate) const CLASS: DeviceClass = DeviceClass::reference(true, false);

pub(crate) fn signer() -> SigningKey {
    SigningKey::from_bytes(&[7; 32])
}

pub(crate) fn trusted() -> PublicKey {
    PublicKey(signer().verifying_key().to_bytes())
}

/// The bidirectional product, which believes `trusted`.
pub(crate) fn device<K: Verify>(trusted: K) -> Device<K> {
    let product = products()[1];
    assert_eq!(product.name, "holdfast-bidirectional");
    Device {
        trusted,
        class: CLASS,
        installation: product.installation,
        meter: product.meter,
        filter_ticks: 1,
    }
}

/// A container of these parts, signed.
pub(crate) fn sealed(header: Header, table: &[u8], key: &SigningKey) -> Vec<u8> {
    let mut bytes = header.write().to_vec();
    bytes.extend(table);
    let signature = key.sign(&bytes);
    bytes.extend(signature.to_bytes());
    bytes
}

/// A container with gb-bi for the charger of these tests.
pub(crate) fn container(version: u32) -> Vec<u8> {
    sealed(header(version, GB_BI), GB_BI, &signer())
}

pub(crate) fn header(version: u32, table: &[u8]) -> Header {
    Header {
        table_len: table.len() as u32,
        class: CLASS,
        version,
        validity: Validity::ALWAYS,
    }
}
