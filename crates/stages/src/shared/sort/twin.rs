//! The same sort on the CPU, for tests.

use super::KeyBits;

/// Sorts items of a key and a value by those low bits of the keys that decide, ascending; items whose bits are equal keep their order. Digit by
/// digit as on the device, from one place to another by the count of lower digits.
pub fn by_key(items: &[(u32, u32)], key_bits: KeyBits) -> Vec<(u32, u32)> {
    let mut items = items.to_vec();
    let mut sorted = items.clone();
    for shift in key_bits.shifts() {
        let digit_of = |key: u32| (key >> shift & 0xff) as usize;
        let mut counts = [0_usize; 256];
        for (key, _) in &items {
            counts[digit_of(*key)] += 1;
        }
        let mut next = 0;
        let mut place = counts.map(|count| {
            let first = next;
            next += count;
            first
        });
        for item in &items {
            let place = &mut place[digit_of(item.0)];
            sorted[*place] = *item;
            *place += 1;
        }
        std::mem::swap(&mut items, &mut sorted);
    }
    items
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn key_bits() -> impl Strategy<Value = KeyBits> {
        (0..KeyBits::ALL.len()).prop_map(|i| KeyBits::ALL[i])
    }

    proptest! {
        #[test]
        fn it_is_a_stable_sort_by_the_low_bits(
            keys in prop::collection::vec(prop_oneof![any::<u32>(), 0..4_u32, Just(u32::MAX)], 0..600),
            key_bits in key_bits(),
        ) {
            let items: Vec<(u32, u32)> = keys.into_iter().zip(0..).collect();
            let mut expected = items.clone();
            expected.sort_by_key(|(key, _)| key & key_bits.mask());
            prop_assert_eq!(by_key(&items, key_bits), expected);
        }
    }

    /// Values tell a sort that is not stable: the same items from last to first are in order by their keys as well, and are another list.
    #[test]
    fn items_in_the_wrong_order_are_told() {
        let items = [(1, 0), (0, 1), (1, 2), (0, 3)];
        let stable = by_key(&items, KeyBits::Low8);
        assert_eq!(stable, [(0, 1), (0, 3), (1, 0), (1, 2)]);
        let reversed: Vec<_> = items.iter().rev().copied().collect();
        let other = by_key(&reversed, KeyBits::Low8);
        assert!(other.is_sorted_by_key(|(key, _)| *key) && other != stable);
    }
}
