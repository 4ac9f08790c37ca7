//! The tree keeps its arrows; and small trees in which one is broken are caught.

use std::{fs, path::Path};

use tempfile::TempDir;
use xtask::arrows::{TABLE, check};

/// Writes a tree of files: path and content.
fn tree(files: &[(&str, &str)]) -> TempDir {
    let root = tempfile::tempdir().unwrap();
    for (path, content) in files {
        let path = root.path().join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, content).unwrap();
    }
    root
}

fn manifest(name: &str, dependencies: &str) -> String {
    format!("[package]\nname = \"{name}\"\n\n{dependencies}\n")
}

fn broken(root: &Path) -> Vec<String> {
    check(root, &TABLE).unwrap().iter().map(ToString::to_string).collect()
}

/// Expects one broken arrow, whose line begins and holds as given.
fn expect_one(root: &Path, start: &str, holds: &str) {
    let found = broken(root);
    assert_eq!(found.len(), 1, "{found:#?}");
    assert!(
        found[0].starts_with(start) && found[0].contains(holds),
        "found {found:#?}, expected `{start}…{holds}`"
    );
}

#[test]
fn arrows_of_this_tree_run_one_way() {
    let found = broken(&xtask::workspace());
    assert!(found.is_empty(), "{} broken arrows:\n{}", found.len(), found.join("\n"));
}

const FORWARD: &str = "pub static TECHNIQUE: Forward = Forward;\nuse crate::gone;\n";

#[test]
fn a_sound_tree_has_no_broken_arrow() {
    let root = tree(&[
        (
            "crates/stages/Cargo.toml",
            &manifest("s", "[dependencies]\nf = { path = \"../frame\" }\nc.workspace = true"),
        ),
        (
            "crates/frame/Cargo.toml",
            &manifest("f", "[dependencies.c]\nworkspace = true\n[dev-dependencies]\ns = \"1\""),
        ),
        ("crates/cost/Cargo.toml", &manifest("c", "[build-dependencies]\nserde = \"1\"")),
        (
            "crates/stages/src/lib.rs",
            "pub mod surfaces;\npub mod lights;\npub use surfaces::gbuffer::Filled;\n",
        ),
        (
            "crates/stages/src/surfaces/mod.rs",
            "pub mod gbuffer;\npub mod geometry;\npub use gbuffer::Filled;\n",
        ),
        (
            "crates/stages/src/surfaces/gbuffer/mod.rs",
            "use crate::lights::step;\nuse super::geometry::Surfaces;\n",
        ),
        ("crates/stages/src/surfaces/geometry/mod.rs", "#[cfg(test)]\nmod tests { use crate::Filled; }\n"),
        ("crates/stages/src/lights/mod.rs", "pub mod step;\n"),
        ("crates/stages/src/lights/step/mod.rs", "fn light() {}\n"),
        ("crates/stages/src/lights/step/step.glsl", "#include \"shading.glsl\"\n#include \"source\"\n"),
        ("crates/shader/include/shading.glsl", "float shade;\n"),
        ("crates/techniques/src/forward/mod.rs", FORWARD),
        ("crates/techniques/src/forward/shade.glsl", "#include \"step/step.glsl\"\n"),
        (
            "crates/techniques/src/forward/prepass/mod.rs",
            "use super::super::forward::x;\nuse crate::forward::y;\n",
        ),
    ]);
    assert_eq!(broken(root.path()), [""; 0]);
}

#[test]
fn a_crate_that_looks_up_is_caught() {
    let root = tree(&[
        ("crates/techniques/Cargo.toml", &manifest("t", "")),
        (
            "crates/renderer/Cargo.toml",
            &manifest("r", "[dependencies]\n# why\nmine = { package = \"t\", path = \"../t\" }"),
        ),
    ]);
    expect_one(
        root.path(),
        "crates/renderer/Cargo.toml:6: found crates/renderer uses crates/techniques",
        "crates/stages",
    );
}

#[test]
fn a_build_dependency_and_one_of_a_target_count() {
    let root = tree(&[
        (
            "crates/gpu/Cargo.toml",
            &manifest("g", "[build-dependencies]\ns = \"1\"\n[target.'cfg(unix)'.dependencies]\ns = \"1\""),
        ),
        ("crates/scene/Cargo.toml", &manifest("s", "")),
    ]);
    assert_eq!(broken(root.path()).len(), 2);
}

#[test]
fn a_crate_without_a_rule_is_caught() {
    let root = tree(&[("crates/attic/Cargo.toml", &manifest("a", ""))]);
    expect_one(root.path(), "crates/attic/Cargo.toml:1: found the crate crates/attic", "a rule");
}

#[test]
fn folders_that_use_each_other_are_caught() {
    let root = tree(&[
        ("crates/stages/src/lib.rs", "pub mod surfaces;\npub use surfaces::visible::Visible;\n"),
        ("crates/stages/src/surfaces/mod.rs", "pub mod gbuffer;\npub mod visible;\n"),
        ("crates/stages/src/surfaces/visible/mod.rs", "fn f() {\n    crate::surfaces::gbuffer::fill()\n}\n"),
        ("crates/stages/src/surfaces/gbuffer/mod.rs", "\nuse crate::{Visible};\n"),
    ]);
    let found = broken(root.path());
    assert_eq!(found.len(), 2, "{found:#?}");
    assert!(found[0].starts_with(
        "crates/stages/src/surfaces/gbuffer/mod.rs:2: found surfaces/gbuffer uses surfaces/visible, expected no circle"
    ));
    assert!(found[1].starts_with(
        "crates/stages/src/surfaces/visible/mod.rs:2: found surfaces/visible uses surfaces/gbuffer"
    ));
}

#[test]
fn a_layer_that_looks_up_is_caught() {
    let above =
        [("crates/stages/src/compose/present/mod.rs", ""), ("crates/stages/src/surfaces/gbuffer/mod.rs", "")];
    for (path, folder) in [("compose::present", "compose/present"), ("surfaces::gbuffer", "surfaces/gbuffer")]
    {
        let step = format!("use crate::{path};\n");
        let root = tree(&[above[0], above[1], ("crates/stages/src/lights/step/mod.rs", &step)]);
        let start = format!("crates/stages/src/lights/step/mod.rs:1: found lights/step uses {folder}");
        expect_one(root.path(), &start, "only shared/sort, shared/cull, lights");
    }
}

/// The sort lies below all stages, though it stands in a folder above most.
#[test]
fn every_stage_may_sort_and_the_sort_uses_none() {
    let sort = "crates/stages/src/shared/sort/mod.rs";
    let lights = "crates/stages/src/lights/bvh/mod.rs";
    let root = tree(&[(sort, ""), (lights, "use crate::shared::sort;\n")]);
    assert_eq!(broken(root.path()), [] as [&str; 0]);
    let root = tree(&[(sort, "use crate::lights::bvh;\n"), (lights, "")]);
    expect_one(root.path(), &format!("{sort}:1: found shared/sort uses lights/bvh"), "only shared/sort");
    let root =
        tree(&[("crates/stages/src/shared/shadow/mod.rs", ""), (lights, "use crate::shared::shadow;\n")]);
    expect_one(
        root.path(),
        &format!("{lights}:1: found lights/bvh uses shared/shadow"),
        "only shared/sort, shared/cull, lights",
    );
}

#[test]
fn techniques_that_use_each_other_are_caught() {
    let root = tree(&[
        ("crates/techniques/src/forward/mod.rs", "fn f() {\n    crate::tiled::shade()\n}\n"),
        ("crates/techniques/src/tiled/mod.rs", "use crate::{forward::shade};\n"),
        ("crates/techniques/src/registry.rs", "use crate::{forward, tiled};\n"),
    ]);
    let found = broken(root.path());
    assert_eq!(found.len(), 2, "{found:#?}");
    assert!(found[0].starts_with("crates/techniques/src/forward/mod.rs:2: found forward uses tiled"));
    assert!(found[1].starts_with("crates/techniques/src/tiled/mod.rs:1: found tiled uses forward"));
}

#[test]
fn an_experiment_that_uses_its_neighbour_is_caught() {
    let root = tree(&[
        ("crates/experiments/src/kit/mod.rs", ""),
        ("crates/experiments/src/speed/mod.rs", "use crate::kit;\nuse crate::sweep;\n"),
        ("crates/experiments/src/sweep/mod.rs", ""),
    ]);
    expect_one(root.path(), "crates/experiments/src/speed/mod.rs:2: found speed uses sweep", "only kit");
}

#[test]
fn a_shader_of_a_stage_that_includes_a_technique_is_caught() {
    let root = tree(&[
        ("crates/stages/src/lights/cells/cells.glsl", "// why\n#include \"forward/shade.glsl\"\n"),
        ("crates/techniques/src/forward/shade.glsl", ""),
    ]);
    expect_one(
        root.path(),
        "crates/stages/src/lights/cells/cells.glsl:2: found `forward/shade.glsl`",
        "never knows who uses it",
    );
}

#[test]
fn a_shared_header_that_includes_a_stage_is_caught() {
    let root = tree(&[
        ("crates/shader/include/shading.glsl", "#include \"cells/cells.glsl\"\n"),
        ("crates/stages/src/lights/cells/cells.glsl", ""),
    ]);
    expect_one(root.path(), "crates/shader/include/shading.glsl:1", "crates/shader");
}

#[test]
fn a_manifest_that_names_what_is_above_it_is_caught() {
    let manifest = (
        "crates/stages/src/lights/cells/variants.txt",
        "# why\ntemplate cells/cells.comp.glsl source=x/mine.glsl ONE\n",
    );
    let template = ("crates/stages/src/lights/cells/cells.comp.glsl", "#include \"source\"\n");
    let root = tree(&[manifest, template, ("crates/techniques/src/x/mine.glsl", "")]);
    expect_one(
        root.path(),
        "crates/stages/src/lights/cells/variants.txt:2: found `x/mine.glsl`",
        "never knows",
    );
    let root = tree(&[manifest, template, ("crates/stages/src/surfaces/x/mine.glsl", "")]);
    expect_one(
        root.path(),
        "crates/stages/src/lights/cells/variants.txt:2: found lights/cells uses surfaces/x",
        "only shared/sort, shared/cull, lights",
    );
}

#[test]
fn shaders_in_a_circle_are_caught() {
    let root = tree(&[
        ("crates/stages/src/lights/cells/cells.glsl", "#include \"lights/bvh/g.glsl\"\n"),
        ("crates/stages/src/lights/bvh/g.glsl", "#include \"cells/cells.glsl\"\n"),
    ]);
    assert_eq!(broken(root.path()).len(), 2);
}

#[test]
fn a_stage_that_names_a_technique_is_caught() {
    let technique = ("crates/techniques/src/dais/mod.rs", "pub static TECHNIQUE: Dais = Dais;\n");
    let places = [
        (
            "crates/stages/src/surfaces/shade/mod.rs",
            "// dais\nfn f(tag: &str) -> bool { tag.starts_with(\"dais\") }\n",
        ),
        ("crates/stages/src/surfaces/shade/variants.txt", "# dais\nshade.comp.glsl #dais-one ONE\n"),
        ("crates/stages/src/surfaces/shade/shade.glsl", "// dais\n#if defined(SOURCE_DAIS)\n#endif\n"),
    ];
    for (path, content) in places {
        let root = tree(&[technique, (path, content)]);
        expect_one(root.path(), &format!("{path}:2: found `"), "names the technique dais");
    }
}
