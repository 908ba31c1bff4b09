//! Where a pixel's sequence of samples is cut, so that its sums are the same bits however it was rendered in waves.
//!
//! A block is a node of one endless tree: `[0, 2^k)` is `[0, 2^(k-1))` and `[2^(k-1), 2^k)`; `[2^k, 2^(k+1))` is its two
//! halves. What has no children is summed at once (exactly, before rounding), what has is the f32 sum of its children:
//! a function of the block alone. So a film that goes on joins what it has, and one that is rendered in a single wave
//! finds the same numbers.

use std::ops::Range;

/// Blocks that a film with `spp` samples holds, in order: each sample by itself up to four; the quarters of the greatest
/// power of two `m` from there on, then what is of `[m, 3m/2)` and of `[3m/2, 2m)`.
pub fn layout(spp: u32) -> Vec<Range<u32>> {
    if spp <= super::BLOCKS {
        return (0..spp).map(|i| i..i + 1).collect();
    }
    let m = 1 << spp.ilog2();
    let mut blocks: Vec<_> = (0..super::BLOCKS).map(|i| i * (m / 4)..(i + 1) * (m / 4)).collect();
    let middle = m + m / 2;
    blocks.extend([m..spp.min(middle), middle..spp].into_iter().filter(|block| !block.is_empty()));
    blocks
}

/// Blocks that are held at once at most by a film that goes on.
pub const MOST: u32 = 6;

/// The two blocks that `block` is the sum of; `None` for one that is summed at once.
fn children(block: &Range<u32>) -> Option<[Range<u32>; 2]> {
    let Range { start, end } = *block;
    let is_whole = end.is_power_of_two() && if start == 0 { end > 1 } else { end == 2 * start && start > 1 };
    let middle = start + (end - start) / 2;
    is_whole.then_some([start..middle, middle..end])
}

/// The blocks of `layout(to)` that lie beyond `from` samples, cut where `from` cuts one.
pub fn beyond(from: u32, to: u32) -> Vec<Range<u32>> {
    fn add(from: u32, block: Range<u32>, found: &mut Vec<Range<u32>>) {
        if block.start >= from {
            found.push(block);
        } else if block.end > from {
            let parts = children(&block).expect("waves end at the ends of blocks, but for the last");
            parts.into_iter().for_each(|part| add(from, part, found));
        }
    }
    let mut found = Vec::new();
    layout(to).into_iter().for_each(|block| add(from, block, &mut found));
    found
}

/// Whether a film of so many samples can go on: `2^k` and `3 2^k`.
pub fn is_end(spp: u32) -> bool {
    let odd = spp >> spp.trailing_zeros().min(31);
    odd <= 1 || odd == 3
}

/// The least end beyond `spp` samples.
pub fn next_end(spp: u32) -> u32 {
    match spp {
        0 | 1 => spp + 1,
        _ => {
            let m = 1 << spp.ilog2();
            if spp < m + m / 2 { m + m / 2 } else { 2 * m }
        }
    }
}

/// What of the tree is summed at once and has sample `sample`: numbered in order, 0 for sample 0.
#[inline]
pub fn leaf(sample: u32) -> u32 {
    if sample < 2 {
        return sample;
    }
    let top = sample.ilog2();
    2 * top + (sample >> (top - 1) & 1)
}

/// The blocks summed at once that `block` is made of, in the order of [`leaf`].
pub fn leaves(block: &Range<u32>) -> Vec<Range<u32>> {
    match children(block) {
        Some(parts) => parts.iter().flat_map(leaves).collect(),
        None => vec![block.clone()],
    }
}

/// Takes `block` out of `parts`, joined of its children where it is not there itself.
///
/// # Panics
/// When a part is missing.
pub fn joined<T>(block: &Range<u32>, parts: &mut Vec<(Range<u32>, T)>, join: &impl Fn(&mut T, T)) -> T {
    if let Some(at) = parts.iter().position(|(part, _)| part == block) {
        return parts.swap_remove(at).1;
    }
    let [first, second] = children(block).expect("a block is there or its children are");
    let mut all = joined(&first, parts, join);
    let second = joined(&second, parts, join);
    join(&mut all, second);
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_cover_the_samples_once_and_there_are_never_more_than_stated() {
        for spp in 1..2000 {
            let blocks = layout(spp);
            assert_eq!((blocks[0].start, blocks[blocks.len() - 1].end), (0, spp));
            assert!(blocks.windows(2).all(|pair| pair[0].end == pair[1].start) && blocks.len() <= MOST as usize);
            for block in &blocks {
                let leaves = leaves(block);
                let numbers: Vec<u32> = (block.start..block.end).map(leaf).collect();
                let of_leaf = |(i, range): (usize, &Range<u32>)| vec![leaf(block.start) + i as u32; range.len()];
                assert_eq!(numbers, leaves.iter().enumerate().flat_map(of_leaf).collect::<Vec<_>>(), "{block:?}");
            }
        }
        assert_eq!(layout(64), [0..16, 16..32, 32..48, 48..64]);
        assert_eq!(layout(100), [0..16, 16..32, 32..48, 48..64, 64..96, 96..100]);
    }

    #[test]
    fn waves_of_any_length_join_to_the_same_sums() {
        // A sum that remembers how it was made.
        let join = |a: &mut String, b: String| *a = format!("({a} {b})");
        let part = |block: &Range<u32>| {
            let mut leaves: Vec<_> =
                leaves(block).into_iter().map(|leaf| (leaf.clone(), format!("{leaf:?}"))).collect();
            (block.clone(), joined(block, &mut leaves, &join))
        };
        let at_once = |spp: u32| layout(spp).iter().map(part).collect::<Vec<_>>();
        for ends in
            [vec![32, 64, 96, 128, 192, 200], vec![1, 2, 4, 8, 16, 32, 37], vec![96, 512], vec![3, 6, 7], vec![12]]
        {
            let mut held: Vec<(Range<u32>, String)> = Vec::new();
            let mut from = 0;
            for to in ends {
                held.extend(beyond(from, to).iter().map(part));
                assert!(held.iter().map(|(block, _)| block.len()).sum::<usize>() == to as usize);
                held = layout(to).into_iter().map(|b| (b.clone(), joined(&b, &mut held, &join))).collect();
                assert_eq!(held, at_once(to), "{from}..{to}");
                from = to;
            }
        }
    }

    #[test]
    fn ends_are_powers_of_two_and_three_quarters_of_them() {
        let mut ends = vec![0];
        while ends.len() < 14 {
            ends.push(next_end(ends[ends.len() - 1]));
        }
        assert_eq!(ends, [0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96]);
        assert!((1..=96).all(|n| is_end(n) == ends.contains(&n)));
        assert_eq!([next_end(5), next_end(65), next_end(100)], [6, 96, 128]);
    }
}
