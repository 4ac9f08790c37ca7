//! Reads what a Rust file names: `use` trees, paths, modules, string literals. A scan over tokens, not a parser: it knows comments, literals
//! and braces, and follows nothing that a macro writes.

/// A path that a file names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reference {
    /// Line, from 1.
    pub line: usize,
    /// Its words, as written: `crate`, `super`, names; without a closing `*`.
    pub path: Vec<String>,
    /// Modules written in the file itself that the path stands in.
    pub inside: Vec<String>,
    /// The name that the file gives on, where the path is that of a `pub use`.
    pub exported_as: Option<String>,
}

/// What a file names, tests left out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Scan {
    /// Paths that begin with `crate`, `super`, `self` or a module that the file declares.
    pub references: Vec<Reference>,
    /// Modules declared as `mod name;`.
    pub modules: Vec<String>,
    /// String literals and their lines.
    pub literals: Vec<(usize, String)>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Kind {
    Word(String),
    Literal(String),
    PathSeparator,
    Mark(char),
}

#[derive(Clone, Debug)]
struct Token {
    line: usize,
    kind: Kind,
}

impl Token {
    fn word(&self) -> Option<&str> {
        match &self.kind {
            Kind::Word(word) => Some(word),
            _ => None,
        }
    }

    fn is(&self, mark: char) -> bool {
        self.kind == Kind::Mark(mark)
    }
}

/// Reads a file. Items under `#[cfg(test)]` are left out: a test may use anything.
pub fn scan(code: &str) -> Scan {
    let tokens = without_tests(&tokens(code));
    let modules = declared_modules(&tokens);
    let mut found = Scan { modules, ..Scan::default() };
    let mut blocks = Blocks::default();
    let mut at = 0;
    while at < tokens.len() {
        blocks.enter(&tokens, at);
        if let Kind::Literal(text) = &tokens[at].kind {
            found.literals.push((tokens[at].line, text.clone()));
        }
        at = if begins_use(&tokens, at) {
            read_use(&tokens, at, &blocks.names(), &mut found)
        } else {
            read_path(&tokens, at, &blocks.names(), &mut found)
        };
    }
    found
}

/// The modules with a body in the file around the place that is read.
#[derive(Default)]
struct Blocks {
    depth: usize,
    open: Vec<(usize, String)>,
}

impl Blocks {
    fn enter(&mut self, tokens: &[Token], at: usize) {
        if tokens[at].is('{') {
            self.depth += 1;
            if at >= 2
                && tokens[at - 2].word() == Some("mod")
                && let Some(name) = tokens[at - 1].word()
            {
                self.open.push((self.depth, name.into()));
            }
        } else if tokens[at].is('}') {
            self.open.retain(|(depth, _)| *depth != self.depth);
            self.depth = self.depth.saturating_sub(1);
        }
    }

    fn names(&self) -> Vec<String> {
        self.open.iter().map(|(_, name)| name.clone()).collect()
    }
}

fn declared_modules(tokens: &[Token]) -> Vec<String> {
    tokens
        .windows(3)
        .filter(|w| w[0].word() == Some("mod") && w[2].is(';'))
        .filter_map(|w| w[1].word().map(String::from))
        .collect()
}

/// Whether a `use` item begins here, and not a `use<'a>` of a type.
fn begins_use(tokens: &[Token], at: usize) -> bool {
    tokens[at].word() == Some("use") && !tokens.get(at + 1).is_some_and(|next| next.is('<'))
}

/// Reads a `use` item that begins at `at`; returns the place after it.
fn read_use(tokens: &[Token], at: usize, inside: &[String], found: &mut Scan) -> usize {
    let public = at > 0 && is_public(tokens, at - 1);
    let end = (at..tokens.len()).find(|&i| tokens[i].is(';')).unwrap_or(tokens.len());
    let mut leaves = Vec::new();
    use_tree(&tokens[at + 1..end], &mut 0, &[], &mut leaves);
    for (line, path, name) in leaves {
        if is_local(&path, &found.modules) {
            let exported_as = if public { name } else { None };
            found.references.push(Reference { line, path, inside: inside.to_vec(), exported_as });
        }
    }
    end
}

/// Whether `pub` or `pub(…)` ends at `at`.
fn is_public(tokens: &[Token], at: usize) -> bool {
    if !tokens[at].is(')') {
        return tokens[at].word() == Some("pub");
    }
    let open = (0..at).rev().find(|&i| tokens[i].is('('));
    open.is_some_and(|open| open > 0 && tokens[open - 1].word() == Some("pub"))
}

type Leaf = (usize, Vec<String>, Option<String>);

/// Reads one tree of a `use` item: a path that ends in a name, `*`, or a group in braces.
fn use_tree(tokens: &[Token], at: &mut usize, prefix: &[String], leaves: &mut Vec<Leaf>) {
    let mut path = prefix.to_vec();
    let mut line = tokens.get(*at).map_or(0, |t| t.line);
    while let Some(token) = tokens.get(*at) {
        match &token.kind {
            Kind::PathSeparator => *at += 1,
            Kind::Word(word) if word == "as" => {
                let name = tokens.get(*at + 1).and_then(Token::word).map(String::from);
                *at += 2;
                leaves.push((line, path, name));
                return;
            }
            Kind::Word(word) => {
                line = token.line;
                path.push(word.clone());
                *at += 1;
            }
            Kind::Mark('{') => return use_group(tokens, at, &path, leaves),
            Kind::Mark('*') => {
                *at += 1;
                leaves.push((line, path, None));
                return;
            }
            _ => break,
        }
    }
    if path.len() > prefix.len() {
        // `{self}` names the path before the braces.
        if path.len() > 1 && path.last().is_some_and(|word| word == "self") {
            path.pop();
        }
        let name = path.last().cloned();
        leaves.push((line, path, name));
    }
}

fn use_group(tokens: &[Token], at: &mut usize, prefix: &[String], leaves: &mut Vec<Leaf>) {
    *at += 1;
    while let Some(token) = tokens.get(*at) {
        if token.is('}') {
            *at += 1;
            return;
        }
        if token.is(',') {
            *at += 1;
            continue;
        }
        let before = *at;
        use_tree(tokens, at, prefix, leaves);
        if *at == before {
            *at += 1;
        }
    }
}

/// Reads a path outside of `use` items, if one begins at `at`; returns the place after it.
fn read_path(tokens: &[Token], at: usize, inside: &[String], found: &mut Scan) -> usize {
    let Some(first) = tokens[at].word() else { return at + 1 };
    let goes_on = |i: usize| {
        tokens.get(i).is_some_and(|t| t.kind == Kind::PathSeparator)
            && tokens.get(i + 1).is_some_and(|t| t.word().is_some())
    };
    let preceded = at > 0 && tokens[at - 1].kind == Kind::PathSeparator;
    let is_visibility = at >= 3
        && tokens[at - 1].word() == Some("in")
        && tokens[at - 2].is('(')
        && tokens[at - 3].word() == Some("pub");
    if preceded || is_visibility || !goes_on(at + 1) {
        return at + 1;
    }
    let mut path = vec![first.to_string()];
    let mut end = at + 1;
    while goes_on(end) {
        path.extend(tokens[end + 1].word().map(String::from));
        end += 2;
    }
    if is_local(&path, &found.modules) {
        found.references.push(Reference {
            line: tokens[at].line,
            path,
            inside: inside.to_vec(),
            exported_as: None,
        });
    }
    end
}

fn is_local(path: &[String], modules: &[String]) -> bool {
    path.first()
        .is_some_and(|first| matches!(first.as_str(), "crate" | "super" | "self") || modules.contains(first))
}

/// Leaves out every item that `#[cfg(test)]` stands before.
fn without_tests(tokens: &[Token]) -> Vec<Token> {
    let mut kept = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        if is_test_attribute(&tokens[at..]) {
            at = after_item(tokens, at + 7);
        } else {
            kept.push(tokens[at].clone());
            at += 1;
        }
    }
    kept
}

/// Whether `#[cfg(test)]`, seven tokens, begins here.
fn is_test_attribute(tokens: &[Token]) -> bool {
    tokens.len() >= 7
        && tokens[0].is('#')
        && tokens[1].is('[')
        && tokens[2].word() == Some("cfg")
        && tokens[3].is('(')
        && tokens[4].word() == Some("test")
        && tokens[5].is(')')
        && tokens[6].is(']')
}

/// The place after the item that begins at `at`: after its `;`, or after its braces.
fn after_item(tokens: &[Token], mut at: usize) -> usize {
    let mut depth = 0;
    while at < tokens.len() {
        match tokens[at].kind {
            Kind::Mark('{') => depth += 1,
            Kind::Mark('}') if depth == 1 => return at + 1,
            Kind::Mark('}') => depth -= 1,
            Kind::Mark(';') if depth == 0 => return at + 1,
            _ => {}
        }
        at += 1;
    }
    at
}

/// Cuts code into tokens; comments are left out. GLSL is cut by the same rules.
fn tokens(code: &str) -> Vec<Token> {
    let mut cutter = Cutter { text: code.chars().collect(), at: 0, line: 1, tokens: Vec::new() };
    while cutter.at < cutter.text.len() {
        cutter.step();
    }
    cutter.tokens
}

/// The words of GLSL code, comments left out, and their lines.
pub fn words(code: &str) -> Vec<(usize, String)> {
    let of = |token: Token| match token.kind {
        Kind::Word(word) => Some((token.line, word)),
        _ => None,
    };
    tokens(code).into_iter().filter_map(of).collect()
}

struct Cutter {
    text: Vec<char>,
    at: usize,
    line: usize,
    tokens: Vec<Token>,
}

impl Cutter {
    fn peek(&self, ahead: usize) -> char {
        self.text.get(self.at + ahead).copied().unwrap_or('\0')
    }

    fn advance(&mut self) {
        if self.peek(0) == '\n' {
            self.line += 1;
        }
        self.at += 1;
    }

    fn push(&mut self, line: usize, kind: Kind) {
        self.tokens.push(Token { line, kind });
    }

    fn step(&mut self) {
        let line = self.line;
        match (self.peek(0), self.peek(1)) {
            ('/', '/') => {
                while self.at < self.text.len() && self.peek(0) != '\n' {
                    self.advance();
                }
            }
            ('/', '*') => self.block_comment(),
            ('"', _) => self.string(line),
            ('\'', _) => self.quote(),
            (':', ':') => {
                self.at += 2;
                self.push(line, Kind::PathSeparator);
            }
            (c, _) if c.is_alphanumeric() || c == '_' => self.word(line),
            (c, _) => {
                if !c.is_whitespace() {
                    self.push(line, Kind::Mark(c));
                }
                self.advance();
            }
        }
    }

    fn block_comment(&mut self) {
        let mut depth = 0;
        while self.at < self.text.len() {
            match (self.peek(0), self.peek(1)) {
                ('/', '*') => {
                    depth += 1;
                    self.at += 2;
                }
                ('*', '/') => {
                    depth -= 1;
                    self.at += 2;
                    if depth == 0 {
                        return;
                    }
                }
                _ => self.advance(),
            }
        }
    }

    fn string(&mut self, line: usize) {
        self.advance();
        let mut text = String::new();
        while self.at < self.text.len() && self.peek(0) != '"' {
            if self.peek(0) == '\\' {
                self.advance();
            }
            text.push(self.peek(0));
            self.advance();
        }
        self.advance();
        self.push(line, Kind::Literal(text));
    }

    /// A character, or the mark of a lifetime.
    fn quote(&mut self) {
        self.advance();
        if self.peek(0) == '\\' {
            self.at += 2;
            while self.at < self.text.len() && self.peek(0) != '\'' {
                self.advance();
            }
            self.advance();
        } else if self.peek(1) == '\'' {
            self.advance();
            self.advance();
        }
    }

    fn word(&mut self, line: usize) {
        let start = self.at;
        while self.peek(0).is_alphanumeric() || self.peek(0) == '_' {
            self.at += 1;
        }
        let word: String = self.text[start..self.at].iter().collect();
        let hashes = (0..).take_while(|&i| self.peek(i) == '#').count();
        if matches!(word.as_str(), "r" | "br") && self.peek(hashes) == '"' {
            self.raw_string(line, hashes);
        } else if word != "b" || self.peek(0) != '"' {
            self.push(line, Kind::Word(word));
        }
    }

    fn raw_string(&mut self, line: usize, hashes: usize) {
        self.at += hashes + 1;
        let mut text = String::new();
        let ends = |c: &Cutter| c.peek(0) == '"' && (1..=hashes).all(|i| c.peek(i) == '#');
        while self.at < self.text.len() && !ends(self) {
            text.push(self.peek(0));
            self.advance();
        }
        self.at += hashes + 1;
        self.push(line, Kind::Literal(text));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(code: &str) -> Vec<String> {
        scan(code).references.iter().map(|r| format!("{}:{}", r.line, r.path.join("::"))).collect()
    }

    #[test]
    fn groups_within_groups_are_read() {
        let code = "use crate::{\n    a,\n    b::{self, c::{D, E as F}},\n    g::*,\n};\nuse std::fmt;\n";
        assert_eq!(
            paths(code),
            ["2:crate::a", "3:crate::b", "3:crate::b::c::D", "3:crate::b::c::E", "4:crate::g"]
        );
    }

    #[test]
    fn paths_in_code_are_read() {
        let code = "mod child;\nfn f() -> super::Thing { crate::a::b(self::c::D, child::E, other::F, std::crate_name) }";
        assert_eq!(paths(code), ["2:super::Thing", "2:crate::a::b", "2:self::c::D", "2:child::E"]);
    }

    #[test]
    fn comments_literals_and_lifetimes_hide_nothing_and_add_nothing() {
        let code = "// crate::no\n/* crate::no /* nested */ crate::no */\nconst A: &str = \"crate::no \\\" \";\n\
                    const B: &str = r#\"crate::no \" \"#;\nfn f<'a>(x: &'a str, q: char) -> bool { q == '\"' && crate::yes::x(x) }";
        assert_eq!(paths(code), ["5:crate::yes::x"]);
        let literals: Vec<_> = scan(code).literals;
        assert_eq!(literals, [(3, "crate::no \" ".to_string()), (4, "crate::no \" ".to_string())]);
    }

    #[test]
    fn tests_may_use_anything() {
        let code = "use crate::a;\n#[cfg(test)]\nmod tests {\n    use crate::{b, c};\n    fn f() { crate::d::e() }\n}\nuse crate::f;\n\
                    #[cfg(test)]\nuse crate::g;\nuse crate::h;";
        assert_eq!(paths(code), ["1:crate::a", "7:crate::f", "10:crate::h"]);
    }

    #[test]
    fn exports_and_blocks_are_told() {
        let code = "pub use crate::a::B;\npub(crate) use crate::a::C as D;\nmod m { use super::e; }\nuse crate::f;\npub(in crate::g) fn h() {}";
        let found = scan(code).references;
        let exported: Vec<_> = found.iter().map(|r| r.exported_as.as_deref()).collect();
        assert_eq!(exported, [Some("B"), Some("D"), None, None]);
        assert_eq!(found[2].inside, ["m"]);
        assert!(found[3].inside.is_empty());
    }

    #[test]
    fn precise_capturing_is_no_import() {
        assert_eq!(paths("fn f<'a>() -> impl Fn() + use<'a> { crate::a::b }"), ["1:crate::a::b"]);
    }
}
