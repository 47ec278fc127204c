//! A report that is drawn: its page and its figures as files.

use super::chart::ChartError;
use super::study::StudyError;

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A figure cannot be drawn.
    #[error(transparent)]
    Chart(#[from] ChartError),
    /// A run cannot be made.
    #[error(transparent)]
    Study(#[from] StudyError),
}

/// A figure as files.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FigureFile {
    /// Name without ending.
    pub id: String,
    /// The drawing, with its own style sheet.
    pub svg: String,
    /// What is drawn.
    pub csv: String,
}

/// A report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rendered {
    /// The page.
    pub html: String,
    /// Its figures in order.
    pub figures: Vec<FigureFile>,
}

impl Rendered {
    /// Every file of the report with its name: the page first, then each figure as SVG and CSV.
    pub fn files(&self) -> Vec<(String, String)> {
        let mut files = vec![("report.html".to_owned(), self.html.clone())];
        for figure in &self.figures {
            files.push((format!("{}.svg", figure.id), figure.svg.clone()));
            files.push((format!("{}.csv", figure.id), figure.csv.clone()));
        }
        files
    }
}
