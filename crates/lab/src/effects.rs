//! Effects in a specification: an object of what is not as it is by default, by the names that the command line has for them.

use std::collections::BTreeMap;

use afterlight_techniques::{Effects, ParamSet as _};
use serde::{Deserialize as _, Deserializer, Serializer, de::Error as _};
use serde_json::Value;

/// Parameters of effects that are not as they are by default, by their keys. One key may stand for parameters of several effects.
pub(crate) fn changed(effects: &Effects) -> BTreeMap<&'static str, String> {
    let usual = effects.infos().into_iter();
    let changed =
        effects.described().into_iter().zip(usual).filter(|(now, usual)| now.default != usual.default);
    changed.map(|(now, _)| (now.key, now.default)).collect()
}

/// For `#[serde(with)]`.
pub fn serialize<S: Serializer>(effects: &Effects, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(changed(effects).into_iter().map(|(key, text)| (key, value(&text))))
}

/// For `#[serde(with)]`.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Effects, D::Error> {
    let mut effects = Effects::default();
    for (key, value) in BTreeMap::<String, Value>::deserialize(deserializer)? {
        let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        effects.set(&key, &text).map_err(D::Error::custom)?;
    }
    Ok(effects)
}

/// A number as a number, else the text.
fn value(text: &str) -> Value {
    let number = text.parse().ok().filter(|value: &Value| value.is_number());
    number.unwrap_or_else(|| Value::from(text))
}
