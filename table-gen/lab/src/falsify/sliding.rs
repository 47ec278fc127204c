//! The least and the greatest of each charger's commands in a window of ticks that only moves
//! forward, at a cost that does not grow with the window.
//!
//! The window is cut in two. Of its older part the ends of every row and all after it are kept, of
//! its newer part those of all rows together. So a row that comes in is folded once; once the older
//! part is used up, all of the window becomes it.

use std::ops::Range;

/// Least and greatest of each charger.
#[derive(Debug, Clone, Default)]
pub(super) struct Ends {
    pub(super) least: Vec<u32>,
    pub(super) most: Vec<u32>,
}

impl Ends {
    fn none(members: usize) -> Self {
        Self {
            least: vec![0; members],
            most: vec![0; members],
        }
    }

    fn set(&mut self, row: &[u32]) {
        self.least.copy_from_slice(row);
        self.most.copy_from_slice(row);
    }

    fn fold(&mut self, least: &[u32], most: &[u32]) {
        for (own, other) in self.least.iter_mut().zip(least) {
            *own = (*own).min(*other);
        }
        for (own, other) in self.most.iter_mut().zip(most) {
            *own = (*own).max(*other);
        }
    }
}

/// The window.
#[derive(Debug, Clone)]
pub(super) struct Sliding {
    /// Where the newer part begins, and where it ends \[ticks\].
    middle: usize,
    end: usize,
    /// Of the rows from a tick of the older part to its end, by tick modulo the number of rows.
    older: Vec<Ends>,
    /// Of all rows of the newer part.
    newer: Ends,
    /// Of both.
    both: Ends,
}

impl Sliding {
    /// So many chargers, and rows that are kept; a window never is as long.
    pub(super) fn new(members: usize, kept: usize) -> Self {
        Self {
            middle: 0,
            end: 0,
            older: vec![Ends::none(members); kept],
            newer: Ends::none(members),
            both: Ends::none(members),
        }
    }

    /// The ends over a window that is not empty and of which neither end lies before those asked
    /// for earlier. Rows are by tick modulo their number, each with whether it differs from the
    /// one before.
    pub(super) fn ends(
        &mut self,
        ticks: Range<usize>,
        rows: &[Vec<u32>],
        differs: &[bool],
    ) -> &Ends {
        let kept = rows.len();
        if ticks.start >= self.middle {
            for tick in ticks.clone().rev() {
                let mut ends = std::mem::take(&mut self.older[tick % kept]);
                if tick + 1 == ticks.end {
                    ends.set(&rows[tick % kept]);
                } else {
                    let after = &self.older[(tick + 1) % kept];
                    ends.least.copy_from_slice(&after.least);
                    ends.most.copy_from_slice(&after.most);
                    if differs[(tick + 1) % kept] {
                        ends.fold(&rows[tick % kept], &rows[tick % kept]);
                    }
                }
                self.older[tick % kept] = ends;
            }
            (self.middle, self.end) = (ticks.end, ticks.end);
        }
        for tick in self.end..ticks.end {
            let row = &rows[tick % kept];
            if tick == self.middle {
                self.newer.set(row);
            } else if differs[tick % kept] {
                self.newer.fold(row, row);
            }
        }
        self.end = ticks.end;
        let older = &self.older[ticks.start % kept];
        if self.end == self.middle {
            return older;
        }
        self.both.least.copy_from_slice(&older.least);
        self.both.most.copy_from_slice(&older.most);
        self.both.fold(&self.newer.least, &self.newer.most);
        &self.both
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Against every row of the window, one after the other.
        #[test]
        fn any_window_that_moves_forward_has_the_ends_of_its_rows(
            changes in proptest::collection::vec((0u32..4, 0u32..4, any::<bool>()), 1..200),
            moves in proptest::collection::vec((0usize..3, 0usize..3), 1..200),
            kept in 2usize..20,
        ) {
            let mut history = vec![vec![1, 1]];
            for (a, b, stays) in &changes {
                let last = history[history.len() - 1].clone();
                history.push(if *stays { last } else { vec![*a, *b] });
            }
            let mut sliding = Sliding::new(2, kept);
            let (mut start, mut end) = (0, 1);
            for (shorter, longer) in moves {
                end = (end + longer).min(history.len());
                start = (start + shorter).clamp(end.saturating_sub(kept - 1), end - 1);
                let mut rows = vec![Vec::new(); kept];
                let mut differs = vec![false; kept];
                for tick in end.saturating_sub(kept)..end {
                    rows[tick % kept] = history[tick].clone();
                    differs[tick % kept] = tick == 0 || history[tick] != history[tick - 1];
                }
                let found = sliding.ends(start..end, &rows, &differs);
                for charger in 0..2 {
                    let of = || history[start..end].iter().map(|row| row[charger]);
                    prop_assert_eq!(Some(found.least[charger]), of().min());
                    prop_assert_eq!(Some(found.most[charger]), of().max());
                }
            }
        }
    }
}
