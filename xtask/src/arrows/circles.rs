//! Finds arrows that run in a circle.

use std::collections::{BTreeMap, BTreeSet};

/// Returns the arrows both of whose ends can reach each other: each lies on a circle.
pub fn on_circles<'a>(arrows: &BTreeSet<(&'a str, &'a str)>) -> Vec<(&'a str, &'a str)> {
    let mut next: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (from, to) in arrows {
        next.entry(from).or_default().push(to);
    }
    let reaches = |from: &str, to: &str| {
        let mut seen = BTreeSet::new();
        let mut open = vec![from];
        while let Some(at) = open.pop() {
            for &step in next.get(at).into_iter().flatten() {
                if step == to {
                    return true;
                }
                if seen.insert(step) {
                    open.push(step);
                }
            }
        }
        false
    };
    arrows.iter().filter(|(from, to)| from != to && reaches(to, from)).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrows_of_circles_are_found_and_no_others() {
        let arrows = BTreeSet::from([("a", "b"), ("b", "c"), ("c", "a"), ("c", "d"), ("e", "a"), ("d", "d")]);
        assert_eq!(on_circles(&arrows), [("a", "b"), ("b", "c"), ("c", "a")]);
    }
}
