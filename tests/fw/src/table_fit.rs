//! Which table goes into which image: what a table says, whether it fits the product, what is
//! proven.
//!
//! The comparison is the firmware's own ([`firmware::charger::misfits`]): what is refused here is
//! what the charger itself would answer with the droop.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use firmware::charger::reference::{Product, products};
use firmware::charger::{ChargerConfig, Misfits, misfits};
use firmware::frequency::filter::Filter;
use firmware::table::{TableError, TableView};
use model::hex::hex;
use model::spec::Spec;
use model::verdict::Verdict;
use sha2::{Digest, Sha256};

use crate::images::{Image, PRODUCTS};
use crate::root;

/// A product and its image.
#[derive(Debug, Clone, Copy)]
pub struct Built {
    /// The image.
    pub image: Image,
    /// What the charger is that runs it.
    pub product: Product,
}

impl Built {
    /// Every build of the product. An image without a product, or the other way round, is a defect
    /// that the tests find.
    pub fn all() -> Vec<Self> {
        let products = products();
        let of = |image: Image| {
            let product = products
                .into_iter()
                .find(|product| product.name == image.name);
            product.map(|product| Self { image, product })
        };
        PRODUCTS.into_iter().filter_map(of).collect()
    }

    /// The shipped table for its direction, power and meter.
    pub fn default_table(&self) -> PathBuf {
        let direction = if self.image.has("bidirectional") {
            "bi"
        } else {
            "uni"
        };
        let chip = if self.image.has("ade7953") {
            "-ade7953"
        } else {
            ""
        };
        let name = format!("gb-{direction}{chip}");
        root().join(format!("firmware/tables/{name}.bin"))
    }
}

/// Why a table cannot go into an image.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// It cannot be read.
    #[error("{path}: {source}", path = shown(path))]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The firmware's reader rejects it.
    #[error("{path}: the charger rejects this table: {}", rejection(*error), path = shown(path))]
    Rejected {
        /// The file.
        path: PathBuf,
        /// Why.
        error: TableError,
    },
}

fn shown(path: &Path) -> String {
    if path.as_os_str().is_empty() {
        "the empty path".to_owned()
    } else {
        path.display().to_string()
    }
}

/// Why a table is rejected, with what would do.
fn rejection(error: TableError) -> String {
    match error {
        TableError::BadMagic { .. } => "it is no table (its first bytes are not HFDT)".to_owned(),
        TableError::TooShort { found, needed } => {
            format!("{found} bytes, at least {needed} are needed")
        }
        TableError::UnsupportedVersion { found, supported } => {
            format!("format {found}, this firmware reads format {supported}: build it anew")
        }
        TableError::BadField { offset } => {
            format!("the field at offset {offset} is out of its range (docs/table-format.md)")
        }
        other => format!("{other:?}"),
    }
}

/// A table that the firmware accepts.
#[derive(Debug)]
pub struct Candidate {
    /// The file.
    pub path: PathBuf,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

impl Candidate {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// It cannot be read, or the firmware's reader rejects it.
    pub fn read(path: &Path) -> Result<Self, FitError> {
        let path = path.to_owned();
        let bytes = match std::fs::read(&path) {
            Ok(bytes) => bytes,
            Err(source) => return Err(FitError::Read { path, source }),
        };
        match TableView::parse(&bytes) {
            Ok(_) => Ok(Self { path, bytes }),
            Err(error) => Err(FitError::Rejected { path, error }),
        }
    }

    /// What a product does not meet.
    ///
    /// # Errors
    /// As [`Candidate::read`].
    pub fn misfits(&self, built: &Built) -> Result<Misfits, FitError> {
        let table = TableView::parse(&self.bytes).map_err(|error| FitError::Rejected {
            path: self.path.clone(),
            error,
        })?;
        let filter = Filter::new(ChargerConfig::DEFAULT.filter_ticks);
        let (installation, meter) = (&built.product.installation, built.product.meter);
        Ok(misfits(&table.header(), installation, meter, &filter))
    }

    /// The table, the spec that it was made from, and what is proven of it, for people.
    pub fn describe(&self) -> String {
        let mut text = format!("table {}: {} bytes", self.path.display(), self.bytes.len());
        let Ok(table) = TableView::parse(&self.bytes) else {
            return text;
        };
        let header = table.header();
        let made_from = Spec::shipped_names()
            .iter()
            .find(|name| Spec::load(name, &[]).is_ok_and(|spec| spec.hash() == header.spec_hash));
        let hash = hex(&header.spec_hash);
        // Writing to a String cannot fail.
        let _ = match made_from {
            Some(name) => write!(text, "; spec {name} ({hash})"),
            None => write!(text, "; spec {hash}, none of the shipped ones"),
        };
        let assumed = &header.hypotheses;
        let _ = write!(
            text,
            "; for {:?} chargers of {:.2} kW, meters within {:.1} mHz that lag {} to {} ms",
            assumed.direction,
            f64::from(assumed.power_per_charger_w) / 1e3,
            f64::from(assumed.estimate_error[0]) / 1e3,
            assumed.meter_lag_ms[0],
            assumed.meter_lag_ms[1]
        );
        let _ = write!(text, "\n  {}", self.proven());
        text
    }

    /// What the verdict beside the table says, if it is about these bytes.
    fn proven(&self) -> String {
        let sha = hex(&Sha256::digest(&self.bytes));
        let beside = [
            self.path.with_extension("verdict.json"),
            self.path.with_file_name("verdict.json"),
        ];
        let verdict = beside
            .iter()
            .filter_map(|path| std::fs::read(path).ok())
            .filter_map(|bytes| serde_json::from_slice::<Verdict>(&bytes).ok())
            .find(|verdict| verdict.table_sha256 == sha);
        let Some(verdict) = verdict else {
            return "NOTHING is known to be proven: no verdict on these bytes lies beside the table \
                    (table-gen verify TABLE --spec SPEC --verdict FILE)"
                .to_owned();
        };
        let names = |holds: bool| -> String {
            let claims = verdict.claims.iter().filter(|claim| claim.holds == holds);
            claims
                .map(|claim| claim.name.as_str())
                .collect::<Vec<_>>()
                .join(", ")
        };
        if verdict.verified {
            format!("verified for {}: {}", verdict.spec, names(true))
        } else {
            format!(
                "NOT verified for {}: open or refuted: {}; proven: {}",
                verdict.spec,
                names(false),
                names(true)
            )
        }
    }
}

/// The names of misfits.
pub fn names(misfits: Misfits) -> String {
    misfits.names().collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_image_has_its_product() {
        assert_eq!(Built::all().len(), PRODUCTS.len());
        assert_eq!(products().len(), PRODUCTS.len());
    }
}
