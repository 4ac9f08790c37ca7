//! What the passes and the resources of a frame are for.
//!
//! A frame graph gives every pass a [`PassRole`] and every buffer and image a [`BufferRole`] where it is declared. Plans, reports
//! and records carry them, so that tables, charts and predictions add up times and bytes by role. Names are for people: renaming a
//! pass changes no figure.

mod buffer;
mod pass;

pub use buffer::BufferRole;
pub use pass::{PassRole, PassWork};

/// Declares an enum of roles: its variants, all of them in order, and the name that each has in JSON.
macro_rules! roles {
    (
        $(#[$meta:meta])*
        $role:ident { $($(#[$variant_meta:meta])* $variant:ident => $name:literal,)+ }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
        #[serde(rename_all = "kebab-case")]
        pub enum $role {
            $($(#[$variant_meta])* $variant,)+
        }

        impl $role {
            /// Every variant, in the order of declaration.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)+];

            /// Returns the name that it has in JSON and in tables.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)+
                }
            }
        }

        impl std::fmt::Display for $role {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.name())
            }
        }
    };
}
pub(crate) use roles;

#[cfg(test)]
mod tests {
    use super::*;
    use serde::{Serialize, de::DeserializeOwned};

    fn json_names<R>(all: &[R], name: fn(R) -> &'static str) -> Vec<&'static str>
    where
        R: Copy + std::fmt::Debug + std::fmt::Display + PartialEq + Serialize + DeserializeOwned,
    {
        for role in all {
            let text = format!("\"{}\"", name(*role));
            assert_eq!(serde_json::to_string(role).expect("is JSON"), text);
            assert_eq!(serde_json::from_str::<R>(&text).expect("reads"), *role);
            assert_eq!(role.to_string(), name(*role));
        }
        all.iter().map(|role| name(*role)).collect()
    }

    /// Records that were written before name roles so: a changed name makes them unreadable.
    #[test]
    fn names_in_json_stay() {
        assert_eq!(
            json_names(PassRole::ALL, PassRole::name),
            [
                "geometry",
                "depth-prepass",
                "triangle-selection",
                "derivatives",
                "light-assignment",
                "shading",
                "resolve",
                "shared",
                "culling",
                "transparency",
                "filter",
                "present",
                "upkeep",
            ]
        );
        assert_eq!(json_names(PassWork::ALL, PassWork::name), ["raster", "compute", "clear", "copy"]);
        assert_eq!(
            json_names(BufferRole::ALL, BufferRole::name),
            [
                "surfaces",
                "depth",
                "visibility",
                "sample-keys",
                "raster-queues",
                "surface-list-heads",
                "surface-list-nodes",
                "claims",
                "triangles",
                "triangle-sets",
                "memoization-cache",
                "lights",
                "targets",
                "counters",
                "scene",
                "constants",
                "shared",
                "transparency",
                "filters",
            ]
        );
    }

    #[test]
    fn what_techniques_share_is_told_apart() {
        let shared: Vec<_> = PassRole::ALL.iter().filter(|role| role.is_shared()).collect();
        assert_eq!(shared, [&PassRole::Shared, &PassRole::Culling, &PassRole::Transparency]);
        let shared: Vec<_> = BufferRole::ALL.iter().filter(|role| role.is_shared()).collect();
        assert_eq!(shared, [&BufferRole::Shared, &BufferRole::Transparency]);
    }
}
