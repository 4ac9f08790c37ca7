//! Which pixels and surfaces keep one sample alone (Fridvalszky and Tóth 2020, section 5): constants of `filter.glsl`.

use afterlight_graph::ConstantBits as _;

use afterlight_frame::scene::SceneGpu;

use super::params::{DepthEdges, FilterParams, Region};

/// Specialization constants of `filter.glsl`.
pub(super) fn constants(params: &FilterParams, eye_moved_m: f32) -> Vec<(String, u32)> {
    let share = |percent: f32| (percent / 100.0).bits();
    [
        ("FILTERS", params.filters.bits()),
        ("SMOOTH_INSIDE", u32::from(params.region == Region::Inside)),
        ("REGION_LEFT", share(params.left)),
        ("REGION_TOP", share(params.top)),
        ("REGION_RIGHT", share(params.right)),
        ("REGION_BOTTOM", share(params.bottom)),
        ("DEPTH_THRESHOLD_M", (params.depth_threshold_m - eye_moved_m).bits()),
        ("EDGE_THRESHOLD", params.edge_threshold.bits()),
        ("DEPTH_RANGE", u32::from(params.depth_edges == DepthEdges::Range)),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .to_vec()
}

/// A bit a draw: its node's or its material's name matches the pattern.
pub(super) fn flagged_draws(scene: &SceneGpu, pattern: &str) -> Vec<u32> {
    let mut words = vec![0u32; scene.draw_names.len().div_ceil(32).max(1)];
    for (draw, names) in scene.draw_names.iter().enumerate() {
        if !pattern.is_empty() && names.iter().any(|name| matches(pattern, name)) {
            words[draw / 32] |= 1 << (draw % 32);
        }
    }
    words
}

/// Whether a name is what a pattern says: letters as they are, `*` for any characters.
fn matches(pattern: &str, name: &str) -> bool {
    let mut parts = pattern.split('*');
    let first = parts.next().unwrap_or_default();
    let Some(mut rest) = name.strip_prefix(first) else { return false };
    let Some(last) = parts.next_back() else { return rest.is_empty() };
    for part in parts {
        match rest.find(part) {
            Some(at) => rest = &rest[at + part.len()..],
            None => return false,
        }
    }
    rest.len() >= last.len() && rest.ends_with(last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_match_whole_names() {
        for (pattern, name) in
            [("tree", "tree"), ("tree*", "tree_07"), ("*leaf", "a leaf"), ("*a*b*", "xaybz"), ("*", "")]
        {
            assert!(matches(pattern, name), "{pattern} {name}");
        }
        for (pattern, name) in
            [("tree", "trees"), ("tree*", "a tree"), ("*leaf", "leafs"), ("a*a", "a"), ("*b*a*", "ab")]
        {
            assert!(!matches(pattern, name), "{pattern} {name}");
        }
    }
}
