//! Parameters that a technique is verified with: its defaults, both ways of visibility, and a set that is drawn at random.

use afterlight_scene::rng::SplitMix64;
use afterlight_techniques::{ParamInfo, ParamKind};

use crate::{Chosen, LabError};

/// The parameter that says who finds the triangles that show, and its two ways.
const VISIBILITY: (&str, [&str; 2]) = ("visibility", ["raster", "compute"]);

/// Parameters that change the picture by design, or only name what another one chooses: they are left as they are.
const NOT_DRAWN: &[(&str, &str)] = &[
    ("cull-px", "draws that are left out are missing from the picture"),
    ("order", "the order of draws decides between equal depths"),
    ("position", "the depth of a sample is not that of the pixel's centre"),
    ("filter", "pixels that a filter leaves out are not anti-aliased"),
    ("edge-threshold", "without a filter it does nothing"),
    ("depth-threshold", "without a filter it does nothing"),
    ("region", "without a filter it does nothing"),
    ("left", "without a filter it does nothing"),
    ("top", "without a filter it does nothing"),
    ("right", "without a filter it does nothing"),
    ("bottom", "without a filter it does nothing"),
    ("objects", "without a filter it does nothing"),
    ("rate", "indirect light is evaluated at fewer places"),
];

/// A technique as it is verified.
pub struct Variant {
    /// The technique and its parameters.
    pub chosen: Chosen,
    /// What it is counted as: its id, and its way of visibility where it has two.
    pub label: String,
}

/// The variants of a technique for a view; what `fixed` names, by `KEY` or `ID.KEY`, stays as it is in `base`.
///
/// # Errors
/// A value that its parameter does not take: a mistake of the declaration.
pub fn variants(base: &Chosen, fixed: &[String], rng: &mut SplitMix64) -> Result<Vec<Variant>, LabError> {
    let is_fixed = |key: &str| fixed.iter().any(|one| one == key || *one == format!("{}.{key}", base.id()));
    let infos = base.params.infos();
    let has_ways = infos.iter().any(|info| info.key == VISIBILITY.0) && !is_fixed(VISIBILITY.0);
    let ways: Vec<Option<&str>> = if has_ways { VISIBILITY.1.map(Some).to_vec() } else { vec![None] };
    let mut all = Vec::new();
    for way in &ways {
        all.push(variant(base, *way)?);
    }
    // Pipelines of drawn parameters are new ones: every second view pays for them.
    let (is_drawn, pick) = (rng.next_f32() < 0.5, rng.next_f32());
    if is_drawn {
        let mut one = variant(base, ways[(pick * ways.len() as f32) as usize])?;
        let before = one.chosen.params.clone();
        for info in &infos {
            let is_free = info.key != VISIBILITY.0 && !is_fixed(info.key);
            if is_free && let Some(value) = draw(info, rng) {
                one.chosen.set(info.key, &value)?;
            }
        }
        if one.chosen.params != before {
            all.push(one);
        }
    }
    Ok(all)
}

fn variant(base: &Chosen, way: Option<&str>) -> Result<Variant, LabError> {
    let mut chosen = Chosen { technique: base.technique, params: base.params.clone() };
    let mut label = chosen.id().to_owned();
    if let Some(way) = way {
        chosen.set(VISIBILITY.0, way)?;
        label = format!("{label} {way}");
    }
    Ok(Variant { chosen, label })
}

/// A value, every second time. Numbers are the ends of their range or a power of two between, so that pipelines are few; numbers where
/// `auto` or `none` would stand are bounds on memory, which lose something by design, and texts are names.
fn draw(info: &ParamInfo, rng: &mut SplitMix64) -> Option<String> {
    let [wanted, pick] = [rng.next_f32(), rng.next_f32()];
    if wanted < 0.5 || NOT_DRAWN.iter().any(|(key, _)| *key == info.key) {
        return None;
    }
    let of = |count: usize| ((pick * count as f32) as usize).min(count - 1);
    match info.kind {
        ParamKind::Choice { values } if !values.is_empty() => Some(values[of(values.len())].to_owned()),
        ParamKind::Bool => Some((pick < 0.5).to_string()),
        ParamKind::Integer { min, max } => {
            let powers = (0..32).map(|bit| 1i128 << bit).filter(|power| *power > min && *power < max);
            let values: Vec<i128> = [min, max].into_iter().chain(powers).collect();
            Some(values[of(values.len())].to_string())
        }
        ParamKind::Number { min, max } => Some([min, max, 1f64.clamp(min, max)][of(3)].to_string()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use afterlight_techniques::registry;

    use super::*;

    fn all_of(base: &Chosen, fixed: &[String]) -> Vec<Variant> {
        let of_view = |seed| variants(base, fixed, &mut SplitMix64::new(seed)).expect("values are taken");
        (0..200).flat_map(of_view).collect()
    }

    #[test]
    fn parameters_that_are_not_drawn_exist() {
        let keys: BTreeSet<&str> =
            registry().iter().flat_map(|one| Chosen::new(*one).params.infos()).map(|info| info.key).collect();
        for (key, reason) in NOT_DRAWN {
            assert!(keys.contains(key) && !reason.is_empty(), "{key}");
        }
    }

    #[test]
    fn every_choice_is_drawn_and_what_is_fixed_stays() {
        for technique in registry() {
            let base = Chosen::new(*technique);
            let drawn = all_of(&base, &["cull".to_owned()]);
            for info in base.params.infos() {
                let values: BTreeSet<String> =
                    drawn.iter().filter_map(|one| one.chosen.params.get(info.key)).collect();
                let is_drawn = info.key != "cull" && NOT_DRAWN.iter().all(|(key, _)| *key != info.key);
                let expected = match info.kind {
                    ParamKind::Choice { values } if info.key == VISIBILITY.0 => values.len() - 1,
                    ParamKind::Choice { values } if is_drawn => values.len(),
                    ParamKind::Integer { .. } if is_drawn => 3,
                    _ => 1,
                };
                assert!(values.len() >= expected, "{} {}: {values:?}", base.id(), info.key);
                assert!(is_drawn || values.len() == 1, "{} {}: {values:?}", base.id(), info.key);
            }
        }
    }

    #[test]
    fn both_ways_of_visibility_are_there_unless_one_is_asked_for() {
        let mut base = Chosen::new(crate::technique("techniques", "visibility").expect("is there"));
        let labels = |all: Vec<Variant>| all.into_iter().map(|one| one.label).collect::<BTreeSet<_>>();
        assert_eq!(labels(all_of(&base, &[])).len(), 2);
        base.set("visibility", "compute").expect("is taken");
        let fixed = all_of(&base, &["visibility".to_owned()]);
        assert!(fixed.iter().all(|one| one.chosen.params.get("visibility").as_deref() == Some("compute")));
        assert_eq!(labels(fixed).len(), 1);
    }
}
