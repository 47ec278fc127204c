//! The domain of a law as bytes: a tree whose leaves are outside, inside, half-spaces or
//! look-aheads, exact or with cells given up.
//!
//! No losing cell may be inside, ever. Winning cells may be given up: the tree is grown until it is
//! exact, then pruned from below, with a price in bytes on each cell given up. The lowest price
//! that stays within the budget is found by bisection. So the budget goes where the boundary is
//! most ragged.

use firmware::grid::Cell;
use firmware::table::{
    AffineFunction, DomainKind, HALF_SPACES_MAX, LEAF_HALF_SPACE, LEAF_HULL, LEAF_INSIDE,
    LEAF_LOOK_AHEAD, LEAF_OUTSIDE, LOOK_AHEAD_LEN, LOOK_AHEADS_MAX, LookAhead,
};

use rayon::prelude::*;

use super::CompressError;
use super::best_plane::{Plane, best_plane, widest_plane};
use super::cells::LabelledCell;
use super::encode::encode_nodes;
use super::tree::{Tree, cut, depth_by_halving};
use model::plant::STATES;

/// Bytes that a leaf adds to a tree, nodes included: between 2 and 2.5, see
/// `firmware::table::Node`.
const LEAF_BYTES: f64 = 2.2;
/// Halvings of the bracket of the price.
const BISECTIONS: u32 = 30;
/// Highest price tried \[bytes a cell\].
const PRICE_MAX: f64 = 64.0;
/// A price at which no cell is given up: no tree is that large.
const PRICE_EXACT: f64 = 1e12;
/// Cells from which on the two sides of a plane are grown in parallel.
const PARALLEL_CELLS: usize = 2_000;
/// Marks a winning cell in its labels: the one value between look-aheads and hull that no leaf has.
const WINNING: u64 = 1 << (LEAF_HULL - 1);

/// A domain part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DomainPart {
    /// How membership is stored.
    pub kind: DomainKind,
    /// The bytes.
    pub bytes: Vec<u8>,
    /// Most nodes, half-spaces and steps that a question visits.
    pub worst_visits: u16,
    /// What the tree's leaves may name.
    pub predicates: Predicates,
    /// The tree.
    pub tree: Tree,
}

/// Half-spaces and look-aheads that a membership tree may name.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Predicates {
    /// Half-spaces; leaf 2 + k names the k-th.
    pub spaces: Vec<AffineFunction>,
    /// The first of them are the hull.
    pub hull: usize,
    /// Look-aheads as bytes; leaf 58 + k names the k-th.
    pub aheads: Vec<[u8; LOOK_AHEAD_LEN]>,
}

impl Predicates {
    /// Most half-spaces.
    pub const SPACES_MAX: usize = HALF_SPACES_MAX as usize;
    /// Most look-aheads.
    pub const AHEADS_MAX: usize = LOOK_AHEADS_MAX as usize;

    /// Leaf values that say "inside" of a cell.
    fn inside(&self, cell: [u16; STATES], count: [u16; STATES]) -> u64 {
        let mut inside = 1u64 << LEAF_INSIDE;
        let mut hull = self.hull > 0;
        for (k, space) in self.spaces.iter().enumerate() {
            let within = space.value(Cell(cell)) >= 0;
            hull &= within || k >= self.hull;
            inside |= u64::from(within) << (usize::from(LEAF_HALF_SPACE) + k);
        }
        for (k, ahead) in self.aheads.iter().enumerate() {
            let within = LookAhead::covers(ahead, Cell(cell), count);
            inside |= u64::from(within) << (usize::from(LEAF_LOOK_AHEAD) + k);
        }
        inside | u64::from(hull) << LEAF_HULL
    }

    /// Leaf values that are right for a cell.
    fn labels(&self, cell: [u16; STATES], count: [u16; STATES], winning: bool) -> u64 {
        let inside = self.inside(cell, count);
        if winning {
            return inside | WINNING;
        }
        let named = |n: usize, first: u8| ((1u64 << n) - 1) << first;
        let all = 3
            | named(self.spaces.len(), LEAF_HALF_SPACE)
            | named(self.aheads.len(), LEAF_LOOK_AHEAD)
            | named(usize::from(self.hull > 0), LEAF_HULL);
        all & !inside
    }

    /// Steps of the longest look-ahead, or half-spaces of the longest question if those are more.
    fn worst_visits(&self) -> u16 {
        let steps = self
            .aheads
            .iter()
            .map(|[_, steps, ..]| u16::from(*steps))
            .max();
        let spaces = self.hull.max(usize::from(!self.spaces.is_empty())) as u16;
        spaces.max(steps.unwrap_or(0))
    }
}

/// A subtree that is exact, with what it would cost to make it a leaf.
struct Grown {
    /// Leaf value that covers no losing cell and the fewest winning cells that it misses.
    leaf: u8,
    missed: u32,
    below: Option<(Plane, Box<(Grown, Grown)>)>,
}

fn grow(cells: &mut [LabelledCell], depth_max: u32) -> Grown {
    let mut right = !WINNING;
    let mut winning = 0u32;
    for cell in cells.iter() {
        if cell.labels & WINNING == 0 {
            right &= cell.labels;
        } else {
            winning += 1;
        }
    }
    let mut missed = [winning; 64];
    for cell in cells.iter().filter(|cell| cell.labels & WINNING != 0) {
        let mut rest = cell.labels & right;
        while rest != 0 {
            missed[rest.trailing_zeros() as usize] -= 1;
            rest &= rest - 1;
        }
    }
    // "Outside" is right for every losing cell.
    let leaf = (0..64u8)
        .filter(|leaf| right >> leaf & 1 == 1)
        .min_by_key(|leaf| missed[usize::from(*leaf)])
        .unwrap_or(LEAF_OUTSIDE);
    let missed = missed[usize::from(leaf)];
    let mut grown = Grown {
        leaf,
        missed,
        below: None,
    };
    if missed == 0 {
        return grown;
    }
    let plane = if depth_max <= depth_by_halving(cells) {
        widest_plane(cells)
    } else {
        best_plane(cells, 0.0)
    };
    let Some(plane) = plane else { return grown };
    let (left, right) = cut(cells, plane);
    let depth = depth_max.saturating_sub(1);
    let below = if left.len() + right.len() >= PARALLEL_CELLS {
        rayon::join(|| grow(left, depth), || grow(right, depth))
    } else {
        (grow(left, depth), grow(right, depth))
    };
    grown.below = Some((plane, Box::new(below)));
    grown
}

/// The cheapest pruning at a price \[bytes a cell\]: cost, cells given up, tree.
fn prune(grown: &Grown, price: f64) -> (f64, u32, Tree) {
    let whole = LEAF_BYTES + price * f64::from(grown.missed);
    let leaf = |()| (whole, grown.missed, Tree::Leaf(grown.leaf));
    let Some((plane, below)) = &grown.below else {
        return leaf(());
    };
    let (left_cost, left_missed, left) = prune(&below.0, price);
    let (right_cost, right_missed, right) = prune(&below.1, price);
    if whole <= left_cost + right_cost {
        return leaf(());
    }
    let tree = Tree::Split {
        plane: *plane,
        left: Box::new(left),
        right: Box::new(right),
    };
    (left_cost + right_cost, left_missed + right_missed, tree)
}

/// Describes the winning among some cells of a grid with `count` cells; cells that are not listed
/// may come out either way. At most `budget` winning cells are given up.
///
/// # Errors
/// A tree that the format cannot hold.
pub fn describe(
    cells: impl ParallelIterator<Item = ([u16; STATES], bool)>,
    count: [u16; STATES],
    predicates: &Predicates,
    budget: u32,
    depth_max: u32,
) -> Result<DomainPart, CompressError> {
    let mut labelled: Vec<LabelledCell> = cells
        .map(|(cell, winning)| LabelledCell {
            cell,
            labels: predicates.labels(cell, count, winning),
        })
        .collect();
    let grown = grow(&mut labelled, depth_max);
    drop(labelled);
    let (mut low, mut high) = (0.0, PRICE_MAX);
    let (mut best, mut missed) = (prune(&grown, PRICE_EXACT).2, 0);
    for _ in 0..BISECTIONS {
        if budget == 0 {
            break;
        }
        let price = 0.5 * (low + high);
        let (_, given_up, tree) = prune(&grown, price);
        if given_up > budget {
            low = price;
        } else {
            high = price;
            (best, missed) = (tree, given_up);
        }
    }
    debug_assert!(missed <= budget);
    let (predicates, tree) = used(predicates, &best);
    DomainPart::new(predicates, tree)
}

impl DomainPart {
    fn new(predicates: Predicates, tree: Tree) -> Result<Self, CompressError> {
        let Predicates {
            spaces,
            hull,
            aheads,
        } = &predicates;
        let mut bytes = vec![spaces.len() as u8, *hull as u8, aheads.len() as u8];
        for space in spaces {
            bytes.extend(space.write());
        }
        bytes.extend(aheads.as_flattened());
        bytes.extend(encode_nodes(&tree)?);
        Ok(Self {
            kind: DomainKind::Tree,
            bytes,
            worst_visits: tree.depth() + predicates.worst_visits(),
            predicates,
            tree,
        })
    }

    /// Covers nothing outside a box of cells (both ends included) of a grid with `count` cells.
    ///
    /// # Errors
    /// A tree that the format cannot hold.
    pub fn confine(
        &mut self,
        low: [u16; STATES],
        high: [u16; STATES],
        count: [u32; STATES],
    ) -> Result<(), CompressError> {
        let mut tree = self.tree.clone();
        let outside = || Box::new(Tree::Leaf(LEAF_OUTSIDE));
        for axis in 0..STATES {
            let beyond = high[axis] + 1;
            if u32::from(beyond) < count[axis] {
                tree = Tree::Split {
                    plane: Plane {
                        axis,
                        threshold: beyond,
                    },
                    left: Box::new(tree),
                    right: outside(),
                };
            }
            if low[axis] > 0 {
                tree = Tree::Split {
                    plane: Plane {
                        axis,
                        threshold: low[axis],
                    },
                    left: outside(),
                    right: Box::new(tree),
                };
            }
        }
        *self = Self::new(self.predicates.clone(), tree)?;
        Ok(())
    }

    /// Whether the part covers a cell of the grid with `count` cells.
    pub fn covers(&self, cell: [u16; STATES], count: [u16; STATES]) -> bool {
        match self.tree.leaf(Cell(cell)) {
            LEAF_OUTSIDE => false,
            leaf => self.predicates.inside(cell, count) >> leaf & 1 == 1,
        }
    }
}

/// Drops the predicates that a tree does not name, and renumbers its leaves.
fn used(predicates: &Predicates, tree: &Tree) -> (Predicates, Tree) {
    let named = tree.values();
    let is_named = |leaf: usize| named >> leaf & 1 == 1;
    let hull_named = is_named(LEAF_HULL.into());
    let mut kept = Predicates::default();
    let mut to: [u8; 64] = std::array::from_fn(|value| value as u8);
    for (k, space) in predicates.spaces.iter().enumerate() {
        let leaf = usize::from(LEAF_HALF_SPACE) + k;
        let in_hull = hull_named && k < predicates.hull;
        if in_hull || is_named(leaf) {
            to[leaf] = LEAF_HALF_SPACE + kept.spaces.len() as u8;
            kept.spaces.push(*space);
            kept.hull += usize::from(in_hull);
        }
    }
    for (k, ahead) in predicates.aheads.iter().enumerate() {
        let leaf = usize::from(LEAF_LOOK_AHEAD) + k;
        if is_named(leaf) {
            to[leaf] = LEAF_LOOK_AHEAD + kept.aheads.len() as u8;
            kept.aheads.push(*ahead);
        }
    }
    (kept, tree.renumbered(&to))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const COUNT: [u16; STATES] = [9, 1, 1, 1];
    const DEPTH_MAX: u32 = 20;

    /// The part for the winning among the cells f = 0 to 8.
    fn part(winning: &[u16], predicates: &Predicates, budget: u32) -> DomainPart {
        let cells: Vec<_> = (0..COUNT[0])
            .map(|f| ([f, 0, 0, 0], winning.contains(&f)))
            .collect();
        describe(cells.into_par_iter(), COUNT, predicates, budget, DEPTH_MAX).unwrap()
    }

    fn covered(part: &DomainPart) -> Vec<u16> {
        (0..COUNT[0])
            .filter(|f| part.covers([*f, 0, 0, 0], COUNT))
            .collect()
    }

    #[test]
    fn the_cell_that_costs_most_is_given_up() {
        let winning = [2, 3, 4, 5, 7];
        let exact = part(&winning, &Predicates::default(), 0);
        assert_eq!(covered(&exact), winning);
        // Outside, inside, outside, inside, outside: five leaves. Without the lone cell three.
        assert_eq!(exact.tree.leaves(), 5);
        let given_up = part(&winning, &Predicates::default(), 1);
        assert_eq!(covered(&given_up), [2, 3, 4, 5]);
        assert_eq!(given_up.tree.leaves(), 3);
    }

    #[test]
    fn a_half_space_that_says_it_all_is_one_leaf() {
        let from = |f: i32| AffineFunction {
            factors: [1, 0, 0, 0],
            constant: -f,
        };
        let predicates = Predicates {
            spaces: vec![from(6), from(3)],
            ..Predicates::default()
        };
        let part = part(&[3, 4, 5, 6, 7, 8], &predicates, 0);
        // The first half-space is not named: it is dropped, and the second is the first.
        assert_eq!(part.predicates.spaces, [from(3)]);
        assert_eq!(part.tree, Tree::Leaf(LEAF_HALF_SPACE));
        assert_eq!(covered(&part), [3, 4, 5, 6, 7, 8]);
    }

    #[test]
    fn a_confined_part_covers_nothing_outside_its_box() {
        let mut part = part(&[0, 1, 2, 3, 4, 5, 6, 7, 8], &Predicates::default(), 0);
        assert_eq!(part.tree, Tree::Leaf(LEAF_INSIDE));
        part.confine([2, 0, 0, 0], [4, 0, 0, 0], COUNT.map(u32::from))
            .unwrap();
        assert_eq!(covered(&part), [2, 3, 4]);
    }

    proptest! {
        #[test]
        fn no_losing_cell_is_covered_and_few_winning_ones_are_not(
            won in proptest::collection::vec(any::<bool>(), 4 * 3 * 2), budget in 0u32..6,
            hull in -4i32..4,
        ) {
            let count = [4, 3, 2, 1];
            let cells: Vec<_> = won.iter().enumerate().map(|(i, won)| {
                let i = i as u16;
                ([i % 4, i / 4 % 3, i / 12, 0], *won)
            }).collect();
            let predicates = Predicates {
                spaces: vec![AffineFunction { factors: [1, -1, 1, 0], constant: hull }],
                hull: 1,
                aheads: Vec::new(),
            };
            let listed = cells.clone().into_par_iter();
            let part = describe(listed, count, &predicates, budget, DEPTH_MAX).unwrap();
            let mut missed = 0;
            for (cell, won) in cells {
                let covered = part.covers(cell, count);
                prop_assert!(won || !covered, "{cell:?} is lost and covered");
                missed += u32::from(won && !covered);
            }
            prop_assert!(missed <= budget, "{missed} of {budget} given up");
        }
    }
}
