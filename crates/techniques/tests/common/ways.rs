//! Every way in which techniques find and keep the surfaces that show.

use afterlight_techniques::{Params, Technique, registry};

use super::params;

/// Ways in which a technique finds and keeps surfaces, by its parameters: who fills its lists, who finds visibility, how.
pub fn ways_of_surfaces(id: &str) -> &'static [&'static [(&'static str, &'static str)]] {
    match id {
        "gbuffer-list" => &[&[("visibility", "raster")], &[("fill", "raster")], &[("visibility", "compute")]],
        "visibility" => &[&[("visibility", "raster")], &[("visibility", "compute")]],
        "dais" | "dais-multirate" => &[
            &[("visibility", "raster")],
            &[("visibility", "compute")],
            &[("fill", "cache")],
            &[("fill", "cache"), ("cache-buckets", "1")],
            &[("fill", "cache"), ("reference-bits", "8")],
        ],
        "dais-list" => &[&[], &[("bands", "1")], &[("bands", "3")]],
        "hybrid" => &[&[], &[("path", "deferred")], &[("path", "prepass")], &[("prepass-weight", "0.7")]],
        _ => &[&[]],
    }
}

/// Every technique in every such way, and its name with the parameters.
pub fn every_way() -> Vec<(&'static dyn Technique, Params, String)> {
    let ways = |technique: &'static dyn Technique| {
        let id = technique.info().id;
        ways_of_surfaces(id).iter().map(move |way| {
            let words: Vec<String> = way.iter().map(|(key, value)| format!("{key}={value}")).collect();
            (technique, params(technique, way), format!("{id} {}", words.join(" ")))
        })
    };
    registry().iter().copied().flat_map(ways).collect()
}
