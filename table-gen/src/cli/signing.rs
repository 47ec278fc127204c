//! What `sign` and `update` share: products, keys, moments, and why a container is refused.

use std::path::Path;

use ::ocpp::container::{SigningKey, private_key, public_key};
use firmware::charger::reference::{Product, products};
use firmware::charger::{ChargerConfig, Misfits};
use update::class::DeviceClass;
use update::device::Device;
use update::key::PublicKey;
use update::marks::TRIALS;
use update::refusal::Refusal;

use super::Failure;

/// A file's bytes.
pub(super) fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    std::fs::read(path).map_err(|error| in_file(path, error))
}

/// Bad input in a file.
pub(super) fn in_file(path: &Path, error: impl std::fmt::Display) -> Failure {
    Failure::BadInput(format!("{}: {error}", path.display()))
}

fn line(path: &Path) -> Result<String, Failure> {
    std::fs::read_to_string(path).map_err(|error| in_file(path, error))
}

/// The private key of a file.
pub(super) fn signer(path: &Path) -> Result<SigningKey, Failure> {
    private_key(&line(path)?).map_err(|error| in_file(path, error))
}

/// The public key of a file.
pub(super) fn trusted(path: &Path) -> Result<PublicKey, Failure> {
    let key = public_key(&line(path)?).map_err(|error| in_file(path, error))?;
    Ok(PublicKey(key.to_bytes()))
}

/// A product of this repository, and its class.
pub(super) fn product(name: &str) -> Result<(Product, DeviceClass), Failure> {
    let class = DeviceClass::REFERENCE
        .iter()
        .find(|(known, _)| *known == name);
    let product = products().into_iter().find(|product| product.name == name);
    let (Some(product), Some((_, class))) = (product, class) else {
        let names = DeviceClass::REFERENCE.map(|(name, _)| name).join(", ");
        let reason = format!("--product {name}: there is no such product; allowed: {names}");
        return Err(Failure::BadInput(reason));
    };
    Ok((product, *class))
}

/// The charger that a product is, with its key.
pub(super) fn charger(product: &Product, class: DeviceClass, key: PublicKey) -> Device<PublicKey> {
    Device {
        trusted: key,
        class,
        installation: product.installation,
        meter: product.meter,
        filter_ticks: ChargerConfig::DEFAULT.filter_ticks,
    }
}

/// A moment on the command line, such as 2027-01-31T00:00:00Z, in seconds since 1970.
pub(super) fn moment(text: &str) -> Result<u32, String> {
    let allowed = "allowed: 1970 to 2106, as in 2027-01-31T00:00:00Z";
    let time: jiff::Timestamp = text.parse().map_err(|_| allowed.to_owned())?;
    u32::try_from(time.as_second()).map_err(|_| allowed.to_owned())
}

/// A moment as it is written.
pub(super) fn shown(seconds: u32) -> String {
    let time = jiff::Timestamp::from_second(i64::from(seconds));
    time.map_or_else(|_| seconds.to_string(), |time| time.to_string())
}

/// A class as it is shown: its number, and the product's name if it is one of this repository's.
pub(super) fn class_name(class: DeviceClass) -> String {
    let known = DeviceClass::REFERENCE
        .iter()
        .find(|(_, known)| *known == class);
    let number = format!("{:#010x}", class.0);
    known.map_or(number.clone(), |(name, _)| format!("{number} ({name})"))
}

fn names(misfits: Misfits) -> String {
    misfits.names().collect::<Vec<_>>().join(", ")
}

/// Why a charger refuses a container, for people.
pub(super) fn told(refusal: Refusal) -> String {
    match refusal {
        Refusal::Truncated { found, needed } => {
            format!("truncated: {found} bytes, and {needed} are needed")
        }
        Refusal::TooMany { found, stated } => {
            format!("{found} bytes, and the header states {stated}")
        }
        Refusal::NotAContainer { found } => {
            let found = found.escape_ascii();
            format!("no signed container: it begins with \"{found}\", not with \"HFSC\"")
        }
        Refusal::UnsupportedFormat { found, supported } => {
            format!(
                "container format {found}; this firmware reads format {supported}: sign it anew"
            )
        }
        Refusal::BadField { offset } => format!(
            "the field at offset {offset} of the container is out of its range \
             (docs/signed-tables.md)"
        ),
        Refusal::BadSignature => {
            "the signature is not that of the trusted key over these bytes".to_owned()
        }
        Refusal::WrongClass { found, own } => format!(
            "for chargers of class {}; this one is of class {}",
            class_name(found),
            class_name(own)
        ),
        Refusal::Older { found, running } => {
            format!("version {found} is older than version {running}, which the charger has")
        }
        Refusal::Replayed { version } => format!("the charger has version {version} already"),
        Refusal::RolledBack { version } => format!(
            "version {version} was started {TRIALS} times without being confirmed, and rolled \
             back: sign what is to be tried again under a newer version"
        ),
        Refusal::NotYetValid { from_s, now_s } => {
            format!("valid from {}; it is {}", shown(from_s), shown(now_s))
        }
        Refusal::Expired { until_s, now_s } => {
            format!("valid until {}; it is {}", shown(until_s), shown(now_s))
        }
        Refusal::NoTime => {
            "valid for a time only, and the charger is not told the time (--now)".to_owned()
        }
        Refusal::Table(error) => format!("the charger rejects the table: {error:?}"),
        Refusal::Misfit(misfits) => format!(
            "the charger is not what the table's proof assumed: {}",
            names(misfits)
        ),
        Refusal::TooLong { found, room } => {
            format!("{found} bytes, and a slot holds {room}")
        }
        Refusal::TrialRuns => {
            "the table in force is on trial, and the other slot is the way back: wait until it is \
             confirmed or rolled back"
                .to_owned()
        }
        Refusal::OutOfTurn => "a part of the container came out of turn".to_owned(),
        Refusal::Flash => "the flash does not take it".to_owned(),
    }
}
