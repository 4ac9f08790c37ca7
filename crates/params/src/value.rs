//! Types that a parameter can have: how each is read, told and described.

use std::{
    fmt::{Debug, Display},
    ops::{RangeFrom, RangeInclusive},
};

use crate::{Choice, ParamError, ParamInfo, ParamKind, Words};

/// The ends of a range; none where only the type limits it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits<B> {
    /// Least value.
    pub min: Option<B>,
    /// Greatest value.
    pub max: Option<B>,
}

impl<B> Limits<B> {
    /// Whatever the type holds.
    pub const NONE: Self = Self { min: None, max: None };
}

impl<B> From<RangeInclusive<B>> for Limits<B> {
    fn from(range: RangeInclusive<B>) -> Self {
        let (min, max) = range.into_inner();
        Self { min: Some(min), max: Some(max) }
    }
}

impl<B> From<RangeFrom<B>> for Limits<B> {
    fn from(range: RangeFrom<B>) -> Self {
        Self { min: Some(range.start), max: None }
    }
}

/// A type that a parameter can have.
pub trait ParamValue: Clone + PartialEq + Debug + Send + Sync + 'static {
    /// Of what its range is.
    type Bound;

    /// What values there are.
    fn kind(limits: &Limits<Self::Bound>) -> ParamKind;

    /// Reads a value; `None` where the text is none, or out of range.
    fn read(text: &str, limits: &Limits<Self::Bound>) -> Option<Self>;

    /// The value as [`ParamValue::read`] takes it.
    fn tell(&self) -> String;
}

/// A number, which may also be left open by a word ([`AutoOr`], [`Option`]).
pub trait Numeric: ParamValue {
    /// Kind of a value that is `auto` or such a number.
    fn auto_or(limits: &Limits<Self::Bound>) -> ParamKind;

    /// Kind of a value that is `none` or such a number.
    fn none_or(limits: &Limits<Self::Bound>) -> ParamKind;
}

/// Reads a number in a range. What is no number at all, as NaN, lies in none.
fn read_number<T>(text: &str, limits: &Limits<T>, min: T, max: T) -> Option<T>
where
    T: std::str::FromStr + PartialOrd + Copy,
{
    let range = limits.min.unwrap_or(min)..=limits.max.unwrap_or(max);
    text.parse().ok().filter(|value| range.contains(value))
}

/// An end of a range of 64 bits that reads as it was written: 0.1, not 0.10000000149.
fn as_written(number: impl Display + Into<f64>) -> f64 {
    number.to_string().parse().unwrap_or_else(|_| number.into())
}

macro_rules! numeric {
    ($($type:ty: $kind:ident, $auto:ident, $none:ident, $end:expr;)*) => { $(
        impl ParamValue for $type {
            type Bound = $type;

            fn kind(limits: &Limits<$type>) -> ParamKind {
                let (min, max) = ends!($type, limits, $end);
                ParamKind::$kind { min, max }
            }

            fn read(text: &str, limits: &Limits<$type>) -> Option<Self> {
                read_number(text, limits, <$type>::MIN, <$type>::MAX)
            }

            fn tell(&self) -> String {
                self.to_string()
            }
        }

        impl Numeric for $type {
            fn auto_or(limits: &Limits<$type>) -> ParamKind {
                let (min, max) = ends!($type, limits, $end);
                ParamKind::$auto { min, max }
            }

            fn none_or(limits: &Limits<$type>) -> ParamKind {
                let (min, max) = ends!($type, limits, $end);
                ParamKind::$none { min, max }
            }
        }
    )* };
}

macro_rules! ends {
    ($type:ty, $limits:expr, $end:expr) => {
        ($end($limits.min.unwrap_or(<$type>::MIN)), $end($limits.max.unwrap_or(<$type>::MAX)))
    };
}

numeric! {
    u32: Integer, AutoOrInteger, NoneOrInteger, i128::from;
    u64: Integer, AutoOrInteger, NoneOrInteger, i128::from;
    i64: Integer, AutoOrInteger, NoneOrInteger, i128::from;
    f32: Number, AutoOrNumber, NoneOrNumber, as_written;
    f64: Number, AutoOrNumber, NoneOrNumber, as_written;
}

impl ParamValue for bool {
    type Bound = bool;

    fn kind(_: &Limits<bool>) -> ParamKind {
        ParamKind::Bool
    }

    fn read(text: &str, _: &Limits<bool>) -> Option<Self> {
        text.parse().ok()
    }

    fn tell(&self) -> String {
        self.to_string()
    }
}

impl ParamValue for String {
    type Bound = String;

    fn kind(_: &Limits<String>) -> ParamKind {
        ParamKind::Text
    }

    fn read(text: &str, _: &Limits<String>) -> Option<Self> {
        Some(text.to_owned())
    }

    fn tell(&self) -> String {
        self.clone()
    }
}

/// A number, or `auto`: whoever uses it chooses one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum AutoOr<T> {
    /// Chosen by whoever uses it.
    #[default]
    Auto,
    /// That number.
    Fixed(T),
}

impl<T> AutoOr<T> {
    /// The number, where there is one.
    pub fn fixed(self) -> Option<T> {
        match self {
            Self::Auto => None,
            Self::Fixed(value) => Some(value),
        }
    }
}

/// How text says [`AutoOr::Auto`].
const AUTO: &str = "auto";
/// How text says that there is no number, and no word of [`Words`].
pub(crate) const NONE: &str = "none";

impl<T: Numeric> ParamValue for AutoOr<T> {
    type Bound = T::Bound;

    fn kind(limits: &Limits<T::Bound>) -> ParamKind {
        T::auto_or(limits)
    }

    fn read(text: &str, limits: &Limits<T::Bound>) -> Option<Self> {
        match text {
            AUTO => Some(Self::Auto),
            _ => T::read(text, limits).map(Self::Fixed),
        }
    }

    fn tell(&self) -> String {
        match self {
            Self::Auto => AUTO.to_owned(),
            Self::Fixed(value) => value.tell(),
        }
    }
}

impl<T: Numeric> ParamValue for Option<T> {
    type Bound = T::Bound;

    fn kind(limits: &Limits<T::Bound>) -> ParamKind {
        T::none_or(limits)
    }

    fn read(text: &str, limits: &Limits<T::Bound>) -> Option<Self> {
        match text {
            NONE => Some(None),
            _ => T::read(text, limits).map(Some),
        }
    }

    fn tell(&self) -> String {
        self.as_ref().map_or_else(|| NONE.to_owned(), ParamValue::tell)
    }
}

impl<C: Choice> ParamValue for C {
    type Bound = C;

    fn kind(_: &Limits<C>) -> ParamKind {
        ParamKind::Choice { values: C::NAMES }
    }

    fn read(text: &str, _: &Limits<C>) -> Option<Self> {
        C::from_name(text)
    }

    fn tell(&self) -> String {
        Choice::name(*self).to_owned()
    }
}

impl<C: Choice> ParamValue for Words<C> {
    type Bound = C;

    fn kind(_: &Limits<C>) -> ParamKind {
        ParamKind::Words { values: C::NAMES }
    }

    fn read(text: &str, _: &Limits<C>) -> Option<Self> {
        match text {
            NONE => Some(Self::NONE),
            _ => text.split('+').map(C::from_name).collect(),
        }
    }

    fn tell(&self) -> String {
        match *self == Self::NONE {
            true => NONE.to_owned(),
            false => self.iter().map(Choice::name).collect::<Vec<_>>().join("+"),
        }
    }
}

/// Sets a field from text.
///
/// # Errors
/// What is not among the field's values.
pub fn read<T: ParamValue>(
    field: &mut T,
    key: &'static str,
    text: &str,
    limits: &Limits<T::Bound>,
) -> Result<(), ParamError> {
    *field = T::read(text, limits).ok_or_else(|| ParamError::Value {
        key: key.to_owned(),
        found: text.to_owned(),
        expected: T::kind(limits).expected(),
    })?;
    Ok(())
}

/// Describes a field, with its value in the place of the default.
pub fn tell<T: ParamValue>(
    field: &T,
    key: &'static str,
    value_name: &'static str,
    documentation: &str,
    limits: &Limits<T::Bound>,
) -> ParamInfo {
    ParamInfo {
        key,
        summary: first_paragraph(documentation),
        kind: T::kind(limits),
        default: field.tell(),
        value_name,
        group: "",
    }
}

/// The first paragraph of a documentation comment, in one line.
fn first_paragraph(documentation: &str) -> String {
    let lines = documentation.lines().map(str::trim).take_while(|line| !line.is_empty());
    lines.collect::<Vec<_>>().join(" ")
}

/// What help calls a value where the declaration does not say it: the key in capitals, in so many bytes as the key has.
pub const fn capitals<const BYTES: usize>(key: &str) -> [u8; BYTES] {
    let key = key.as_bytes();
    let mut capitals = [b'_'; BYTES];
    let mut at = 0;
    while at < BYTES {
        if key[at] != b'-' {
            capitals[at] = key[at].to_ascii_uppercase();
        }
        at += 1;
    }
    capitals
}

/// The same as text, at compile time.
pub const fn text(bytes: &[u8]) -> &str {
    match std::str::from_utf8(bytes) {
        Ok(text) => text,
        Err(_) => panic!("a key that is text stays text in capitals"),
    }
}
