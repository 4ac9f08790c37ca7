//! Parameters as options of a command line of their own, `--key VALUE`.

use crate::{ParamInfo, ParamKind, ParamSet};

/// An option of a command line.
#[derive(Clone, Debug, PartialEq)]
pub struct OptionInfo {
    /// Its long name, without dashes: the parameter's key.
    pub long: &'static str,
    /// What help calls its value.
    pub value_name: &'static str,
    /// What it does.
    pub help: String,
    /// What help says of its default. It is never to be set: sets that share an option may have defaults of their own, and this
    /// text then names them all. None where it says nothing: without the option there is no value, or an empty text.
    pub default: Option<String>,
    /// Values, where each has a name; else empty, and any text may be one.
    pub possible_values: &'static [&'static str],
}

/// The options of a set, in order, one a key. The set takes their values by [`ParamSet::set`], which checks them.
///
/// Embedded sets may share a key; help tells the default of each by the field that embeds it.
pub fn options(set: &dyn ParamSet) -> Vec<OptionInfo> {
    let infos = set.infos();
    let is_first = |at: usize| infos[..at].iter().all(|before| before.key != infos[at].key);
    let firsts = (0..infos.len()).filter(|at| is_first(*at));
    firsts.map(|at| option(&infos[at], &sharing(&infos, infos[at].key))).collect()
}

/// The parameters of one key.
fn sharing<'a>(infos: &'a [ParamInfo], key: &str) -> Vec<&'a ParamInfo> {
    infos.iter().filter(|info| info.key == key).collect()
}

fn option(info: &ParamInfo, sharing: &[&ParamInfo]) -> OptionInfo {
    OptionInfo {
        long: info.key,
        value_name: info.value_name,
        help: info.summary.clone(),
        default: default(info, sharing),
        possible_values: info.kind.names(),
    }
}

fn default(info: &ParamInfo, sharing: &[&ParamInfo]) -> Option<String> {
    if sharing.iter().any(|other| other.default != info.default) {
        let each: Vec<String> =
            sharing.iter().map(|info| format!("{} for {}", info.default, info.group)).collect();
        return Some(each.join(", "));
    }
    let says_nothing = match info.kind {
        ParamKind::Text => info.default.is_empty(),
        kind => kind.has_none() && info.default == crate::value::NONE,
    };
    (!says_nothing).then(|| info.default.clone())
}
