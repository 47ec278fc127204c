//! What a charger keeps in flash: its settings, its device key, and up to which number it has given
//! challenges.
//!
//! Three items of a map of `sequential-storage`, each replaced as a whole. A power cut at any step
//! leaves the old item or the new one, and never touches the others. The map's own page marks
//! assume that an interrupted erasure can be seen; [`crate::flash`] makes that so.
//!
//! A write that was accepted is read again before it counts.

use core::future::Future;
use core::ops::Range;
use core::pin::pin;
use core::task::{Context, Poll, Waker};

use embedded_storage::nor_flash::MultiwriteNorFlash;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};

use crate::flash::{FlashError, Pages};
use crate::record::{self, RECORD_MAX, RecordError};
use crate::values::{Build, Values};

/// Bytes of a device key.
pub const KEY_LEN: usize = 32;
/// Items of the map. Numbers stay for ever.
const SETTINGS: u8 = 1;
const DEVICE_KEY: u8 = 2;
const CEILING: u8 = 3;
/// Longest item with its number, rounded up to a word of 4 bytes.
const BUFFER_LEN: usize = (1 + RECORD_MAX).next_multiple_of(4);

/// What the map works in.
#[repr(align(4))]
struct Buffer([u8; BUFFER_LEN]);

/// Why something was not read or written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StoreError {
    /// The flash: its range, or an access that failed.
    Flash(FlashError),
    /// What is in the flash makes no sense: it holds something else, or is worn out.
    Corrupted,
    /// What was written is not what is read.
    NotWritten,
    /// The settings that were read are not allowed.
    Record(RecordError),
    /// Nobody has looked: the start left it out.
    NotOpened,
}

/// Where a charger's settings come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// Never set: the defaults.
    Default,
    /// Read from flash.
    Stored,
    /// They cannot be read, so that the charger offers nothing ([`Values::nothing_known`]).
    Unreadable(StoreError),
}

/// Settings as a charger starts with them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Loaded {
    /// The values.
    pub values: Values,
    /// Where they come from.
    pub origin: Origin,
}

type Map<F> = MapStorage<u8, Pages<F>, Cache<Uncached, Uncached, Uncached, u8>>;

/// A charger's memory.
pub struct Store<F: MultiwriteNorFlash> {
    map: Map<F>,
    build: Build,
}

impl<F: MultiwriteNorFlash> core::fmt::Debug for Store<F> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Store")
            .field("build", &self.build)
            .finish_non_exhaustive()
    }
}

/// The result of a future that never waits: the flash is served at once.
fn served<T>(
    future: impl Future<Output = Result<T, sequential_storage::Error<FlashError>>>,
) -> Result<T, StoreError> {
    let mut context = Context::from_waker(Waker::noop());
    match pin!(future).poll(&mut context) {
        Poll::Ready(Ok(value)) => Ok(value),
        Poll::Ready(Err(sequential_storage::Error::Storage { value, .. })) => {
            Err(StoreError::Flash(value))
        }
        Poll::Ready(Err(_)) | Poll::Pending => Err(StoreError::Corrupted),
    }
}

impl<F: MultiwriteNorFlash> Store<F> {
    /// The memory in this range of the flash, two or more whole pages. Finishes what a power cut
    /// interrupted.
    ///
    /// # Errors
    /// [`StoreError::Flash`].
    pub fn open(flash: F, range: Range<u32>, build: Build) -> Result<Self, StoreError> {
        let pages = Pages::open(flash, range).map_err(StoreError::Flash)?;
        let config = MapConfig::try_new(pages.seen());
        let config = config.map_err(|_| StoreError::Flash(FlashError::Layout))?;
        let map = MapStorage::new(pages, config, Cache::new_uncached());
        Ok(Self { map, build })
    }

    /// What the image was built for.
    pub const fn build(&self) -> Build {
        self.build
    }

    /// The flash itself.
    pub const fn flash(&mut self) -> &mut F {
        self.map.flash().flash()
    }

    /// The settings to start with.
    pub fn settings(&mut self) -> Loaded {
        match self.stored() {
            Ok(Some(values)) => Loaded {
                values,
                origin: Origin::Stored,
            },
            Ok(None) => Loaded {
                values: Values::defaults(self.build),
                origin: Origin::Default,
            },
            Err(error) => Loaded {
                values: Values::nothing_known(self.build),
                origin: Origin::Unreadable(error),
            },
        }
    }

    fn stored(&mut self) -> Result<Option<Values>, StoreError> {
        let mut buffer = Buffer([0; BUFFER_LEN]);
        let item = self.map.fetch_item::<&[u8]>(&mut buffer.0, &SETTINGS);
        served(item)?
            .map(|bytes| record::read(bytes, self.build).map_err(StoreError::Record))
            .transpose()
    }

    /// Replaces the settings.
    ///
    /// # Errors
    /// They were not written; what was there before is there still, or the new ones are.
    pub fn write_settings(&mut self, values: &Values) -> Result<(), StoreError> {
        let mut bytes = [0; RECORD_MAX];
        let length = record::write(values, self.build, &mut bytes);
        let bytes = bytes.get(..length).unwrap_or_default();
        let mut buffer = Buffer([0; BUFFER_LEN]);
        served(self.map.store_item(&mut buffer.0, &SETTINGS, &bytes))?;
        if self.stored()? == Some(*values) {
            Ok(())
        } else {
            Err(StoreError::NotWritten)
        }
    }

    /// The device key, if one was ever given.
    ///
    /// # Errors
    /// The flash cannot be read; that is no proof that there is no key.
    pub fn device_key(&mut self) -> Result<Option<[u8; KEY_LEN]>, StoreError> {
        let mut buffer = Buffer([0; BUFFER_LEN]);
        let item = self.map.fetch_item::<&[u8]>(&mut buffer.0, &DEVICE_KEY);
        served(item)?
            .map(|bytes| <[u8; KEY_LEN]>::try_from(bytes).map_err(|_| StoreError::Corrupted))
            .transpose()
    }

    /// Replaces the device key.
    ///
    /// # Errors
    /// It was not written; the old one or the new one is in force.
    pub fn write_device_key(&mut self, key: &[u8; KEY_LEN]) -> Result<(), StoreError> {
        let mut buffer = Buffer([0; BUFFER_LEN]);
        let bytes: &[u8] = key;
        served(self.map.store_item(&mut buffer.0, &DEVICE_KEY, &bytes))?;
        if self.device_key()? == Some(*key) {
            Ok(())
        } else {
            Err(StoreError::NotWritten)
        }
    }

    /// No challenge of this number or a larger one was ever given; 0 at first.
    ///
    /// # Errors
    /// The flash cannot be read.
    pub fn ceiling(&mut self) -> Result<u32, StoreError> {
        let mut buffer = Buffer([0; BUFFER_LEN]);
        let item = self.map.fetch_item::<u32>(&mut buffer.0, &CEILING);
        Ok(served(item)?.unwrap_or(0))
    }

    /// Replaces the ceiling, before any number below it is used.
    ///
    /// # Errors
    /// It was not written.
    pub fn write_ceiling(&mut self, ceiling: u32) -> Result<(), StoreError> {
        let mut buffer = Buffer([0; BUFFER_LEN]);
        served(self.map.store_item(&mut buffer.0, &CEILING, &ceiling))?;
        if self.ceiling()? == ceiling {
            Ok(())
        } else {
            Err(StoreError::NotWritten)
        }
    }
}
