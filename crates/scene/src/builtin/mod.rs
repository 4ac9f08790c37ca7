//! The scenes that come with the program: deterministic, made by code, textures included.

mod colonnade;
mod kit;
mod simple;
mod textures;

pub use simple::edge_coverage;

use crate::{Scene, SceneError};

/// A parameter of a built-in scene: a whole number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key {
    /// Name, as in `builtin:NAME?key=value`.
    pub name: &'static str,
    /// Value where none is given.
    pub default: u32,
    /// Least value.
    pub min: u32,
    /// Greatest value.
    pub max: u32,
    /// What it does.
    pub about: &'static str,
}

/// A built-in scene.
#[derive(Clone, Copy, Debug)]
pub struct Builtin {
    /// Name, as in `builtin:NAME`.
    pub name: &'static str,
    /// What it shows and what it is for.
    pub about: &'static str,
    /// Its parameters.
    pub keys: &'static [Key],
    make: fn(&Values) -> Scene,
}

/// The values of a scene's parameters.
struct Values(Vec<(&'static str, u32)>);

impl Values {
    /// The value of a key of the scene; keys are compile-time names of the scene's own list.
    fn get(&self, name: &str) -> u32 {
        let found = self.0.iter().find(|(key, _)| *key == name);
        found.unwrap_or_else(|| panic!("key {name} is not among {:?}", self.0)).1
    }
}

const SEGMENTS: Key =
    Key { name: "segments", default: 128, min: 6, max: 2048, about: "divisions around a sphere's equator" };

const TEXTURE: Key = Key {
    name: "texture",
    default: 512,
    min: 16,
    max: 4096,
    about: "width and height of the textures, pixels",
};

const BUILTINS: &[Builtin] = &[
    Builtin {
        name: "colonnade",
        about: "an arcade with columns, arches, drapes, foliage cards, lanterns and transparent panes",
        keys: &[
            Key {
                name: "triangles",
                default: 262_144,
                min: colonnade::TRIANGLES_MIN,
                max: 16_777_216,
                about: "triangles drawn, met within 2%",
            },
            TEXTURE,
        ],
        make: |v| colonnade::make(v.get("triangles"), v.get("texture")),
    },
    Builtin {
        name: "spheres",
        about: "a grid of materials: metalness upwards, roughness to the right",
        keys: &[
            Key { name: "rows", default: 5, min: 1, max: 32, about: "steps of metalness" },
            Key { name: "columns", default: 9, min: 1, max: 32, about: "steps of roughness" },
            SEGMENTS,
        ],
        make: |v| simple::spheres(v.get("rows"), v.get("columns"), v.get("segments")),
    },
    Builtin {
        name: "furnace",
        about: "white spheres in uniform light of radiance 1: every pixel is 1",
        keys: &[SEGMENTS],
        make: |v| simple::furnace(v.get("segments")),
    },
    Builtin {
        name: "edge",
        about: "two white triangles with a slanted edge whose coverage of every pixel is known",
        keys: &[],
        make: |_| simple::edge(),
    },
    Builtin {
        name: "gradients",
        about: "gradients and a diagonal step (Mallett et al. 2020, Figure 5)",
        keys: &[Key { default: 1024, ..TEXTURE }],
        make: |v| simple::gradients(v.get("texture")),
    },
    Builtin {
        name: "moving",
        about: "objects that slide, spin, swing and scale in a loop of 4 s",
        keys: &[SEGMENTS],
        make: |v| simple::moving(v.get("segments")),
    },
    Builtin {
        name: "sphere",
        about: "one unit sphere in one directional light, for comparison with its closed form",
        keys: &[Key { default: 512, ..SEGMENTS }],
        make: |v| simple::sphere(v.get("segments")),
    },
    Builtin {
        name: "intersect",
        about: "triangles that pass through each other: edges inside pixels that no silhouette shows",
        keys: &[Key { name: "blades", default: 8, min: 2, max: 256, about: "triangles about the axis" }],
        make: |v| simple::intersect(v.get("blades")),
    },
    Builtin {
        name: "floor",
        about: "a floor of two large triangles, seen from a standing person's eye above its middle",
        keys: &[Key { name: "width", default: 40, min: 1, max: 100_000, about: "width and depth, metres" }],
        make: |v| simple::floor(v.get("width")),
    },
    Builtin {
        name: "crowd",
        about: "small figures in rows on a floor: many nodes of few meshes, most of them out of view",
        keys: &[Key { name: "nodes", default: 2048, min: 1, max: 1_000_000, about: "figures" }],
        make: |v| simple::crowd(v.get("nodes")),
    },
];

/// All built-in scenes.
pub fn list() -> &'static [Builtin] {
    BUILTINS
}

/// Makes the scene that `builtin:NAME?key=value&…` names; the prefix may be left out. The same
/// text always makes the same scene.
///
/// # Errors
/// [`SceneError::UnknownBuiltin`] lists the names that exist; [`SceneError::BadParameter`] lists the
/// keys of the scene, or the range of a key.
pub fn build(spec: &str) -> Result<Scene, SceneError> {
    let spec = spec.strip_prefix("builtin:").unwrap_or(spec);
    let (name, query) = spec.split_once('?').unwrap_or((spec, ""));
    let builtin = BUILTINS.iter().find(|b| b.name == name).ok_or_else(|| SceneError::UnknownBuiltin {
        found: format!("'{}'", crate::error::one_line(name)),
        known: BUILTINS.iter().map(|b| b.name).collect::<Vec<_>>().join(", "),
    })?;
    let mut scene = (builtin.make)(&parse_values(builtin, query)?);
    scene.name = format!("builtin:{name}");
    Ok(scene)
}

/// The values that a query gives, defaults for the others.
fn parse_values(builtin: &Builtin, query: &str) -> Result<Values, SceneError> {
    let mut values = Values(builtin.keys.iter().map(|k| (k.name, k.default)).collect());
    for pair in query.split('&').filter(|p| !p.is_empty()) {
        let (key_name, text) = pair.split_once('=').unwrap_or((pair, ""));
        let shown = |text: &str| format!("'{}'", crate::error::one_line(text));
        let i =
            builtin.keys.iter().position(|k| k.name == key_name).ok_or_else(|| SceneError::BadParameter {
                name: format!("builtin:{}", builtin.name),
                found: format!("the key {}", shown(key_name)),
                expected: known_keys(builtin),
            })?;
        let key = builtin.keys[i];
        let value = text.parse().ok().filter(|v| (key.min..=key.max).contains(v));
        values.0[i].1 = value.ok_or_else(|| SceneError::BadParameter {
            name: format!("builtin:{}?{}", builtin.name, key.name),
            found: shown(text),
            expected: format!("a whole number from {} to {}", key.min, key.max),
        })?;
    }
    Ok(values)
}

/// The keys of a scene with their ranges, for a message.
fn known_keys(builtin: &Builtin) -> String {
    if builtin.keys.is_empty() {
        return "no key".to_owned();
    }
    let keys: Vec<_> = builtin.keys.iter().map(|k| format!("{} ({} to {})", k.name, k.min, k.max)).collect();
    format!("one of {}", keys.join(", "))
}
