//! Words to sort by: a float in the upper 32 bits, and below it the place of what has it, so that those of one float keep the order of their
//! places. Integers are sorted several times as fast as pairs by a comparison.

/// Bits of a float whose order as unsigned numbers is that of the floats ([`f32::total_cmp`]): −0 before 0, NaN first or last by its sign.
pub const fn sortable_bits(value: f32) -> u32 {
    let bits = value.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

/// The float that [`sortable_bits`] were made of.
pub const fn from_sortable_bits(bits: u32) -> f32 {
    f32::from_bits(if bits >> 31 == 1 { bits & !(1 << 31) } else { !bits })
}

/// A word by which the greatest float comes first.
pub(crate) fn greatest_first(value: f32, place: u32) -> u64 {
    u64::from(!sortable_bits(value)) << 32 | u64::from(place)
}

/// The place that a word has.
pub(crate) fn place_of(word: u64) -> u32 {
    word as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Any bits: infinities, zeros of both signs and what is no number have their places as well.
        #[test]
        fn words_order_as_floats_and_places(a: u32, b: u32, first: u32, second: u32) {
            let [a, b] = [a, b].map(f32::from_bits);
            let word = greatest_first;
            prop_assert_eq!(word(a, first).cmp(&word(b, second)), b.total_cmp(&a).then(first.cmp(&second)));
            prop_assert_eq!(word(a, first).cmp(&word(a, second)), first.cmp(&second));
            prop_assert_eq!(place_of(word(a, first)), first);
        }
    }
}
