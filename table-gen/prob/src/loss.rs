//! The size of the loss, drawn once an event: bands of sizes, each with how often a year it comes.

use std::path::Path;

use model::spec::LOSS_SYNTHETIC;
use serde::{Deserialize, Serialize};

/// Losses of sizes in a band.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LossBand {
    /// Least size \[GW\].
    pub low_gw: f64,
    /// Largest size \[GW\].
    pub high_gw: f64,
    /// Events a year, or a relative weight.
    pub weight: f64,
}

/// A distribution of losses.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Losses {
    /// Its bands.
    pub bands: Vec<LossBand>,
    /// Weight of events that are larger than all bands. Nothing is proven of them.
    pub larger: f64,
    /// What it rests on.
    pub assumption: String,
}

/// Why there is no distribution.
#[derive(Debug, thiserror::Error)]
pub enum LossError {
    /// The file cannot be read.
    #[error("{path}: {source}")]
    File {
        /// The file.
        path: String,
        /// Why.
        source: csv::Error,
    },
    /// The columns are others.
    #[error("{path}: the first line is `{found}`; it must be `loss_gw,weight` (GW, events a year)")]
    Header {
        /// The file.
        path: String,
        /// What was found.
        found: String,
    },
    /// A row is wrong.
    #[error(
        "{path}, row {row}: `{found}`; a size of 0 to 10 GW and a weight of 0 to 1e6 are allowed"
    )]
    Row {
        /// The file.
        path: String,
        /// Row, from 1, the first line not counted.
        row: usize,
        /// What was found.
        found: String,
    },
    /// No weight at all.
    #[error("{path}: the weights add up to 0")]
    Nothing {
        /// The file.
        path: String,
    },
}

/// Events a year above [`LEAST_GW`], the scale of their sizes, and the ends and width of the bands.
const EVENTS_PER_YEAR: f64 = 20.0;
const SCALE_GW: f64 = 0.35;
const LEAST_GW: f64 = 0.3;
const MOST_GW: f64 = 3.0;
const BAND_GW: f64 = 0.1;

impl Losses {
    /// A distribution by its name, or from a file.
    ///
    /// # Errors
    /// A file that cannot be read, or is no distribution.
    pub fn load(name: &str) -> Result<Self, LossError> {
        if name == LOSS_SYNTHETIC {
            Ok(Self::synthetic())
        } else {
            Self::from_csv(Path::new(name))
        }
    }

    /// One band, with certainty.
    pub fn certain([low_gw, high_gw]: [f64; 2]) -> Self {
        let weight = 1.0;
        Self {
            bands: vec![LossBand {
                low_gw,
                high_gw,
                weight,
            }],
            larger: 0.0,
            assumption: format!("the loss is in {low_gw} to {high_gw} GW, as the spec says"),
        }
    }

    /// `20 exp(-(s - 0.3)/0.35)` events a year larger than s GW. It is made up, so that a yearly
    /// rate can be shown: one loss a year of 1.35 GW and more, one in four years of 1.8 GW and
    /// more, one in eleven of 2.2 GW and more. Public records of 2017 to 2024 have 1.0 GW (May
    /// 2017), 1.4 GW (October 2024), and the cascade of August 2019.
    pub fn synthetic() -> Self {
        let above = |s: f64| EVENTS_PER_YEAR * (-(s - LEAST_GW) / SCALE_GW).exp();
        let count = ((MOST_GW - LEAST_GW) / BAND_GW).round() as u32;
        let edge = |i: u32| (3.0 + f64::from(i)) / 10.0;
        let bands = (0..count).map(|i| LossBand {
            low_gw: edge(i),
            high_gw: edge(i + 1),
            weight: above(edge(i)) - above(edge(i + 1)),
        });
        Self {
            bands: bands.collect(),
            larger: above(MOST_GW),
            assumption: format!(
                "synthetic, not measured: {EVENTS_PER_YEAR} exp(-(s - {LEAST_GW})/{SCALE_GW}) losses a year larger than s GW"
            ),
        }
    }

    /// Reads `loss_gw,weight`; every row is one size.
    ///
    /// # Errors
    /// See [`LossError`].
    pub fn from_csv(path: &Path) -> Result<Self, LossError> {
        let name = path.display().to_string();
        let file = |source| LossError::File {
            path: name.clone(),
            source,
        };
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .from_path(path)
            .map_err(file)?;
        let header: Vec<String> = reader
            .headers()
            .map_err(file)?
            .iter()
            .map(str::to_owned)
            .collect();
        if header != ["loss_gw", "weight"] {
            return Err(LossError::Header {
                path: name,
                found: header.join(","),
            });
        }
        let mut bands = Vec::new();
        for (index, record) in reader.records().enumerate() {
            let record = record.map_err(file)?;
            let number = |field: usize| record.get(field).and_then(|text| text.parse::<f64>().ok());
            let band = match (number(0), number(1)) {
                (Some(size), Some(weight))
                    if (0.0..=10.0).contains(&size) && (0.0..=1e6).contains(&weight) =>
                {
                    LossBand {
                        low_gw: size,
                        high_gw: size,
                        weight,
                    }
                }
                _ => {
                    let found = record.iter().collect::<Vec<_>>().join(",");
                    return Err(LossError::Row {
                        path: name,
                        row: index + 1,
                        found,
                    });
                }
            };
            bands.push(band);
        }
        if bands.iter().map(|band| band.weight).sum::<f64>() <= 0.0 {
            return Err(LossError::Nothing { path: name });
        }
        Ok(Self {
            bands,
            larger: 0.0,
            assumption: format!("sizes and weights of {name}"),
        })
    }

    /// Weight of all events.
    pub fn total(&self) -> f64 {
        self.bands.iter().map(|band| band.weight).sum::<f64>() + self.larger
    }

    /// Lower bound of the mean of a lower bound per band, 0 for larger losses.
    pub fn mean(&self, of_band: &[f64]) -> f64 {
        let sum: f64 = self
            .bands
            .iter()
            .zip(of_band)
            .map(|(band, p)| band.weight * p)
            .sum();
        // A sum of n products of non-negative numbers and a quotient err by at most n + 2
        // roundings, relative.
        let roundings = (self.bands.len() + 4) as f64 * f64::EPSILON;
        (sum / self.total() * (1.0 - 2.0 * roundings)).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_synthetic_bands_touch_and_add_up() {
        let losses = Losses::synthetic();
        assert_eq!(losses.bands.len(), 27);
        assert!((losses.total() - EVENTS_PER_YEAR).abs() < 1e-12);
        for pair in losses.bands.windows(2) {
            assert_eq!(pair[0].high_gw, pair[1].low_gw);
        }
    }

    #[test]
    fn a_file_is_read_and_a_wrong_row_is_named() {
        let dir = std::env::temp_dir().join(format!("holdfast-loss-{}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        let path = dir.join("loss.csv");
        std::fs::write(&path, "loss_gw,weight\n1.0, 2\n1.8,0.5\n").unwrap();
        let losses = Losses::from_csv(&path).unwrap();
        assert_eq!(losses.total(), 2.5);
        let mean = losses.mean(&[1.0, 0.0]);
        assert!(mean <= 0.8 && mean > 0.8 - 1e-14);
        std::fs::write(&path, "loss_gw,weight\n1.0,2\n-1,3\n").unwrap();
        assert!(matches!(
            Losses::from_csv(&path),
            Err(LossError::Row { row: 2, .. })
        ));
        std::fs::write(&path, "size,weight\n1.0,2\n").unwrap();
        assert!(matches!(
            Losses::from_csv(&path),
            Err(LossError::Header { .. })
        ));
        std::fs::remove_dir_all(&dir).unwrap();
    }
}
