//! The parts of a page: headings, words, tables, figures.

use super::figure::Figure;

/// A table of texts.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DataTable {
    /// What it shows.
    pub caption: String,
    /// Head of each column.
    pub header: Vec<String>,
    /// Rows, each as long as the header.
    pub rows: Vec<Vec<String>>,
}

impl DataTable {
    /// A table without rows yet.
    pub fn new(caption: impl Into<String>, header: &[&str]) -> Self {
        Self {
            caption: caption.into(),
            header: header.iter().map(|head| (*head).to_owned()).collect(),
            rows: Vec::new(),
        }
    }

    /// Adds a row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }
}

/// A section of the page.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Section {
    /// Heading.
    pub heading: String,
    /// Paragraphs.
    pub words: Vec<String>,
    /// Tables.
    pub tables: Vec<DataTable>,
    /// Figures.
    pub figures: Vec<Figure>,
    /// Text as it is, such as a spec, with its caption.
    pub listings: Vec<(String, String)>,
}

impl Section {
    /// A section with a heading alone.
    pub fn new(heading: impl Into<String>) -> Self {
        Self {
            heading: heading.into(),
            ..Self::default()
        }
    }

    /// Adds a paragraph.
    #[must_use]
    pub fn say(mut self, words: impl Into<String>) -> Self {
        self.words.push(words.into());
        self
    }
}
