//! The page holds what it was given, escaped, and needs nothing from outside.

use afterlight_measure::{
    DeviceRecord, Difference, Memory, Pass, Run, RunResult, SCHEMA, SceneRecord, SettingsRecord, Spread,
    Status,
};
use afterlight_report::{Picture, Report, Section};

fn run() -> Run {
    let mut ok = RunResult::without_figures("tiled", Status::Ok, "");
    ok.reason = None;
    ok.frame_ms = Spread::of(&[12.0, 13.0, 15.0]);
    ok.passes = vec![Pass {
        name: "tiled/shade".into(),
        role: None,
        work: None,
        ms: Spread::of(&[9.0]),
        reads: Vec::new(),
        writes: Vec::new(),
        statistics: [("compute_invocations".to_owned(), 1_234_567)].into(),
    }];
    ok.memory = Some(Memory { technique_bytes: 1 << 20, peak_bytes: 3 << 20, buffers: Vec::new() });
    ok.difference = Some(Difference { psnr_db: 61.23, max_abs: 1, flip: Some(0.0001) });
    Run {
        schema: SCHEMA,
        device: DeviceRecord {
            name: "<b>GPU</b>".into(),
            driver: "d".into(),
            api: "1.3".into(),
            kind: "cpu".into(),
        },
        scene: SceneRecord { name: "a&b".into(), triangles: 262_144, draws: 9, lights: 100 },
        settings: SettingsRecord {
            width: 640,
            height: 360,
            samples: 1,
            frames: 3,
            camera: "front".into(),
            reference: "forward".into(),
            post: "smaa".into(),
            tessellate_px: None,
            displacement_mm: 0.0,
            indirect: "none".into(),
            rsm_size: None,
            shadows: "none".to_owned(),
            shadow_map_size: None,
            transparency: "none".to_owned(),
            light_seed: Some(1),
            version: "0.1.0".into(),
        },
        results: vec![
            ok,
            RunResult::without_figures("mesh", Status::Unavailable, "the device lacks mesh shaders"),
        ],
        process: None,
    }
}

#[test]
fn page_holds_the_figures_and_escapes_names() {
    let run = run();
    let html = Report {
        title: "A report".into(),
        command: "afterlight compare".into(),
        sections: vec![Section {
            heading: String::new(),
            note: String::new(),
            run: &run,
            charts: Vec::new(),
            pictures: vec![Picture {
                technique: "tiled".into(),
                image_png: vec![1, 2, 3],
                difference_png: None,
                difference_caption: "61.2 dB".into(),
            }],
        }],
    }
    .html();
    for expected in [
        "<title>A report</title>",
        "&lt;b&gt;GPU&lt;/b&gt;",
        "a&amp;b",
        "262\u{202f}144 triangles",
        "13.0",
        "12.0 – 15.0",
        "1.00 MiB",
        "61.2",
        "the device lacks mesh shaders",
        "1\u{202f}234\u{202f}567",
        "data:image/png;base64,AQID",
    ] {
        assert!(html.contains(expected), "expected {expected}");
    }
    assert!(!html.contains("http://") && !html.contains("https://"), "the page needs no network");
    assert!(!html.contains("<b>GPU"));
}
