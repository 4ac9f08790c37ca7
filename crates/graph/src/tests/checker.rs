//! Replays a plan by brute force, knowing nothing of how it was made: every pair of conflicting accesses must be ordered
//! by barriers, every layout must be right, and every kept result must be what it is without aliasing and dropping.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use afterlight_gpu::vk;

use crate::declare::ResourceKind;
use crate::{Access, Barrier, Plan, Subresource};

type Stages = vk::PipelineStageFlags2;
type AccessFlags = vk::AccessFlags2;

/// An access, or a layout transition, of one part of a resource, and what barriers have done for it since.
struct Event {
    what: String,
    resource: usize,
    cell: usize,
    stages: Stages,
    access: AccessFlags,
    write: bool,
    /// Stages that are ordered after it.
    chain: Stages,
    available: bool,
    visible: Vec<(Stages, AccessFlags)>,
}

fn writes(access: AccessFlags) -> AccessFlags {
    access
        & (AccessFlags::SHADER_STORAGE_WRITE
            | AccessFlags::COLOR_ATTACHMENT_WRITE
            | AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE
            | AccessFlags::TRANSFER_WRITE)
}

fn has_stages(all: Stages, some: Stages) -> bool {
    all.contains(Stages::ALL_COMMANDS) || all.contains(some)
}

fn has_access(all: AccessFlags, some: AccessFlags) -> bool {
    let mut all = all;
    if all.contains(AccessFlags::MEMORY_WRITE) {
        all |= writes(some);
    }
    if all.contains(AccessFlags::MEMORY_READ) {
        all |= some & !writes(some);
    }
    all.contains(some)
}

fn meet(a: Stages, b: Stages) -> bool {
    let all = |stages: Stages| stages.contains(Stages::ALL_COMMANDS);
    a.intersects(b) || (all(a) && !b.is_empty()) || (all(b) && !a.is_empty())
}

pub struct Checker<'a> {
    plan: &'a Plan,
    events: Vec<Event>,
    layouts: HashMap<(usize, usize), vk::ImageLayout>,
    /// What each part holds, as a hash of how it was made.
    values: HashMap<(usize, usize), u64>,
    poison: u64,
}

/// What resources with history hold before the first frame.
const CLEARED: u64 = 55;

fn grid(kind: &ResourceKind) -> (u32, u32) {
    match kind {
        ResourceKind::Image(info) => (info.mips, info.layers),
        ResourceKind::Buffer { .. } => (1, 1),
    }
}

impl<'a> Checker<'a> {
    /// Replays `plan` once, and where it has history four times, the third a frame that is drawn again; returns what kept resources hold at the
    /// end, or the first fault.
    pub fn run(plan: &'a Plan) -> Result<HashMap<(String, usize), u64>, String> {
        let next: &[bool] = if plan.has_history() { &[true, false, true] } else { &[] };
        Self::frames(plan, next)
    }

    /// Replays `plan` for a first frame, and one more each of `next`: of the other turn where it is true, else of the same one.
    pub fn frames(plan: &'a Plan, next: &[bool]) -> Result<HashMap<(String, usize), u64>, String> {
        let mut checker = Self::new(plan);
        let mut kept = checker.frame()?;
        for flips in next {
            checker.begin_next(*flips);
            kept = checker.frame()?;
        }
        Ok(kept)
    }

    fn new(plan: &'a Plan) -> Self {
        let mut checker = Checker {
            plan,
            events: Vec::new(),
            layouts: HashMap::new(),
            values: HashMap::new(),
            poison: 1 << 63,
        };
        for (index, resource) in plan.resources.iter().enumerate() {
            if let Some(crate::declare::Import::Fake { layout }) = &resource.import {
                let (mips, layers) = grid(&resource.kind);
                for cell in 0..(mips * layers) as usize {
                    checker.layouts.insert((index, cell), *layout);
                    checker.values.insert((index, cell), 77 + index as u64);
                }
            }
            if resource.version.is_some() {
                for (cell, layout) in resource.final_layouts.iter().enumerate() {
                    checker.layouts.insert((index, cell), *layout);
                    checker.values.insert((index, cell), CLEARED);
                }
            }
        }
        checker
    }

    /// Where each resource of a frame of the other turn finds its memory.
    fn place_in_turn(&self, resource: usize, flips: bool) -> usize {
        let version = self.plan.resources[resource].version.filter(|_| flips);
        version.map_or(resource, |version| version.other().0 as usize)
    }

    /// Goes on to the next frame. Frames begin after all that was done before; of resources with history the plan's own barriers must say so.
    fn begin_next(&mut self, flips: bool) {
        let plan = self.plan;
        self.events.retain(|event| plan.resources[event.resource].version.is_some());
        let mut events = std::mem::take(&mut self.events);
        for event in &mut events {
            event.resource = self.place_in_turn(event.resource, flips);
        }
        self.events = events;
        let lives_on = |resource: usize| {
            let resource = &plan.resources[resource];
            resource.version.is_some() || resource.imported
        };
        self.layouts.retain(|(resource, _), _| lives_on(*resource));
        self.values.retain(|(resource, _), _| lives_on(*resource));
        let layouts = std::mem::take(&mut self.layouts);
        let values = std::mem::take(&mut self.values);
        let turned = |(resource, cell)| (self.place_in_turn(resource, flips), cell);
        let layouts = layouts.into_iter().map(|(key, layout)| (turned(key), layout)).collect();
        let values = values.into_iter().map(|(key, value)| (turned(key), value)).collect();
        (self.layouts, self.values) = (layouts, values);
    }

    /// Replays one frame; returns what kept resources hold at its end.
    fn frame(&mut self) -> Result<HashMap<(String, usize), u64>, String> {
        let (plan, checker) = (self.plan, self);
        checker.check_places()?;
        for pass in &plan.passes {
            checker.barriers(&pass.name, &pass.barriers)?;
            checker.accesses(&pass.name, &pass.accesses)?;
        }
        checker.barriers("the end", &plan.final_barriers)?;
        let mut kept = HashMap::new();
        for (index, resource) in plan.resources.iter().enumerate() {
            if resource.version.is_some() && matches!(resource.kind, ResourceKind::Image(_)) {
                for (cell, home) in resource.final_layouts.iter().enumerate() {
                    let found = checker.layouts.get(&(index, cell)).copied().unwrap_or_default();
                    if found != *home {
                        return Err(format!("{}[{cell}] ends in {found:?}, not in {home:?}", resource.name));
                    }
                }
            }
            if let Some(crate::declare::Import::Fake { layout }) = &resource.import {
                for ((_, cell), found) in checker.layouts.iter().filter(|((id, _), _)| *id == index) {
                    if *layout != vk::ImageLayout::UNDEFINED && found != layout {
                        return Err(format!(
                            "{}[{cell}] ends in {found:?}, came in {layout:?}",
                            resource.name
                        ));
                    }
                }
            }
            if resource.kept {
                for ((_, cell), value) in checker.values.iter().filter(|((id, _), _)| *id == index) {
                    kept.insert((resource.name.clone(), *cell), *value);
                }
            }
        }
        Ok(kept)
    }

    fn check_places(&self) -> Result<(), String> {
        for resource in &self.plan.resources {
            let Some(place) = resource.placement else { continue };
            let heap = self.plan.heaps[place.heap];
            if place.offset % resource.need.alignment != 0 || place.offset + resource.need.bytes > heap.bytes
            {
                return Err(format!("{} lies badly in its heap", resource.name));
            }
            if heap.type_bits != resource.need.type_bits {
                return Err(format!("{} lies in a heap of another memory type", resource.name));
            }
        }
        Ok(())
    }

    fn same_memory(&self, a: usize, b: usize) -> bool {
        let (a, b) = (&self.plan.resources[a], &self.plan.resources[b]);
        let (Some(place_a), Some(place_b)) = (a.placement, b.placement) else { return false };
        place_a.heap == place_b.heap
            && place_a.offset < place_b.offset + b.need.bytes
            && place_b.offset < place_a.offset + a.need.bytes
    }

    fn cells(&self, resource: usize, range: &Subresource) -> Vec<usize> {
        let (mips, _) = grid(&self.plan.resources[resource].kind);
        let mut cells = Vec::new();
        for layer in range.layer..range.layer + range.layer_count {
            for mip in range.mip..range.mip + range.mip_count {
                cells.push((layer * mips + mip) as usize);
            }
        }
        cells
    }

    fn next_poison(&mut self) -> u64 {
        self.poison += 1;
        self.poison
    }

    fn barriers(&mut self, pass: &str, barriers: &[Barrier]) -> Result<(), String> {
        let mut transitions = Vec::new();
        for barrier in barriers {
            let Some(id) = barrier.resource else { continue };
            let resource = id.0 as usize;
            if !matches!(self.plan.resources[resource].kind, ResourceKind::Image(_)) {
                continue;
            }
            for cell in self.cells(resource, &barrier.range) {
                let found =
                    self.layouts.get(&(resource, cell)).copied().unwrap_or(vk::ImageLayout::UNDEFINED);
                let name = &self.plan.resources[resource].name;
                if barrier.old_layout != vk::ImageLayout::UNDEFINED && barrier.old_layout != found {
                    return Err(format!(
                        "{pass}: {name}[{cell}] is in {found:?}, not in {:?}",
                        barrier.old_layout
                    ));
                }
                if barrier.old_layout == barrier.new_layout {
                    continue;
                }
                self.order_transition(pass, resource, cell, barrier, barriers)?;
                if barrier.old_layout == vk::ImageLayout::UNDEFINED {
                    let poison = self.next_poison();
                    self.values.insert((resource, cell), poison);
                    self.spoil_aliases(resource);
                }
                self.layouts.insert((resource, cell), barrier.new_layout);
                transitions.push(Event {
                    what: format!("transition before {pass}"),
                    resource,
                    cell,
                    stages: Stages::NONE,
                    access: AccessFlags::NONE,
                    write: true,
                    chain: barrier.dst_stages,
                    available: true,
                    visible: vec![(barrier.dst_stages, barrier.dst_access)],
                });
            }
        }
        let plan = self.plan;
        for event in &mut self.events {
            let mut chain = event.chain;
            let mut visible = Vec::new();
            for barrier in barriers {
                let covers = match barrier.resource {
                    None => true,
                    Some(id) if id.0 as usize != event.resource => false,
                    Some(_) => {
                        let (mips, _) = grid(&plan.resources[event.resource].kind);
                        let (mip, layer) = (event.cell as u32 % mips, event.cell as u32 / mips);
                        let range = barrier.range;
                        (range.mip..range.mip + range.mip_count).contains(&mip)
                            && (range.layer..range.layer + range.layer_count).contains(&layer)
                    }
                };
                let direct = !event.stages.is_empty() && has_stages(barrier.src_stages, event.stages);
                if !(direct || meet(barrier.src_stages, event.chain)) {
                    continue;
                }
                // Execution is ordered whatever the barrier's resource; memory only for what it covers.
                chain |= barrier.dst_stages;
                if !covers {
                    continue;
                }
                if event.write && has_access(barrier.src_access, writes(event.access)) && direct {
                    event.available = true;
                }
                if event.available {
                    visible.push((barrier.dst_stages, barrier.dst_access));
                }
            }
            event.chain = chain;
            event.visible.extend(visible);
        }
        self.events.extend(transitions);
        Ok(())
    }

    /// A transition writes: all earlier accesses to that memory must lie in its barrier's first scope.
    fn order_transition(
        &self,
        pass: &str,
        resource: usize,
        cell: usize,
        barrier: &Barrier,
        all: &[Barrier],
    ) -> Result<(), String> {
        for event in &self.events {
            let same = event.resource == resource && event.cell == cell;
            let alias = event.resource != resource && self.same_memory(event.resource, resource);
            if !same && !alias {
                continue;
            }
            let direct = !event.stages.is_empty() && has_stages(barrier.src_stages, event.stages);
            let ordered = direct || meet(barrier.src_stages, event.chain);
            let flushed = !event.write
                || event.available
                || all.iter().any(|other| {
                    (other.resource.is_none() || other == barrier)
                        && has_stages(other.src_stages, event.stages)
                        && has_access(other.src_access, writes(event.access))
                });
            if !ordered || !flushed {
                return Err(format!(
                    "{pass}: transition of {}[{cell}] is not ordered after {} ({})",
                    self.plan.resources[resource].name, event.what, self.plan.resources[event.resource].name
                ));
            }
        }
        Ok(())
    }

    fn spoil_aliases(&mut self, resource: usize) {
        let keys: Vec<(usize, usize)> = self.values.keys().copied().collect();
        for key in keys {
            if key.0 != resource && self.same_memory(key.0, resource) {
                let poison = self.next_poison();
                self.values.insert(key, poison);
            }
        }
    }

    fn accesses(&mut self, pass: &str, accesses: &[Access]) -> Result<(), String> {
        for (index, access) in accesses.iter().enumerate() {
            self.hazards(pass, access)?;
            for other in &accesses[..index] {
                if other.resource != access.resource
                    && self.same_memory(other.resource.0 as usize, access.resource.0 as usize)
                {
                    return Err(format!("{pass}: two of its resources share memory"));
                }
            }
        }
        self.evaluate(pass, accesses)?;
        for access in accesses {
            let resource = access.resource.0 as usize;
            for cell in self.cells(resource, &access.range) {
                self.events.push(Event {
                    what: format!("{} in {pass}", access.what),
                    resource,
                    cell,
                    stages: access.stages,
                    access: access.access,
                    write: access.write,
                    chain: Stages::NONE,
                    available: false,
                    visible: Vec::new(),
                });
            }
        }
        Ok(())
    }

    fn hazards(&self, pass: &str, access: &Access) -> Result<(), String> {
        let resource = access.resource.0 as usize;
        let name = &self.plan.resources[resource].name;
        for cell in self.cells(resource, &access.range) {
            let found = self.layouts.get(&(resource, cell)).copied().unwrap_or(vk::ImageLayout::UNDEFINED);
            if access.layout != found {
                return Err(format!("{pass}: {name}[{cell}] is in {found:?}, used in {:?}", access.layout));
            }
            for event in &self.events {
                let same = event.resource == resource && event.cell == cell;
                let alias = event.resource != resource && self.same_memory(event.resource, resource);
                if !(same || alias) || !(event.write || access.write) {
                    continue;
                }
                let fault = |what: &str| {
                    Err(format!(
                        "{pass}: {} of {name}[{cell}] {what} {} ({})",
                        access.what, event.what, self.plan.resources[event.resource].name
                    ))
                };
                if !has_stages(event.chain, access.stages) {
                    return fault("is not ordered after");
                }
                if event.write && !event.available {
                    return fault("finds unavailable the write of");
                }
                let sees = event.visible.iter().any(|(stages, seen)| {
                    has_stages(*stages, access.stages) && has_access(*seen, access.access)
                });
                if same && event.write && !sees {
                    return fault("does not see");
                }
            }
        }
        Ok(())
    }

    /// Gives each written part a value that tells everything that went into it.
    fn evaluate(&mut self, pass: &str, accesses: &[Access]) -> Result<(), String> {
        let mut inputs: Vec<(String, usize, u64)> = Vec::new();
        for access in accesses {
            let resource = access.resource.0 as usize;
            let reads = !access.write || (!access.discard && access.access != writes(access.access));
            for cell in self.cells(resource, &access.range) {
                if reads {
                    let is_lost = self.values.get(&(resource, cell)).is_some_and(|value| value >> 63 == 1);
                    if is_lost && self.plan.resources[resource].version.is_some() && !access.write {
                        let name = &self.plan.resources[resource].name;
                        return Err(format!("{pass}: {name}[{cell}] has lost what the frame before wrote"));
                    }
                    let value = self.value(resource, cell);
                    inputs.push((self.plan.resources[resource].name.clone(), cell, value));
                }
            }
        }
        inputs.sort();
        for access in accesses.iter().filter(|access| access.write) {
            let resource = access.resource.0 as usize;
            for cell in self.cells(resource, &access.range) {
                let mut hasher = DefaultHasher::new();
                (pass, &inputs, &self.plan.resources[resource].name, cell).hash(&mut hasher);
                if !access.discard {
                    self.value(resource, cell).hash(&mut hasher);
                }
                self.values.insert((resource, cell), hasher.finish() >> 1);
            }
            self.spoil_aliases(resource);
        }
        Ok(())
    }

    /// What a part holds; unwritten memory counts as one value, so that plans can be compared.
    fn value(&self, resource: usize, cell: usize) -> u64 {
        let value = self.values.get(&(resource, cell)).copied().unwrap_or(0);
        if value >> 63 == 1 { 0 } else { value }
    }
}
