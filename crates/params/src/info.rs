//! What is known of a parameter without its type.

use serde::Serialize;

/// What values a parameter takes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum ParamKind {
    /// One of some names.
    Choice {
        /// The names.
        values: &'static [&'static str],
    },
    /// A whole number in a range.
    Integer {
        /// Least value.
        min: i128,
        /// Greatest value.
        max: i128,
    },
    /// `auto`, or a whole number in a range.
    AutoOrInteger {
        /// Least value.
        min: i128,
        /// Greatest value.
        max: i128,
    },
    /// `none`, or a whole number in a range.
    NoneOrInteger {
        /// Least value.
        min: i128,
        /// Greatest value.
        max: i128,
    },
    /// A number in a range.
    Number {
        /// Least value.
        min: f64,
        /// Greatest value.
        max: f64,
    },
    /// `auto`, or a number in a range.
    AutoOrNumber {
        /// Least value.
        min: f64,
        /// Greatest value.
        max: f64,
    },
    /// `none`, or a number in a range.
    NoneOrNumber {
        /// Least value.
        min: f64,
        /// Greatest value.
        max: f64,
    },
    /// `none`, or some names joined by `+`.
    Words {
        /// The names.
        values: &'static [&'static str],
    },
    /// `true` or `false`.
    Bool,
    /// Any text.
    Text,
}

impl ParamKind {
    /// What an error says was expected.
    pub fn expected(&self) -> String {
        match self {
            Self::Choice { values } => format!("one of: {}", values.join(", ")),
            Self::Integer { min, max } => format!("a whole number from {min} to {max}"),
            Self::AutoOrInteger { min, max } => format!("auto, or a whole number from {min} to {max}"),
            Self::NoneOrInteger { min, max } => format!("none, or a whole number from {min} to {max}"),
            Self::Number { min, max } => format!("a number from {min} to {max}"),
            Self::AutoOrNumber { min, max } => format!("auto, or a number from {min} to {max}"),
            Self::NoneOrNumber { min, max } => format!("none, or a number from {min} to {max}"),
            Self::Words { values } => format!("none, or some of: {}, joined by +", values.join(", ")),
            Self::Bool => "true or false".to_owned(),
            Self::Text => "a text".to_owned(),
        }
    }

    /// The values in brief, for lists.
    pub fn range(&self) -> String {
        match self {
            Self::Choice { values } => values.join("|"),
            Self::Integer { min, max } => format!("{min} to {max}"),
            Self::AutoOrInteger { min, max } => format!("auto, {min} to {max}"),
            Self::NoneOrInteger { min, max } => format!("none, {min} to {max}"),
            Self::Number { min, max } => format!("{min} to {max}"),
            Self::AutoOrNumber { min, max } => format!("auto, {min} to {max}"),
            Self::NoneOrNumber { min, max } => format!("none, {min} to {max}"),
            Self::Words { values } => format!("none, {}", values.join("+")),
            Self::Bool => "true|false".to_owned(),
            Self::Text => "text".to_owned(),
        }
    }

    /// The values where they are few and each has a name, for completion and help; empty where a value is a number or a text.
    pub fn names(&self) -> &'static [&'static str] {
        match self {
            Self::Choice { values } => values,
            Self::Bool => &["true", "false"],
            _ => &[],
        }
    }

    /// Whether the value may be none at all.
    pub(crate) fn has_none(&self) -> bool {
        matches!(self, Self::NoneOrInteger { .. } | Self::NoneOrNumber { .. })
    }
}

/// A parameter as lists and help show it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParamInfo {
    /// Name, as in `--set NAME=VALUE`.
    pub key: &'static str,
    /// What it does: the first paragraph of the field's documentation.
    pub summary: String,
    /// Its values.
    #[serde(flatten)]
    pub kind: ParamKind,
    /// The default, as text.
    pub default: String,
    /// What help calls a value: as declared, else the key in capitals.
    #[serde(skip)]
    pub value_name: &'static str,
    /// The field that holds the set which it comes from, where that is embedded in another; empty elsewhere.
    #[serde(skip)]
    pub group: &'static str,
}
