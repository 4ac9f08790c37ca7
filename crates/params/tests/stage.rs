//! How techniques and stages take typed parameters: a model of the traits of the frame, small enough to see whole.

#[allow(dead_code, reason = "other techniques have another test")]
#[path = "../drafts/mod.rs"]
mod drafts;

use afterlight_params::{ParamSet, Params};
use drafts::{
    dais::{CacheParams, DaisParams, Fill},
    draws::{DrawOrder, DrawParams},
    light_step::{LightStepParams, Lights},
};

/// What a renderer holds: any technique.
trait Technique {
    /// The defaults of its parameters.
    fn params(&self) -> Params;
    /// Declares its passes.
    fn record(&self, graph: &mut Vec<String>, params: &Params);
}

/// What a technique is written as: it names the type of its parameters, and is given no other.
trait Typed {
    type Params: ParamSet + Default;
    fn record_typed(&self, graph: &mut Vec<String>, params: &Self::Params);
}

impl<T: Typed> Technique for T {
    fn params(&self) -> Params {
        Params::of(T::Params::default())
    }

    fn record(&self, graph: &mut Vec<String>, params: &Params) {
        self.record_typed(graph, params.typed());
    }
}

/// Parameters that every technique has, before its own.
fn params_of(technique: &dyn Technique) -> Params {
    Params::of(DrawParams::default()).and(technique.params())
}

struct Dais;

impl Typed for Dais {
    type Params = DaisParams;

    fn record_typed(&self, graph: &mut Vec<String>, params: &DaisParams) {
        match params.fill.fill {
            Fill::Auto | Fill::Resolve => graph.push("resolve".to_owned()),
            Fill::Cache => fill_through_cache(graph, params.fill.cache),
        }
        find_lights(graph, params.light_step());
    }
}

/// A stage: it knows its own parameters, and not whose they are.
fn fill_through_cache(graph: &mut Vec<String>, CacheParams { buckets }: CacheParams) {
    graph.push(format!("fill through {buckets} buckets"));
}

fn find_lights(graph: &mut Vec<String>, asked: LightStepParams) {
    let tile_px = asked.cells.tiles.tile_px;
    match asked.lights {
        Lights::Tiles | Lights::Tiles25d => graph.push(format!("tiles of {tile_px} px")),
        other => graph.push(other.to_string()),
    }
}

#[test]
fn text_reaches_stages_as_types() {
    let technique: &dyn Technique = &Dais;
    let mut params = params_of(technique);
    for (key, text) in
        [("fill", "cache"), ("cache-buckets", "64"), ("lights", "tiles"), ("tile-px", "8"), ("order", "near")]
    {
        params.set(key, text).expect("a value");
    }
    assert_eq!(params.typed::<DrawParams>().order, DrawOrder::Near);
    let mut graph = Vec::new();
    technique.record(&mut graph, &params);
    assert_eq!(graph, ["fill through 64 buckets", "tiles of 8 px"]);
}

#[test]
fn a_program_sets_fields() {
    let mut own = DaisParams::default();
    own.fill.fill = Fill::Cache;
    own.lights.lights = Lights::Tree;
    let mut graph = Vec::new();
    Technique::record(&Dais, &mut graph, &Params::of(own));
    assert_eq!(graph, ["fill through 8192 buckets", "tree"]);
}
