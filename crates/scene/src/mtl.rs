//! Material libraries of OBJ files (MTL).
//!
//! `tobj` reads them as well, but panics on a colour of one number, which the format allows, and drops the whole library at the
//! first statement that it cannot read. Here a statement that cannot be read is skipped and named, and the others count.

use std::path::Path;

/// What a material library says of one material; `None` where it says nothing that can be read.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct MtlMaterial {
    /// `newmtl`.
    pub(crate) name: String,
    /// `Kd`, linear.
    pub(crate) diffuse: Option<[f32; 3]>,
    /// `Ke`, linear.
    pub(crate) emissive: Option<[f32; 3]>,
    /// `d`: 1 is opaque.
    pub(crate) dissolve: Option<f32>,
    /// `Tr`: 0 is opaque.
    pub(crate) transparency: Option<f32>,
    /// `Ns`, the Blinn-Phong exponent.
    pub(crate) exponent: Option<f32>,
    /// `Pm`, 0 to 1.
    pub(crate) metalness: Option<f32>,
    /// `Pr`, 0 to 1.
    pub(crate) roughness: Option<f32>,
    /// `map_Kd`, options included.
    pub(crate) diffuse_map: Option<String>,
    /// `map_Ke`, options included.
    pub(crate) emissive_map: Option<String>,
    /// `map_d`, options included.
    pub(crate) dissolve_map: Option<String>,
    /// `norm` or `map_Kn`, options included.
    pub(crate) normal_map: Option<String>,
    /// `bump`, `map_bump` or `map_Bump`, options included.
    pub(crate) bump_map: Option<String>,
}

/// Statements that are named one by one where they cannot be read; a file that is no material library has thousands.
const UNREAD_NAMED_MAX: usize = 3;

/// Reads a library. Returns its materials in order, and a line for each statement that was skipped; bytes that are no UTF-8 are
/// replaced. `file` is named in the lines.
pub(crate) fn parse(file: &Path, bytes: &[u8]) -> (Vec<MtlMaterial>, Vec<String>) {
    let (text, name) = (String::from_utf8_lossy(bytes), crate::error::one_line(&file.display().to_string()));
    let mut materials: Vec<MtlMaterial> = Vec::new();
    let (mut skipped, mut skipped_count) = (Vec::new(), 0usize);
    for (number, line) in (1..).zip(text.trim_start_matches('\u{feff}').lines()) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let Err(expected) = read_statement(line, &mut materials) else { continue };
        skipped_count += 1;
        if skipped_count <= UNREAD_NAMED_MAX {
            let found = crate::error::one_line(line);
            skipped
                .push(format!("{name}: line {number}: found {found:?}, expected {expected}; it is skipped"));
        }
    }
    if skipped_count > UNREAD_NAMED_MAX {
        let more = skipped_count - UNREAD_NAMED_MAX;
        skipped.push(format!("{name}: {more} more statements are skipped"));
    }
    (materials, skipped)
}

/// Reads a statement into the last material. The error is what was expected; statements of other kinds are none.
fn read_statement(line: &str, materials: &mut Vec<MtlMaterial>) -> Result<(), &'static str> {
    let (key, value) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    let value = value.trim();
    if key == "newmtl" {
        materials.push(MtlMaterial { name: value.to_owned(), ..MtlMaterial::default() });
        return if value.is_empty() { Err("a name") } else { Ok(()) };
    }
    let mut unused = MtlMaterial::default();
    let before_all = materials.is_empty();
    let m = materials.last_mut().unwrap_or(&mut unused);
    match key {
        "Kd" => m.diffuse = Some(color(value)?),
        "Ke" => m.emissive = Some(color(value)?),
        "d" => m.dissolve = Some(number(value.strip_prefix("-halo").unwrap_or(value))?),
        "Tr" => m.transparency = Some(number(value)?),
        "Ns" => m.exponent = Some(number(value)?),
        "Pm" => m.metalness = Some(number(value)?),
        "Pr" => m.roughness = Some(number(value)?),
        "map_Kd" => m.diffuse_map = Some(map(value)?),
        "map_Ke" => m.emissive_map = Some(map(value)?),
        "map_d" => m.dissolve_map = Some(map(value)?),
        "norm" | "map_Kn" => m.normal_map = Some(map(value)?),
        "bump" | "map_bump" | "map_Bump" => m.bump_map = Some(map(value)?),
        _ => return Ok(()),
    }
    if before_all { Err("newmtl before it") } else { Ok(()) }
}

/// The finite number that a value starts with.
fn number(value: &str) -> Result<f32, &'static str> {
    let word = value.split_whitespace().next().unwrap_or_default();
    word.parse().ok().filter(|v: &f32| v.is_finite()).ok_or("a finite number")
}

/// `r [g b]`: a colour of one number is grey. Colours by spectra or in CIE XYZ are not read.
fn color(value: &str) -> Result<[f32; 3], &'static str> {
    const EXPECTED: &str = "one or three finite numbers";
    let words: Vec<&str> =
        value.split_whitespace().take_while(|word| !word.starts_with('#')).take(3).collect();
    let read = |word: &str| number(word).map_err(|_| EXPECTED);
    match words[..] {
        [grey] => Ok([read(grey)?; 3]),
        [r, g, b] => Ok([read(r)?, read(g)?, read(b)?]),
        _ => Err(EXPECTED),
    }
}

fn map(value: &str) -> Result<String, &'static str> {
    if value.is_empty() { Err("a file name") } else { Ok(value.to_owned()) }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{MtlMaterial, UNREAD_NAMED_MAX, parse};

    fn read(text: &[u8]) -> (Vec<MtlMaterial>, Vec<String>) {
        parse(Path::new("a.mtl"), text)
    }

    #[test]
    fn a_colour_of_one_number_is_grey() {
        let (materials, skipped) =
            read(b"\xef\xbb\xbfnewmtl a b\r\nKd 0.5 # grey\r\n\tKe 1 2 3 4\r\nnewmtl c\nKd\t1\n");
        assert!(skipped.is_empty(), "{skipped:?}");
        let [a, c] = &materials[..] else { panic!("{materials:?}") };
        assert_eq!((a.name.as_str(), a.diffuse, a.emissive), ("a b", Some([0.5; 3]), Some([1.0, 2.0, 3.0])));
        assert_eq!((c.name.as_str(), c.diffuse, c.emissive), ("c", Some([1.0; 3]), None));
    }

    #[test]
    fn a_statement_that_cannot_be_read_is_named_and_the_others_count() {
        let unreadable = [
            "Kd",
            "Kd 1 2",
            "Kd red",
            "Kd 1 2 nan",
            "Kd spectral file.rfl 1.0",
            "Ke xyz 1 1 1",
            "Ns",
            "Ns 1e39",
            "d -halo",
            "Tr x",
            "Pm inf",
            "Pr -",
            "map_Kd",
            "map_d ",
            "norm",
            "bump",
            "newmtl",
        ];
        for statement in unreadable {
            let text = format!("newmtl m\nd -halo 0.5\nKd 0.25 0.5 1\n{statement}\nillum\nKe 1\n");
            let (materials, skipped) = read(text.as_bytes());
            assert_eq!(skipped.len(), 1, "{statement}: {skipped:?}");
            let named = format!("a.mtl: line 4: found {:?}, expected ", statement.trim());
            assert!(skipped[0].starts_with(&named), "{skipped:?}");
            assert_eq!((materials[0].diffuse, materials[0].dissolve), (Some([0.25, 0.5, 1.0]), Some(0.5)));
            assert_eq!(materials.last().and_then(|m| m.emissive), Some([1.0; 3]));
        }
        let (materials, skipped) = read(b"Kd 1\nKe 1\nnewmtl m\n");
        assert_eq!((materials.len(), skipped.len()), (1, 2));
    }

    #[test]
    fn bytes_that_are_no_text_drop_nothing() {
        let (materials, skipped) = read(b"# caf\xe9\nnewmtl caf\xe9\nKd 0.9 0 0\nmap_Kd \xff.png\n");
        assert!(skipped.is_empty(), "{skipped:?}");
        assert_eq!((materials.len(), materials[0].diffuse), (1, Some([0.9, 0.0, 0.0])));
    }

    #[test]
    fn a_file_of_another_kind_is_a_few_lines() {
        let (_, skipped) = read("Kd x\n".repeat(10_000).as_bytes());
        assert_eq!(skipped.len(), UNREAD_NAMED_MAX + 1);
        assert!(skipped[UNREAD_NAMED_MAX].contains("9997 more"), "{skipped:?}");
    }
}
