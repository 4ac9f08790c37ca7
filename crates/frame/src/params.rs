//! Parameters of techniques: listed data, checked against ranges.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::TechniqueError;

/// What values a parameter takes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum ParamKind {
    /// One of some words.
    Choice {
        /// The words.
        values: &'static [&'static str],
    },
    /// A whole number in a range.
    Integer {
        /// Least value.
        min: u32,
        /// Greatest value.
        max: u32,
    },
    /// `auto`, or a whole number in a range.
    AutoOrInteger {
        /// Least value.
        min: u32,
        /// Greatest value.
        max: u32,
    },
    /// A number in a range.
    Number {
        /// Least value.
        min: f32,
        /// Greatest value.
        max: f32,
    },
    /// `none`, or some words joined by `+`.
    Words {
        /// The words.
        values: &'static [&'static str],
    },
    /// Any text.
    Text,
}

/// A parameter of a technique.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ParamInfo {
    /// Name, as in `--set NAME=VALUE`.
    pub key: &'static str,
    /// What it does.
    pub summary: &'static str,
    /// Its values.
    #[serde(flatten)]
    pub kind: ParamKind,
    /// The default.
    pub default: &'static str,
}

/// Parameters that every technique has.
pub const COMMON: &[ParamInfo] = &[
    ParamInfo {
        key: "cull",
        summary: "draws outside the view are left out on the CPU",
        kind: ParamKind::Choice { values: &["frustum", "none"] },
        default: "frustum",
    },
    ParamInfo {
        key: "order",
        summary: "order of draws: by the nearest point or the centre of their bounds, or as in the scene",
        kind: ParamKind::Choice { values: &["center", "near", "scene"] },
        default: "center",
    },
];

impl ParamKind {
    fn check(&self, key: &str, value: &str) -> Result<(), TechniqueError> {
        let (ok, expected) = match self {
            Self::Choice { values } => (values.contains(&value), format!("one of: {}", values.join(", "))),
            Self::Integer { min, max } => (
                value.parse::<u32>().is_ok_and(|v| (*min..=*max).contains(&v)),
                format!("a whole number from {min} to {max}"),
            ),
            Self::AutoOrInteger { min, max } => (
                value == "auto" || value.parse::<u32>().is_ok_and(|v| (*min..=*max).contains(&v)),
                format!("auto, or a whole number from {min} to {max}"),
            ),
            Self::Number { min, max } => (
                value.parse::<f32>().is_ok_and(|v| (*min..=*max).contains(&v)),
                format!("a number from {min} to {max}"),
            ),
            Self::Words { values } => (
                value == "none" || value.split('+').all(|word| values.contains(&word)),
                format!("none, or some of: {}, joined by +", values.join(", ")),
            ),
            Self::Text => (true, String::new()),
        };
        if ok {
            return Ok(());
        }
        Err(TechniqueError::BadParam { key: key.to_owned(), found: value.to_owned(), expected })
    }
}

/// Values of parameters, by name; what is not set has its default.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct Params {
    values: BTreeMap<String, String>,
}

impl Params {
    /// Sets a parameter of a technique.
    ///
    /// # Errors
    /// A name that the technique does not have, a value out of range: both list what is known.
    pub fn set(&mut self, info: &crate::Info, key: &str, value: &str) -> Result<(), TechniqueError> {
        let param = Self::known(info).find(|p| p.key == key).ok_or_else(|| TechniqueError::UnknownParam {
            key: key.to_owned(),
            technique: info.id,
            known: Self::known(info).map(|p| p.key).collect::<Vec<_>>().join(", "),
        })?;
        param.kind.check(key, value)?;
        self.values.insert(key.to_owned(), value.to_owned());
        Ok(())
    }

    /// All parameters that a technique has: those of all, its own, and where it has `lights` those of what lights may be listed for.
    pub fn known(info: &crate::Info) -> impl Iterator<Item = &'static ParamInfo> {
        let has_step = info.params.iter().any(|p| p.key == "lights");
        COMMON.iter().chain(info.params).chain(if has_step { CELLS } else { &[] })
    }

    /// Every parameter of a technique with its value.
    pub fn resolved(&self, info: &crate::Info) -> BTreeMap<String, String> {
        Self::known(info).map(|p| (p.key.to_owned(), self.get(p).to_owned())).collect()
    }

    /// The value of a parameter.
    pub fn get<'a>(&'a self, param: &'a ParamInfo) -> &'a str {
        self.values.get(param.key).map_or(param.default, String::as_str)
    }

    /// The value of a parameter that counts something; 0 where it is a word.
    pub fn count(&self, param: &ParamInfo) -> u32 {
        self.values.get(param.key).map_or(param.default, String::as_str).parse().unwrap_or_default()
    }

    /// The value of a parameter that is a number; 0 where it is a word.
    pub fn number(&self, info: &crate::Info, key: &str) -> f32 {
        self.text(info, key).parse().unwrap_or_default()
    }

    /// The value of the parameter of that name, or `""` where the technique has none.
    pub fn text<'a>(&'a self, info: &'a crate::Info, key: &str) -> &'a str {
        Self::known(info).find(|p| p.key == key).map_or("", |p| self.get(p))
    }
}

/// Most slices: words of bits that `cells.comp.glsl` has for a tile.
const SLICES_MAX: i64 = 256;

/// Parameters of techniques with clusters.
pub const CLUSTERS: &[ParamInfo] = &[CLUSTER_PX, SLICES, SLICING];

/// Width of clusters.
pub const CLUSTER_PX: ParamInfo = ParamInfo {
    key: "cluster-px",
    summary: "width and height of a cluster, pixels",
    kind: ParamKind::Integer { min: 8, max: 256 },
    default: "16",
};

/// Slices of view distance.
pub const SLICES: ParamInfo = ParamInfo {
    key: "slices",
    summary: "clusters of a tile, one behind the other, between the ends of the scene",
    kind: ParamKind::Integer { min: 1, max: SLICES_MAX as _ },
    default: "128",
};

/// Where slices end.
pub const SLICING: ParamInfo = ParamInfo {
    key: "slicing",
    summary: "view distances at which clusters end: in equal steps, or at equal ratios",
    kind: ParamKind::Choice { values: &["logarithmic", "uniform"] },
    default: "logarithmic",
};

/// Width of tiles.
pub const TILE_PX: ParamInfo = ParamInfo {
    key: "tile-px",
    summary: "width and height of a tile, pixels",
    kind: ParamKind::Integer { min: 8, max: 256 },
    default: "16",
};

/// Parameters that every technique with `lights` has as well.
pub const CELLS: &[ParamInfo] = &[TILE_PX, CLUSTER_PX, SLICES, SLICING];
