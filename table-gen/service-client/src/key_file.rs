//! A charger's key as text: 32 bytes in Base64.

use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use service::seal::DeviceKey;
use settings::store::KEY_LEN;

/// Why a file gives no key.
#[derive(Debug, thiserror::Error)]
pub enum KeyFileError {
    /// It cannot be read.
    #[error("{path}: {error}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// It holds something else.
    #[error(
        "{path}: not a device key; allowed: {KEY_LEN} bytes in Base64, as `head -c 32 /dev/urandom | base64` writes them"
    )]
    NoKey {
        /// The file.
        path: PathBuf,
    },
    /// It holds zeros or another byte 32 times.
    #[error("{path}: the key is one byte repeated; take random bytes")]
    Weak {
        /// The file.
        path: PathBuf,
    },
}

/// Reads a key.
///
/// # Errors
/// [`KeyFileError`].
pub fn read(path: &Path) -> Result<DeviceKey, KeyFileError> {
    let text = std::fs::read_to_string(path).map_err(|error| KeyFileError::Unreadable {
        path: path.to_owned(),
        error,
    })?;
    let no_key = || KeyFileError::NoKey {
        path: path.to_owned(),
    };
    let bytes = STANDARD.decode(text.trim()).map_err(|_| no_key())?;
    let bytes: [u8; KEY_LEN] = bytes.try_into().map_err(|_| no_key())?;
    let [first, ..] = bytes;
    if bytes == [first; KEY_LEN] {
        return Err(KeyFileError::Weak {
            path: path.to_owned(),
        });
    }
    Ok(DeviceKey::new(bytes))
}
