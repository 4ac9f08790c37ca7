//! Options of effects, from what effects there are.

use std::ffi::OsStr;

use afterlight_techniques::{
    Effects, ParamError, ParamSet as _,
    params::{OptionInfo, options},
};
use clap::{
    Arg, ArgMatches, Args, Command, Error, FromArgMatches,
    builder::{PossibleValue, TypedValueParser},
    error::ErrorKind,
};

/// Effects as options set them, one for each parameter; what is not said has its default.
#[derive(Clone, Debug, Default)]
pub struct EffectArgs(pub Effects);

/// Names of the options.
pub fn names() -> impl Iterator<Item = &'static str> {
    options(&Effects::default()).into_iter().map(|option| option.long)
}

impl Args for EffectArgs {
    fn augment_args(command: Command) -> Command {
        command.args(options(&Effects::default()).into_iter().map(argument))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for EffectArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let mut args = Self::default();
        args.update_from_arg_matches(matches)?;
        Ok(args)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        for name in names() {
            if let Some(text) = matches.get_one::<String>(name) {
                // The option's parser has taken it already.
                self.0.set(name, text).map_err(|error| Error::raw(ErrorKind::ValueValidation, error))?;
            }
        }
        Ok(())
    }
}

fn argument(option: OptionInfo) -> Arg {
    let default = option.default.map(|default| format!(" [default: {default}]")).unwrap_or_default();
    Arg::new(option.long)
        .long(option.long)
        .value_name(option.value_name)
        .help(option.help + &default)
        .value_parser(EffectValue { name: option.long, names: option.possible_values })
}

/// Takes the text that sets an effect's parameter.
#[derive(Clone)]
struct EffectValue {
    name: &'static str,
    /// Its values where each has a name.
    names: &'static [&'static str],
}

impl TypedValueParser for EffectValue {
    type Value = String;

    fn parse_ref(&self, command: &Command, argument: Option<&Arg>, text: &OsStr) -> Result<String, Error> {
        let Self { name, names } = *self;
        let taken = move |text: &str| match Effects::default().set(name, text) {
            Ok(()) => Ok(text.to_owned()),
            Err(ParamError::Value { .. }) if !names.is_empty() => Err(format!("expected {}", listed(names))),
            Err(ParamError::Value { expected, .. }) => Err(format!("expected {expected}")),
            Err(other) => Err(other.to_string()),
        };
        taken.parse_ref(command, argument, text)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        match self.names {
            [] => None,
            names => Some(Box::new(names.iter().map(PossibleValue::new))),
        }
    }
}

/// `none, map or other`.
fn listed(names: &[&str]) -> String {
    match names {
        [before @ .., last] if !before.is_empty() => format!("{} or {last}", before.join(", ")),
        names => names.join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight_techniques::{Indirect, Post, Shadows, Transparency};

    fn command() -> Command {
        EffectArgs::augment_args(Command::new("afterlight"))
    }

    fn effects(arguments: &[&str]) -> Result<Effects, String> {
        let matches = command().try_get_matches_from([&["afterlight"], arguments].concat());
        let args = matches.and_then(|matches| EffectArgs::from_arg_matches(&matches));
        args.map(|args| args.0).map_err(|error| error.to_string())
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
        assert!(error.contains("'pcss' for '--shadows <SHADOWS>': expected none or map"), "{error}");
        let error = effects(&["--tessellate", "0.5"]).expect_err("too short");
        assert!(
            error.contains("'0.5' for '--tessellate <PX>': expected none, or a number from 1 to 64"),
            "{error}"
        );
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
}
