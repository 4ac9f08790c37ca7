//! A set of parameters, whatever its type.

use std::{
    any::{Any, TypeId},
    collections::BTreeMap,
    fmt::Debug,
};

use crate::ParamInfo;

/// A parameter that cannot be set: one line that names what, found and expected.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ParamError {
    /// A name that the set does not have.
    #[error("parameter {key:?}{}: found no such parameter, expected one of: {known}", of(.owner))]
    Unknown {
        /// The name.
        key: String,
        /// Whose parameters they are; empty where that is not known.
        owner: String,
        /// What there is.
        known: String,
    },
    /// A value out of range.
    #[error("parameter {key}: found {found:?}, expected {expected}")]
    Value {
        /// The parameter.
        key: String,
        /// The value.
        found: String,
        /// The range.
        expected: String,
    },
}

fn of(owner: &str) -> String {
    if owner.is_empty() { String::new() } else { format!(" of {owner}") }
}

impl ParamError {
    /// The error, with whose parameters they are.
    #[must_use]
    pub fn of(self, owner: &str) -> Self {
        match self {
            Self::Unknown { key, known, .. } => Self::Unknown { key, owner: owner.to_owned(), known },
            value => value,
        }
    }
}

/// A set of parameters: a struct that [`parameters!`](crate::parameters) declares.
pub trait ParamSet: Debug + Send + Sync + 'static {
    /// The parameters in the order of their declaration, those of embedded sets in their place.
    fn infos(&self) -> Vec<ParamInfo>;

    /// The same, with the values that this set has in the place of defaults.
    fn described(&self) -> Vec<ParamInfo>;

    /// Sets a parameter from text wherever the set has one of that name; `None` where it has none.
    fn try_set(&mut self, key: &str, text: &str) -> Option<Result<(), ParamError>>;

    /// This set, or one that is embedded in it, by type.
    fn part(&self, id: TypeId) -> Option<&dyn Any>;

    /// The same, to be changed.
    fn part_mut(&mut self, id: TypeId) -> Option<&mut dyn Any>;

    /// A copy.
    fn clone_box(&self) -> Box<dyn ParamSet>;

    /// The type's name, for messages.
    fn type_name(&self) -> &'static str;

    /// The set as a value of any type.
    fn as_any(&self) -> &dyn Any;

    /// Whether the other is of the same type and has the same values.
    fn is_equal(&self, other: &dyn ParamSet) -> bool;

    /// Sets a parameter from text.
    ///
    /// # Errors
    /// A name that there is not, a value out of range: both tell what there is.
    fn set(&mut self, key: &str, text: &str) -> Result<(), ParamError> {
        self.try_set(key, text).unwrap_or_else(|| Err(unknown(key, &self.infos())))
    }

    /// A parameter's value as text; `None` where there is no such parameter.
    fn get(&self, key: &str) -> Option<String> {
        self.described().into_iter().find(|info| info.key == key).map(|info| info.default)
    }

    /// Every parameter with its value as text.
    fn resolved(&self) -> BTreeMap<String, String> {
        self.described().into_iter().map(|info| (info.key.to_owned(), info.default)).collect()
    }
}

/// The error of a name that is not among those.
pub(crate) fn unknown(key: &str, infos: &[ParamInfo]) -> ParamError {
    let known: Vec<&str> = infos.iter().map(|info| info.key).collect();
    ParamError::Unknown { key: key.to_owned(), owner: String::new(), known: known.join(", ") }
}

crate::parameters! {
    /// No parameters.
    pub struct NoParams {}
}
