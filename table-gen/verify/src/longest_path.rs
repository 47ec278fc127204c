//! The worst number of periods until Hold: the longest path of the cell graph, found backwards.
//!
//! A cell is *done in k* periods if its whole box is done in k-1; Hold cells are done in 0. The
//! sweeps stop when none is left (the number of sweeps is the longest path) or when none can be
//! added (the rest can go round for ever).

use firmware::grid::Grid;
use firmware::phase::Phase;

use super::cellset::CellSet;
use super::successor::Cells;

/// From a cell, under the law in force there, to a box of cells.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    pub(super) from: u32,
    pub(super) phase: Phase,
    pub(super) to: Cells,
}

/// Longest runs in periods.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Longest {
    /// Of C1 alone.
    pub(super) c1: u32,
    /// Of C2 alone.
    pub(super) c2: u32,
    /// Of C1 and C2 in any order, until Hold.
    pub(super) total: u32,
}

/// All edges of the reachable cells.
#[derive(Debug)]
pub(super) struct Graph<'g> {
    grid: &'g Grid,
    edges: Vec<Edge>,
}

impl<'g> Graph<'g> {
    pub(super) fn new(grid: &'g Grid) -> Self {
        Self {
            grid,
            edges: Vec::new(),
        }
    }

    pub(super) fn extend(&mut self, edges: Vec<Edge>) {
        self.edges.extend(edges);
    }

    /// A Hold cell and a cell of its box that is not Hold's.
    pub(super) fn hold_leaves_hold(&self) -> Option<(u32, u32)> {
        let done = self.cells_of(|phase| phase == Phase::Hold);
        self.edges
            .iter()
            .filter(|edge| edge.phase == Phase::Hold)
            .find_map(|edge| done.missing(&edge.to).map(|missing| (edge.from, missing)))
    }

    /// The longest runs, or a cell from which the target may never be reached.
    pub(super) fn longest(&self) -> Result<Longest, u32> {
        Ok(Longest {
            c1: self.periods(|phase| phase == Phase::C1)?,
            c2: self.periods(|phase| phase == Phase::C2)?,
            total: self.periods(|phase| phase != Phase::Hold)?,
        })
    }

    /// Cells in which one of some laws, and no other law, may decide.
    fn cells_of(&self, law: impl Fn(Phase) -> bool) -> CellSet {
        let others = CellSet::new(self.grid);
        for edge in self.edges.iter().filter(|edge| !law(edge.phase)) {
            others.insert(edge.from);
        }
        let set = CellSet::new(self.grid);
        for edge in self.edges.iter().filter(|edge| law(edge.phase)) {
            if !others.contains(edge.from) {
                set.insert(edge.from);
            }
        }
        set
    }

    /// Longest run of the laws chosen.
    fn periods(&self, law: impl Fn(Phase) -> bool) -> Result<u32, u32> {
        let done = self.cells_of(|phase| !law(phase));
        // An edge and a cell of its box that was not done when last looked at.
        let mut open: Vec<(Edge, u32)> = self
            .edges
            .iter()
            .filter(|edge| law(edge.phase))
            .map(|edge| (*edge, edge.from))
            .collect();
        let mut sweeps = 0;
        while !open.is_empty() {
            sweeps += 1;
            let mut finished = Vec::new();
            open.retain_mut(|(edge, witness)| {
                if sweeps > 1 && !done.contains(*witness) {
                    return true;
                }
                match done.missing(&edge.to) {
                    Some(cell) => {
                        *witness = cell;
                        true
                    }
                    None => {
                        finished.push(edge.from);
                        false
                    }
                }
            });
            if finished.is_empty() {
                return Err(open.iter().map(|(edge, _)| edge.from).min().unwrap_or(0));
            }
            // A cell astride a band's edge has two edges: it is done when the last is.
            let still = CellSet::new(self.grid);
            if self.has_astride() {
                for (edge, _) in &open {
                    still.insert(edge.from);
                }
            }
            for cell in finished {
                if !still.contains(cell) {
                    done.insert(cell);
                }
            }
        }
        Ok(sweeps)
    }

    /// Whether some cell has more than one edge; edges of a cell are neighbours.
    fn has_astride(&self) -> bool {
        self.edges
            .windows(2)
            .any(|pair| pair[0].from == pair[1].from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge(from: u32, phase: Phase, low: u16, high: u16) -> Edge {
        let to = Cells {
            low: [low, 0, 0, 0],
            high: [high, 0, 0, 0],
        };
        Edge { from, phase, to }
    }

    /// A line of cells: 0 is Hold's, 1 and 2 C2's, 3 and 4 C1's.
    fn line() -> (Grid, Vec<Edge>) {
        let grid = Grid::new([0; 4], [1; 4], [5, 1, 1, 1]).unwrap();
        let edges = vec![
            edge(0, Phase::Hold, 0, 0),
            edge(1, Phase::C2, 0, 0),
            edge(2, Phase::C2, 0, 1),
            edge(3, Phase::C1, 1, 2),
            edge(4, Phase::C1, 2, 3),
        ];
        (grid, edges)
    }

    #[test]
    fn the_longest_path_of_a_line_is_its_length() {
        let (grid, edges) = line();
        let mut graph = Graph::new(&grid);
        graph.extend(edges);
        assert_eq!(
            graph.longest(),
            Ok(Longest {
                c1: 2,
                c2: 2,
                total: 4
            })
        );
        assert_eq!(graph.hold_leaves_hold(), None);
    }

    #[test]
    fn a_cycle_and_a_leak_are_found() {
        let (grid, mut edges) = line();
        edges[3] = edge(3, Phase::C1, 2, 4);
        edges[0] = edge(0, Phase::Hold, 0, 1);
        let mut graph = Graph::new(&grid);
        graph.extend(edges);
        assert_eq!(graph.longest(), Err(3));
        assert_eq!(graph.hold_leaves_hold(), Some((0, 1)));
    }
}
