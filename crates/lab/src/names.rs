//! Effects of a frame in specifications: by the names that the command line and run records have for them.

use afterlight_techniques::{Indirect, Post, Shadows, Transparency};

/// A module for `#[serde(with)]` that writes a value as its name and reads it back.
macro_rules! by_name {
    ($module:ident, $kind:ty, $all:expr) => {
        pub mod $module {
            use super::*;
            use serde::{Deserialize as _, Deserializer, Serializer, de::Error as _};

            pub fn serialize<S: Serializer>(value: &$kind, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_str(value.name())
            }

            pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<$kind, D::Error> {
                let found = String::deserialize(deserializer)?;
                $all.into_iter().find(|value| value.name() == found).ok_or_else(|| {
                    let known: Vec<&str> = $all.iter().map(|value| value.name()).collect();
                    D::Error::custom(format!("found {found:?}, expected one of: {}", known.join(", ")))
                })
            }
        }
    };
}

by_name!(post, Post, Post::ALL);
by_name!(shadows, Shadows, [Shadows::None, Shadows::Map]);
by_name!(indirect, Indirect, [Indirect::None, Indirect::Rsm]);
by_name!(transparency, Transparency, [Transparency::None, Transparency::Sorted]);
