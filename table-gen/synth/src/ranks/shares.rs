//! Work that is a list of items, shared out between ranks: parameter studies, scorecards.
//!
//! Rank r of n takes the items r, r + n, r + 2 n and so on, and the first rank collects what they
//! answered, in the items' order. So the whole does not depend on the number of ranks if an item's
//! answer does not depend on the others.

use super::{Transport, gather};
use crate::game::exchange::Lost;

/// The items that this rank takes.
pub fn own<T: Clone>(transport: &impl Transport, items: &[T]) -> Vec<T> {
    let own = items.iter().skip(transport.rank());
    own.step_by(transport.ranks()).cloned().collect()
}

/// Answers to all items in their order, on the first rank; `None` on the others. Every rank calls
/// it with the answers to its [`own`] items, in their order.
///
/// # Errors
/// A rank that is gone, or that has answered more or fewer items than others.
pub fn collect(
    transport: &impl Transport,
    answers: &[Vec<u8>],
) -> Result<Option<Vec<Vec<u8>>>, Lost> {
    let mut words = vec![answers.len() as u64];
    for answer in answers {
        words.push(answer.len() as u64);
        words.extend(answer.chunks(8).map(packed));
    }
    let Some(words) = gather(transport, &words)? else {
        return Ok(None);
    };
    let mut rest = words.as_slice();
    let mut by_rank = Vec::with_capacity(transport.ranks());
    for rank in 0..transport.ranks() {
        let answers =
            unpacked(&mut rest).ok_or_else(|| Lost(format!("rank {rank} sent half an answer")))?;
        by_rank.push(answers.into_iter());
    }
    let count = by_rank.iter().map(ExactSizeIterator::len).sum();
    let ranks = by_rank.len();
    let mut all = Vec::with_capacity(count);
    for item in 0..count {
        let rank = item % ranks;
        let answer = by_rank[rank].next();
        all.push(answer.ok_or_else(|| Lost(format!("rank {rank} has no answer to item {item}")))?);
    }
    Ok(Some(all))
}

/// Up to eight bytes as a word.
fn packed(bytes: &[u8]) -> u64 {
    let mut word = [0; 8];
    word[..bytes.len()].copy_from_slice(bytes);
    u64::from_le_bytes(word)
}

/// A rank's answers from the front of the words; `None` where they end too soon.
fn unpacked(words: &mut &[u64]) -> Option<Vec<Vec<u8>>> {
    let (count, mut rest) = words.split_first()?;
    let mut answers = Vec::new();
    for _ in 0..*count {
        let (len, after) = rest.split_first()?;
        let len = usize::try_from(*len).ok()?;
        let (body, after) = after.split_at_checked(len.div_ceil(8))?;
        let mut bytes: Vec<u8> = body.iter().flat_map(|word| word.to_le_bytes()).collect();
        bytes.truncate(len);
        answers.push(bytes);
        rest = after;
    }
    *words = rest;
    Some(answers)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

    use super::super::threads;
    use super::*;

    /// Bytes of no word's length, that differ from item to item.
    fn answer(item: u32) -> Vec<u8> {
        (0..item).map(|n| (n * 7 + item) as u8).collect()
    }

    #[test]
    fn any_number_of_ranks_collects_what_one_would_answer() {
        for items in [0, 1, 2, 7, 20] {
            let items: Vec<u32> = (0..items).collect();
            let alone: Vec<_> = items.iter().map(|item| answer(*item)).collect();
            for count in 1..=5 {
                let found = threads::run(count, |rank| {
                    let own: Vec<_> = own(rank, &items).into_iter().map(answer).collect();
                    collect(rank, &own).unwrap()
                });
                assert_eq!(found[0].as_ref(), Some(&alone), "{count} ranks");
                assert!(found[1..].iter().all(Option::is_none));
            }
        }
    }

    #[test]
    fn a_rank_that_left_items_out_is_named() {
        let found = threads::run(2, |rank| {
            let all = if rank.rank() == 0 { 3 } else { 1 };
            collect(rank, &vec![vec![1, 2]; all])
        });
        let error = found[0].as_ref().unwrap_err().to_string();
        assert!(error.contains("rank 1 has no answer to item 3"), "{error}");
    }
}
