//! The program as a user meets it: output, exit codes, one line for each bad input.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use afterlight_testkit::{Need, shared_scenes, skip};
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
        skip(Need::Device, "`afterlight devices` finds none");
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
    refused(&["compare", "--shadows", "pcss"], 2, &["--shadows", "pcss", "none or map"]);
    refused(&["compare", "--indirect", "gi"], 2, &["--indirect", "gi", "rsm"]);
    refused(&["compare", "--shadow-map-size", "256"], 2, &["--shadow-map-size", "256", "--shadows map"]);
    refused(
        &["render", "builtin:edge", "--technique", "forward", "--view", "normals", "-o", "unused.png"],
        2,
        &["view", "normals", "final", "invocations"],
    );
    refused(&["verify", "--views", "0"], 2, &["--views", "0"]);
    refused(&["verify", "--samples", "3"], 2, &["--samples", "3", "1, 2, 4, 8 or 16"]);
    refused(&["verify", "--techniques", "backward"], 2, &["--techniques", "backward", "forward"]);
    refused(&["verify", "--techniques", "tiled", "--samples", "4"], 2, &["--samples", "4", "one of: 1"]);
    refused(&["verify", "--set", "nokey=1"], 2, &["nokey", "cull"]);
    refused(&["verify", "--json", "builtin:spheres"], 2, &["--json", "builtin:spheres"]);
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
    for command in
        [&["scene"][..], &["compare"], &["verify"], &["render", "--technique", "forward", "-o", "a.png"]]
    {
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
        for key in [
            "title",
            "sources",
            "answers",
            "appendix_a",
            "exactness",
            "approximations",
            "departures",
            "params",
            "views",
        ] {
            assert!(!one[key].is_null(), "{}: {key}", one["id"]);
        }
    }
    let dais = list.iter().find(|one| one["id"] == "dais").expect("listed");
    assert!(
        dais["views"].as_array().is_some_and(|views| views.contains(&"triangle-sharing".into())),
        "{dais}"
    );
    for one in list {
        let views = one["views"].as_array().expect("a list");
        assert!(
            ["light-count", "light-error", "velocity"].iter().all(|view| views.contains(&(*view).into())),
            "{one}"
        );
    }
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
fn specifications_are_shown_and_read() {
    let shown =
        run(&["bench", "dais-fig5", "--show-spec", "--scale", "0.5", "--views", "3", "--lights", "7"]);
    let spec = json(&shown);
    assert_eq!(
        (&spec["scale"], &spec["views"], &spec["frame"]["lights"]),
        (&0.5.into(), &3.into(), &7.into())
    );
    let folder = folder();
    let show = |text: &str| {
        fs::write(folder.path().join("a.json"), text).expect("written");
        run_in(folder.path(), &["bench", "dais-fig5", "--spec", "a.json", "--show-spec"])
    };
    assert_eq!(json(&show(&text(&shown.stdout))), spec);
    assert_eq!(json(&show(r#"{"views": 3}"#))["frame"]["width"], 1920);
    let told = show(r#"{"veiws": 3}"#);
    assert_eq!(told.status.code(), Some(2));
    assert!(text(&told.stderr).contains("veiws") && text(&told.stderr).lines().count() == 1);
    refused(&["bench", "speed", "--spec", "absent.json"], 2, &["absent.json"]);
    refused(&["bench", "all", "--spec", "absent.json"], 2, &["--spec", "one experiment"]);
    refused(&["bench", "speed", "--spec", "absent.json", "--width", "64"], 2, &["--spec", "--width"]);
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

/// Panes are shown unless they are refused, by a pass that is no technique's.
#[test]
fn panes_are_drawn_and_recorded() {
    if !has_device() {
        return;
    }
    let folder = folder();
    let rendered = |transparency: &[&str]| -> (Value, Vec<u8>) {
        let scene = "builtin:colonnade?triangles=17000&texture=16";
        let files = ["-o", "a.png", "--stats", "s.json"];
        let plain = ["render", scene, "--technique", "deferred", "--camera", "fountain"];
        let output = run_in(folder.path(), &[&plain[..], &files, &SMALL, transparency].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert!(text(&output.stderr).is_empty(), "{}", text(&output.stderr));
        let read = |file: &str| fs::read(folder.path().join(file)).expect("written");
        (serde_json::from_slice(&read("s.json")).expect("is JSON"), read("a.png"))
    };
    let (shown, shown_png) = rendered(&["--quiet"]);
    let (sorted, sorted_png) = rendered(&["--quiet", "--transparency", "sorted"]);
    let (none, none_png) = rendered(&["--quiet", "--transparency", "none"]);
    let setting = |run: &Value| run["settings"]["transparency"].clone();
    assert_eq!([setting(&shown), setting(&sorted), setting(&none)], ["sorted", "sorted", "none"]);
    assert_eq!(shown_png, sorted_png);
    assert_ne!(sorted_png, none_png);
    let drawn = |run: &Value| {
        let passes = run["results"][0]["passes"].as_array().cloned().unwrap_or_default();
        passes.iter().any(|pass| pass["name"] == "shared/transparent")
    };
    assert_eq!([drawn(&shown), drawn(&none)], [true, false]);
    let bytes = |run: &Value| run["results"][0]["memory"]["technique_bytes"].clone();
    assert_eq!(bytes(&shown), bytes(&none));
    refused(&["render", "--transparency", "weighted"], 2, &["--transparency", "weighted", "sorted", "none"]);
}

/// Lights' views are passes of their own that no technique's memory counts, and the figures say that they were there.
#[test]
fn views_of_lights_are_recorded() {
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
    let shadowed = stats(&["--shadows", "map", "--shadow-map-size", "128"]);
    assert_eq!(
        (&without["settings"]["shadows"], &shadowed["settings"]["shadows"]),
        (&"none".into(), &"map".into())
    );
    let sizes = |run: &Value| ["rsm_size", "shadow_map_size"].map(|size| run["settings"][size].as_u64());
    assert_eq!(sizes(&without), [None, None]);
    assert_eq!(sizes(&with), [Some(64), None]);
    assert_eq!(sizes(&shadowed), [None, Some(128)]);
    assert_eq!(sizes(&stats(&["--shadows", "map", "--indirect", "rsm"])), [Some(512), Some(2048)]);
    let memory = |run: &Value| run["results"][0]["memory"]["technique_bytes"].clone();
    assert_eq!(memory(&without), memory(&with));
    assert_eq!(memory(&without), memory(&shadowed));
    let passes = |run: &Value| run["results"][0]["passes"].as_array().map_or(0, Vec::len);
    assert_eq!(passes(&without) + 1, passes(&with));
    assert_eq!(passes(&without) + 1, passes(&shadowed));
    assert_eq!(with["results"][0]["passes"][0]["name"], "shared/rsm");
    assert_eq!(shadowed["results"][0]["passes"][0]["name"], "shared/shadow");
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
    // The summary went to standard error, since JSON took standard output; passes are shown where they are asked for alone.
    let told = text(&output.stderr);
    let last: Vec<&str> = told.lines().rev().take(2).collect();
    assert!(
        last[1].starts_with("fastest exact technique: ") && last[0].starts_with("least memory"),
        "{told}"
    );
    assert!(!told.contains("tiled/"), "{told}");
    let output = run_in(
        folder.path(),
        &[&["compare", "builtin:spheres", "--techniques", "tiled,deferred-dedup"], &["--passes"][..], &SMALL]
            .concat(),
    );
    let told = text(&output.stdout);
    assert!(
        told.contains("tiled/shade") && told.contains("but with --samples 2, 4, 8 or 16: deferred-dedup"),
        "{told}"
    );
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
        return skip(Need::ReachableLimit, "the device has every number of samples");
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

#[test]
fn bench_lights_sweep_counts_pairs_beside_predictions() {
    if !has_device() {
        return;
    }
    let size = ["--scenes", "builtin:intersect", "--scale", "0.05", "--frames", "1"];
    let columns = ["--techniques", "forward,deferred,tiled,gbuffer-list,deferred-dedup"];
    let lights = ["--light-counts", "100,1,10", "--max-pairs", "100000", "--set", "gbuffer-list.lights=all"];
    let (found, html) =
        bench(&[&["lights-sweep"], &size[..], &columns, &lights, &["--report", "r", "--json", "-"]].concat());
    assert_eq!((&found["schema"], &found["experiment"]), (&1.into(), &"lights-sweep".into()));
    assert_eq!(found["bounds"]["max_pairs"], 1e5);
    let rows = found["rows"].as_array().expect("a list");
    let seen: Vec<_> =
        rows.iter().map(|row| (&row["scene"]["lights"], &row["settings"]["samples"])).collect();
    let [one, ten, hundred, four] = [1, 10, 100, 4].map(Value::from);
    let expected =
        [(&one, &one), (&one, &four), (&ten, &one), (&ten, &four), (&hundred, &one), (&hundred, &four)];
    assert_eq!(seen, expected, "a row for each number of samples");
    let pixels = 64.0 * 36.0;
    for row in rows.iter().step_by(2) {
        let count = row["scene"]["lights"].as_f64().expect("a number");
        let pairs = |column: &str| {
            let cell = cell(row, column);
            ["tested", "lit"].map(|what| cell["pairs"][what].as_f64())
        };
        // 100 lights in 2,304 pixels, each shaded once at least, are more pairs than were allowed.
        let forward = cell(row, "forward");
        if count == 100.0 {
            let reason = forward["reason"].as_str().expect("a reason");
            assert!(forward["status"] == "unavailable" && reason.contains("--max-pairs"), "{forward}");
            assert!(
                forward["frame_ms"].is_null() && forward["predicted"]["evaluations"].as_f64() > Some(1e5)
            );
        } else {
            let [tested, lit] = pairs("forward");
            assert_eq!(pairs("gbuffer-list"), [tested, lit], "both visit all lights");
            assert_eq!(pairs("tiled")[1], lit);
            assert!(tested <= Some(count * pixels) && lit <= tested, "{forward}");
            assert!(cell(row, "forward")["over_baseline"].as_f64() > Some(0.0));
        }
        let [tested, lit] = pairs("tiled");
        assert!(lit > Some(0.0) && tested >= lit, "{row}");
        assert_eq!(cell(row, "deferred")["over_baseline"], 1.0);
        let result = &row["results"][0];
        assert!(result["cost"]["proc"].as_f64() > Some(0.0), "{result}");
    }
    cell(&rows[1], "deferred-dedup 4x");
    let growth = found["growth"].as_array().expect("a list");
    let deferred = growth.iter().find(|one| one["column"] == "deferred").expect("told");
    assert_eq!((&deferred["from_lights"], &deferred["to_lights"]), (&hundred, &hundred));
    assert_eq!(found["symbols"].as_array().map(Vec::len), Some(3));
    assert!(html.contains("pairs tested") && html.contains("<path") && html.contains("--max-pairs"));
}

/// Small enough for a software device: tens of pixels, tens of triangles, a view of the light of 32 texels.
const DAIS_SMALL: [&str; 12] = [
    "--scenes",
    "builtin:intersect",
    "--scale",
    "0.03",
    "--samples",
    "4",
    "--frames",
    "1",
    "--report",
    "r",
    "--json",
    "-",
];

/// Runs an experiment and returns its JSON and its report.
fn bench(arguments: &[&str]) -> (Value, String) {
    let folder = folder();
    let output = run_in(folder.path(), &[&["bench"], arguments].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let html = fs::read_to_string(folder.path().join("r/report.html")).expect("written");
    (json(&output), html)
}

/// The cell of a column; asserts that a column without figures says why.
fn cell<'a>(row: &'a Value, column: &str) -> &'a Value {
    let cells = row["cells"].as_array().expect("a list");
    let cell = cells.iter().find(|cell| cell["column"] == column);
    let cell = cell.unwrap_or_else(|| panic!("no cell {column}"));
    assert!(
        cell["status"] == "ok" || cell["status"] == "unavailable" && cell["reason"].is_string(),
        "{cell}"
    );
    cell
}

#[test]
fn bench_dais_table1_has_times_memory_and_floors() {
    if !has_device() {
        return;
    }
    let rsm = ["--indirect", "rsm", "--shadow-map-size", "32"];
    let (found, html) = bench(&[&["dais-table1"], &DAIS_SMALL[..], &rsm].concat());
    assert_eq!((&found["schema"], &found["experiment"]), (&1.into(), &"dais-table1".into()));
    let row = &found["rows"][0];
    assert_eq!((&row["settings"]["width"], &row["settings"]["indirect"]), (&115.into(), &"rsm".into()));
    assert_eq!(row["settings"]["camera"], "fly-through");
    assert_eq!(row["scene"]["lights"], 1, "the scene's own");
    let deferred = cell(row, "deferred-dedup");
    assert_eq!(deferred["status"], "ok");
    assert_eq!(
        (&deferred["memory_over_deferred"], &deferred["frame_over_deferred"]),
        (&1.0.into(), &1.0.into())
    );
    // 20 bytes a sample, whole pages apart.
    let least_mib = f64::from(115 * 65 * 4 * 20) / f64::from(1 << 20);
    let total_mib = deferred["total_mib"].as_f64().expect("a number");
    assert!(total_mib >= least_mib && total_mib < least_mib * 1.3, "{total_mib} {least_mib}");
    let columns = ["dais", "dais, fill=cache", "dais-list", "dais-multirate", "dais-multirate, fill=cache"];
    for column in columns {
        let cell = cell(row, column);
        if cell["status"] != "ok" {
            continue;
        }
        for key in ["fill_ms", "derivatives_ms", "shade_ms", "frame_ms", "memory_over_deferred", "peak_mib"] {
            assert!(cell[key].as_f64().is_some_and(|value| value > 0.0), "{column} {key}: {cell}");
        }
        // The baseline's image.
        let results = row["results"].as_array().expect("a list");
        let index =
            row["cells"].as_array().and_then(|all| all.iter().position(|one| one == cell)).expect("there");
        let psnr_db = results[index]["difference"]["psnr_db"].as_f64().expect("a number");
        assert!(psnr_db >= 40.0, "{column}: {psnr_db} dB");
        let fills_by_raster = column == "dais-list" || column.ends_with("fill=cache");
        assert_eq!(cell["z_prepass_ms"].is_number(), fills_by_raster, "{column}");
        assert!(cell["with_radiance_mib"].as_f64() > cell["total_mib"].as_f64(), "{column}");
        let shade = cell["passes"].as_array().expect("a list").iter().find(|one| one["phase"] == "shade");
        let shade = shade.expect("a pass");
        assert!(shade["known_bytes"].as_u64() > Some(115 * 65 * 8), "{shade}");
    }
    assert!(found["bandwidth"]["gb_per_s"].as_f64().is_none_or(|rate| rate > 0.0));
    let claims = found["claims"].as_array().expect("a list");
    assert!(claims.iter().all(|claim| claim["met"].is_null() && claim["as_in_paper"] == false), "{claims:?}");
    assert!(html.contains("dais, fill=cache") && html.contains("dais-list"));

    // Indirect light needs a light: a scene without one gets one, and the record says so.
    let dark = [
        "dais-table1",
        "--techniques",
        "dais",
        "--scenes",
        "builtin:edge",
        "--scale",
        "0.01",
        "--samples",
        "4",
    ];
    let (found, _) = bench(&[&dark[..], &["--frames", "1", "--report", "r", "--json", "-"], &rsm].concat());
    let row = &found["rows"][0];
    assert_eq!((&row["scene"]["lights"], &row["settings"]["light_seed"]), (&1.into(), &1.into()));
    assert!(
        found["notes"]
            .as_array()
            .expect("a list")
            .iter()
            .any(|note| note.as_str().is_some_and(|n| n.contains("no light")))
    );
}

#[test]
fn bench_dais_fig5_follows_a_path_at_two_sizes() {
    if !has_device() {
        return;
    }
    let more = ["--views", "2", "--techniques", "deferred-dedup,dais-list", "--indirect", "rsm"];
    let (found, html) = bench(&[&["dais-fig5", "--shadow-map-size", "32"], &DAIS_SMALL[..], &more].concat());
    let rows = found["rows"].as_array().expect("a list");
    let seen: Vec<_> =
        rows.iter().map(|row| (row["settings"]["width"].as_u64(), &row["settings"]["camera"])).collect();
    let cameras = ["fly-through at 0.000", "fly-through at 0.500"].map(Value::from);
    let expected =
        [58, 115].map(|width| cameras.iter().map(move |camera| (Some(width), camera))).into_iter().flatten();
    assert_eq!(seen, expected.collect::<Vec<_>>());
    for row in rows {
        let deferred = cell(row, "deferred-dedup");
        assert!(
            deferred["geometry_ms"].as_f64() > Some(0.0) && deferred["triangles_drawn"] == 10,
            "{deferred}"
        );
    }
    let claims = found["claims"].as_array().expect("a list");
    let of = |column: &str| claims.iter().filter(|claim| claim["column"] == column).collect::<Vec<_>>();
    assert_eq!((of("deferred-dedup").len(), of("dais-list").len()), (1, 3), "growth; memory at two sizes");
    let growth = of("deferred-dedup")[0];
    assert!(
        growth["least"].as_f64() <= growth["greatest"].as_f64() && growth["ratio"].is_number(),
        "{growth}"
    );
    assert_eq!(found["curves"].as_array().map(Vec::len), Some(4));
    assert!(html.contains("<svg") && html.contains("geometry pass, ms"), "no chart");
    refused(&["bench", "dais-fig5", "--camera", "0"], 2, &["--camera", "--path"]);
    refused(&["bench", "dais-fig5", "--path", "absent.json"], 2, &["absent.json"]);
}

#[test]
fn bench_dais_fig7_counts_the_triangles_of_a_tessellation() {
    if !has_device() {
        return;
    }
    let (found, _) = bench(&[&["dais-fig7", "--views", "1"], &DAIS_SMALL[..]].concat());
    let sizes = found["tessellation"].as_array().expect("a list");
    assert_eq!(sizes.len(), 2);
    for (size, row) in sizes.iter().zip(found["rows"].as_array().expect("a list")) {
        assert_eq!(size["edge_px"], row["settings"]["tessellate_px"], "{size}");
        let deferred = cell(row, "deferred-dedup");
        let (drawn, counted) = (deferred["triangles_drawn"].as_u64(), size["triangles"].as_u64());
        assert!(deferred["status"] != "ok" || drawn > Some(100) && counted > Some(100), "{size} {deferred}");
        for column in ["dais", "dais-list"] {
            let cell = cell(row, column);
            assert!(cell["status"] != "ok" || cell["triangles_drawn"].as_u64() > Some(100), "{size} {cell}");
        }
    }
}

#[test]
fn every_invalid_sample_is_told_or_loads() {
    let Some(scenes) = shared_scenes() else { return };
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

/// Runs a command that the program has printed; its words are quoted for a shell by single quotes alone.
fn run_printed(folder: &Path, command: &str, more: &[&str]) -> Output {
    let words = command.strip_prefix("afterlight ").expect("is a command of the program");
    let words: Vec<String> = words.split(' ').map(|word| word.trim_matches('\'').to_owned()).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).chain(more.iter().copied()).collect();
    run_in(folder, &words)
}

/// The command of a finding draws the very view again: its image is as far from the reference's, to the last digit.
#[test]
fn verify_finds_nothing_and_its_commands_repeat_views() {
    if !has_device() {
        return;
    }
    let folder = folder();
    let verify =
        ["verify", "builtin:intersect", "--views", "3", "--seed", "7", "--width", "80", "--height", "45"];
    let chosen = ["--techniques", "deferred,tiled,gbuffer-list", "--lights", "9", "--probes", "64", "--json"];
    let output = run_in(folder.path(), &[&verify[..], &chosen].concat());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("3 views of seed 7"), "{}", text(&output.stderr));
    let found = json(&output);
    assert_eq!((&found["views"], &found["off_count"], &found["seed"]), (&3.into(), &0.into(), &7.into()));
    assert!(found["probes"]["surfaces"].as_u64() > Some(100), "{}", found["probes"]);
    let nearest = found["nearest"].as_array().expect("is a list");
    assert!(!nearest.is_empty());
    for finding in nearest {
        let command = finding["command"].as_str().expect("is a text");
        let again = json(&run_printed(folder.path(), command, &["--json"]));
        let difference = &again["results"][0]["difference"];
        for key in ["psnr_db", "max_abs"] {
            assert_eq!(difference[key], finding["difference"][key], "{command}");
        }
    }
}

#[test]
fn verify_ends_with_1_where_a_technique_is_off() {
    if !has_device() {
        return;
    }
    let folder = folder();
    let verify =
        ["verify", "builtin:intersect", "--views", "4", "--seed", "1", "--width", "80", "--height", "45"];
    let chosen = ["--techniques", "light-list", "--set", "light-nodes=4", "--lights", "40", "--samples", "1"];
    let more = ["--pictures", "off", "--json"];
    let output = run_in(folder.path(), &[&verify[..], &chosen, &more].concat());
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    let last = text(&output.stderr).lines().last().expect("a line").to_owned();
    assert!(last.starts_with("afterlight: ") && last.contains("light-list"), "{last}");
    let found = json(&output);
    let worst = &found["off"][0];
    assert_eq!(worst["params"]["light-nodes"], "4");
    let picture = folder.path().join(worst["picture"].as_str().expect("a picture was written"));
    assert!(fs::read(picture).expect("is there").starts_with(b"\x89PNG"));
    let command = worst["command"].as_str().expect("is a text");
    let again = run_printed(folder.path(), command, &[]);
    assert_eq!(again.status.code(), Some(1), "{command}: {}", text(&again.stderr));
}

#[test]
fn play_tells_how_steady_frames_are() {
    if !has_device() {
        return;
    }
    let folder = folder();
    let scene = "builtin:colonnade?triangles=20000&texture=64";
    let size = ["--width", "80", "--height", "45", "--lights", "5"];
    let turns = ["play", scene, "--technique", "tiled,visibility", "--switch-every", "3", "--frames", "9"];
    let output = run_in(folder.path(), &[&turns[..], &size, &["-o", "f%02d.png", "--json", "-"]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let played = json(&output);
    assert_eq!(played["schema"], 1);
    assert_eq!((&played["path"], &played["settings"]["camera"]), (&"nave".into(), &"nave".into()));
    let techniques = played["techniques"].as_array().expect("a list");
    let frames: Vec<_> =
        techniques.iter().map(|one| (one["technique"].clone(), one["frames"].clone())).collect();
    assert_eq!(frames, [("tiled".into(), 6.into()), ("visibility".into(), 3.into())]);
    for one in techniques {
        assert_eq!(one["moves_without_plans"], true);
        for what in ["gpu_ms", "cpu_ms"] {
            let times = &one[what];
            let [median, worst] = ["median", "worst"].map(|key| times[key].as_f64().expect("a time"));
            assert!(median > 0.0 && worst >= median, "{what}: {times}");
        }
    }
    assert!(played["memory"]["in_flight_bytes"].as_u64().expect("bytes") > 0);
    assert!((0.0..=1.0).contains(&played["idle_fraction"].as_f64().expect("a fraction")));
    assert!((0..9).all(|frame| folder.path().join(format!("f{frame:02}.png")).is_file()));

    refused(&["play", "--technique", "backward"], 2, &["backward", "forward"]);
    refused(&["play", "--technique", "tiled", "--frames", "0"], 2, &["--frames"]);
    refused(&["play", "--technique", "tiled", "-o", "frames.png"], 2, &["--output", "%04d"]);
    refused(&["play", "--technique", "tiled", "--in-flight", "9"], 2, &["--in-flight"]);
    refused(&["play", "--technique", "tiled", "--camera", "0"], 2, &["--camera", "--path"]);
    refused(&["play", "--technique", "tiled", "--path", "nowhere"], 2, &["nowhere", "nave"]);
    let turns = ["play", "--technique", "tiled", "--switch-every", "3"];
    refused(&[&turns[..], &["--sizes", "64"]].concat(), 2, &["--sizes", "160x90"]);
    refused(&[&turns[..], &["--samples-list", "1,3"]].concat(), 2, &["--samples-list"]);
    refused(&["play", "--technique", "tiled", "--sizes", "64x48"], 2, &["--switch-every"]);
}

/// Flights of other techniques, sizes and samples, each prepared while another one flies: every round begins with what the one before began
/// with, and no message of validation.
#[test]
fn turns_of_technique_size_and_samples_leave_nothing_behind() {
    if !has_device() {
        return;
    }
    let folder = folder();
    let scene = "builtin:spheres?rows=2&columns=3&segments=16";
    let turns = ["--technique", "visibility,forward,dais", "--sizes", "64x48,48x32", "--samples-list", "1,4"];
    // A camera that hardly moves: lists need the same in each round.
    let how =
        ["--switch-every", "15", "--frames", "600", "--path-seconds", "1e9", "--validate", "--json", "-"];
    let output = run_in(folder.path(), &[&["play", scene], &turns[..], &how].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let played = json(&output);
    let frames: u64 = played["techniques"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|one| one["frames"].as_u64())
        .sum();
    assert_eq!(frames, 600);
    // Ten turns a round: `visibility` has one sample.
    let held = played["held"].as_array().expect("a list");
    assert_eq!(
        held.iter().filter_map(|one| one["frame"].as_u64()).collect::<Vec<_>>(),
        [0, 150, 300, 450, 600]
    );
    for what in ["device_bytes", "device_objects"] {
        assert!(held[1][what].as_u64().expect("a number") > 0);
        assert_eq!([&held[2][what], &held[3][what]], [&held[1][what]; 2], "{what}: {held:?}");
    }
}
