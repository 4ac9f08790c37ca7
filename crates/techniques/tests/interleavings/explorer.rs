//! Tries all orders in which threads may run their steps on shared memory.
//!
//! A thread's steps come in groups, between which it has a memory barrier. The steps of a group touch memory in any order, so that a
//! barrier which is missing shows as a group that is too large. Steps are atomic, and each sees what the ones before it
//! have left: an order that no device can have is tried as well, an order that a device can have through atomics and barriers is not
//! left out.

use std::{collections::HashSet, hash::Hash};

/// A step on shared memory. Words are numbered; `reg` is a register of the thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Step {
    /// Reads a word into a register.
    Load { reg: usize, word: usize },
    /// Writes a word.
    Store { word: usize, value: u32 },
    /// Writes `value` where the word is `expected`; the register holds what the word was.
    CompareSwap { reg: usize, word: usize, expected: u32, value: u32 },
    /// Writes a word; the register holds what it was.
    Exchange { reg: usize, word: usize, value: u32 },
    /// Adds to a word; the register holds what it was.
    Add { reg: usize, word: usize, value: u32 },
    /// Sets bits of a word; the register holds what it was.
    Or { reg: usize, word: usize, value: u32 },
}

/// What a thread does after a group of steps.
pub enum Next {
    /// Goes on with another group.
    Group(u32),
    /// Ends what it was asked for, with a result.
    Result(u32),
}

/// Registers of a thread.
pub type Registers = [u32; 8];

/// What threads run.
pub trait Protocol {
    /// Words of shared memory in the beginning.
    fn start(&self) -> Vec<u32>;
    /// Steps of a group, for what the thread is asked for.
    fn group(&self, group: u32, regs: &Registers, asked: u32) -> Vec<Step>;
    /// What follows a group. It may set registers.
    fn after(&self, group: u32, regs: &mut Registers, asked: u32) -> Next;
    /// Why a result is wrong.
    fn check(&self, memory: &[u32], asked: u32, result: u32) -> Result<(), String>;
    /// Why the memory is wrong when all threads have ended; results are those of each thread, in turn.
    fn check_end(&self, memory: &[u32], results: &[Vec<u32>]) -> Result<(), String>;
}

#[derive(Clone, PartialEq, Eq, Hash)]
struct Thread {
    /// Of what it is asked for, how much is done.
    done: usize,
    group: u32,
    /// Steps of the group that have not been run, a bit each.
    pending: u32,
    /// The group's steps, as they were when it began.
    steps: Vec<Step>,
    regs: Registers,
    results: Vec<u32>,
}

#[derive(Clone, PartialEq, Eq, Hash)]
struct State {
    memory: Vec<u32>,
    threads: Vec<Thread>,
}

/// What was tried.
#[derive(Debug, PartialEq, Eq)]
pub struct Explored {
    /// States that differ.
    pub states: usize,
    /// Ends of all threads that differ.
    pub ends: usize,
}

/// Tries all orders of threads that are asked for one thing after the other.
///
/// # Errors
/// What went wrong in some order.
pub fn explore(protocol: &dyn Protocol, asked: &[&[u32]]) -> Result<Explored, String> {
    let mut first = State { memory: protocol.start(), threads: Vec::new() };
    for asked in asked {
        let mut thread =
            Thread { done: 0, group: 0, pending: 0, steps: Vec::new(), regs: [0; 8], results: Vec::new() };
        begin(protocol, &mut thread, asked, 0);
        first.threads.push(thread);
    }
    let mut seen = HashSet::new();
    let mut explored = Explored { states: 0, ends: 0 };
    let mut open = vec![first];
    while let Some(state) = open.pop() {
        if !seen.insert(state.clone()) {
            continue;
        }
        explored.states += 1;
        let mut ended = true;
        for (number, asked) in asked.iter().enumerate() {
            let pending = state.threads[number].pending;
            for step in (0..32).filter(|step| pending >> step & 1 != 0) {
                ended = false;
                let mut next = state.clone();
                run(protocol, &mut next, number, step, asked)?;
                open.push(next);
            }
        }
        if ended {
            explored.ends += 1;
            let results: Vec<_> = state.threads.iter().map(|thread| thread.results.clone()).collect();
            protocol.check_end(&state.memory, &results)?;
        }
    }
    Ok(explored)
}

/// Begins a group, or ends the thread where nothing is left to be asked for.
fn begin(protocol: &dyn Protocol, thread: &mut Thread, asked: &[u32], group: u32) {
    (thread.group, thread.pending) = (group, 0);
    thread.steps.clear();
    if let Some(asked) = asked.get(thread.done) {
        thread.steps = protocol.group(group, &thread.regs, *asked);
        assert!((1..32).contains(&thread.steps.len()), "group {group}: {} steps", thread.steps.len());
        thread.pending = (1 << thread.steps.len()) - 1;
    }
}

/// Runs one step of a thread and, where it was the group's last, what follows.
fn run(
    protocol: &dyn Protocol,
    state: &mut State,
    number: usize,
    step: usize,
    asked: &[u32],
) -> Result<(), String> {
    let State { memory, threads } = state;
    let thread = &mut threads[number];
    apply(thread.steps[step], memory, &mut thread.regs);
    thread.pending &= !(1 << step);
    if thread.pending != 0 {
        return Ok(());
    }
    let now = asked[thread.done];
    match protocol.after(thread.group, &mut thread.regs, now) {
        Next::Group(group) => begin(protocol, thread, asked, group),
        Next::Result(result) => {
            protocol.check(memory, now, result)?;
            thread.done += 1;
            thread.results.push(result);
            thread.regs = [0; 8];
            begin(protocol, thread, asked, 0);
        }
    }
    Ok(())
}

fn apply(step: Step, memory: &mut [u32], regs: &mut Registers) {
    match step {
        Step::Load { reg, word } => regs[reg] = memory[word],
        Step::Store { word, value } => memory[word] = value,
        Step::CompareSwap { reg, word, expected, value } => {
            regs[reg] = memory[word];
            if memory[word] == expected {
                memory[word] = value;
            }
        }
        Step::Exchange { reg, word, value } => regs[reg] = std::mem::replace(&mut memory[word], value),
        Step::Add { reg, word, value } => {
            regs[reg] = memory[word];
            memory[word] += value;
        }
        Step::Or { reg, word, value } => {
            regs[reg] = memory[word];
            memory[word] |= value;
        }
    }
}
