//! Effects become options of a command line, without a word about any of them there.

#[allow(dead_code, reason = "techniques have another test")]
#[path = "../drafts/mod.rs"]
mod drafts;

use afterlight_params::{OptionInfo, ParamError, ParamSet, options};
use clap::{Arg, ArgMatches, Command, builder::PossibleValuesParser, parser::ValueSource};
use drafts::effects::{Effects, Indirect, Post, Shadows, Transparency};

/// The option of a command line.
fn argument(option: OptionInfo) -> Arg {
    let default = option.default.map(|default| format!(" [default: {default}]")).unwrap_or_default();
    let argument =
        Arg::new(option.long).long(option.long).value_name(option.value_name).help(option.help + &default);
    match option.possible_values {
        [] => argument,
        names => argument.value_parser(PossibleValuesParser::new(names)),
    }
}

/// Sets what the command line says; what it does not say has its default.
fn set(matches: &ArgMatches, set: &mut dyn ParamSet) -> Result<(), ParamError> {
    for option in options(set) {
        if matches.value_source(option.long) == Some(ValueSource::CommandLine)
            && let Some(text) = matches.get_one::<String>(option.long)
        {
            set.set(option.long, text)?;
        }
    }
    Ok(())
}

fn command() -> Command {
    Command::new("afterlight").args(options(&Effects::default()).into_iter().map(argument))
}

fn effects(arguments: &[&str]) -> Result<Effects, String> {
    let matches =
        command().try_get_matches_from([&["afterlight"], arguments].concat()).map_err(|e| e.to_string())?;
    let mut effects = Effects::default();
    set(&matches, &mut effects).map_err(|e| e.to_string())?;
    Ok(effects)
}

#[test]
fn nothing_said_is_all_defaults() {
    command().debug_assert();
    let effects = effects(&[]).expect("defaults");
    assert_eq!(effects, Effects::default());
    assert_eq!((effects.shadows.map_size_px, effects.indirect.map_size_px), (2048, 512));
    assert_eq!(effects.transparency.order, Transparency::Sorted);
    assert_eq!(effects.tessellation.edge_px, None);
}

#[test]
fn options_set_fields() {
    let effects = effects(&[
        "--post",
        "smaa",
        "--tessellate",
        "8",
        "--displacement",
        "2.5",
        "--shadows",
        "map",
        "--indirect",
        "rsm",
        "--transparency",
        "none",
    ])
    .expect("known options");
    assert_eq!(effects.post.filter, Post::Smaa);
    assert_eq!(effects.tessellation.edge_px, Some(8.0));
    assert_eq!(effects.tessellation.displacement_m(), 2.5 * 1e-3);
    assert_eq!((effects.shadows.method, effects.shadows.map_size_px), (Shadows::Map, 2048));
    assert_eq!((effects.indirect.method, effects.indirect.map_size_px), (Indirect::Rsm, 512));
    assert_eq!(effects.transparency.order, Transparency::None);
}

#[test]
fn one_size_is_that_of_both_maps() {
    let effects = effects(&["--shadow-map-size", "256"]).expect("a size");
    assert_eq!((effects.shadows.map_size_px, effects.indirect.map_size_px), (256, 256));
}

#[test]
fn errors_name_option_found_and_expected() {
    let error = effects(&["--shadows", "pcss"]).expect_err("no such shadows");
    assert!(error.contains("--shadows <SHADOWS>") && error.contains("pcss") && error.contains("none, map"));
    let error = effects(&["--tessellate", "0.5"]).expect_err("too short");
    assert_eq!(error, r#"parameter tessellate: found "0.5", expected none, or a number from 1 to 64"#);
    let error = effects(&["--shadow-map-size", "0"]).expect_err("too small");
    assert!(error.contains("expected a whole number from 1 to 4294967295"), "{error}");
}

#[test]
fn help_comes_from_the_declaration() {
    let help = command().term_width(200).render_help().to_string();
    let lines: Vec<String> =
        help.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect();
    for expected in [
        "--post <POST> Anti-aliasing after shading [default: none] [possible values: none, fxaa, smaa, sraa]",
        "--tessellate <PX> Tessellates surfaces to triangles with edges of about PX pixels",
        "--displacement <MM> Displaces tessellated surfaces by up to MM millimetres along each axis [default: 0]",
        "--shadow-map-size <N> Width and height of a light's view, texels [default: 2048 for shadows, 512 for indirect]",
        "--indirect <INDIRECT> Indirect light [default: none] [possible values: none, rsm]",
    ] {
        assert!(lines.iter().any(|line| line == expected), "{expected}\n{help}");
    }
}
