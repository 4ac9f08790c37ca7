//! Commands that repeat a view.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use crate::{Chosen, FrameSpec, effects};

/// Parameters that are not as they are by default.
pub fn changed(chosen: &Chosen) -> BTreeMap<String, String> {
    let usual = Chosen::new(chosen.technique).params.resolved();
    let resolved = chosen.params.resolved();
    resolved.into_iter().filter(|(key, value)| usual.get(key) != Some(value)).collect()
}

/// The `afterlight compare` command that draws a specification's frame with a technique, quoted for a shell. Numbers are told with all digits
/// that tell them from their neighbours, so they are read back as they are.
pub fn compare_command(source: &str, spec: &FrameSpec, chosen: &Chosen) -> String {
    let mut text = format!("afterlight compare {}", quoted(source));
    let mut option = |name: &str, value: String| {
        let _ = write!(text, " --{name} {}", quoted(&value));
    };
    option("techniques", chosen.id().to_owned());
    option("width", spec.width.to_string());
    option("height", spec.height.to_string());
    option("samples", spec.samples.to_string());
    if spec.lights > 0 {
        option("lights", spec.lights.to_string());
        option("light-seed", spec.light_seed.to_string());
    }
    if let Some(camera) = &spec.camera {
        option("camera", camera.clone());
    }
    if let Some(time_s) = spec.time_s {
        option("time", time_s.to_string());
    }
    if let Some(device) = &spec.device {
        option("device", device.clone());
    }
    for (key, value) in effects::changed(&spec.effects) {
        option(key, value);
    }
    for (key, value) in changed(chosen) {
        option("set", format!("{key}={value}"));
    }
    option("frames", "1".to_owned());
    text
}

/// A word as a shell reads it back.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-./:=,+".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use afterlight_techniques::{Indirect, Transparency};

    use super::*;

    #[test]
    fn a_command_holds_what_is_not_usual() {
        let mut spec = FrameSpec { width: 64, height: 36, samples: 4, ..FrameSpec::default() };
        let mut chosen = Chosen::new(crate::technique("techniques", "visibility").expect("is there"));
        assert_eq!(
            compare_command("builtin:floor", &spec, &chosen),
            "afterlight compare builtin:floor --techniques visibility --width 64 --height 36 --samples 4 --frames 1"
        );
        chosen.set("visibility", "compute").expect("is taken");
        (spec.lights, spec.light_seed, spec.camera) = (3, 9, Some("-1,0,1e-7,2,3,4,60".to_owned()));
        spec.effects.indirect.method = Indirect::Rsm;
        (spec.effects.indirect.map_size_px, spec.effects.shadows.map_size_px) = (128, 128);
        spec.effects.transparency.order = Transparency::None;
        assert_eq!(
            compare_command("a b?.gltf", &spec, &chosen),
            "afterlight compare 'a b?.gltf' --techniques visibility --width 64 --height 36 --samples 4 --lights 3 \
             --light-seed 9 --camera -1,0,1e-7,2,3,4,60 --indirect rsm --shadow-map-size 128 --transparency none \
             --set visibility=compute --frames 1"
        );
    }

    #[test]
    fn quotes_are_quoted() {
        assert_eq!(quoted("it's"), r"'it'\''s'");
        assert_eq!(quoted(""), "''");
        assert_eq!(quoted("builtin:colonnade?triangles=17000"), "'builtin:colonnade?triangles=17000'");
    }
}
