//! The memoization cache of `dais`: one bucket of `dais/memoize.glsl`.

use crate::explorer::{Explored, Next, Protocol, Registers, Step, explore};

/// Of `memoize.glsl`, what [`Cache`] is a model of.
const MODELLED: &str = "\
// Puts a triangle first in a bucket that this fragment has locked: the older entry leaves it, the newer becomes the older.
void replace_entries(uint bucket, uvec2 newer, uvec2 newest) {
    memoryBarrierBuffer();  // who sees an entry of these sees that the version is odd
    cache_entries[bucket * 2u + 1u] = newer;
    cache_entries[bucket * 2u] = newest;
    memoryBarrierBuffer();  // who sees the next version sees these entries
}

uint memoized(uint id) {
    uint bucket = bucket_of(id);
    for (uint poll = 0u; poll < POLLS; ++poll) {
        uint version = cache_versions[bucket];
        if ((version & 1u) != 0u) {
            continue;
        }
        memoryBarrierBuffer();  // the entries are read after the version
        uvec2 newer = cache_entries[bucket * 2u], older = cache_entries[bucket * 2u + 1u];
        memoryBarrierBuffer();  // the version is read again after the entries
        if (newer.x == id + 1u || older.x == id + 1u) {
            if (cache_versions[bucket] == version) {
                return newer.x == id + 1u ? newer.y : older.y;
            }
        } else if (atomicCompSwap(cache_versions[bucket], version, version + 1u) == version) {
            uint place = store_triangle(id);
            replace_entries(bucket, newer, uvec2(id + 1u, place));
            atomicExchange(cache_versions[bucket], version + 2u);
            return place;
        }
    }
    return store_triangle(id);
}
";

/// The model and the shader are one.
#[test]
fn the_model_is_of_the_shader() {
    let shader = std::fs::read_to_string(crate::common::source("dais/memoize.glsl")).expect("a shader");
    assert!(shader.contains(MODELLED), "memoize.glsl has changed: change its model, then the text here");
}

/// Turns of the loop: enough that a fragment which has lost one can win the next.
const POLLS: u32 = 2;

// Words. An entry is an ID plus one and a place; triangles that are stored follow, an ID plus one each.
const VERSION: usize = 0;
const NEWER: usize = 1;
const OLDER: usize = 3;
const STORED_COUNT: usize = 5;
const STORED: usize = 6;
const STORED_MAX: usize = 10;

// Registers.
const R_VERSION: usize = 0;
const R_NEWER: usize = 1; // and the place after it
const R_OLDER: usize = 3;
const R_AGAIN: usize = 5;
const R_PLACE: usize = 6;
const R_POLL: usize = 7;

/// What a mutant does otherwise.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Change {
    None,
    /// Takes an entry that it finds without looking at the version again.
    Unchecked,
    /// No barrier between reading the entries and reading the version again.
    NoBarrierAfterEntries,
    /// No barrier between reading the version and reading the entries.
    NoBarrierBeforeEntries,
    /// No barrier between writing the entries and letting go.
    NoBarrierBeforeRelease,
    /// Lets go by the version that there was: a lock alone.
    SameVersion,
    /// Reads while the version is odd.
    ReadsWhileLocked,
}

struct Cache {
    change: Change,
    /// Triangles that are to be stored in all; `None` where the order decides.
    stored: Option<u32>,
}

// Groups of steps, see `Cache::group`.
const READ_VERSION: u32 = 0;
const READ_ENTRIES: u32 = 1;
const READ_AGAIN: u32 = 2;
const LOCK: u32 = 3;
const TAKE: u32 = 4;
const REPLACE: u32 = 5;
const RELEASE: u32 = 6;
const TAKE_UNCACHED: u32 = 7;
const STORE: u32 = 8;
const STORE_UNCACHED: u32 = 9;

fn loads(regs: [usize; 2], words: [usize; 2]) -> [Step; 4] {
    let load = |reg, word| Step::Load { reg, word };
    [
        load(regs[0], words[0]),
        load(regs[0] + 1, words[0] + 1),
        load(regs[1], words[1]),
        load(regs[1] + 1, words[1] + 1),
    ]
}

fn stores(word: usize, id_plus_one: u32, place: u32) -> [Step; 2] {
    [Step::Store { word, value: id_plus_one }, Step::Store { word: word + 1, value: place }]
}

impl Cache {
    fn poll_again(regs: &mut Registers) -> Next {
        let polls = regs[R_POLL];
        // What was read is not looked at again: without it, states that differ by it alone are one.
        *regs = Registers::default();
        regs[R_POLL] = polls + 1;
        Next::Group(if regs[R_POLL] < POLLS { READ_VERSION } else { TAKE_UNCACHED })
    }

    /// The place of an ID among the entries that were read.
    fn found(regs: &Registers, id: u32) -> Option<u32> {
        [R_NEWER, R_OLDER].into_iter().find(|entry| regs[*entry] == id + 1).map(|entry| regs[entry + 1])
    }
}

impl Protocol for Cache {
    fn words(&self) -> usize {
        STORED + STORED_MAX
    }

    fn group(&self, group: u32, regs: &Registers, id: u32) -> Vec<Step> {
        let read_version = Step::Load { reg: R_VERSION, word: VERSION };
        let read_again = Step::Load { reg: R_AGAIN, word: VERSION };
        let read_entries = loads([R_NEWER, R_OLDER], [NEWER, OLDER]);
        let replace =
            [stores(OLDER, regs[R_NEWER], regs[R_NEWER + 1]), stores(NEWER, id + 1, regs[R_PLACE])].concat();
        let next_version = regs[R_VERSION] + if self.change == Change::SameVersion { 0 } else { 2 };
        let release = Step::Store { word: VERSION, value: next_version };
        match (group, self.change) {
            (READ_VERSION, Change::NoBarrierBeforeEntries) => [&[read_version], &read_entries[..]].concat(),
            (READ_VERSION, _) => vec![read_version],
            (READ_ENTRIES, Change::NoBarrierAfterEntries) => [&[read_again], &read_entries[..]].concat(),
            (READ_ENTRIES, _) => read_entries.to_vec(),
            (READ_AGAIN, _) => vec![read_again],
            (LOCK, _) => vec![Step::CompareSwap {
                reg: R_AGAIN,
                word: VERSION,
                expected: regs[R_VERSION],
                value: regs[R_VERSION] + 1,
            }],
            (REPLACE, Change::NoBarrierBeforeRelease) => [replace, vec![release]].concat(),
            (REPLACE, _) => replace,
            (RELEASE, _) => vec![release],
            (TAKE | TAKE_UNCACHED, _) => vec![Step::Add { reg: R_PLACE, word: STORED_COUNT, value: 1 }],
            // STORE, STORE_UNCACHED
            _ => vec![Step::Store { word: STORED + regs[R_PLACE] as usize, value: id + 1 }],
        }
    }

    fn after(&self, group: u32, regs: &mut Registers, id: u32) -> Next {
        match group {
            READ_VERSION if regs[R_VERSION] & 1 != 0 && self.change != Change::ReadsWhileLocked => {
                Self::poll_again(regs)
            }
            READ_VERSION if self.change != Change::NoBarrierBeforeEntries => Next::Group(READ_ENTRIES),
            READ_VERSION | READ_ENTRIES => match Self::found(regs, id) {
                Some(place) if self.change == Change::Unchecked => Next::Result(place),
                Some(_) if self.change == Change::NoBarrierAfterEntries => self.after(READ_AGAIN, regs, id),
                Some(_) => Next::Group(READ_AGAIN),
                None => Next::Group(LOCK),
            },
            READ_AGAIN if regs[R_AGAIN] == regs[R_VERSION] => {
                Next::Result(Self::found(regs, id).expect("found before"))
            }
            LOCK if regs[R_AGAIN] == regs[R_VERSION] => Next::Group(TAKE),
            READ_AGAIN | LOCK => Self::poll_again(regs),
            TAKE => Next::Group(STORE),
            TAKE_UNCACHED => Next::Group(STORE_UNCACHED),
            REPLACE if self.change != Change::NoBarrierBeforeRelease => Next::Group(RELEASE),
            REPLACE | RELEASE => Next::Result(regs[R_PLACE]),
            STORE => Next::Group(REPLACE),
            _ => Next::Result(regs[R_PLACE]),
        }
    }

    fn check(&self, memory: &[u32], id: u32, place: u32) -> Result<(), String> {
        check_place(memory, id, place)
    }

    fn check_end(&self, memory: &[u32], _: &[Vec<u32>]) -> Result<(), String> {
        let stored = memory[STORED_COUNT];
        if memory[VERSION] & 1 != 0 {
            return Err("the bucket is still locked".to_owned());
        }
        match self.stored {
            Some(expected) if stored != expected => Err(format!("{stored} stored, {expected} expected")),
            _ => Ok(()),
        }
    }
}

/// Whether a place holds the triangle.
fn check_place(memory: &[u32], id: u32, place: u32) -> Result<(), String> {
    match memory[STORED + place as usize] {
        stored if stored == id + 1 => Ok(()),
        stored => Err(format!("triangle {id} was sent to place {place}, where {} stands", stored as i32 - 1)),
    }
}

/// What fragments of two or three threads ask for, by triangle IDs: triangles that leave the bucket and come back, those that
/// two ask for at once, more threads than entries.
const ASKED: &[&[&[u32]]] = &[
    &[&[1], &[1]],
    &[&[1], &[2, 3, 1]],
    &[&[1, 1], &[2, 3, 1]],
    &[&[1, 2, 3], &[3, 1, 2]],
    &[&[1], &[1], &[1]],
    &[&[1], &[2], &[3]],
];

fn every_order(protocol: &dyn Protocol) -> Result<Explored, String> {
    let mut all = Explored { states: 0, ends: 0 };
    for asked in ASKED {
        let explored = explore(protocol, asked)?;
        println!("{asked:?}: {explored:?}");
        all.states += explored.states;
        all.ends += explored.ends;
    }
    Ok(all)
}

/// In every order of every step, a fragment is sent to a place that holds its own triangle, and lets go of the bucket.
#[test]
fn a_place_is_the_triangles_own_in_every_order() {
    let explored =
        every_order(&Cache { change: Change::None, stored: None }).unwrap_or_else(|e| panic!("{e}"));
    assert!(explored.states > 100_000, "{explored:?}: too few to say much");
}

/// Without one of its barriers, without the version, or without looking at it, some order sends a fragment elsewhere.
#[test]
fn every_part_of_the_protocol_is_needed() {
    for change in [
        Change::Unchecked,
        Change::NoBarrierAfterEntries,
        Change::NoBarrierBeforeEntries,
        Change::NoBarrierBeforeRelease,
        Change::SameVersion,
        Change::ReadsWhileLocked,
    ] {
        match every_order(&Cache { change, stored: None }) {
            Ok(explored) => panic!("{change:?} holds in every order: {explored:?}"),
            Err(found) => println!("{change:?}: {found}"),
        }
    }
}

/// The protocol that there was: a lock for who writes; who reads compares the ID before and after it reads the place.
struct ComparedIds;

// Groups of ComparedIds: a look-up of three reads an entry, two of them, then the lock, the same look-up, the replacement.
const UNLOCKED: u32 = 0;
const LOCKED: u32 = 20;

impl ComparedIds {
    /// Steps of a look-up: the ID of an entry, its place, its ID again.
    fn look_up(step: u32) -> Step {
        let entry = [NEWER, OLDER][(step / 3) as usize];
        match step % 3 {
            0 => Step::Load { reg: R_NEWER, word: entry },
            1 => Step::Load { reg: R_PLACE, word: entry + 1 },
            _ => Step::Load { reg: R_AGAIN, word: entry },
        }
    }
}

impl Protocol for ComparedIds {
    fn words(&self) -> usize {
        STORED + STORED_MAX
    }

    fn group(&self, group: u32, regs: &Registers, id: u32) -> Vec<Step> {
        let store = |word, value| Step::Store { word, value };
        vec![match group {
            0..6 => Self::look_up(group),
            6 => Step::CompareSwap { reg: R_AGAIN, word: VERSION, expected: 0, value: 1 },
            20..26 => Self::look_up(group - LOCKED),
            26 | 50 => Step::Add { reg: R_PLACE, word: STORED_COUNT, value: 1 },
            27 | 51 => store(STORED + regs[R_PLACE] as usize, id + 1),
            28 => Step::Load { reg: R_OLDER, word: NEWER },
            29 => Step::Load { reg: R_OLDER + 1, word: NEWER + 1 },
            30 => store(OLDER, 0),
            31 => store(OLDER + 1, regs[R_OLDER + 1]),
            32 => store(OLDER, regs[R_OLDER]),
            33 => store(NEWER, 0),
            34 => store(NEWER + 1, regs[R_PLACE]),
            35 => store(NEWER, id + 1),
            _ => store(VERSION, 0),
        }]
    }

    fn after(&self, group: u32, regs: &mut Registers, id: u32) -> Next {
        let look_up = group % LOCKED;
        match group {
            0..6 | 20..26 if look_up % 3 == 0 && regs[R_NEWER] != id + 1 => {
                Next::Group(if look_up < 3 { group + 3 } else { group - look_up + 6 })
            }
            2 | 5 if regs[R_AGAIN] == id + 1 => Next::Result(regs[R_PLACE]),
            22 | 25 if regs[R_AGAIN] == id + 1 => Next::Group(36),
            6 if regs[R_AGAIN] == 0 => Next::Group(LOCKED),
            6 => {
                regs[R_POLL] += 1;
                Next::Group(if regs[R_POLL] < POLLS { UNLOCKED } else { 50 })
            }
            36 | 51 => Next::Result(regs[R_PLACE]),
            _ => Next::Group(group + 1),
        }
    }

    fn check(&self, memory: &[u32], id: u32, place: u32) -> Result<(), String> {
        check_place(memory, id, place)
    }

    fn check_end(&self, _: &[u32], _: &[Vec<u32>]) -> Result<(), String> {
        Ok(())
    }
}

/// A triangle that leaves the bucket and comes back while its place is read is taken for the one that never left.
#[test]
fn compared_ids_are_caught() {
    // What none leaves is right.
    explore(&ComparedIds, &[&[1, 2], &[1, 2]]).unwrap_or_else(|e| panic!("{e}"));
    let found = every_order(&ComparedIds).expect_err("it holds in every order");
    println!("{found}");
}

/// Alone, a thread stores a triangle once as long as it is among the bucket's two.
#[test]
fn what_is_cached_is_not_stored_again() {
    for (asked, stored) in [(&[1, 1, 1][..], 1), (&[1, 2, 1, 2, 2], 2), (&[1, 2, 3, 1], 4)] {
        let cache = Cache { change: Change::None, stored: Some(stored) };
        explore(&cache, &[asked]).unwrap_or_else(|e| panic!("{asked:?}: {e}"));
    }
}
