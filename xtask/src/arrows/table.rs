//! Which way imports run, and why.

/// All rules of a tree.
#[derive(Clone, Copy, Debug)]
pub struct Table {
    /// Crates, from the lowest to the highest.
    pub crates: &'static [Crate],
    /// Rules between the folders of a crate.
    pub folders: &'static [Folders],
    /// Where no technique is named.
    pub names: Names,
}

/// A crate and those that it may use.
#[derive(Clone, Copy, Debug)]
pub struct Crate {
    /// Its folder from the root of the tree; a last part `*` stands for every folder there.
    pub folder: &'static str,
    /// Folders of the crates that it may use; with each come those which that one may use.
    pub may_use: &'static [&'static str],
    /// Why.
    pub reason: &'static str,
}

/// The rule between the folders of one crate, to a depth of two.
#[derive(Clone, Copy, Debug)]
pub struct Folders {
    /// The crate's folder from the root of the tree.
    pub crate_folder: &'static str,
    /// What a folder may use. Whatever it is, folders never use each other in a circle.
    pub rule: Rule,
    /// Why.
    pub reason: &'static str,
}

/// What a folder of a crate may use.
#[derive(Clone, Copy, Debug)]
pub enum Rule {
    /// Layers from the lowest to the highest: a folder uses its own layer and those before. A folder in no layer is free.
    Layers(&'static [&'static [&'static str]]),
    /// The folders that it lies in, and these; not its neighbours.
    Parents(&'static [&'static str]),
}

/// Where no technique is named, by its id.
#[derive(Clone, Copy, Debug)]
pub struct Names {
    /// Folders in whose Rust literals, `variants.txt` and GLSL no technique is named.
    pub silent: &'static [&'static str],
    /// The folder of the techniques: a folder in it whose `mod.rs` defines `pub static TECHNIQUE` is one.
    pub techniques: &'static str,
    /// Ids that are words of the field as well: of these only a name of a shader or a pass (`ID/…`) is held.
    pub plain_words: &'static [&'static str],
}

/// The tree's own rules.
pub static TABLE: Table = Table {
    crates: &[
        Crate {
            folder: "crates/gpu",
            may_use: &[],
            reason: "Vulkan alone: the only unsafe code knows nothing above it",
        },
        Crate {
            folder: "crates/shader",
            may_use: &[],
            reason: "build scripts use it before anything else is built",
        },
        Crate {
            folder: "crates/roles",
            may_use: &[],
            reason: "what passes and buffers are for is a list of words: a record that is read needs no device",
        },
        Crate {
            folder: "crates/params",
            may_use: &[],
            reason: "a declaration of parameters serves programs that record nothing",
        },
        Crate {
            folder: "crates/graph",
            may_use: &["crates/gpu", "crates/shader", "crates/roles"],
            reason: "a plan knows passes and resources and carries their roles; it knows no scene",
        },
        Crate {
            folder: "crates/scene",
            may_use: &[],
            reason: "a scene is data; it is loaded without a device",
        },
        Crate {
            folder: "crates/oracle",
            may_use: &["crates/scene"],
            reason: "a twin on the CPU sees nothing that it checks",
        },
        Crate { folder: "crates/image", may_use: &[], reason: "files and comparisons of pixels" },
        Crate {
            folder: "crates/measure",
            may_use: &["crates/roles"],
            reason: "a record is data that other programs read",
        },
        Crate {
            folder: "crates/report",
            may_use: &["crates/measure", "crates/image"],
            reason: "a report is made from records, without a device",
        },
        Crate {
            folder: "crates/testkit",
            may_use: &["crates/gpu", "crates/image"],
            reason: "tests alone use it, as a dev-dependency",
        },
        Crate { folder: "crates/cost", may_use: &[], reason: "the cost model is arithmetic" },
        Crate {
            folder: "crates/frame",
            may_use: &["crates/graph", "crates/scene", "crates/cost", "crates/params"],
            reason: "what a technique is given; it knows no stage and no technique",
        },
        Crate {
            folder: "crates/stages",
            may_use: &["crates/frame"],
            reason: "a stage never knows who uses it",
        },
        Crate {
            folder: "crates/renderer",
            may_use: &["crates/stages"],
            reason: "it is handed a technique and a set of shaders, and never names one",
        },
        Crate {
            folder: "crates/techniques",
            may_use: &["crates/stages"],
            reason: "a technique is made of stages; it does not run itself",
        },
        Crate {
            folder: "crates/predict",
            may_use: &["crates/techniques", "crates/frame", "crates/cost", "crates/measure"],
            reason: "it reads facts and records, and opens no device",
        },
        Crate {
            folder: "crates/lab",
            may_use: &[
                "crates/predict",
                "crates/renderer",
                "crates/techniques",
                "crates/measure",
                "crates/image",
                "crates/oracle",
            ],
            reason: "trials and comparisons, also with rays in f64, for a command line, a viewer or another language",
        },
        Crate {
            folder: "crates/experiments",
            may_use: &["crates/lab", "crates/report"],
            reason: "an experiment is a library that any program can fill and run",
        },
        Crate { folder: "apps/*", may_use: &["crates/experiments"], reason: "a program parses and prints" },
        Crate {
            folder: "bindings/*",
            may_use: &["crates/experiments"],
            reason: "a program in another language",
        },
        Crate {
            folder: "examples/*",
            may_use: &["crates/renderer", "crates/techniques", "crates/image"],
            reason: "what another repository would write",
        },
        Crate { folder: "xtask", may_use: &[], reason: "chores are built in seconds" },
    ],
    folders: &[
        Folders {
            crate_folder: "crates/frame",
            rule: Rule::Layers(&[]),
            reason: "what a frame is can be read from the bottom up",
        },
        Folders {
            crate_folder: "crates/stages",
            rule: Rule::Layers(&[
                &["shared/sort", "shared/cull"],
                &["lights"],
                &["surfaces"],
                &["views"],
                &["shared"],
                &["compose"],
            ]),
            reason: "a sort knows keys alone, a choice of draws their bounds; lights are listed for places, whatever stands there; surfaces are shaded by the lights; views show both; \
                     shared work draws surfaces; what a frame ends in comes last",
        },
        Folders { crate_folder: "crates/renderer", rule: Rule::Layers(&[]), reason: "no circles" },
        Folders {
            crate_folder: "crates/techniques",
            rule: Rule::Layers(&[]),
            reason: "a technique may build on another one, which then knows nothing of it",
        },
        Folders { crate_folder: "crates/lab", rule: Rule::Layers(&[]), reason: "no circles" },
        Folders {
            crate_folder: "crates/experiments",
            rule: Rule::Parents(&["kit", "dais"]),
            reason: "an experiment is a folder over the shared kit; four experiments of one paper share `dais`, which is none itself",
        },
    ],
    names: Names {
        silent: &[
            "crates/gpu/src",
            "crates/graph/src",
            "crates/shader/src",
            "crates/shader/include",
            "crates/frame/src",
            "crates/stages/src",
            "crates/renderer/src",
        ],
        techniques: "crates/techniques/src",
        plain_words: &["forward", "deferred", "tiled", "clustered", "visibility", "hybrid"],
    },
};

impl Table {
    /// The rule of the crate in a folder.
    pub fn of(&self, folder: &str) -> Option<&'static Crate> {
        self.crates.iter().find(|c| matches(c.folder, folder))
    }

    /// Whether the crate in `from` may use the one in `to`, at once or through others.
    pub fn allows(&self, from: &Crate, to: &str) -> bool {
        from.may_use
            .iter()
            .any(|next| matches(next, to) || self.of(next).is_some_and(|next| self.allows(next, to)))
    }
}

fn matches(pattern: &str, folder: &str) -> bool {
    match pattern.strip_suffix("/*") {
        None => pattern == folder,
        Some(parent) => {
            folder.strip_prefix(parent).is_some_and(|rest| rest.starts_with('/') && !rest[1..].contains('/'))
        }
    }
}
