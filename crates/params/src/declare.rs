//! The macro that declares a set of parameters.

/// Declares a struct with public fields, its defaults, and how it is set and told as text ([`ParamSet`](crate::ParamSet)).
///
/// A field is one of:
/// ```text
/// /// summary
/// name: Type = default, "key";                      a parameter; Type is a ParamValue
/// name: Type = default, "key", 1..=64;              with a range, or 1.. for one without an end
/// name: Type = default, "key" <PX>, 1..=64;         with a name for its value in help
/// name: Type = default;                             no parameter: text does not set it
/// ..name: Set;                                      another set, whose parameters stand here
/// ..name: Set = default;                            the same with other defaults
/// ```
/// Each ends with a semicolon. The summary is the first paragraph of the documentation comment. Two embedded sets may share a
/// key: setting it sets both.
#[macro_export]
macro_rules! parameters {
    ($(#[$meta:meta])* $vis:vis struct $name:ident { $($fields:tt)* }) => {
        $crate::__parameters! { @fields { $(#[$meta])* $vis struct $name } {} $($fields)* }
    };
}

#[doc(hidden)]
#[macro_export]
macro_rules! __parameters {
    // Fields are sorted into what they are, one a step. An embedded set with its own defaults:
    (@fields $head:tt { $($done:tt)* }
        $(#[doc = $doc:literal])* .. $field:ident : $type:ty = $default:expr ; $($rest:tt)*) => {
        $crate::__parameters! { @fields $head { $($done)*
            { $(#[doc = $doc])* $field: $type = $default; embedded $field }
        } $($rest)* }
    };
    // An embedded set:
    (@fields $head:tt { $($done:tt)* }
        $(#[doc = $doc:literal])* .. $field:ident : $type:ty ; $($rest:tt)*) => {
        $crate::__parameters! { @fields $head { $($done)*
            { $(#[doc = $doc])* $field: $type = ::std::default::Default::default(); embedded $field }
        } $($rest)* }
    };
    // A parameter:
    (@fields $head:tt { $($done:tt)* }
        $(#[doc = $doc:literal])* $field:ident : $type:ty = $default:expr ,
        $key:literal $(<$value:ident>)? $(, $range:expr)? ; $($rest:tt)*) => {
        $crate::__parameters! { @fields $head { $($done)*
            { $(#[doc = $doc])* $field: $type = $default; keyed $key $(<$value>)? $(, $range)? }
        } $($rest)* }
    };
    // What text does not set:
    (@fields $head:tt { $($done:tt)* }
        $(#[doc = $doc:literal])* $field:ident : $type:ty = $default:expr ; $($rest:tt)*) => {
        $crate::__parameters! { @fields $head { $($done)*
            { $(#[doc = $doc])* $field: $type = $default; plain }
        } $($rest)* }
    };

    // All are sorted.
    (@fields { $(#[$meta:meta])* $vis:vis struct $name:ident } { $(
        { $(#[doc = $doc:literal])* $field:ident : $type:ty = $default:expr; $($role:tt)* }
    )* }) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq)]
        $vis struct $name {
            $($(#[doc = $doc])* pub $field: $type,)*
        }

        impl ::std::default::Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }

        #[allow(unused_mut, unused_variables, reason = "a set may be empty")]
        impl $crate::ParamSet for $name {
            fn infos(&self) -> ::std::vec::Vec<$crate::ParamInfo> {
                $crate::ParamSet::described(&<Self as ::std::default::Default>::default())
            }

            fn described(&self) -> ::std::vec::Vec<$crate::ParamInfo> {
                let mut infos = ::std::vec::Vec::new();
                $($crate::__parameters! {
                    @describe infos, &self.$field, $type, concat!($($doc, "\n"),*), $($role)*
                })*
                infos
            }

            fn try_set(
                &mut self,
                key: &str,
                text: &str,
            ) -> ::std::option::Option<::std::result::Result<(), $crate::ParamError>> {
                let mut found = ::std::option::Option::None;
                $($crate::__parameters! { @set found, &mut self.$field, $type, key, text, $($role)* })*
                found
            }

            fn part(&self, id: ::std::any::TypeId) -> ::std::option::Option<&dyn ::std::any::Any> {
                if id == ::std::any::TypeId::of::<Self>() {
                    return ::std::option::Option::Some(self);
                }
                $($crate::__parameters! { @part $crate::ParamSet::part, &self.$field, id, $($role)* })*
                ::std::option::Option::None
            }

            fn part_mut(
                &mut self,
                id: ::std::any::TypeId,
            ) -> ::std::option::Option<&mut dyn ::std::any::Any> {
                if id == ::std::any::TypeId::of::<Self>() {
                    return ::std::option::Option::Some(self);
                }
                $($crate::__parameters! { @part $crate::ParamSet::part_mut, &mut self.$field, id, $($role)* })*
                ::std::option::Option::None
            }

            fn clone_box(&self) -> ::std::boxed::Box<dyn $crate::ParamSet> {
                ::std::boxed::Box::new(::std::clone::Clone::clone(self))
            }

            fn type_name(&self) -> &'static str {
                stringify!($name)
            }

            fn as_any(&self) -> &dyn ::std::any::Any {
                self
            }

            fn is_equal(&self, other: &dyn $crate::ParamSet) -> bool {
                other.as_any().downcast_ref::<Self>().is_some_and(|other| self == other)
            }
        }
    };

    (@describe $infos:ident, $value:expr, $type:ty, $doc:expr, keyed $key:literal $(<$name:ident>)? $(, $range:expr)?) => {
        $infos.push($crate::macro_support::tell::<$type>(
            $value,
            $key,
            $crate::__parameters!(@value_name $key $($name)?),
            $doc,
            &$crate::__parameters!(@limits $type $(, $range)?),
        ));
    };
    (@describe $infos:ident, $value:expr, $type:ty, $doc:expr, embedded $field:ident) => {
        for mut info in $crate::ParamSet::described($value) {
            info.group = stringify!($field);
            $infos.push(info);
        }
    };
    (@describe $infos:ident, $value:expr, $type:ty, $doc:expr, plain) => {};

    (@set $found:ident, $value:expr, $type:ty, $wanted:ident, $text:ident, keyed $key:literal $(<$name:ident>)? $(, $range:expr)?) => {
        if $wanted == $key {
            let limits = $crate::__parameters!(@limits $type $(, $range)?);
            let set = $crate::macro_support::read::<$type>($value, $key, $text, &limits);
            $found = ::std::option::Option::Some($found.unwrap_or(::std::result::Result::Ok(())).and(set));
        }
    };
    (@set $found:ident, $value:expr, $type:ty, $wanted:ident, $text:ident, embedded $field:ident) => {
        if let ::std::option::Option::Some(set) = $crate::ParamSet::try_set($value, $wanted, $text) {
            $found = ::std::option::Option::Some($found.unwrap_or(::std::result::Result::Ok(())).and(set));
        }
    };
    (@set $found:ident, $value:expr, $type:ty, $wanted:ident, $text:ident, plain) => {};

    (@part $find:path, $value:expr, $id:ident, embedded $field:ident) => {
        if let ::std::option::Option::Some(part) = $find($value, $id) {
            return ::std::option::Option::Some(part);
        }
    };
    (@part $find:path, $value:expr, $id:ident, $($other:tt)*) => {};

    (@value_name $key:literal $name:ident) => {
        stringify!($name)
    };
    (@value_name $key:literal) => {{
        const CAPITALS: [u8; $key.len()] = $crate::macro_support::capitals($key);
        const NAME: &str = $crate::macro_support::text(&CAPITALS);
        NAME
    }};

    (@limits $type:ty, $range:expr) => {
        $crate::Limits::<<$type as $crate::ParamValue>::Bound>::from($range)
    };
    (@limits $type:ty) => {
        $crate::Limits::<<$type as $crate::ParamValue>::Bound>::NONE
    };
}
