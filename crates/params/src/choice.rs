//! Values that have names: one of them, or a set of them.

use std::{fmt, hash::Hash, marker::PhantomData};

use serde::{Serialize, Serializer};

/// An enum without fields whose variants have names; declared by [`choices!`](crate::choices).
pub trait Choice: Copy + Eq + Hash + fmt::Debug + Send + Sync + 'static {
    /// All variants, as declared.
    const ALL: &'static [Self];
    /// Their names.
    const NAMES: &'static [&'static str];

    /// Its place among [`Choice::ALL`].
    fn index(self) -> usize;

    /// Its name on the command line and in records.
    fn name(self) -> &'static str {
        Self::NAMES[self.index()]
    }

    /// The variant of that name.
    fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().position(|known| *known == name).map(|index| Self::ALL[index])
    }
}

/// A set of the variants of a [`Choice`] of at most 32: as text `none`, or their names joined by `+`.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Words<C> {
    bits: u32,
    of: PhantomData<C>,
}

impl<C: Choice> Words<C> {
    /// No word.
    pub const NONE: Self = {
        assert!(C::NAMES.len() <= 32, "a set has a bit of 32 for each word");
        Self { bits: 0, of: PhantomData }
    };

    /// A bit for each word, the first declared the lowest, as shaders test them.
    pub fn bits(self) -> u32 {
        self.bits
    }

    /// The set with one word more.
    pub fn with(self, word: C) -> Self {
        Self { bits: self.bits | 1 << word.index(), ..self }
    }

    /// Whether the word is in the set.
    pub fn contains(self, word: C) -> bool {
        self.bits & 1 << word.index() != 0
    }

    /// The words, as declared.
    pub fn iter(self) -> impl Iterator<Item = C> {
        C::ALL.iter().copied().filter(move |word| self.contains(*word))
    }
}

impl<C: Choice> Default for Words<C> {
    fn default() -> Self {
        Self::NONE
    }
}

impl<C: Choice> FromIterator<C> for Words<C> {
    fn from_iter<I: IntoIterator<Item = C>>(words: I) -> Self {
        words.into_iter().fold(Self::NONE, Self::with)
    }
}

impl<C: Choice> fmt::Debug for Words<C> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.iter()).finish()
    }
}

impl<C: Choice> Serialize for Words<C> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&crate::ParamValue::tell(self))
    }
}

/// Declares an enum whose variants have names: [`Choice`], `ALL`, `name()`, [`Display`](fmt::Display) and [`Serialize`] by them.
///
/// ```
/// afterlight_params::choices! {
///     /// Where slices end.
///     pub enum Slicing {
///         /// At equal ratios.
///         Logarithmic = "logarithmic",
///         /// In equal steps.
///         Uniform = "uniform",
///     }
/// }
/// assert_eq!(Slicing::Uniform.name(), "uniform");
/// ```
#[macro_export]
macro_rules! choices {
    ($(#[$meta:meta])* $vis:vis enum $name:ident {
        $($(#[$variant_meta:meta])* $variant:ident = $word:literal),+ $(,)?
    }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        $vis enum $name {
            $($(#[$variant_meta])* $variant),+
        }

        #[allow(dead_code, reason = "whoever declares names may need one direction alone")]
        impl $name {
            /// All of them, as declared.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// Name on the command line and in records.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $word),+
                }
            }
        }

        impl $crate::Choice for $name {
            const ALL: &'static [Self] = &[$(Self::$variant),+];
            const NAMES: &'static [&'static str] = &[$($word),+];

            fn index(self) -> usize {
                self as usize
            }
        }

        impl ::std::fmt::Display for $name {
            fn fmt(&self, f: &mut ::std::fmt::Formatter<'_>) -> ::std::fmt::Result {
                f.pad(self.name())
            }
        }

        impl $crate::macro_support::serde::Serialize for $name {
            fn serialize<S>(&self, serializer: S) -> ::std::result::Result<S::Ok, S::Error>
            where
                S: $crate::macro_support::serde::Serializer,
            {
                serializer.serialize_str(self.name())
            }
        }
    };
}
