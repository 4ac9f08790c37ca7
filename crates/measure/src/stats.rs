//! Summaries of repeated measurements.

use serde::{Deserialize, Serialize};

/// Median, least and greatest of repeated measurements.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// The middle one; the mean of the two middle ones where their number is even.
    pub median: f64,
    /// The least.
    pub min: f64,
    /// The greatest.
    pub max: f64,
}

impl Spread {
    /// Summarises samples; none where there is no finite one.
    ///
    /// ```
    /// use afterlight_measure::Spread;
    /// assert_eq!(Spread::of(&[3.0, 1.0, 2.0, 10.0]), Some(Spread { median: 2.5, min: 1.0, max: 10.0 }));
    /// assert_eq!(Spread::of(&[]), None);
    /// ```
    pub fn of(samples: &[f64]) -> Option<Spread> {
        let mut sorted: Vec<f64> = samples.iter().copied().filter(|sample| sample.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let (min, max) = (*sorted.first()?, *sorted.last()?);
        let middle = sorted.len() / 2;
        let median = match sorted.len() % 2 {
            1 => sorted[middle],
            _ => (sorted[middle - 1] + sorted[middle]) / 2.0,
        };
        Some(Spread { median, min, max })
    }
}

/// How a time is spread over many frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Distribution {
    /// The middle one; the mean of the two middle ones where their number is even.
    pub median: f64,
    /// 95 of 100 are at most this: the least sample that 95% of all do not exceed.
    pub p95: f64,
    /// 99 of 100 are at most this.
    pub p99: f64,
    /// The greatest.
    pub worst: f64,
}

impl Distribution {
    /// Summarises samples; none where there is no finite one.
    ///
    /// ```
    /// use afterlight_measure::Distribution;
    /// let hundred: Vec<f64> = (1..=100).map(f64::from).collect();
    /// assert_eq!(Distribution::of(&hundred), Some(Distribution { median: 50.5, p95: 95.0, p99: 99.0, worst: 100.0 }));
    /// assert_eq!(Distribution::of(&[]), None);
    /// ```
    pub fn of(samples: &[f64]) -> Option<Distribution> {
        let Spread { median, max, .. } = Spread::of(samples)?;
        let mut sorted: Vec<f64> = samples.iter().copied().filter(|sample| sample.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let at_most = |percent: usize| sorted[(sorted.len() * percent).div_ceil(100) - 1];
        Some(Distribution { median, p95: at_most(95), p99: at_most(99), worst: max })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_even_and_single() {
        assert_eq!(Spread::of(&[5.0]), Some(Spread { median: 5.0, min: 5.0, max: 5.0 }));
        assert_eq!(Spread::of(&[5.0, 1.0, 3.0]), Some(Spread { median: 3.0, min: 1.0, max: 5.0 }));
        assert_eq!(Spread::of(&[4.0, 1.0]), Some(Spread { median: 2.5, min: 1.0, max: 4.0 }));
    }

    #[test]
    fn what_is_not_finite_is_left_out() {
        assert_eq!(
            Spread::of(&[f64::NAN, 2.0, f64::INFINITY]),
            Some(Spread { median: 2.0, min: 2.0, max: 2.0 })
        );
        assert_eq!(Spread::of(&[f64::NAN]), None);
    }
}
