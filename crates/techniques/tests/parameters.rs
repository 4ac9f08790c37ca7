//! Parameters that moved from lists of constants into structs are told as before.

use afterlight_stages::lights::{
    cells::CellParams,
    step::{Lights, StepParams, asked},
};
use afterlight_techniques::{
    Condition, DrawOrder, DrawParams, Exactness, Params,
    dais::{CacheParams, DaisParams, Fill, Rate, RateParams},
    deferred::DeferredParams,
    exactness_of, find,
    gbuffer_list::{Filter, FilterParams, GbufferListParams},
    params::{AutoOr, NoParams, ParamSet as _, Words},
    params_of, registry,
};
use serde_json::{Value, json};

/// The id of every technique that there was when parameters were constants, with its parameters.
fn techniques() -> Vec<(&'static str, Params)> {
    let before = before();
    let known = registry().iter().filter(|technique| before.contains_key(technique.info().id));
    known.map(|technique| (technique.info().id, params_of(*technique))).collect()
}

/// What `afterlight techniques --json` told of parameters when they were constants.
fn before() -> serde_json::Map<String, Value> {
    match serde_json::from_str(include_str!("parameters.json")).expect("JSON") {
        Value::Object(techniques) => techniques,
        other => panic!("expected an object, found {other}"),
    }
}

#[test]
fn lists_are_as_they_were() {
    let before = before();
    let now = techniques();
    let ids: Vec<&str> = now.iter().map(|(id, _)| *id).collect();
    assert_eq!(ids, before.keys().map(String::as_str).collect::<Vec<_>>());
    for (id, params) in &now {
        let list = serde_json::to_value(params.infos()).expect("a list");
        // As text, so that the order of fields and the way that numbers are written count.
        assert_eq!(list.to_string(), before[*id].to_string(), "{id}");
    }
}

#[test]
fn defaults_resolve_to_what_lists_say() {
    let before = before();
    for (id, params) in techniques() {
        let list = before[id].as_array().expect("a list");
        let expected: serde_json::Map<String, Value> = list
            .iter()
            .map(|info| (info["key"].as_str().expect("a text").to_owned(), info["default"].clone()))
            .collect();
        assert_eq!(json!(params), Value::Object(expected), "{id}");
    }
}

#[test]
fn every_default_and_end_of_a_range_is_taken() {
    for (id, mut params) in techniques() {
        let defaults = params.clone();
        for info in params.infos() {
            params.set(info.key, &info.default).unwrap_or_else(|e| panic!("{id}: {e}"));
            assert_eq!(params, defaults, "{id} {}", info.key);
            let info = serde_json::to_value(&info).expect("an object");
            let ends = ["min", "max"].iter().filter_map(|end| info.get(end));
            let texts: Vec<String> = ends.map(Value::to_string).collect();
            let names = info.get("values").and_then(Value::as_array).into_iter().flatten();
            let names = names.map(|name| name.as_str().expect("a text").to_owned());
            for text in texts.into_iter().chain(names) {
                let key = info["key"].as_str().expect("a text");
                params.set(key, &text).unwrap_or_else(|e| panic!("{id}: {e}"));
            }
            params = defaults.clone();
        }
    }
}

#[test]
fn what_is_read_has_types() {
    let mut dais = params_of(find("dais").expect("dais"));
    dais.set("fill", "cache").expect("a name");
    dais.set("cache-buckets", "65536").expect("in range");
    dais.set("order", "scene").expect("a name");
    dais.set("tile-px", "32").expect("in range");
    let typed = dais.typed::<DaisParams>();
    assert_eq!((typed.fill.fill, typed.fill.cache.buckets), (Fill::Cache, 65536));
    assert_eq!(typed.light_step().cells.tiles.tile_px, 32);
    assert_eq!(dais.typed::<CacheParams>().buckets, 65536);
    assert_eq!(dais.typed::<CellParams>().clusters.slices, 128);
    assert_eq!(dais.typed::<DrawParams>().order, DrawOrder::Scene);
    dais.typed_mut::<DaisParams>().fill.fill = Fill::Resolve;
    assert_eq!(dais.get("fill").as_deref(), Some("resolve"));
    assert!(dais.find::<NoParams>().is_none());
}

#[test]
fn shared_sets_have_defaults_of_their_own() {
    let rate = |id: &str| params_of(find(id).expect("a technique")).typed::<RateParams>().rate.cell_px();
    assert_eq!((rate("dais-list"), rate("dais-multirate")), (1, 2));
    assert_eq!(RateParams::default().rate, Rate::Half);
    assert_eq!(DeferredParams::default().light_step().lights, Lights::Volumes);
    assert_eq!(DaisParams::default().light_step().lights, Lights::Auto);
}

#[test]
fn filters_are_bits() {
    let mut params = GbufferListParams::default();
    params.set("filter", "edges+depth").expect("words");
    params.set("blocks", "4294967295").expect("in range");
    assert_eq!(params.filter.filters.bits(), 1 << 5 | 1 << 2);
    assert_eq!(params.blocks, AutoOr::Fixed(u32::MAX));
    assert_eq!(params.get("filter").as_deref(), Some("depth+edges"));
    params.set("filter", "none").expect("no words");
    assert_eq!(params.filter, FilterParams { filters: Words::NONE, ..FilterParams::default() });
    assert!(params.set("filter", "none+edges").is_err());
    assert_eq!([Filter::Edges].into_iter().collect::<Words<_>>().bits(), 1 << 5);
}

#[test]
fn what_is_left_open_has_its_default() {
    let dais = find("dais").expect("dais");
    let mut own = DaisParams::default();
    own.fill.fill = Fill::Cache;
    let params =
        afterlight_techniques::completed(dais, &Params::of(own).and(Params::of(NoParams::default())));
    assert_eq!(params.typed::<DaisParams>().fill.fill, Fill::Cache);
    assert_eq!(params.typed::<DrawParams>(), &DrawParams::default());
    assert!(!params.holds::<NoParams>(), "what the technique does not have is left out");
    assert_eq!(afterlight_techniques::completed(dais, &Params::default()), params_of(dais));
}

#[test]
fn errors_name_the_technique_and_what_it_has() {
    let tiled = find("tiled-forward").expect("tiled-forward");
    let mut params = params_of(tiled);
    let mut told = |key, value| {
        let refused = afterlight_techniques::set_param(tiled, &mut params, key, value);
        refused.expect_err("is refused").to_string()
    };
    let expected = r#"parameter "tiles" of tiled-forward: found no such parameter, expected one of: cull, cull-on, cull-px, order, tile-px"#;
    assert_eq!(told("tiles", "3"), expected);
    let expected = r#"parameter tile-px: found "3", expected a whole number from 8 to 256"#;
    assert_eq!(told("tile-px", "3"), expected);
}

#[test]
fn lights_are_found_by_type() {
    let of = |id: &str| asked(&params_of(find(id).expect("a technique")));
    assert_eq!(of("deferred"), Some(Lights::Volumes));
    assert_eq!(of("dais"), Some(Lights::Auto));
    assert_eq!(of("tiled"), None);
    assert_eq!(StepParams::default().light_step().lights, Lights::Auto);
}

/// What the paper's table promises of the hardware's multisampling is kept, or told.
#[test]
fn multisampling_of_the_papers_is_kept_or_told() {
    for technique in registry() {
        let info = technique.info();
        let told = info.departures.iter().any(|departure| departure.starts_with("one sample a pixel alone"));
        let keeps = info.samples.iter().any(|samples| *samples > 1);
        let promised = info.appendix_a.hardware_msaa == "y";
        assert!(!promised || keeps || told, "{}: one sample a pixel, and no departure says so", info.id);
        assert!(!(keeps && told), "{}: several samples, and a departure says one", info.id);
    }
}

/// Ways that are further from `forward` than the default name parameters that there are, and count where their conditions hold.
#[test]
fn approximations_hold_under_their_conditions() {
    for technique in registry() {
        let info = technique.info();
        for way in info.approximations {
            let mut params = params_of(*technique);
            for condition in way.when {
                if let Condition::Param(key, value) = condition {
                    let before = params.get(key);
                    params.set(key, value).unwrap_or_else(|e| panic!("{}: {e}", info.id));
                    let differs = before.as_deref() != Some(*value);
                    assert!(differs || way.when.len() > 1, "{}: {key}={value} is the default", info.id);
                }
            }
            assert!(!way.bound.is_empty() && way.min_psnr_db > 0.0, "{}: {way:?}", info.id);
            let found = exactness_of(*technique, &params, 4);
            let expected = Exactness::Approximate { bound: way.bound, min_psnr_db: way.min_psnr_db };
            assert_eq!(found, expected, "{}: {}", info.id, way.when_text());
        }
        assert_eq!(exactness_of(*technique, &Params::default(), 1), info.exactness, "{}", info.id);
    }
    let prepass = find("light-prepass").expect("light-prepass");
    assert!(matches!(exactness_of(prepass, &Params::default(), 4), Exactness::Approximate { .. }));
}
