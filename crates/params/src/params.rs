//! Sets of parameters of any type, together.

use std::{
    any::{TypeId, type_name},
    collections::BTreeMap,
};

use serde::{Serialize, Serializer};

use crate::{ParamError, ParamInfo, ParamSet, set::unknown};

/// Sets of parameters of any type, in order: what text sets and records tell, and what is read by type.
#[derive(Debug, Default)]
pub struct Params {
    sets: Vec<Box<dyn ParamSet>>,
}

impl Params {
    /// Those of one set.
    pub fn of(set: impl ParamSet) -> Self {
        Self { sets: vec![Box::new(set)] }
    }

    /// Those, and after them the ones of others.
    ///
    /// # Panics
    /// Where a key is in both: one `--set` would mean two things.
    #[must_use]
    pub fn and(mut self, others: Params) -> Self {
        let known: Vec<&str> = self.infos().iter().map(|info| info.key).collect();
        for info in others.infos() {
            assert!(
                !known.contains(&info.key),
                "key {:?}: found twice, in {self:?} and {others:?}",
                info.key
            );
        }
        self.sets.extend(others.sets);
        self
    }

    /// The sets of `defaults`, each as it is here where there is one of its type: what is left open gets its default, what
    /// `defaults` does not have is left out.
    #[must_use]
    pub fn over(&self, defaults: Params) -> Params {
        let type_of = |set: &dyn ParamSet| set.as_any().type_id();
        let here = |wanted: &dyn ParamSet| {
            self.sets.iter().find(|set| type_of(set.as_ref()) == type_of(wanted)).map(|set| set.clone_box())
        };
        Self { sets: defaults.sets.into_iter().map(|set| here(set.as_ref()).unwrap_or(set)).collect() }
    }

    /// Whether there is a set of that type, embedded in another or not.
    pub fn holds<T: ParamSet>(&self) -> bool {
        self.find::<T>().is_some()
    }

    /// The set of that type, or the first one embedded in another.
    pub fn find<T: ParamSet>(&self) -> Option<&T> {
        self.sets.iter().find_map(|set| set.part(TypeId::of::<T>()))?.downcast_ref()
    }

    /// The set of that type.
    ///
    /// # Panics
    /// Where there is none: whoever reads parameters knows their type.
    #[track_caller]
    pub fn typed<T: ParamSet>(&self) -> &T {
        match self.find() {
            Some(set) => set,
            None => panic!("parameters: found {}, expected {}", self.type_names(), type_name::<T>()),
        }
    }

    /// The set of that type, to be changed.
    ///
    /// # Panics
    /// As [`Params::typed`].
    #[track_caller]
    pub fn typed_mut<T: ParamSet>(&mut self) -> &mut T {
        let found = self.type_names();
        let set = self.sets.iter_mut().find_map(|set| set.part_mut(TypeId::of::<T>()));
        match set.and_then(|set| set.downcast_mut()) {
            Some(set) => set,
            None => panic!("parameters: found {found}, expected {}", type_name::<T>()),
        }
    }

    fn type_names(&self) -> String {
        self.sets.iter().map(|set| set.type_name()).collect::<Vec<_>>().join(" and ")
    }

    /// What parameters there are, in order, with their defaults.
    pub fn infos(&self) -> Vec<ParamInfo> {
        self.sets.iter().flat_map(|set| set.infos()).collect()
    }

    /// Whether there is a parameter of that name.
    pub fn has(&self, key: &str) -> bool {
        self.infos().iter().any(|info| info.key == key)
    }

    /// Sets a parameter from text.
    ///
    /// # Errors
    /// A name that there is not, a value out of range: both tell what there is.
    pub fn set(&mut self, key: &str, text: &str) -> Result<(), ParamError> {
        let found = self.sets.iter_mut().find_map(|set| set.try_set(key, text));
        found.unwrap_or_else(|| Err(unknown(key, &self.infos())))
    }

    /// A parameter's value as text; `None` where there is no such parameter.
    pub fn get(&self, key: &str) -> Option<String> {
        self.sets.iter().find_map(|set| set.get(key))
    }

    /// Every parameter with its value as text.
    pub fn resolved(&self) -> BTreeMap<String, String> {
        self.sets.iter().flat_map(|set| set.resolved()).collect()
    }
}

impl Clone for Params {
    fn clone(&self) -> Self {
        Self { sets: self.sets.iter().map(|set| set.clone_box()).collect() }
    }
}

impl PartialEq for Params {
    fn eq(&self, other: &Self) -> bool {
        self.sets.len() == other.sets.len()
            && self.sets.iter().zip(&other.sets).all(|(one, other)| one.is_equal(other.as_ref()))
    }
}

impl Serialize for Params {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.resolved().serialize(serializer)
    }
}
