//! Techniques that were asked for, with their parameters.

use afterlight_techniques::{Params, Technique, params_of, registry, set_param};

use crate::LabError;

/// A technique with the parameters that were asked for.
pub struct Chosen {
    /// The technique.
    pub technique: &'static dyn Technique,
    /// Its parameters.
    pub params: Params,
}

impl Chosen {
    /// A technique with the defaults of its parameters.
    pub fn new(technique: &'static dyn Technique) -> Self {
        Self { technique, params: params_of(technique) }
    }

    /// Sets a parameter.
    ///
    /// # Errors
    /// Keys and values that are not known.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), LabError> {
        Ok(set_param(self.technique, &mut self.params, key, value)?)
    }

    /// Its id.
    pub fn id(&self) -> &'static str {
        self.technique.info().id
    }
}

/// Finds a technique; `setting` is what named it.
///
/// # Errors
/// An id that no technique has: lists what there is.
pub fn technique(setting: &'static str, id: &str) -> Result<&'static dyn Technique, LabError> {
    afterlight_techniques::find(id).ok_or_else(|| {
        let known: Vec<&str> = registry().iter().map(|technique| technique.info().id).collect();
        LabError::setting(setting, format!("{id:?}"), format!("one of: {}", known.join(", ")))
    })
}

/// Finds techniques, `all` for all, each once, and gives them their parameters: `KEY=VALUE` goes to every technique that has the
/// key, `ID.KEY=VALUE` to one. `setting` is what named the techniques.
///
/// # Errors
/// Ids, keys and values that are not known: the error lists those that are.
pub fn choose(setting: &'static str, ids: &[String], sets: &[String]) -> Result<Vec<Chosen>, LabError> {
    let mut techniques: Vec<&'static dyn Technique> = Vec::new();
    for id in ids.iter().map(|id| id.trim()) {
        let more = if id == "all" { registry().to_vec() } else { vec![technique(setting, id)?] };
        for one in more {
            if techniques.iter().all(|known| known.info().id != one.info().id) {
                techniques.push(one);
            }
        }
    }
    let mut chosen: Vec<Chosen> = techniques.into_iter().map(Chosen::new).collect();
    for set in sets {
        apply(&mut chosen, set)?;
    }
    Ok(chosen)
}

/// Applies one `--set`: `KEY=VALUE` to every technique that has the key, `ID.KEY=VALUE` to one.
fn apply(chosen: &mut [Chosen], set: &str) -> Result<(), LabError> {
    let Some((name, value)) = set.split_once('=') else {
        return Err(LabError::setting("set", format!("{set:?}"), "KEY=VALUE or ID.KEY=VALUE"));
    };
    if let Some((id, key)) = name.split_once('.') {
        let known: Vec<&str> = chosen.iter().map(Chosen::id).collect();
        let Some(one) = chosen.iter_mut().find(|one| one.id() == id) else {
            let expected = format!("one of the techniques that run: {}", known.join(", "));
            return Err(LabError::setting("set", format!("technique {id:?}"), expected));
        };
        return one.set(key, value);
    }
    let mut taken = false;
    for one in chosen.iter_mut() {
        if one.params.has(name) {
            one.set(name, value)?;
            taken = true;
        }
    }
    if taken {
        return Ok(());
    }
    let mut known: Vec<&str> =
        chosen.iter().flat_map(|one| one.params.infos()).map(|param| param.key).collect();
    known.sort_unstable();
    known.dedup();
    Err(LabError::setting("set", format!("parameter {name:?}"), format!("one of: {}", known.join(", "))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ids(ids: &[&str]) -> Vec<String> {
        ids.iter().map(|id| (*id).to_owned()).collect()
    }

    #[test]
    fn all_is_the_registry_and_nothing_is_twice() {
        let all = choose("techniques", &ids(&["all"]), &[]).expect("all");
        assert_eq!(all.len(), registry().len());
        let twice = choose("techniques", &ids(&["forward", "all", "forward"]), &[]).expect("all");
        assert_eq!(twice.len(), registry().len());
    }

    #[test]
    fn unknown_names_list_what_there_is() {
        let text = |result: Result<Vec<Chosen>, LabError>| result.err().expect("fails").to_string();
        let line = text(choose("techniques", &ids(&["backward"]), &[]));
        assert!(line.contains("\"backward\"") && line.contains("forward"), "{line}");
        let line = text(choose("techniques", &ids(&["forward"]), &ids(&["nokey=1"])));
        assert!(line.contains("nokey") && line.contains("cull"), "{line}");
        let line = text(choose("techniques", &ids(&["forward"]), &ids(&["tiled.cull=none"])));
        assert!(line.contains("tiled") && line.contains("forward"), "{line}");
        let line = text(choose("techniques", &ids(&["forward"]), &ids(&["cull=perhaps"])));
        assert!(line.contains("perhaps") && line.contains("frustum"), "{line}");
        let line = text(choose("techniques", &ids(&["forward"]), &ids(&["cull"])));
        assert!(line.contains("KEY=VALUE"), "{line}");
    }

    #[test]
    fn parameters_reach_all_or_one() {
        let chosen = choose(
            "techniques",
            &ids(&["forward", "deferred"]),
            &ids(&["cull=none", "deferred.order=scene"]),
        )
        .expect("known");
        let text = |index: usize, key: &str| chosen[index].params.get(key).expect("every technique has it");
        assert_eq!((text(0, "cull"), text(1, "cull")), ("none".into(), "none".into()));
        assert_eq!((text(0, "order"), text(1, "order")), ("center".into(), "scene".into()));
    }
}
