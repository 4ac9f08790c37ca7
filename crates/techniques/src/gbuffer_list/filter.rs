//! Which pixels and surfaces keep one sample alone (Fridvalszky and Tóth 2020, section 5): parameters, and constants of
//! `filter.glsl`.

use afterlight_graph::ConstantBits as _;

use afterlight_frame::{
    Info, Params,
    params::{ParamInfo, ParamKind},
    scene::SceneGpu,
};

/// Which filters there are; each word's place is its bit in `filter.glsl`.
const WORDS: &[&str] = &["ellipse", "rectangle", "depth", "objects", "depth-edges", "edges"];
/// Bit of the detector that compares the surfaces of a pixel.
pub(super) const EDGES: u32 = 1 << 5;

const PERCENT: ParamKind = ParamKind::Number { min: 0.0, max: 100.0 };

/// `filter`, see [`WORDS`].
pub(super) const FILTER: ParamInfo = ParamInfo {
    key: "filter",
    summary: "what keeps one sample a pixel: outside of an ellipse or a rectangle, beyond a depth, flagged objects, pixels without an edge in the depth buffer, pixels whose surfaces are alike",
    kind: ParamKind::Words { values: WORDS },
    default: "none",
};
/// `region`
pub(super) const REGION: ParamInfo = ParamInfo {
    key: "region",
    summary: "which side of the ellipse or rectangle is anti-aliased",
    kind: ParamKind::Choice { values: &["inside", "outside"] },
    default: "inside",
};
/// `left`
pub(super) const LEFT: ParamInfo = ParamInfo {
    key: "left",
    summary: "left edge of the region, percent of the width",
    kind: PERCENT,
    default: "20",
};
/// `top`
pub(super) const TOP: ParamInfo = ParamInfo {
    key: "top",
    summary: "upper edge of the region, percent of the height",
    kind: PERCENT,
    default: "15",
};
/// `right`
pub(super) const RIGHT: ParamInfo = ParamInfo {
    key: "right",
    summary: "right edge of the region, percent of the width",
    kind: PERCENT,
    default: "80",
};
/// `bottom`
pub(super) const BOTTOM: ParamInfo = ParamInfo {
    key: "bottom",
    summary: "lower edge of the region, percent of the height",
    kind: PERCENT,
    default: "85",
};
/// `depth-threshold`
pub(super) const DEPTH_THRESHOLD: ParamInfo = ParamInfo {
    key: "depth-threshold",
    summary: "view distance in metres beyond which the filter `depth` keeps one sample",
    kind: ParamKind::Number { min: 0.0, max: 1e9 },
    default: "20",
};
/// `objects`
pub(super) const OBJECTS: ParamInfo = ParamInfo {
    key: "objects",
    summary: "nodes or materials that the filter `objects` flags: a name, * for any characters",
    kind: ParamKind::Text,
    default: "",
};
/// `edge-threshold`
pub(super) const EDGE_THRESHOLD: ParamInfo = ParamInfo {
    key: "edge-threshold",
    summary: "depth-edges: share of the nearest sample's distance; edges: one less the cosine between normals",
    kind: ParamKind::Number { min: 0.0, max: 2.0 },
    default: "0.02",
};

/// Bits of the filters that are on.
pub(super) fn bits(info: &Info, params: &Params) -> u32 {
    let text = params.text(info, FILTER.key);
    WORDS
        .iter()
        .enumerate()
        .filter(|(_, word)| text.split('+').any(|w| w == **word))
        .map(|(i, _)| 1 << i)
        .sum()
}

/// Specialization constants of `filter.glsl`.
pub(super) fn constants(info: &Info, params: &Params) -> Vec<(String, u32)> {
    let share = |param: &ParamInfo| (params.number(info, param.key) / 100.0).bits();
    [
        ("FILTERS", bits(info, params)),
        ("SMOOTH_INSIDE", u32::from(params.text(info, REGION.key) == "inside")),
        ("REGION_LEFT", share(&LEFT)),
        ("REGION_TOP", share(&TOP)),
        ("REGION_RIGHT", share(&RIGHT)),
        ("REGION_BOTTOM", share(&BOTTOM)),
        ("DEPTH_THRESHOLD_M", params.number(info, DEPTH_THRESHOLD.key).bits()),
        ("EDGE_THRESHOLD", params.number(info, EDGE_THRESHOLD.key).bits()),
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
