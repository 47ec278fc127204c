//! The table in a `DataTransfer`: what OCPP cannot say, carried whole and signed.
//!
//! | field of `data` | content |
//! |---|---|
//! | `format` | `holdfast-table-1` |
//! | `table` | the bytes of the table, in Base64 |
//! | `sha256` | their SHA-256, in hexadecimal digits, for people |
//! | `publicKey` | the signer's Ed25519 key, in Base64 |
//! | `signature` | Ed25519 over the format's name, a zero byte and the table's bytes, in Base64 |
//!
//! The key in the container names the signer; whoever receives it decides by a key of his own. The
//! charger's firmware does not read these messages: whatever receives one on the charging station
//! checks it and writes the table's sector. What the firmware itself verifies and installs is the
//! container of the package `update`, another format by the same kinds of keys.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
pub use ed25519_dalek::SigningKey;
use ed25519_dalek::{Signature, Signer as _, VerifyingKey};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest as _, Sha256};

use crate::curve::FieldError;
use crate::export::call;

/// Name of the format, version included.
pub const FORMAT: &str = "holdfast-table-1";
/// `vendorId` of the messages.
pub const VENDOR: &str = "holdfast";
/// `messageId` of the messages.
pub const MESSAGE: &str = "table";

#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct DataTransfer {
    vendor_id: String,
    message_id: String,
    data: Container,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct Container {
    format: String,
    table: String,
    sha256: String,
    public_key: String,
    signature: String,
}

/// Why a container is not opened.
#[derive(Debug, thiserror::Error)]
pub enum ContainerError {
    /// Not the JSON of a container.
    #[error("not a container: {0}")]
    Json(#[from] serde_json::Error),
    /// A field has a value that it cannot have.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// Signed by somebody else, or changed since.
    #[error("the signature is not that of the trusted key over these bytes")]
    Signature,
}

fn signed_bytes(table: &[u8]) -> Vec<u8> {
    [FORMAT.as_bytes(), &[0], table].concat()
}

fn sha256(table: &[u8]) -> String {
    let digest = Sha256::digest(table);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A private key from its text: 32 bytes in Base64.
///
/// # Errors
/// Anything else.
pub fn private_key(text: &str) -> Result<SigningKey, FieldError> {
    Ok(SigningKey::from_bytes(&bytes_of(
        "private key",
        text.trim(),
    )?))
}

/// A public key from its text: 32 bytes in Base64.
///
/// # Errors
/// Anything else.
pub fn public_key(text: &str) -> Result<VerifyingKey, FieldError> {
    let bytes = bytes_of("public key", text.trim())?;
    let refused = |_| FieldError::new("public key", text.trim(), "an Ed25519 key");
    VerifyingKey::from_bytes(&bytes).map_err(refused)
}

/// The private key's text.
pub fn private_text(key: &SigningKey) -> String {
    STANDARD.encode(key.to_bytes())
}

/// The public key's text.
pub fn public_text(key: &SigningKey) -> String {
    STANDARD.encode(key.verifying_key().as_bytes())
}

fn bytes_of<const N: usize>(field: &str, text: &str) -> Result<[u8; N], FieldError> {
    let bytes = STANDARD.decode(text).ok();
    let bytes = bytes.and_then(|bytes| <[u8; N]>::try_from(bytes).ok());
    let found = format!("{} characters", text.len());
    bytes.ok_or_else(|| FieldError::new(field, found, format!("{N} bytes in Base64")))
}

/// The call that carries a table.
///
/// # Errors
/// None that a caller should see.
pub fn seal(table: &[u8], key: &SigningKey) -> Result<Value, serde_json::Error> {
    let signature = key.sign(&signed_bytes(table));
    let message = DataTransfer {
        vendor_id: VENDOR.to_owned(),
        message_id: MESSAGE.to_owned(),
        data: Container {
            format: FORMAT.to_owned(),
            table: STANDARD.encode(table),
            sha256: sha256(table),
            public_key: public_text(key),
            signature: STANDARD.encode(signature.to_bytes()),
        },
    };
    call("DataTransfer", "table", &message)
}

/// The table in a call or its payload, if the trusted key signed it.
///
/// # Errors
/// A message that is no container, or another signature.
pub fn open(text: &str, trusted: &VerifyingKey) -> Result<Vec<u8>, ContainerError> {
    let document: Value = serde_json::from_str(text)?;
    let payload = match document {
        Value::Array(mut items) if items.len() == 4 => items.remove(3),
        other => other,
    };
    let message: DataTransfer = serde_json::from_value(payload)?;
    let data = message.data;
    if data.format != FORMAT {
        return Err(FieldError::new("data.format", data.format, FORMAT).into());
    }
    let decoded = STANDARD.decode(&data.table);
    let table = decoded.map_err(|error| FieldError::new("data.table", error, "Base64"))?;
    let signature = Signature::from_bytes(&bytes_of("data.signature", &data.signature)?);
    let verified = trusted.verify_strict(&signed_bytes(&table), &signature);
    verified.map_err(|_| ContainerError::Signature)?;
    if data.sha256 != sha256(&table) {
        return Err(FieldError::new("data.sha256", data.sha256, sha256(&table)).into());
    }
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_trusted_key_and_the_signed_bytes_open() {
        let key = SigningKey::from_bytes(&[7; 32]);
        let other = SigningKey::from_bytes(&[8; 32]);
        let table: Vec<u8> = (0..=255).collect();
        let text = seal(&table, &key).unwrap().to_string();
        assert_eq!(open(&text, &key.verifying_key()).unwrap(), table);
        let refused = open(&text, &other.verifying_key());
        assert!(matches!(refused, Err(ContainerError::Signature)));
        let changed = text.replacen("AAEC", "BAEC", 1);
        assert_ne!(changed, text);
        let refused = open(&changed, &key.verifying_key());
        assert!(matches!(refused, Err(ContainerError::Signature)));
        // Another format's name is refused before anything is checked.
        let renamed = text.replacen(FORMAT, "holdfast-table-2", 1);
        assert!(open(&renamed, &key.verifying_key()).is_err());
    }

    #[test]
    fn keys_are_32_bytes() {
        let key = SigningKey::from_bytes(&[7; 32]);
        let text = public_text(&key);
        assert_eq!(
            public_key(&format!("{text}\n")).unwrap(),
            key.verifying_key()
        );
        assert_eq!(private_key(&private_text(&key)).unwrap(), key);
        for text in ["", "AAAA", "not base64", &"A".repeat(88)] {
            assert!(private_key(text).is_err(), "{text:?}");
        }
    }
}
