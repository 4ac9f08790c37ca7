//! SplitMix64 (Steele, Lea, Flood 2014): the one source of pseudo-random numbers of scenes and lights.

/// A SplitMix64 generator. Its state is the seed.
#[derive(Clone, Debug)]
pub struct SplitMix64 {
    state: u64,
}

impl SplitMix64 {
    /// A generator that starts at a seed.
    pub fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// The next 64 bits.
    pub fn next_u64(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = self.state;
        let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// The next number in [0, 1): the upper 24 bits over 2^24, so exact in `f32`.
    pub fn next_f32(&mut self) -> f32 {
        (self.next_u64() >> 40) as f32 / 16_777_216.0
    }

    /// The next number in [`low`, `high`).
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.next_f32()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_values_of_seed_1234567_are_the_published_ones() {
        let mut rng = SplitMix64::new(1_234_567);
        let found: Vec<u64> = (0..3).map(|_| rng.next_u64()).collect();
        assert_eq!(found, [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423]);
    }

    #[test]
    fn numbers_are_the_upper_24_bits() {
        let (mut bits, mut numbers) = (SplitMix64::new(1), SplitMix64::new(1));
        for _ in 0..1000 {
            let expected = (bits.next_u64() >> 40) as f64 / f64::from(1 << 24);
            let found = f64::from(numbers.next_f32());
            assert!(found == expected && (0.0..1.0).contains(&found));
        }
    }
}
