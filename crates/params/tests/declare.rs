//! What a declaration gives.

use afterlight_params::{
    AutoOr, Choice as _, NoParams, ParamError, ParamKind, ParamSet, Params, Words, choices, parameters,
};
use serde_json::json;

choices! {
    /// Colours.
    pub enum Color {
        /// Red.
        Red = "red",
        /// Green.
        Green = "green",
        /// Blue.
        Blue = "blue",
    }
}

parameters! {
    /// To be embedded.
    #[derive(Copy)]
    pub struct Inner {
        /// a number of 64 bits
        large: u64 = 1, "large";
        /// a number with a sign
        signed: i64 = -1, "signed", -5..=5;
    }
}

parameters! {
    /// One of each.
    pub struct All {
        /// a colour,
        /// in two lines
        ///
        /// And what help does not tell.
        color: Color = Color::Green, "color";
        /// a count
        count: u32 = 16_777_217, "count";
        /// counted, or so many
        nodes: AutoOr<u32> = AutoOr::Auto, "nodes", 1..=64;
        /// Those of another.
        ..inner: Inner = Inner { signed: 3, ..Inner::default() };
        /// a share
        share: f32 = 0.1, "share" <SHARE>, 0.1..=1.0;
        /// the same in 64 bits
        wide_share: f64 = 0.1, "wide-share", 0.1..=1.0;
        /// an edge, or none
        edge_px: Option<f32> = None, "edge" <PX>, 1.0..;
        /// colours
        colors: Words<Color> = Words::NONE.with(Color::Blue), "colors";
        /// on or off
        on: bool = true, "on";
        /// a name
        name: String = "any".to_owned(), "name";
        /// Not for text.
        hidden: f32 = 2.0;
    }
}

fn resolved(set: &dyn ParamSet) -> serde_json::Value {
    json!(set.resolved())
}

#[test]
fn defaults_are_as_declared() {
    let all = All::default();
    assert_eq!((all.color, all.count, all.inner.large, all.inner.signed), (Color::Green, 16_777_217, 1, 3));
    assert_eq!((all.hidden, all.on, all.edge_px), (2.0, true, None));
    let expected = json!({
        "color": "green", "colors": "blue", "count": "16777217", "edge": "none", "large": "1", "name": "any",
        "nodes": "auto", "on": "true", "share": "0.1", "signed": "3", "wide-share": "0.1",
    });
    assert_eq!(resolved(&all), expected);
}

#[test]
fn infos_tell_kind_and_default() {
    let mut all = All::default();
    all.set("color", "red").expect("a name");
    let infos = all.infos();
    let of = |key: &str| json!(infos.iter().find(|info| info.key == key).expect("declared"));
    assert_eq!(
        of("color"),
        json!({ "key": "color", "summary": "a colour, in two lines", "kind": "choice",
                "values": ["red", "green", "blue"], "default": "green" })
    );
    assert_eq!(of("signed")["default"], "3");
    assert_eq!((&of("signed")["min"], &of("signed")["max"]), (&json!(-5), &json!(5)));
    assert_eq!(of("large")["max"], json!(u64::MAX));
    assert_eq!(of("nodes")["kind"], "auto_or_integer");
    assert_eq!(
        of("share").to_string(),
        of("wide-share").to_string().replace("wide-share", "share").replace("the same in 64 bits", "a share")
    );
    assert_eq!(of("edge")["kind"], "none_or_number");
    assert_eq!(of("on"), json!({ "key": "on", "summary": "on or off", "kind": "bool", "default": "true" }));
    let named = |key: &str| infos.iter().find(|info| info.key == key).expect("declared").value_name;
    assert_eq!((named("edge"), named("wide-share")), ("PX", "WIDE_SHARE"));
    assert_eq!(all.described()[0].default, "red");
    assert!(infos.iter().all(|info| info.key != "hidden"));
}

#[test]
fn whole_numbers_stay_whole() {
    let mut all = All::default();
    for (key, text) in
        [("count", "4294967295"), ("large", "18446744073709551615"), ("large", "9007199254740993")]
    {
        all.set(key, text).expect("in range");
        assert_eq!(all.get(key).as_deref(), Some(text));
    }
    assert_eq!(all.inner.large, 9_007_199_254_740_993);
    for (key, text) in
        [("count", "1.0"), ("count", "4294967296"), ("count", "-1"), ("count", "1e3"), ("large", "")]
    {
        assert!(all.set(key, text).is_err(), "{key}={text}");
    }
}

#[test]
fn what_is_told_is_read_again() {
    let mut all = All::default();
    for (key, text) in [
        ("color", "blue"),
        ("nodes", "64"),
        ("nodes", "auto"),
        ("signed", "-5"),
        ("share", "0.3"),
        ("edge", "2.5"),
        ("edge", "none"),
        ("colors", "red+blue"),
        ("colors", "none"),
        ("on", "false"),
        ("name", ""),
        ("name", "a=b"),
    ] {
        all.set(key, text).expect("a value");
        assert_eq!(all.get(key).as_deref(), Some(text), "{key}");
        let mut again = All::default();
        for (key, text) in all.resolved() {
            again.set(&key, &text).expect("a value");
        }
        assert_eq!(again, all);
    }
}

#[test]
fn errors_name_found_and_expected() {
    let mut all = All::default();
    let before = all.clone();
    for (key, text, expected) in [
        ("color", "gray", "one of: red, green, blue"),
        ("nodes", "0", "auto, or a whole number from 1 to 64"),
        ("signed", "6", "a whole number from -5 to 5"),
        ("share", "NaN", "a number from 0.1 to 1"),
        ("wide-share", "2", "a number from 0.1 to 1"),
        ("colors", "red+gray", "none, or some of: red, green, blue, joined by +"),
        ("colors", "", "none, or some of: red, green, blue, joined by +"),
        ("on", "yes", "true or false"),
    ] {
        let error = all.set(key, text).expect_err("refused");
        assert_eq!(error.to_string(), format!("parameter {key}: found {text:?}, expected {expected}"));
    }
    assert_eq!(all, before);
    let error = Inner::default().set("smal", "1").expect_err("unknown");
    let expected = r#"parameter "smal": found no such parameter, expected one of: large, signed"#;
    assert_eq!(error.to_string(), expected);
    let expected = r#"parameter "smal" of dais: found no such parameter, expected one of: large, signed"#;
    assert_eq!(error.of("dais").to_string(), expected);
    assert!(matches!(all.set("hidden", "1"), Err(ParamError::Unknown { .. })));
}

#[test]
fn sets_of_any_type_compare_and_copy() {
    let mut params = Params::of(NoParams {}).and(Params::of(All::default()));
    let copy = params.clone();
    assert_eq!(params, copy);
    params.set("large", "7").expect("in range");
    assert_ne!(params, copy);
    assert_eq!((params.typed::<Inner>().large, copy.typed::<Inner>().large), (7, 1));
    params.typed_mut::<All>().hidden = 3.0;
    assert_eq!(params.typed::<All>().hidden, 3.0);
    assert_ne!(Params::of(Inner::default()), Params::of(NoParams {}));
    assert!(params.has("large") && !params.has("hidden"));
    assert_eq!(json!(Params::of(Inner::default())), json!({ "large": "1", "signed": "-1" }));
    assert_eq!(Params::default().resolved().len(), 0);
    let error = params.set("smal", "1").expect_err("unknown");
    assert!(error.to_string().contains("expected one of: color, count"), "{error}");
}

#[test]
#[should_panic(expected = "parameters: found NoParams and Inner, expected")]
fn another_type_is_a_programmers_error() {
    let _ = Params::of(NoParams {}).and(Params::of(Inner::default())).typed::<All>().hidden;
}

#[test]
#[should_panic(expected = "key \"large\": found twice")]
fn one_key_in_two_sets_is_a_programmers_error() {
    let _ = Params::of(Inner::default()).and(Params::of(All::default()));
}

#[test]
fn choices_have_names() {
    assert_eq!(Color::ALL.len(), 3);
    assert_eq!(Color::Blue.to_string(), "blue");
    assert_eq!(Color::from_name("green"), Some(Color::Green));
    assert_eq!(Color::from_name("Green"), None);
    assert_eq!(json!([Color::Red, Color::Blue]), json!(["red", "blue"]));
    let words: Words<Color> = [Color::Blue, Color::Red].into_iter().collect();
    assert_eq!((words.bits(), json!(words)), (5, json!("red+blue")));
    assert!(words.contains(Color::Red) && !words.contains(Color::Green));
    assert_eq!(ParamKind::Words { values: Color::NAMES }.range(), "none, red+green+blue");
}
