//! Compiled variants kept between builds, a file each. A file holds a stamp, which is a hash of everything that decided
//! the variant: so an edited header compiles again the variants that include it, and no others.

use std::collections::BTreeSet;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

use crate::compile::{CompileError, Compiled, Compiler, Files};
use crate::manifest::Variant;
use crate::{INCLUDES, Shader, pack};

/// Starts each file; a change of the format changes it.
const MAGIC: &[u8; 8] = b"shader 1";

/// A folder of compiled variants.
pub(crate) struct Cache<'a> {
    folder: PathBuf,
    compiler: &'a Compiler,
    /// What all variants depend on.
    common: u64,
}

impl<'a> Cache<'a> {
    /// Opens the cache, and makes its folder where there is none.
    pub(crate) fn open(folder: PathBuf, compiler: &'a Compiler) -> Result<Cache<'a>, CompileError> {
        std::fs::create_dir_all(&folder)
            .map_err(|source| CompileError::Write { path: folder.clone(), source })?;
        let mut hasher = DefaultHasher::new();
        // A new version of glslang needs no place here: with it Cargo gives build scripts another output folder.
        env!("AFTERLIGHT_SHADER_SOURCE_HASH").hash(&mut hasher);
        format!("{compiler:?}").hash(&mut hasher);
        for (name, _) in INCLUDES {
            name.hash(&mut hasher);
        }
        Ok(Cache { folder, compiler, common: hasher.finish() })
    }

    /// Returns the variant as it was compiled before, where nothing that decided it has changed.
    pub(crate) fn get(&self, variant: &Variant) -> Option<Compiled> {
        let bytes = std::fs::read(self.path(variant)).ok()?;
        let (stamp, files, shader) = read(&bytes)?;
        (stamp == self.stamp(variant, &files)).then_some(Compiled { shader, files })
    }

    /// Compiles the variant and keeps it.
    pub(crate) fn compile(&self, variant: &Variant) -> Result<Compiled, CompileError> {
        let compiled = self.compiler.compile(variant)?;
        let path = self.path(variant);
        let bytes = written(self.stamp(variant, &compiled.files), &compiled);
        std::fs::write(&path, bytes).map_err(|source| CompileError::Write { path, source })?;
        Ok(compiled)
    }

    /// Removes the files of variants that are no longer there.
    pub(crate) fn keep_only(&self, variants: &[Variant]) {
        let kept: BTreeSet<PathBuf> = variants.iter().map(|variant| self.path(variant)).collect();
        let files = std::fs::read_dir(&self.folder).into_iter().flatten().flatten().map(|entry| entry.path());
        for path in files.filter(|path| !kept.contains(path)) {
            // A file that stays costs room and nothing else.
            let _ = std::fs::remove_file(path);
        }
    }

    fn path(&self, variant: &Variant) -> PathBuf {
        self.folder.join(format!("{:016x}", hash_of(&variant.name)))
    }

    /// Hashes what decides the variant. 64 bits of the standard library's SipHash are enough: a stamp is only ever compared
    /// with the one before, by a build on the same machine with the same compiler of Rust.
    fn stamp(&self, variant: &Variant, files: &Files) -> u64 {
        let mut hasher = DefaultHasher::new();
        (self.common, variant).hash(&mut hasher);
        for path in &files.read {
            (path, std::fs::read(path).ok()).hash(&mut hasher);
        }
        for path in &files.absent {
            (path, path.is_file()).hash(&mut hasher);
        }
        for name in &files.embedded {
            (name, INCLUDES.iter().find(|(other, _)| other == name)).hash(&mut hasher);
        }
        hasher.finish()
    }
}

fn hash_of(value: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    value.hash(&mut hasher);
    hasher.finish()
}

/// Writes a file: magic, check sum of the rest, stamp, bytes of the list of files, that list, the packed shader.
fn written(stamp: u64, compiled: &Compiled) -> Vec<u8> {
    let files = listed(&compiled.files);
    let mut rest = stamp.to_le_bytes().to_vec();
    rest.extend((files.len() as u64).to_le_bytes());
    rest.extend(files.as_bytes());
    rest.extend(pack::pack(&[&compiled.shader]));
    [MAGIC.as_slice(), &hash_of(&rest).to_le_bytes(), &rest].concat()
}

/// Reads what [`written`] wrote; none where anything of it is broken.
fn read(bytes: &[u8]) -> Option<(u64, Files, Shader)> {
    let (sum, rest) = number(bytes.strip_prefix(MAGIC)?)?;
    if hash_of(rest) != sum {
        return None;
    }
    let (stamp, rest) = number(rest)?;
    let (files_bytes, rest) = number(rest)?;
    let (files, shader) = rest.split_at_checked(usize::try_from(files_bytes).ok()?)?;
    let files = unlisted(std::str::from_utf8(files).ok()?)?;
    Some((stamp, files, pack::unpack_owned(shader).ok()?.pop()?))
}

fn number(bytes: &[u8]) -> Option<(u64, &[u8])> {
    let (number, rest) = bytes.split_first_chunk::<8>()?;
    Some((u64::from_le_bytes(*number), rest))
}

/// Lists files, one a line, after a letter that says what they are. A path that is no UTF-8 comes out as another, which
/// does not exist: its variants are then compiled each time.
fn listed(files: &Files) -> String {
    let paths = |letter: char, paths: &BTreeSet<PathBuf>| -> String {
        paths.iter().map(|path| format!("{letter} {}\n", path.to_string_lossy())).collect()
    };
    let embedded: String = files.embedded.iter().map(|name| format!("e {name}\n")).collect();
    paths('r', &files.read) + &paths('a', &files.absent) + &embedded
}

fn unlisted(text: &str) -> Option<Files> {
    let mut files = Files::default();
    for line in text.lines() {
        let _ = match line.split_once(' ')? {
            ("r", path) => files.read.insert(Path::new(path).to_owned()),
            ("a", path) => files.absent.insert(Path::new(path).to_owned()),
            ("e", name) => files.embedded.insert(name.to_owned()),
            _ => return None,
        };
    }
    Some(files)
}
