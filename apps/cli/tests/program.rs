//! The program as a user meets it: output, exit codes, one line for each bad input.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

/// Runs the program in a folder of its own with a cache of its own.
fn run_in(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_afterlight"))
        .args(arguments)
        .current_dir(folder)
        .env("XDG_CACHE_HOME", folder.join("cache"))
        .output()
        .expect("the program starts")
}

fn folder() -> TempDir {
    TempDir::new().expect("a temporary folder")
}

fn run(arguments: &[&str]) -> Output {
    run_in(folder().path(), arguments)
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Asserts the exit code and one line on standard error that holds every part; returns the line.
fn refused(arguments: &[&str], code: i32, parts: &[&str]) -> String {
    let folder = folder();
    let output = run_in(folder.path(), arguments);
    let line = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {line}");
    assert_eq!(line.lines().count(), 1, "{arguments:?}: expected one line, found:\n{line}");
    assert!(line.starts_with("afterlight: "), "{line}");
    for part in parts {
        assert!(line.contains(part), "{arguments:?}: expected `{part}` in: {line}");
    }
    assert!(output.stdout.is_empty(), "{arguments:?}: {}", text(&output.stdout));
    let left: Vec<_> = fs::read_dir(folder.path())
        .expect("listed")
        .flatten()
        .map(|entry| entry.file_name())
        .filter(|name| name != "cache")
        .collect();
    assert!(left.is_empty(), "{arguments:?}: left {left:?}");
    line
}

/// Whether there is a device; tells where there is none.
fn has_device() -> bool {
    let there = run(&["devices"]).status.success();
    if !there {
        eprintln!("skipped: no Vulkan device on this machine");
    }
    there
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|error| panic!("{error}: {} / {}", text(&output.stdout), text(&output.stderr)))
}

#[test]
fn bad_usage_is_one_line_and_exit_code_2() {
    refused(&["explode"], 2, &["explode"]);
    refused(&["compare", "--bogus"], 2, &["--bogus"]);
    refused(&["compare", "--width", "0"], 2, &["--width"]);
    refused(&["compare", "--width", "many"], 2, &["--width", "many"]);
    refused(&["compare", "--samples", "3"], 2, &["--samples", "3", "1, 2, 4, 8 or 16"]);
    refused(&["compare", "--lights", "-1"], 2, &["-1"]);
    refused(&["compare", "--techniques", "forward,backward"], 2, &["backward", "one of: ", "forward"]);
    refused(&["compare", "--reference", "backward"], 2, &["--reference", "backward"]);
    refused(&["compare", "--set", "nokey=1"], 2, &["nokey", "cull"]);
    refused(&["compare", "--set", "cull=perhaps"], 2, &["cull", "perhaps", "frustum"]);
    refused(&["compare", "--set", "cull"], 2, &["--set", "KEY=VALUE"]);
    refused(&["compare", "--json", "builtin:spheres"], 2, &["--json", "builtin:spheres"]);
    refused(&["compare", "--post", "blur"], 2, &["--post", "blur", "fxaa"]);
    refused(&["compare", "--tessellate", "0.5"], 2, &["--tessellate", "0.5", "from 1 to 64"]);
    refused(
        &["compare", "--tessellate", "8", "--displacement", "200"],
        2,
        &["--displacement", "200", "from 0 to 100"],
    );
    refused(&["compare", "--displacement", "20"], 2, &["--tessellate"]);
    refused(&["compare", "--shadows", "pcss"], 2, &["--shadows", "pcss"]);
    refused(&["compare", "--indirect", "gi"], 2, &["--indirect", "gi", "rsm"]);
    refused(&["compare", "--shadow-map-size", "256"], 2, &["--shadow-map-size", "256", "--indirect rsm"]);
    refused(
        &["render", "builtin:edge", "--technique", "forward", "--view", "normals", "-o", "unused.png"],
        2,
        &["view", "normals", "final", "invocations"],
    );
    refused(&["bench", "everything"], 2, &["everything", "speed", "msaa-table1"]);
    refused(&["bench", "speed", "--scale", "0"], 2, &["--scale", "0", "at most 1"]);
    refused(&["completions", "csh"], 2, &["csh"]);
    refused(&["render", "-o", "a.png"], 2, &["--technique"]);
    let exr = ["render", "--technique", "forward", "-o", "a.exr", "--post", "smaa"];
    refused(&exr, 2, &["--post", "smaa", "none", ".png"]);
    refused(&["render", "--technique", "forward", "-o", "a.jpg"], 2, &["a.jpg", ".png or .exr"]);
    refused(&["render", "--technique", "forward", "-o", "no/such/a.png"], 2, &["no/such"]);
    refused(&["render", "--technique", "all", "-o", "a.png"], 2, &["one technique"]);
}

#[test]
fn bad_scenes_are_one_line_and_exit_code_2() {
    for command in [&["scene"][..], &["compare"], &["render", "--technique", "forward", "-o", "a.png"]] {
        let with = |scene| [command, &[scene]].concat();
        refused(&with("absent.gltf"), 2, &["absent.gltf"]);
        refused(&with("absent.txt"), 2, &["absent.txt", ".gltf"]);
        refused(&with("builtin:nothing"), 2, &["nothing", "colonnade"]);
        refused(&with("builtin:colonnade?triangles=none"), 2, &["triangles", "none"]);
    }
}

#[test]
fn no_device_is_exit_code_4_with_a_command() {
    let folder = folder();
    for arguments in [
        &["devices"][..],
        &["render", "builtin:edge", "--technique", "forward", "-o", "a.png"],
        &["compare", "builtin:edge"],
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_afterlight"))
            .args(arguments)
            .current_dir(folder.path())
            .env("VK_ICD_FILENAMES", "/nonexistent/driver.json")
            .env("VK_DRIVER_FILES", "/nonexistent/driver.json")
            .output()
            .expect("the program starts");
        let line = text(&output.stderr);
        assert_eq!(output.status.code(), Some(4), "{arguments:?}: {line}");
        assert!(line.contains("apt-get install") && line.lines().count() == 1, "{line}");
    }
}

#[test]
fn unknown_device_and_camera_list_what_there_is() {
    if !has_device() {
        return;
    }
    let render = ["render", "builtin:edge", "--technique", "forward", "-o", "a.png"];
    refused(&[&render[..], &["--device", "nosuchdevice"]].concat(), 2, &["nosuchdevice"]);
    refused(&[&render[..], &["--device", "99"]].concat(), 2, &["99"]);
    refused(&[&render[..], &["--camera", "nosuchcamera"]].concat(), 2, &["nosuchcamera"]);
    refused(&[&render[..], &["--width", "1000000"]].concat(), 2, &["1000000"]);
}

#[test]
fn lists_are_text_and_json() {
    let techniques = json(&run(&["techniques", "--json"]));
    let list = techniques["techniques"].as_array().expect("a list");
    assert!(list.iter().any(|one| one["id"] == "forward"));
    for one in list {
        for key in ["title", "sources", "answers", "appendix_a", "exactness", "params", "views"] {
            assert!(!one[key].is_null(), "{}: {key}", one["id"]);
        }
    }
    let dais = list.iter().find(|one| one["id"] == "dais").expect("listed");
    assert!(
        dais["views"].as_array().is_some_and(|views| views.contains(&"triangle-sharing".into())),
        "{dais}"
    );
    let plain = text(&run(&["techniques"]).stdout);
    assert!(plain.contains("forward") && plain.contains("appendix A"), "{plain}");
    let scene = json(&run(&["scene", "builtin:spheres", "--json", "-"]));
    assert!(scene["triangles"].as_u64().is_some_and(|count| count > 0), "{scene}");
    assert!(text(&run(&["scene", "builtin:spheres"]).stdout).contains("triangles"));
    if has_device() {
        let devices = json(&run(&["devices", "--json"]));
        assert!(
            devices["devices"][0]["techniques"].as_array().is_some_and(|all| all.len() == list.len()),
            "{devices}"
        );
    }
}

#[test]
fn completions_and_help_are_printed() {
    for shell in ["bash", "zsh", "fish"] {
        assert!(text(&run(&["completions", shell]).stdout).contains("afterlight"), "{shell}");
    }
    let help = run(&["compare", "--help"]);
    assert!(help.status.success() && text(&help.stdout).contains("--techniques"));
    assert!(run(&["--version"]).status.success());
    assert_eq!(run(&[]).status.code(), Some(2));
}

const SMALL: [&str; 6] = ["--width", "48", "--height", "27", "--lights", "8"];

#[test]
fn render_writes_png_exr_and_figures() {
    if !has_device() {
        return;
    }
    let folder = folder();
    for name in ["a.png", "a.exr"] {
        let arguments = [
            &["render", "builtin:spheres", "--technique", "forward", "-o", name, "--stats", "s.json"][..],
            &SMALL,
        ]
        .concat();
        let output = run_in(folder.path(), &arguments);
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert!(output.stdout.is_empty());
    }
    let png = fs::read(folder.path().join("a.png")).expect("written");
    assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
    assert_eq!((&png[16..20], &png[20..24]), (&[0, 0, 0, 48][..], &[0, 0, 0, 27][..]));
    let exr = fs::read(folder.path().join("a.exr")).expect("written");
    assert_eq!(&exr[..4], &[0x76, 0x2f, 0x31, 0x01]);
    let stats: Value =
        serde_json::from_slice(&fs::read(folder.path().join("s.json")).expect("written")).expect("is JSON");
    assert!(stats["process"]["first_image_ms"].as_f64().is_some_and(|ms| ms > 0.0));
    assert_eq!(stats["results"][0]["technique"], "forward");
}

/// Indirect light is a pass of its own that no technique's memory counts, and the figures say that it was there.
#[test]
fn indirect_light_is_recorded() {
    if !has_device() {
        return;
    }
    let folder = folder();
    let stats = |more: &[&str]| -> Value {
        let plain =
            ["render", "builtin:intersect", "--technique", "deferred", "-o", "a.png", "--stats", "s.json"];
        let output = run_in(folder.path(), &[&plain[..], &SMALL, more].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        let bytes = fs::read(folder.path().join("s.json")).expect("written");
        serde_json::from_slice(&bytes).expect("is JSON")
    };
    let without = stats(&[]);
    let with = stats(&["--indirect", "rsm", "--shadow-map-size", "64"]);
    assert_eq!(
        (&without["settings"]["indirect"], &with["settings"]["indirect"]),
        (&"none".into(), &"rsm".into())
    );
    assert!(without["settings"]["shadow_map_size"].is_null());
    assert_eq!(with["settings"]["shadow_map_size"], 64);
    let memory = |run: &Value| run["results"][0]["memory"]["technique_bytes"].clone();
    assert_eq!(memory(&without), memory(&with));
    let passes = |run: &Value| run["results"][0]["passes"].as_array().map_or(0, Vec::len);
    assert_eq!(passes(&without) + 1, passes(&with));
    assert_eq!(with["results"][0]["passes"][0]["name"], "shared/rsm");
}

#[test]
fn compare_writes_the_schema_table_and_report() {
    if !has_device() {
        return;
    }
    let folder = folder();
    let arguments = [
        &[
            "compare",
            "builtin:spheres",
            "--techniques",
            "forward,tiled",
            "--frames",
            "2",
            "--json",
            "-",
            "--report",
            "r",
        ][..],
        &SMALL,
    ]
    .concat();
    let output = run_in(folder.path(), &arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let run = json(&output);
    assert_eq!(run["schema"], 1);
    for key in ["name", "driver", "api", "type"] {
        assert!(run["device"][key].is_string(), "device.{key}");
    }
    assert_eq!(run["scene"]["lights"], 8);
    assert_eq!((&run["settings"]["width"], &run["settings"]["frames"]), (&48.into(), &2.into()));
    let results = run["results"].as_array().expect("a list");
    assert_eq!(results.len(), 2);
    for result in results {
        assert_eq!(result["status"], "ok", "{result}");
        for key in ["median", "min", "max"] {
            assert!(result["frame_ms"][key].as_f64().is_some_and(|ms| ms > 0.0), "{key}");
        }
        let passes = result["passes"].as_array().expect("passes");
        assert!(!passes.is_empty());
        assert!(
            passes[0]["ms"]["median"].is_f64() && passes[0]["fragment_invocations"].is_u64(),
            "{passes:?}"
        );
        assert!(result["memory"]["technique_bytes"].is_u64() && result["memory"]["peak_bytes"].is_u64());
        for key in ["cmd", "proc", "mem", "band"] {
            assert!(result["cost"][key].is_number(), "cost.{key}");
        }
        assert!(
            result["difference"]["psnr_db"].as_f64().is_some_and(|db| db >= 50.0),
            "{}",
            result["difference"]
        );
        assert!(result["difference"]["max_abs"].is_u64() && result["difference"]["flip"].is_number());
    }
    // The table went to standard error, since JSON took standard output.
    assert!(text(&output.stderr).contains("tiled/"), "{}", text(&output.stderr));
    let html = fs::read_to_string(folder.path().join("r/report.html")).expect("written");
    assert!(html.contains("data:image/png;base64,") && html.contains("tiled"));
    assert!(folder.path().join("r/report.json").is_file());
}

#[test]
fn samples_that_the_device_lacks_are_told() {
    if !has_device() {
        return;
    }
    let devices = json(&run(&["devices", "--json"]));
    let there = devices["devices"][0]["samples"]["color"].as_array().expect("a list").clone();
    let Some(lacking) = ["2", "8", "16"]
        .into_iter()
        .find(|count| !there.contains(&count.parse::<u64>().expect("a number").into()))
    else {
        eprintln!("skipped: the device has every number of samples");
        return;
    };
    refused(
        &["compare", "builtin:edge", "--device", "0", "--samples", lacking],
        2,
        &["--samples", lacking, "one of: 1"],
    );
}

#[test]
fn bench_msaa_table1_has_all_cells_beside_the_papers() {
    if !has_device() {
        return;
    }
    let folder = folder();
    let arguments = ["bench", "msaa-table1", "--scale", "0.1", "--report", "r", "--json", "-"];
    let output = run_in(folder.path(), &arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let found = json(&output);
    assert_eq!((&found["schema"], &found["experiment"]), (&1.into(), &"msaa-table1".into()));
    let rows = found["rows"].as_array().expect("a list");
    let samples: Vec<_> = rows.iter().map(|row| row["settings"]["samples"].as_u64()).collect();
    assert_eq!(samples, [Some(1), Some(4), Some(8)]);
    let cells: Vec<&Value> = rows.iter().flat_map(|row| row["cells"].as_array().expect("a list")).collect();
    let paper = [
        ("none", [23.73, 7.91, 31.64]),
        ("MSAA 4x", [94.92, 31.64, 126.56]),
        ("MSAA 8x", [189.84, 63.28, 253.12]),
        ("list 4x min", [27.69, 31.64, 59.33]),
        ("list 4x max", [110.74, 31.64, 142.38]),
        ("list 8x min", [27.69, 63.28, 90.97]),
        ("list 8x max", [221.48, 63.28, 284.76]),
    ];
    for (column, figures) in paper {
        for (row, figure) in ["g-buffer", "z-buffer", "total"].into_iter().zip(figures) {
            let cell = cells
                .iter()
                .find(|cell| cell["column"] == column && cell["row"] == row)
                .unwrap_or_else(|| panic!("no cell {column} {row}"));
            let paper_mib = cell["paper_mib"].as_f64().expect("a number");
            assert!((paper_mib - figure * 0.01).abs() < 1e-6, "{cell}");
            match cell["status"].as_str() {
                // A tenth of the size: a page more or less weighs a hundred times as much.
                Some("ok") => {
                    let off = cell["deviation_without_granularity_percent"].as_f64().expect("a number");
                    assert!(off.abs() < 3.0, "{cell}");
                    assert!(cell["bytes"].as_u64() >= cell["layout_bytes"].as_u64(), "{cell}");
                }
                _ => assert!(cell["status"] == "unavailable" && cell["reason"].is_string(), "{cell}"),
            }
        }
    }
    for used in ["list 4x used", "default list 4x used"] {
        assert!(cells.iter().any(|cell| cell["column"] == used), "no cell {used}");
    }
    let html = fs::read_to_string(folder.path().join("r/report.html")).expect("written");
    assert!(html.contains("MSAA 4x") && html.contains("G-buffer"));
}

#[test]
fn bench_of_anti_aliasing_runs_on_small_images() {
    if !has_device() {
        return;
    }
    let folder = folder();
    let common =
        ["--scenes", "builtin:edge", "--scale", "0.05", "--samples", "4", "--frames", "1", "--json", "-"];

    let table2 = [
        &["bench", "msaa-table2", "--light-counts", "5", "--techniques", "deferred-ssaa,gbuffer-list"][..],
        &common,
    ]
    .concat();
    let output = run_in(folder.path(), &table2);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let found = json(&output);
    let row = &found["rows"][0];
    assert_eq!((&row["settings"]["width"], &row["scene"]["lights"]), (&96.into(), &5.into()));
    let columns: Vec<_> =
        row["cells"].as_array().expect("a list").iter().map(|cell| cell["column"].clone()).collect();
    assert!(columns.contains(&"gbuffer-list 4x, edges".into()), "{columns:?}");
    assert!(found["duels"][0]["ratio"].is_number(), "{}", found["duels"]);

    let quality = [&["bench", "antialiasing", "--report", "r"][..], &common].concat();
    let output = run_in(folder.path(), &quality);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let found = json(&output);
    let rows = found["rows"].as_array().expect("a list");
    let posts: Vec<_> = rows.iter().map(|row| row["settings"]["post"].clone()).collect();
    assert_eq!(posts, ["none", "fxaa", "smaa", "sraa", "none"]);
    for cell in rows.iter().flat_map(|row| row["cells"].as_array().expect("a list")) {
        assert!(cell["flip"].is_number() && cell["psnr_db"].is_number(), "{cell}");
    }
    assert_eq!(found["post"].as_array().map(Vec::len), Some(3));
    let html = fs::read_to_string(folder.path().join("r/report.html")).expect("written");
    assert!(html.contains("below forward 1x") && html.contains("data:image/png;base64,"));
}

#[test]
fn bench_dais_fig6_tells_errors_beside_the_paper() {
    if !has_device() {
        return;
    }
    let folder = folder();
    let size = ["--width", "64", "--height", "36"];
    let scene = ["--scenes", "builtin:colonnade?triangles=20000"];
    let tail = ["--report", "r", "--json", "-"];
    let output = run_in(folder.path(), &[&["bench", "dais-fig6"][..], &size, &scene, &tail].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let found = json(&output);
    assert!(found["paper"]["says"].as_str().is_some_and(|says| says.contains("no figures")));
    let cells = found["rows"][0]["cells"].as_array().expect("a list");
    let dais = cells.iter().find(|cell| cell["technique"] == "dais").expect("dais runs");
    let error = |name: &str| dais["errors"][name].as_f64().unwrap_or_else(|| panic!("{name}: {dais}"));
    assert!(error("compared_pixels") > 0.5 * 64.0 * 36.0, "{dais}");
    assert!((1e-9..1e-5).contains(&error("position_max")), "{dais}");
    assert!(error("position_mean") < error("position_max") && error("texture_mean") < 0.01, "{dais}");
    // Lists need several samples.
    let list = cells.iter().find(|cell| cell["technique"] == "dais-list").expect("told");
    assert!(list["status"] == "unavailable" && list["errors"].is_null(), "{list}");
    let html = fs::read_to_string(folder.path().join("r/report.html")).expect("written");
    assert!(html.contains("position error") && html.contains("data:image/png;base64,"));
    refused(&["bench", "dais-fig6", "--techniques", "forward"], 2, &["forward", "dais"]);
}

/// The folder of reference scenes, beside the repository.
fn reference_scenes() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/scenes");
    if !folder.is_dir() {
        eprintln!("skipped: no reference scenes in {}", folder.display());
        return None;
    }
    Some(folder)
}

#[test]
fn every_invalid_sample_is_told_or_loads() {
    let Some(scenes) = reference_scenes() else { return };
    let mut stack = vec![scenes.join("samples/invalid")];
    let mut files = Vec::new();
    while let Some(folder) = stack.pop() {
        for path in fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()) {
            let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
            if path.is_dir() {
                stack.push(path);
            } else if ["gltf", "glb", "obj"].contains(&extension.as_str()) {
                files.push(path);
            }
        }
    }
    assert!(!files.is_empty(), "no file in samples/invalid");
    // Loading alone, in this process: starting one for each of hundreds of files would take minutes.
    for path in files {
        if let Err(error) = afterlight_scene::load(&path, &afterlight_scene::LoadOptions::default()) {
            assert_eq!(error.to_string().lines().count(), 1, "{}: {error}", path.display());
        }
    }
}
