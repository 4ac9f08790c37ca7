//! Lists that fragments append to, and words that they share: nothing is lost, nothing is twice, in any order.

use crate::explorer::{Next, Protocol, Registers, Step, explore};

/// Asserts that a shader has the text that a model is of.
pub(crate) fn is_of(shader: &str, modelled: &str) {
    let text = std::fs::read_to_string(crate::common::source(shader)).expect("a shader");
    assert!(text.contains(modelled), "{shader} has changed: change its model, then the text in its test");
}

/// Whether a protocol of so many threads, each asked for its own number from 1, holds in every order.
fn every_order(protocol: &dyn Protocol, asked: &[&[u32]]) -> Result<(), String> {
    let explored = explore(protocol, asked)?;
    println!("{asked:?}: {explored:?}");
    Ok(())
}

const THREADS: &[&[u32]] = &[&[1], &[2], &[3]];

// Words of a list: its head, the number of nodes, nodes of an entry and a link each.
const HEAD: usize = 0;
const COUNT: usize = 1;
const NODES: usize = 2;
const NODES_MAX: usize = 4;
/// A head or a link that is an entry itself, not a node's number plus one.
const ENTRY: u32 = 0x100;

/// A list of one pixel: `atomicExchange` of its head.
struct List {
    /// Whether the first entry stands in the head itself (`dais-list`).
    alone_in_head: bool,
    /// Nodes that there is room for.
    capacity: u32,
    /// A mutant: the head is read and written, not exchanged.
    torn: bool,
    /// A mutant: whether the head is free is looked at, not exchanged.
    looked_at: bool,
}

const RIGHT: List = List { alone_in_head: false, capacity: NODES_MAX as u32, torn: false, looked_at: false };

impl List {
    fn entries(&self, memory: &[u32]) -> Vec<u32> {
        let mut entries = Vec::new();
        let mut link = memory[HEAD];
        while link != 0 && entries.len() <= NODES_MAX {
            if link & ENTRY != 0 {
                entries.push(link & !ENTRY);
                break;
            }
            let node = NODES + 2 * (link as usize - 1);
            entries.push(memory[node] & !ENTRY);
            link = memory[node + 1];
        }
        entries.sort_unstable();
        entries
    }
}

impl Protocol for List {
    fn start(&self) -> Vec<u32> {
        vec![0; NODES + 2 * NODES_MAX]
    }

    fn group(&self, group: u32, regs: &Registers, asked: u32) -> Vec<Step> {
        let (node, entry) = (NODES + 2 * regs[1] as usize, ENTRY | asked);
        let link = regs[1] + 1;
        match group {
            0 if !self.alone_in_head => vec![Step::Add { reg: 1, word: COUNT, value: 1 }],
            0 if self.looked_at => vec![Step::Load { reg: 0, word: HEAD }],
            0 => vec![Step::CompareSwap { reg: 0, word: HEAD, expected: 0, value: entry }],
            1 => vec![Step::Add { reg: 1, word: COUNT, value: 1 }],
            2 if self.torn => vec![Step::Load { reg: 2, word: HEAD }],
            2 => vec![Step::Exchange { reg: 2, word: HEAD, value: link }],
            3 => vec![Step::Store { word: HEAD, value: link }],
            5 => vec![Step::Store { word: HEAD, value: entry }],
            _ => {
                vec![Step::Store { word: node, value: entry }, Step::Store { word: node + 1, value: regs[2] }]
            }
        }
    }

    fn after(&self, group: u32, regs: &mut Registers, _: u32) -> Next {
        let taken = || if regs[1] < self.capacity { Next::Group(2) } else { Next::Result(0) };
        match group {
            0 if !self.alone_in_head => taken(),
            0 if self.looked_at && regs[0] == 0 => Next::Group(5),
            0 if regs[0] == 0 => Next::Result(1),
            0 => Next::Group(1),
            1 => taken(),
            2 if self.torn => Next::Group(3),
            2 | 3 => Next::Group(4),
            _ => Next::Result(1),
        }
    }

    fn check(&self, _: &[u32], _: u32, _: u32) -> Result<(), String> {
        Ok(())
    }

    /// The list has, once each, the entries of the threads that found room, and room is used up before any finds none.
    fn check_end(&self, memory: &[u32], results: &[Vec<u32>]) -> Result<(), String> {
        let found_room = (1..).zip(results).filter(|(_, result)| result[0] == 1).map(|(thread, _)| thread);
        let expected: Vec<u32> = found_room.collect();
        let room = self.capacity as usize + usize::from(self.alone_in_head);
        let entries = self.entries(memory);
        if entries != expected || expected.len() != results.len().min(room) {
            return Err(format!("{entries:?} listed, {expected:?} expected, room for {room}"));
        }
        Ok(())
    }
}

#[test]
fn light_lists_hold_every_light_once() {
    is_of(
        "lights/pixel_lists/append.frag.glsl",
        "\
    if (node < NODE_CAPACITY) {
        light_nodes[node] = uvec2(light_index, atomicExchange(light_heads[pixel].link, node + 1u));
        return;
    }",
    );
    for capacity in [0, 1, 3] {
        every_order(&List { capacity, ..RIGHT }, THREADS).unwrap_or_else(|e| panic!("{e}"));
    }
    let torn = List { torn: true, ..RIGHT };
    println!("torn: {}", every_order(&torn, THREADS).expect_err("a head that is not exchanged holds"));
}

#[test]
fn blocks_of_a_gbuffer_list_are_linked_once() {
    is_of(
        "gbuffer_list/fill.frag.glsl",
        "\
            uint next = atomicExchange(blocks[pointer_word(head)], pack_pointer(block, own));
            blocks[pointer_word(block)] = next;
",
    );
    // The pixel's own block is written by the fragment with sample 0 alone; what links others is the list above.
    every_order(&RIGHT, THREADS).unwrap_or_else(|e| panic!("{e}"));
}

#[test]
fn lists_of_triangles_hold_every_triangle_once() {
    is_of(
        "dais_list/fill.frag.glsl",
        "\
    if (atomicCompSwap(heads[pixel], 0u, entry) == 0u) {
        return;
    }
    uint node = atomicAdd(nodes_needed, 1u);
    if (node < NODE_CAPACITY) {
        nodes[node] = uvec2(entry, atomicExchange(heads[pixel], node + 1u));
        return;
    }
",
    );
    for capacity in [0, 1, 2, 3] {
        let list = List { alone_in_head: true, capacity, ..RIGHT };
        every_order(&list, THREADS).unwrap_or_else(|e| panic!("{e}"));
    }
    for mutant in [
        List { alone_in_head: true, torn: true, ..RIGHT },
        List { alone_in_head: true, looked_at: true, ..RIGHT },
    ] {
        println!("{}", every_order(&mutant, THREADS).expect_err("a mutant holds in every order"));
    }
}

/// A word whose bits threads set: samples that fragments claim, triangles that show. What a thread is asked for are its bits.
struct Bits {
    /// Whether who finds its bits set leaves them (marks).
    looks_first: bool,
    /// Whether each bit belongs to one thread (claims).
    claimed: bool,
    /// All bits that threads ask for.
    all: u32,
    /// A mutant: the word is read and written.
    torn: bool,
}

/// Whether a word has bits that were set: it only ever gains some.
fn kept(word: u32, bits: u32) -> Result<(), String> {
    if word & bits == bits { Ok(()) } else { Err(format!("of {bits:b} some are lost: {word:b}")) }
}

impl Protocol for Bits {
    fn start(&self) -> Vec<u32> {
        vec![0; 1]
    }

    fn group(&self, group: u32, regs: &Registers, asked: u32) -> Vec<Step> {
        match group {
            0 if self.looks_first || self.torn => vec![Step::Load { reg: 0, word: 0 }],
            0 | 1 if !self.torn => vec![Step::Or { reg: 0, word: 0, value: asked }],
            _ => vec![Step::Store { word: 0, value: regs[0] | asked }],
        }
    }

    fn after(&self, group: u32, regs: &mut Registers, asked: u32) -> Next {
        match group {
            0 if self.looks_first && regs[0] & asked == asked => Next::Result(0),
            0 if self.looks_first || self.torn => Next::Group(1),
            _ => Next::Result(asked & !regs[0]),
        }
    }

    fn check(&self, memory: &[u32], asked: u32, _: u32) -> Result<(), String> {
        kept(memory[0], asked)
    }

    fn check_end(&self, memory: &[u32], results: &[Vec<u32>]) -> Result<(), String> {
        kept(memory[0], self.all)?;
        let all: Vec<u32> = results.iter().flatten().copied().collect();
        let (sum, union) = (all.iter().sum::<u32>(), all.iter().fold(0, |union, bits| union | bits));
        if self.claimed && sum != union {
            return Err(format!("{all:?} claimed of {:b}", memory[0]));
        }
        Ok(())
    }
}

#[test]
fn a_sample_is_claimed_by_one_fragment() {
    is_of(
        "surfaces/claims/claims.glsl",
        "return samples & ~(atomicOr(sample_claims[pixel / a_word], samples << shift) >> shift);",
    );
    let claims = Bits { looks_first: false, claimed: true, all: 0b1111_1111, torn: false };
    // Samples that overlap, and those of a neighbour in the same word.
    let asked: &[&[u32]] = &[&[0b0011, 0b1000], &[0b0110], &[0b1111, 0b1111_0000]];
    every_order(&claims, asked).unwrap_or_else(|e| panic!("{e}"));
    println!("{}", every_order(&Bits { torn: true, ..claims }, asked).expect_err("a torn word holds"));
}

#[test]
fn a_mark_is_never_lost() {
    is_of(
        "surfaces/triangles/marks.glsl",
        "\
    if ((marked_bits[id >> 5] & bit) == 0u) {
        atomicOr(marked_bits[id >> 5], bit);
    }
",
    );
    let marks = Bits { looks_first: true, claimed: false, all: 0b111, torn: false };
    let asked: &[&[u32]] = &[&[1, 2], &[2, 4], &[1, 4]];
    every_order(&marks, asked).unwrap_or_else(|e| panic!("{e}"));
    println!("{}", every_order(&Bits { torn: true, ..marks }, asked).expect_err("a torn word holds"));
}

/// The table of shading samples of `low_rate.glsl`: open addressing in as many slots as there can be names.
struct Table {
    /// A mutant: whether a slot is free is looked at, not exchanged.
    looked_at: bool,
}

/// Slots; names are numbers from 1, all of which hash to slot 0.
const SLOTS: usize = 3;

impl Protocol for Table {
    fn start(&self) -> Vec<u32> {
        vec![0; SLOTS]
    }

    fn group(&self, group: u32, regs: &Registers, name: u32) -> Vec<Step> {
        let word = regs[1] as usize;
        match (group, self.looked_at) {
            (0, true) => vec![Step::Load { reg: 0, word }],
            (0, false) => vec![Step::CompareSwap { reg: 0, word, expected: 0, value: name }],
            _ => vec![Step::Store { word, value: name }],
        }
    }

    fn after(&self, group: u32, regs: &mut Registers, name: u32) -> Next {
        if group == 0 && regs[0] == 0 && self.looked_at {
            return Next::Group(1);
        }
        if group == 1 || regs[0] == 0 || regs[0] == name {
            return Next::Result(regs[1]);
        }
        regs[1] = (regs[1] + 1) % SLOTS as u32;
        Next::Group(0)
    }

    fn check(&self, memory: &[u32], name: u32, slot: u32) -> Result<(), String> {
        match memory[slot as usize] == name {
            true => Ok(()),
            false => Err(format!("{name} was sent to slot {slot} of {memory:?}")),
        }
    }

    fn check_end(&self, memory: &[u32], _: &[Vec<u32>]) -> Result<(), String> {
        let mut names: Vec<u32> = memory.iter().copied().filter(|name| *name != 0).collect();
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        if names.len() < count { Err(format!("a name twice: {memory:?}")) } else { Ok(()) }
    }
}

#[test]
fn a_shading_sample_has_one_slot() {
    is_of(
        "surfaces/low_rate/low_rate.glsl",
        "\
        uint found = atomicCompSwap(grid_names[first + probe], NO_TRIANGLE, name);
",
    );
    let asked: &[&[u32]] = &[&[1, 2], &[2, 1], &[3, 2]];
    every_order(&Table { looked_at: false }, asked).unwrap_or_else(|e| panic!("{e}"));
    println!(
        "{}",
        every_order(&Table { looked_at: true }, asked).expect_err("a slot that is looked at holds")
    );
}
