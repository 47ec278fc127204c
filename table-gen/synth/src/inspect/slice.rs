//! Two axes of a law as a picture, the other two fixed.

use std::fmt::Write as _;

use firmware::grid::Cell;
use firmware::table::{Law, TableView};

use model::plant::STATES;

/// Characters for levels from none of the fleet to all of it.
const SHADES: &[u8] = b"0123456789abcdefghijklmnopqrstuvwxyz";
/// Side of a cell in the SVG.
const SIDE: usize = 8;

/// A slice: `levels[y][x]`, `None` outside the law's domain.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Slice {
    /// Levels, row by row; the first row is the lowest cell of the y axis.
    pub levels: Vec<Vec<Option<u8>>>,
    /// Levels that the table has.
    pub level_count: u8,
}

/// Cuts a slice along the axes x and y through a cell; `None` if the axes are equal or past the
/// fourth.
pub fn cut(table: &TableView<'_>, law: Law, x: usize, y: usize, through: Cell) -> Option<Slice> {
    if x == y || x >= STATES || y >= STATES {
        return None;
    }
    let count = table.header().grid.count();
    let levels = (0..count[y])
        .map(|row| {
            (0..count[x])
                .map(|column| {
                    let mut cell = through.0;
                    (cell[x], cell[y]) = (column, row);
                    table.lookup(law, Cell(cell))
                })
                .collect()
        })
        .collect();
    Some(Slice {
        levels,
        level_count: table.header().levels,
    })
}

impl Slice {
    /// One character a cell, the highest row first: 0 to 9 and then letters for the level, a dot
    /// outside.
    pub fn ascii(&self) -> String {
        let mut out = String::new();
        for row in self.levels.iter().rev() {
            for level in row {
                let shade = level.and_then(|level| SHADES.get(usize::from(level)));
                out.push(char::from(*shade.unwrap_or(&b'.')));
            }
            out.push('\n');
        }
        out
    }

    /// The same as an SVG: from pale (no response) to dark (all of the fleet), white outside.
    pub fn svg(&self) -> String {
        let width = self.levels.first().map_or(0, Vec::len) * SIDE;
        let height = self.levels.len() * SIDE;
        let mut out = String::new();
        // Writing to a String cannot fail.
        let _ = writeln!(
            out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" shape-rendering=\"crispEdges\">"
        );
        for (row, levels) in self.levels.iter().rev().enumerate() {
            for (column, level) in levels.iter().enumerate() {
                let Some(level) = level else { continue };
                let share = f64::from(*level) / f64::from(self.level_count.max(2) - 1);
                let light = 92.0 - 67.0 * share;
                let (x, y) = (column * SIDE, row * SIDE);
                let _ = writeln!(
                    out,
                    "<rect x=\"{x}\" y=\"{y}\" width=\"{SIDE}\" height=\"{SIDE}\" fill=\"hsl(215,55%,{light:.0}%)\"/>"
                );
            }
        }
        out.push_str("</svg>\n");
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_have_the_highest_row_first_and_nothing_outside() {
        let slice = Slice {
            levels: vec![vec![Some(0), None], vec![Some(10), Some(20)]],
            level_count: 21,
        };
        assert_eq!(slice.ascii(), "ak\n0.\n");
        let svg = slice.svg();
        assert_eq!(svg.matches("<rect").count(), 3);
        assert!(svg.contains("x=\"8\" y=\"0\""));
        assert!(svg.contains("hsl(215,55%,25%)"), "all of the fleet is dark");
    }
}
