//! `verify` on built-in scenes: every technique and way of visibility from drawn views, with a seed that is always the same and with one of the
//! day; and that it finds what is wrong.

use std::time::{SystemTime, UNIX_EPOCH};

use afterlight_lab::verify::{Fixed, VerifySpec, verify, verify_failure};
use afterlight_lab::{Chosen, FrameSpec, Session, Silent, choose, technique};
use afterlight_measure::Verification;
use afterlight_scene::Scene;
use afterlight_techniques::cost::{Cost, Workload};
use afterlight_techniques::graph::{Graph, ImageHandle};
use afterlight_techniques::{Exactness, Frame, Info, Params, Technique, TechniqueError, find};

/// Views of one scene in a test: more are for the program.
const VIEWS: u64 = 3;

fn open(source: &str) -> (Session, Scene, FrameSpec) {
    let device = std::env::var("AFTERLIGHT_DEVICE").ok();
    let spec = FrameSpec { width: 64, height: 64, device, validate: true, ..FrameSpec::default() };
    let (session, scene) =
        Session::open_with_scene(source, &spec, &Silent).unwrap_or_else(|error| panic!("{source}: {error}"));
    (session, scene, spec)
}

fn small(views: u64, seed: u64) -> VerifySpec {
    let fixed = Fixed { width: Some(101), height: Some(67), validate: true, ..Fixed::default() };
    VerifySpec { views, seed, fixed: Fixed { lights: Some(12), ..fixed }, ..VerifySpec::default() }
}

fn run(source: &str, techniques: &[Chosen], spec: &VerifySpec) -> Verification {
    let (session, scene, frame) = open(source);
    let found = verify(&session, &scene, source, techniques, spec, &|_, _| Ok(None), &Silent)
        .unwrap_or_else(|error| panic!("{source}: {error}"));
    session.finish(&frame, &Silent).unwrap_or_else(|error| panic!("{source}: {error}"));
    found
}

/// What is off, with the commands that repeat it.
fn told(found: &Verification) -> String {
    let lines = found.off.iter().map(|one| {
        let reason = one.reason.as_deref().unwrap_or_default();
        format!("view {}, {}: {reason}\n  {}\n", one.view, one.technique, one.command)
    });
    lines.collect()
}

fn all_hold(source: &str, seed: u64) {
    let all = choose("techniques", &["all".to_owned()], &[]).expect("all");
    let found = run(source, &all, &small(VIEWS, seed));
    println!("{source}, seed {seed}: {} comparisons, probes {:?}", found.comparisons, found.probes);
    assert!(verify_failure(&found).is_none(), "{source}, seed {seed}:\n{}", told(&found));
    assert_eq!((found.views, found.off_count), (VIEWS, 0));
    assert!(found.comparisons > VIEWS * 15, "{} comparisons", found.comparisons);
    assert!(found.probes.surfaces > VIEWS * 64, "{:?}", found.probes);
}

/// Rasterisation in compute is verified beside the raster pass, wherever the device has it.
#[test]
fn both_ways_of_visibility_are_compared() {
    let visibility = choose("techniques", &["visibility".to_owned()], &[]).expect("visibility");
    let mut spec = small(1, 3);
    spec.fixed.samples = Some(1);
    let found = run("builtin:intersect", &visibility, &spec);
    assert!(verify_failure(&found).is_none(), "{}", told(&found));
    let compared =
        |label: &str| found.techniques.iter().any(|one| one.technique == label && one.comparisons > 0);
    assert!(compared("visibility raster"), "{:?}", found.techniques);
    match found.left_out.iter().find(|one| one.technique == "visibility compute") {
        Some(left_out) => {
            afterlight_testkit::skip(afterlight_testkit::Need::ComputeVisibility, &left_out.reason)
        }
        None => assert!(compared("visibility compute"), "{:?}", found.techniques),
    }
}

const SCENES: [&str; 4] = [
    "builtin:floor",
    "builtin:intersect",
    "builtin:spheres?segments=16",
    "builtin:colonnade?triangles=17000&texture=64",
];

#[test]
fn every_technique_holds_from_views_of_a_fixed_seed() {
    for source in SCENES {
        all_hold(source, 20);
    }
}

/// Another seed every day; the message of a failure has commands that repeat it.
#[test]
fn every_technique_holds_from_views_of_a_fresh_seed() {
    let days = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs() / 86_400);
    for source in SCENES {
        all_hold(source, days);
    }
}

/// A technique that keeps four lights a pixel and claims to be exact.
struct FourLights(Info);

impl Technique for FourLights {
    fn info(&self) -> &Info {
        &self.0
    }

    fn shaders(&self) -> &[afterlight_techniques::shader::Shader] {
        of_four_lights().shaders()
    }

    fn params(&self) -> Params {
        of_four_lights().params()
    }

    fn predict(&self, workload: &Workload, params: &Params) -> Cost {
        of_four_lights().predict(workload, params)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        of_four_lights().record(graph, frame)
    }
}

fn of_four_lights() -> &'static dyn Technique {
    find("light-indexed").expect("is there")
}

static BROKEN: FourLights =
    FourLights(Info { id: "broken", exactness: Exactness::Exact { min_psnr_db: 50.0 }, ..Info::USUAL });

#[test]
fn a_technique_that_loses_lights_is_off() {
    let spec = small(6, 4);
    let spec = VerifySpec { fixed: Fixed { lights: Some(60), samples: Some(1), ..spec.fixed }, ..spec };
    let honest = Chosen::new(technique("techniques", "tiled").expect("is there"));
    let found = run("builtin:spheres?segments=16", &[honest, Chosen::new(&BROKEN)], &spec);
    assert!(verify_failure(&found).is_some_and(|why| why.contains("broken")), "{found:?}");
    assert!(
        found.off.iter().all(|one| one.technique == "broken" && one.margin_db < Some(0.0)),
        "{}",
        told(&found)
    );
    assert_eq!(found.techniques[0].off, 0);
    // The worst comes first, and its command names what was drawn.
    assert!(found.off.is_sorted_by(|a, b| a.margin_db <= b.margin_db));
    assert!(found.off[0].command.contains("--lights 60") && found.off[0].command.contains("--camera"));
}

/// A run that checks nothing proves nothing.
#[test]
fn no_view_is_no_success() {
    let one = [Chosen::new(technique("techniques", "deferred").expect("is there"))];
    let found = run("builtin:floor", &one, &VerifySpec { seconds: Some(1e-9), ..small(4, 9) });
    assert_eq!((found.views, found.off_count), (0, 0));
    assert!(verify_failure(&found).is_some_and(|why| why.contains("no view was checked")));
}

/// Views of one seed are the same whoever draws them.
#[test]
fn views_may_be_shared_among_programs() {
    let one = [Chosen::new(technique("techniques", "deferred").expect("is there"))];
    let source = "builtin:intersect";
    let spec = VerifySpec { probes: 16, ..small(4, 9) };
    let spec = VerifySpec { fixed: Fixed { samples: Some(1), ..spec.fixed }, ..spec };
    let all = run(source, &one, &spec);
    let halves = [0, 2].map(|first| run(source, &one, &VerifySpec { first, views: 2, ..spec.clone() }));
    assert_eq!(all.comparisons, halves.iter().map(|half| half.comparisons).sum::<u64>());
    assert_eq!(all.probes.surfaces, halves.iter().map(|half| half.probes.surfaces).sum::<u64>());
    let least = |found: &Verification| found.techniques[0].least_margin_db;
    assert_eq!(least(&all), least(&halves[0]).zip(least(&halves[1])).map(|(a, b)| a.min(b)));
}
