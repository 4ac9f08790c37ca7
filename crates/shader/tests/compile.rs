//! Compiling, reflecting and checking small shaders.
#![cfg(feature = "compile")]

use std::fs;

use afterlight_shader::build::Builder;
use afterlight_shader::compile::{CompileError, Compiled};
use afterlight_shader::pack::{pack, unpack, unpack_owned};
use afterlight_shader::reload::{Changed, Reloader};
use afterlight_shader::{
    BindingKind, FieldLayout, ImageDim, ImageShape, Reflection, Scalar, Stage, StructLayout, shader_struct,
};
use tempfile::TempDir;

shader_struct! {
    /// As the shaders below declare it.
    pub struct Lamp {
        /// World space, m.
        pub position_ws: [f32; 3],
        /// m.
        pub radius_m: f32,
        /// Four numbers.
        pub weights: [u32; 4],
        /// World to lamp.
        pub lamp_from_world: [[f32; 4]; 4],
    }
}

const LAMP: &str =
    "struct Lamp { vec3 position_ws; float radius_m; uint weights[4]; mat4 lamp_from_world; };\n";

fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = TempDir::new().expect("a temporary folder");
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a parent")).expect("folder made");
        fs::write(path, text).expect("file written");
    }
    folder
}

fn compile(files: &[(&str, &str)], layouts: &[StructLayout]) -> Result<Vec<Compiled>, CompileError> {
    let folder = folder(files);
    Builder::new().folder("t", folder.path()).layouts(layouts).compile()
}

fn compile_one(files: &[(&str, &str)]) -> Reflection {
    compile(files, &[]).expect("compiles").remove(0).shader.reflection
}

const COMPUTE: &str = "#version 460
#include \"sub/lamp.glsl\"
layout(constant_id = 7) const uint LIMIT = 12;
layout(constant_id = 3) const bool FAST = true;
layout(local_size_x = 16, local_size_y = 8) in;
layout(set = 0, binding = 0, scalar) uniform FrameBlock { mat4 clip_from_world; } frame;
layout(set = 0, binding = 1, scalar) readonly buffer LampBlock { Lamp lamps[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer OutBlock { uint counts[]; } written;
layout(set = 0, binding = 3, rgba16f) uniform writeonly image2D hdr_out;
layout(set = 0, binding = 4, r32ui) uniform uimage2DArray both;
layout(set = 1, binding = 0) uniform texture2DArray maps[4];
layout(set = 1, binding = 1) uniform sampler linear;
layout(set = 0, binding = 5) uniform sampler2DMS depth_ms;
layout(set = 0, binding = 9) uniform sampler2D never_used;
layout(push_constant, scalar) uniform Push { uvec2 size_px; float bias; } push;
void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    float sum = frame.clip_from_world[0][0] + lamps[pixel.x].radius_m + push.bias;
    sum += texelFetch(depth_ms, ivec2(pixel), 1).x + texture(sampler2DArray(maps[2], linear), vec3(0)).x;
    written.counts[0] = FAST ? LIMIT : push.size_px.x;
    imageAtomicAdd(both, ivec3(0), 1u);
    imageStore(hdr_out, ivec2(pixel), vec4(sum));
}
";

#[test]
fn compute_shader_is_reflected() {
    let reflection = compile_one(&[
        ("variants.txt", "# a comment\n\nshade.comp #big SIZE=2\n"),
        ("shade.comp", COMPUTE),
        ("sub/lamp.glsl", LAMP),
    ]);
    assert_eq!(reflection.local_size, [16, 8, 1]);
    assert_eq!(reflection.push_constant_bytes, 12);
    let constants: Vec<_> =
        reflection.spec_constants.iter().map(|c| (c.id, c.name.as_str(), c.scalar, c.default_bits)).collect();
    assert_eq!(constants, [(3, "FAST", Scalar::Bool, 1), (7, "LIMIT", Scalar::Uint, 12)]);
    let bindings: Vec<_> = reflection
        .bindings
        .iter()
        .map(|b| (b.set, b.binding, b.name.as_str(), b.kind, b.count, b.readable, b.writable))
        .collect();
    use BindingKind::*;
    assert_eq!(
        bindings,
        [
            (0, 0, "frame", UniformBuffer, 1, true, false),
            (0, 1, "LampBlock", StorageBuffer, 1, true, false),
            (0, 2, "written", StorageBuffer, 1, false, true),
            (0, 3, "hdr_out", StorageImage, 1, false, true),
            (0, 4, "both", StorageImage, 1, true, true),
            (0, 5, "depth_ms", CombinedImageSampler, 1, true, false),
            (1, 0, "maps", SampledImage, 4, true, false),
            (1, 1, "linear", Sampler, 1, true, false),
        ]
    );
    let shape = |arrayed, multisampled| Some(ImageShape { dim: ImageDim::D2, arrayed, multisampled });
    assert_eq!(reflection.binding("both").and_then(|b| b.image), shape(true, false));
    assert_eq!(reflection.binding("depth_ms").and_then(|b| b.image), shape(false, true));
    assert_eq!(reflection.binding("never_used"), None);
}

#[test]
fn unused_descriptors_leave_the_module() {
    let compiled = compile(
        &[("variants.txt", "shade.comp"), ("shade.comp", COMPUTE), ("sub/lamp.glsl", LAMP)],
        &[Lamp::LAYOUT],
    )
    .expect("compiles");
    let text: Vec<u8> = compiled[0].shader.spirv.iter().flat_map(|word| word.to_le_bytes()).collect();
    let has = |name: &str| text.windows(name.len()).any(|window| window == name.as_bytes());
    assert!(has("depth_ms"));
    assert!(!has("never_used"));
    assert_eq!(compiled[0].shader.spirv[1], 0x0001_0500, "SPIR-V 1.5");
}

#[test]
fn interface_of_a_vertex_and_a_fragment_shader() {
    let compiled = compile(
        &[
            ("variants.txt", "a.vert\na.frag.glsl #mask MASK"),
            (
                "a.vert",
                "#version 460\nlayout(location = 0) in vec3 position; layout(location = 2) in uvec2 packed;\n\
                 layout(location = 1) out vec2 uv; layout(location = 3) flat out uint id;\n\
                 void main() { gl_Position = vec4(position, 1); uv = position.xy; id = packed.x; }",
            ),
            (
                "a.frag.glsl",
                "#version 460\n#ifndef MASK\n#error no mask\n#endif\nlayout(location = 0) out vec4 color;\nvoid main() { color = vec4(1); }",
            ),
        ],
        &[],
    )
    .expect("compiles");
    let list = |shader: usize, outputs: bool| -> Vec<(u32, String, u32, Scalar)> {
        let reflection = &compiled[shader].shader.reflection;
        let list = if outputs { &reflection.outputs } else { &reflection.inputs };
        list.iter().map(|one| (one.location, one.name.to_string(), one.components, one.scalar)).collect()
    };
    assert_eq!(
        list(0, false),
        [(0, "position".into(), 3, Scalar::Float), (2, "packed".into(), 2, Scalar::Uint)]
    );
    assert_eq!(list(0, true), [(1, "uv".into(), 2, Scalar::Float), (3, "id".into(), 1, Scalar::Uint)]);
    assert_eq!(list(1, true), [(0, "color".into(), 4, Scalar::Float)]);
    assert_eq!(compiled[1].shader.name, "t/a.frag#mask");
    assert_eq!((compiled[0].shader.stage, compiled[1].shader.stage), (Stage::Vertex, Stage::Fragment));
}

#[test]
fn includes_resolve_beside_then_in_the_folder_then_in_this_crate() {
    let (name, _) = afterlight_shader::INCLUDES.first().expect("headers are embedded");
    let main = format!(
        "#version 460\n#include \"a/one.glsl\"\n#include \"a/one.glsl\"\n#include \"{name}\"\nlayout(local_size_x = 1) in;\nvoid main() {{ float x = one() + two(); }}"
    );
    let compiled = compile(
        &[
            ("variants.txt", "main.comp"),
            ("main.comp", &main),
            (
                "a/one.glsl",
                "#pragma once\n#include \"two.glsl\"\n#include \"root.glsl\"\nfloat one() { return 1.0; }\n",
            ),
            ("a/two.glsl", "float two() { return 2.0; }\n"),
            ("two.glsl", "#error the wrong one\n"),
            ("root.glsl", "\n"),
        ],
        &[],
    )
    .expect("compiles");
    let files: Vec<_> = compiled[0]
        .files
        .read
        .iter()
        .map(|path| path.file_name().expect("a name").to_string_lossy().into_owned())
        .collect();
    assert_eq!(files, ["one.glsl", "two.glsl", "main.comp", "root.glsl"]);
}

#[test]
fn errors_cite_file_and_line() {
    let cases = [
        (
            "#version 460\nlayout(local_size_x = 1) in;\nvoid main() {\n    float x = nothing;\n}\n",
            "bad.comp:4: ",
        ),
        (
            "#version 460\n#include \"sub/part.glsl\"\nlayout(local_size_x = 1) in;\nvoid main() { part(); }\n",
            "sub/part.glsl:2: ",
        ),
        (
            "#version 460\n#include \"sub/lamp.glsl\"\nlayout(local_size_x = 1) in;\nvoid main() {\n    nothing();\n}\n",
            "bad.comp:5: ",
        ),
        ("#version 460\n\n#include \"absent.glsl\"\nvoid main() {}\n", "bad.comp:3: "),
    ];
    for (text, place) in cases {
        let error = compile(
            &[
                ("variants.txt", "bad.comp"),
                ("bad.comp", text),
                ("sub/part.glsl", "\nfloat part() { return oops; }\n"),
                ("sub/lamp.glsl", LAMP),
            ],
            &[],
        )
        .expect_err("does not compile")
        .to_string();
        assert!(error.contains(place), "expected `{place}` in:\n{error}");
        assert!(error.starts_with("t/bad.comp: "), "{error}");
    }
}

#[test]
fn wrong_manifests_are_told_by_line() {
    for (line, expected) in [
        ("shade.glsl", "expected one that ends in .vert"),
        ("a.comp\na.comp", "variants.txt:2: found `t/a.comp` a second time"),
        ("a.comp #x #y", "a second tag `#y`"),
        ("a.comp 1BAD", "found `1BAD`, expected NAME or NAME=VALUE"),
    ] {
        let error = compile(&[("variants.txt", line)], &[]).expect_err("is wrong").to_string();
        assert!(error.contains(expected), "expected `{expected}` in: {error}");
    }
    let error = compile(&[("variants.txt", "absent.comp")], &[]).expect_err("no file").to_string();
    assert!(error.contains("absent.comp: "), "{error}");
}

/// A stage's folder with two templates, and a technique's folder that uses them.
const STAGES: &[(&str, &str)] = &[
    (
        "stage/shade.comp.glsl",
        "#version 460\n#include \"near.glsl\"\n#include \"source\"\n#include \"source\"\nlayout(local_size_x = SIZE) in;\n\
         void main() { surface(); near(); }\n",
    ),
    ("stage/volume.frag.glsl", "#version 460\n#include \"source\"\nvoid main() { surface(); }\n"),
    ("stage/near.glsl", "void near() {}\n"),
    ("stage/common.glsl", "void common_part() {}\n"),
];
const SOURCE: &str = "#pragma once\n#include \"stage/common.glsl\"\n#ifndef SIZE\n#define SIZE 1\n#endif\nvoid surface() { common_part(); }\n";

/// Compiles the technique `mine` with the include folders `stages` and `techniques` of one temporary folder.
fn compile_mine(files: &[(&str, &str)]) -> Result<Vec<Compiled>, CompileError> {
    let (stages, techniques) = (folder(STAGES), folder(files));
    builder_of_mine(&stages, &techniques).compile()
}

fn builder_of_mine(stages: &TempDir, techniques: &TempDir) -> Builder {
    Builder::new()
        .include_dir(stages.path())
        .include_dir(techniques.path())
        .folder("mine", techniques.path().join("mine"))
}

#[test]
fn a_template_takes_each_users_source() {
    let manifest = "\
        template stage/shade.comp.glsl stage/volume.frag.glsl source=source_mine.glsl #base EXTRA\n\
        \n  axis - | #refs REFERENCES | #keys KEYS=2   # what an ID is\n\
        # a comment within\n  axis - | #one SIZE=4\n  without #keys #one\n\
        own.comp #plain\n\
        template stage/shade.comp.glsl source=other/source.glsl\n";
    let compiled = compile_mine(&[
        ("mine/variants.txt", manifest),
        ("mine/source_mine.glsl", SOURCE),
        ("mine/near.glsl", "#error a template's include is beside the template\n"),
        ("mine/own.comp", "#version 460\nlayout(local_size_x = 2) in;\nvoid main() {}\n"),
        ("other/source.glsl", "#pragma once\n#define SIZE 8\nvoid surface() {}\n"),
    ])
    .unwrap_or_else(|error| panic!("{error}"));
    let sizes: Vec<_> =
        compiled.iter().map(|one| (one.shader.name.as_str(), one.shader.reflection.local_size[0])).collect();
    assert_eq!(
        sizes,
        [
            ("mine/shade.comp#base", 1),
            ("mine/shade.comp#base-one", 4),
            ("mine/shade.comp#base-refs", 1),
            ("mine/shade.comp#base-refs-one", 4),
            ("mine/shade.comp#base-keys", 1),
            ("mine/volume.frag#base", 1),
            ("mine/volume.frag#base-one", 1),
            ("mine/volume.frag#base-refs", 1),
            ("mine/volume.frag#base-refs-one", 1),
            ("mine/volume.frag#base-keys", 1),
            ("mine/own.comp#plain", 2),
            ("mine/shade.comp", 8),
        ]
    );
}

#[test]
fn wrong_templates_are_told_by_line() {
    let file = "template stage/shade.comp.glsl source=source.glsl";
    for (manifest, expected) in [
        (
            "template stage/shade.comp.glsl",
            "variants.txt:1: found `template stage/shade.comp.glsl` without a source",
        ),
        ("template source=source.glsl", "variants.txt:1: found no template before `source=`"),
        (
            "\ntemplate stage/absent.comp source=source.glsl",
            "variants.txt:2: found no template `stage/absent.comp`",
        ),
        (
            "template stage/near.glsl source=source.glsl",
            "found file `stage/near.glsl`, expected one that ends in",
        ),
        (
            "template stage/shade.comp.glsl source=absent.glsl",
            "found no source `absent.glsl`, expected a file of ",
        ),
        (
            "own.comp source=source.glsl",
            "found `source=source.glsl`, expected it once and on a `template` line",
        ),
        ("own.comp\naxis - | #one ONE", "variants.txt:2: found `axis`, expected a `template` line above it"),
        ("without #one #two", "found `without`, expected a `template` line above it"),
        (&format!("{file}\naxis #a | "), "variants.txt:2: found an empty option"),
        (&format!("{file}\naxis #a | #b\naxis #a | -"), "variants.txt:3: found `#a` a second time"),
        (&format!("{file}\naxis - | X"), "found two options without a tag"),
        (&format!("{file}\naxis - | #a 1X"), "found `1X`, expected NAME or NAME=VALUE"),
        (
            &format!("{file}\naxis - | #a\nwithout #a #b"),
            "variants.txt:3: found `#b`, expected a #TAG of an axis",
        ),
        (&format!("{file}\naxis #a | #b\nwithout #a #b"), "expected tags of different axes"),
        (&format!("{file}\naxis - | #a\nwithout #a"), "found 1 tag(s) after `without`"),
        (&format!("{file}\n{file}"), "variants.txt:2: found `mine/shade.comp` a second time"),
    ] {
        let error = compile_mine(&[("mine/variants.txt", manifest), ("mine/source.glsl", SOURCE)])
            .expect_err("is wrong")
            .to_string();
        assert!(error.contains(expected), "expected `{expected}` in: {error}");
    }
}

#[test]
fn includes_that_lead_nowhere_or_to_two_files_are_explained() {
    const OWN: &str = "#version 460\n#include \"HEADER\"\nlayout(local_size_x = 2) in;\nvoid main() {}\n";
    let (embedded, _) = afterlight_shader::INCLUDES.first().expect("headers are embedded");
    for (header, expected) in [
        ("source", "mine/own.comp:2: found `#include \"source\"` in `mine/own.comp`, which has no source"),
        ("absent.glsl", "mine/own.comp:2: found no file `absent.glsl`, expected it beside"),
        ("stage/common.glsl", "mine/own.comp:2: found `stage/common.glsl` twice, "),
        (*embedded, "twice, "),
        ("zero.glsl", "zero.glsl: found a zero byte"),
    ] {
        let files = [
            ("mine/variants.txt", "own.comp"),
            ("mine/own.comp", &OWN.replace("HEADER", header)),
            ("mine/zero.glsl", "\0"),
            ("stage/common.glsl", ""),
            (*embedded, ""),
        ];
        let error = compile_mine(&files).expect_err("is wrong").to_string();
        assert!(error.contains(expected), "expected `{expected}` in: {error}");
    }
    let (stages, techniques) = (
        folder(STAGES),
        folder(&[
            ("mine/variants.txt", "own.comp"),
            ("mine/own.comp", &OWN.replace("HEADER", "stage/common.glsl")),
        ]),
    );
    builder_of_mine(&stages, &techniques)
        .include_dir(stages.path().join("."))
        .compile()
        .expect("one folder twice");
}

#[test]
fn reload_sees_sources_and_files_that_come_between() {
    let (stages, techniques) = (
        folder(STAGES),
        folder(&[
            (
                "mine/variants.txt",
                "template stage/shade.comp.glsl source=source.glsl\n  axis - | #two SIZE=2",
            ),
            ("mine/source.glsl", SOURCE),
        ]),
    );
    let mut reloader = Reloader::new(builder_of_mine(&stages, &techniques)).expect("compiles");
    assert!(reloader.poll().is_empty());
    let write = |name: &str, text: &str| fs::write(techniques.path().join(name), text).expect("written");
    let names = |changes: Vec<Changed>| -> Vec<String> {
        changes
            .into_iter()
            .map(|change| match change {
                Changed::Compiled(shader) => shader.name.to_string(),
                Changed::Failed { message, .. } => message,
            })
            .collect()
    };
    write("mine/source.glsl", &SOURCE.replace("SIZE 1", "SIZE 16"));
    assert_eq!(names(reloader.poll()), ["mine/shade.comp", "mine/shade.comp#two"]);
    // A macro of one variant.
    write("mine/variants.txt", "template stage/shade.comp.glsl source=source.glsl\n  axis - | #two SIZE=3");
    assert_eq!(names(reloader.poll()), ["mine/shade.comp#two"]);
    // A file that did not exist makes a name ambiguous, until it goes again.
    fs::create_dir(techniques.path().join("stage")).expect("made");
    write("stage/common.glsl", "");
    assert!(names(reloader.poll()).iter().all(|message| message.contains("found `stage/common.glsl` twice")));
    assert!(reloader.poll().is_empty());
    fs::remove_file(techniques.path().join("stage/common.glsl")).expect("removed");
    assert_eq!(names(reloader.poll()).len(), 2);
    assert!(reloader.poll().is_empty());
}

#[test]
fn structs_must_lie_as_in_rust() {
    let shader = |declaration: &str, layout: &str| {
        format!(
            "#version 460\n{declaration}layout(local_size_x = 1) in;\n\
             layout(binding = 0, {layout}) buffer Block {{ Lamp lamps[]; }};\nvoid main() {{ lamps[0].radius_m = 1.0; }}"
        )
    };
    let check = |text: String, layout: StructLayout| {
        compile(&[("variants.txt", "s.comp"), ("s.comp", &text)], &[layout]).map(|_| ())
    };
    check(shader(LAMP, "scalar"), Lamp::LAYOUT).expect("the same in both");
    check(shader(LAMP, "std430"), Lamp::LAYOUT).expect("the same in both");

    // std140 spreads the array; a swapped, a renamed and a missing field, and a shorter struct in Rust.
    let swapped = LAMP.replace("vec3 position_ws; float radius_m;", "float radius_m; vec3 position_ws;");
    let renamed = LAMP.replace("weights", "weight");
    let missing = LAMP.replace(" mat4 lamp_from_world;", "");
    let narrower = LAMP.replace("mat4", "mat3");
    let shorter = StructLayout { fields: &Lamp::LAYOUT.fields[..3], ..Lamp::LAYOUT };
    const MOVED: &[FieldLayout] = &[FieldLayout { name: "position_ws", offset_bytes: 4, size_bytes: 12 }];
    let moved = StructLayout { fields: MOVED, ..Lamp::LAYOUT };
    for (text, layout, expected) in [
        (shader(&swapped, "scalar"), Lamp::LAYOUT, "GLSL has `radius_m` at byte 0"),
        (shader(&renamed, "scalar"), Lamp::LAYOUT, "GLSL has `weight` at byte 16 (16 bytes)"),
        (shader(&missing, "scalar"), Lamp::LAYOUT, "GLSL lacks field `lamp_from_world`"),
        (shader(&narrower, "scalar"), Lamp::LAYOUT, "at byte 32 (36 bytes)"),
        (shader(LAMP, "scalar"), shorter, "Rust lacks field `lamp_from_world` at byte 32"),
        (shader(LAMP, "scalar"), moved, "at byte 4 (12 bytes)"),
        (shader(LAMP, "scalar"), StructLayout { size_bytes: 100, ..Lamp::LAYOUT }, "stride of 96 bytes"),
    ] {
        let error = check(text, layout).expect_err("differs").to_string();
        assert!(
            error.contains("struct `Lamp`") && error.contains(expected),
            "expected `{expected}` in: {error}"
        );
    }
}

#[test]
fn reload_tells_changes_and_keeps_the_old_on_errors() {
    const GOOD: &str =
        "#version 460\n#include \"part.glsl\"\nlayout(local_size_x = 4) in;\nvoid main() { part(); }\n";
    let folder = folder(&[("variants.txt", "a.comp"), ("a.comp", GOOD), ("part.glsl", "void part() {}\n")]);
    let mut reloader = Reloader::new(Builder::new().folder("t", folder.path())).expect("compiles");
    assert!(reloader.poll().is_empty());
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("written");

    write("part.glsl", "void part() { oops(); }\n");
    match &reloader.poll()[..] {
        [Changed::Failed { name, message }] => {
            assert_eq!(name, "t/a.comp");
            assert!(message.contains("part.glsl:1: "), "{message}");
        }
        other => panic!("expected one failure, found {other:?}"),
    }
    assert!(reloader.poll().is_empty(), "a failure is told once");

    write("part.glsl", "void part() {   }\n");
    assert!(matches!(&reloader.poll()[..], [Changed::Compiled(_)]));

    write("a.comp", &GOOD.replace("= 4)", "= 128)"));
    match &reloader.poll()[..] {
        [Changed::Compiled(shader)] => assert_eq!(shader.reflection.local_size, [128, 1, 1]),
        other => panic!("expected one change, found {other:?}"),
    }
    write("variants.txt", "a.comp\na.comp #more MORE\n");
    assert!(matches!(&reloader.poll()[..], [Changed::Compiled(shader)] if shader.name == "t/a.comp#more"));
    assert!(reloader.poll().is_empty());
}

#[test]
fn emitted_code_names_every_shader() {
    let folder = folder(&[
        ("variants.txt", "a.comp\na.comp #x X=3"),
        ("a.comp", "#version 460\nlayout(local_size_x = 1) in;\nvoid main() {}\n"),
    ]);
    let out = TempDir::new().expect("a temporary folder");
    Builder::new().folder("t", folder.path()).emit(out.path()).expect("emits");
    let code = fs::read_to_string(out.path().join("shaders.rs")).expect("written");
    for expected in ["pub static SHADERS", "pub fn shader(name: &str)", "/shaders.bin"] {
        assert!(code.contains(expected), "expected {expected} in:\n{code}");
    }
    let packed = fs::read(out.path().join("shaders.bin")).expect("written");
    let names: Vec<_> =
        unpack_owned(&packed).expect("shaders").into_iter().map(|shader| shader.name.to_string()).collect();
    assert_eq!(names, ["t/a.comp", "t/a.comp#x"]);
}

#[test]
fn shaders_are_the_same_after_packing() {
    let files = [
        ("variants.txt", "shade.comp\na.vert"),
        ("shade.comp", COMPUTE),
        ("sub/lamp.glsl", LAMP),
        (
            "a.vert",
            "#version 460\nlayout(location = 0) in vec3 p; layout(location = 1) flat out uint id;\nvoid main() { gl_Position = vec4(p, 1); id = 1; }",
        ),
    ];
    let shaders: Vec<_> = compile(&files, &[]).expect("compiles").into_iter().map(|one| one.shader).collect();
    let packed = pack(&shaders.iter().collect::<Vec<_>>());
    assert_eq!(unpack_owned(&packed).as_ref(), Ok(&shaders));
    assert_eq!(unpack(packed.clone().leak()).as_ref(), Ok(&shaders));
    for length in 0..packed.len() {
        unpack_owned(&packed[..length]).expect_err("is cut");
    }
    assert!(unpack_owned(&[packed.as_slice(), &[0]].concat()).is_err(), "one byte too many");
    let mut wrong_stage = packed;
    wrong_stage[8 + "t/shade.comp".len()] = 77;
    let error = unpack_owned(&wrong_stage).expect_err("no stage").to_string();
    assert!(error.contains("found 77 before byte 24, expected a stage"), "{error}");
}

#[test]
fn only_what_changed_is_compiled_again() {
    let main = |header: &str| {
        format!("#version 460\n#include \"{header}\"\nlayout(local_size_x = SIZE) in;\nvoid main() {{}}\n")
    };
    let techniques = folder(&[
        ("mine/variants.txt", "a.comp\na.comp #more MORE\nb.comp\nc.comp\nd.comp"),
        ("mine/a.comp", &main("one.glsl")),
        ("mine/b.comp", &main("deep.glsl")),
        ("mine/c.comp", &main("two.glsl")),
        ("mine/d.comp", &main("shared.glsl")),
        ("mine/one.glsl", "#define SIZE 1\n"),
        ("mine/two.glsl", "#define SIZE 2\n"),
        ("mine/deep.glsl", "#include \"one.glsl\"\n"),
        ("shared.glsl", "#define SIZE 3\n"),
    ]);
    let out = TempDir::new().expect("a temporary folder");
    let emit_with = |layouts: &[StructLayout]| {
        let builder =
            Builder::new().include_dir(techniques.path()).folder("mine", techniques.path().join("mine"));
        builder.layouts(layouts).emit(out.path()).unwrap_or_else(|error| panic!("{error}")).compiled_count
    };
    let emit = || emit_with(&[]);
    let write = |name: &str, text: &str| fs::write(techniques.path().join(name), text).expect("written");
    let size = |name: &str| {
        let packed = fs::read(out.path().join("shaders.bin")).expect("written");
        let shaders = unpack_owned(&packed).expect("shaders");
        shaders.iter().find(|shader| shader.name == *name).expect("there").reflection.local_size[0]
    };
    assert_eq!(emit(), 5);
    let written = fs::metadata(out.path().join("shaders.bin")).expect("there").modified().expect("a time");
    assert_eq!(emit(), 0, "nothing changed");
    let now = fs::metadata(out.path().join("shaders.bin")).expect("there").modified().expect("a time");
    assert_eq!(now, written, "what is the same is not written again");

    write("mine/one.glsl", "#define SIZE 4\n");
    assert_eq!(emit(), 3, "two variants include it, and one through another header");
    assert_eq!((size("mine/b.comp"), size("mine/c.comp")), (4, 2));
    write("mine/two.glsl", "#define SIZE 5\n");
    assert_eq!(emit(), 1);
    write("mine/shared.glsl", "#define SIZE 6\n");
    assert_eq!(emit(), 1, "a new file comes before the one of the include folder");
    assert_eq!(size("mine/d.comp"), 6);
    write("mine/variants.txt", "a.comp\na.comp #more MORE=2\nb.comp\nc.comp");
    assert_eq!(emit(), 1, "another macro, and one variant less");
    assert_eq!(fs::read_dir(out.path().join("shader_cache")).expect("there").count(), 4);
    assert_eq!(emit_with(&[Lamp::LAYOUT]), 4, "other layouts");
    assert_eq!(emit_with(&[Lamp::LAYOUT]), 0);
    for (index, entry) in fs::read_dir(out.path().join("shader_cache")).expect("there").enumerate() {
        let path = entry.expect("a file").path();
        let mut bytes = fs::read(&path).expect("read");
        match index {
            0 => bytes.clear(),
            1 => bytes.truncate(bytes.len() - 4),
            2 => *bytes.last_mut().expect("not empty") ^= 1,
            _ => continue,
        }
        fs::write(&path, bytes).expect("written");
    }
    assert_eq!(emit_with(&[Lamp::LAYOUT]), 3, "broken files of the cache");
    write("mine/two.glsl", "#error wrong\n");
    let builder =
        || Builder::new().include_dir(techniques.path()).folder("mine", techniques.path().join("mine"));
    builder().emit(out.path()).expect_err("does not compile");
    write("mine/two.glsl", "#define SIZE 7\n");
    assert_eq!(builder().emit(out.path()).expect("compiles").compiled_count, 1, "what did compile was kept");
}

#[test]
fn broken_spirv_is_an_error() {
    use afterlight_shader::reflect::{ReflectError, reflect};
    assert_eq!(reflect(&[]), Err(ReflectError::Magic { found: 0 }));
    assert!(matches!(reflect(&[0x0723_0203, 0x10500, 0, 9, 0, 0]), Err(ReflectError::Length { .. })));
    // A name instruction without operands.
    assert!(matches!(
        reflect(&[0x0723_0203, 0x10500, 0, 9, 0, 0x0001_0005]),
        Err(ReflectError::Malformed { .. })
    ));
}

proptest::proptest! {
    #![proptest_config(proptest::test_runner::Config { failure_persistence: None, ..Default::default() })]
    #[test]
    fn reflection_never_panics(words in proptest::collection::vec(proptest::num::u32::ANY, 0..64), flips in proptest::collection::vec((0usize..2000, proptest::num::u32::ANY), 1..6)) {
        use afterlight_shader::reflect::{reflect, strip_unused, structs_in_memory};
        static GOOD: std::sync::LazyLock<Vec<u32>> = std::sync::LazyLock::new(|| {
            let files = [("variants.txt", "shade.comp"), ("shade.comp", COMPUTE), ("sub/lamp.glsl", LAMP)];
            compile(&files, &[]).expect("compiles")[0].shader.spirv.to_vec()
        });
        let mut flipped = GOOD.clone();
        for (at, word) in flips {
            let at = at % flipped.len();
            flipped[at] = word;
        }
        let mut random = vec![0x0723_0203, 0x10500, 0, 100, 0];
        random.extend(words.iter().map(|word| word & 0x0003_ffff));
        for module in [random, flipped] {
            let _ = (reflect(&module), structs_in_memory(&module), strip_unused(&module));
        }
    }
}
