//! Filters of `gbuffer-list`, as the experiments set them.

/// A filter of `gbuffer-list` as the experiments set it: its name and its parameters.
pub(crate) struct Filter {
    pub name: &'static str,
    pub params: &'static [(&'static str, &'static str)],
}

/// Every filter, each alone. Foliage is flagged by its material's name, as the paper flags trees; regions and thresholds are
/// the parameters' defaults, written out.
pub(crate) const FILTERS: &[Filter] = &[
    Filter { name: "ellipse", params: &[("filter", "ellipse")] },
    Filter { name: "rectangle", params: &[("filter", "rectangle")] },
    Filter { name: "depth", params: &[("filter", "depth"), ("depth-threshold", "20")] },
    Filter { name: "objects", params: &[("filter", "objects"), ("objects", "leaves")] },
    Filter { name: "depth-edges", params: &[("filter", "depth-edges"), ("edge-threshold", "0.02")] },
    Filter { name: "edges", params: &[("filter", "edges"), ("edge-threshold", "0.02")] },
];
