//! The stage that sorts items of a 32-bit key and a 32-bit value on the device: stable, ascending by the keys' bits.
//!
//! A radix sort from the least significant digit, 8 bits a step, each by three passes: digits are counted, the counts are summed, items are moved.

pub use afterlight_frame::sort_words::{from_sortable_bits, sortable_bits};
use afterlight_frame::{Frame, TechniqueError};
use afterlight_graph::{BufferHandle, BufferRole, ComputePass, Graph, PassRole, gpu::Features};

pub mod twin;

/// Values of a digit of 8 bits: `DIGITS` in `items.glsl`.
const DIGITS: u32 = 256;
/// Items of a group: `BATCH_ITEMS` in `items.glsl`. More would not fit the 32 KiB of shared memory that small devices have.
const BATCH_ITEMS: u32 = 4096;

/// Shared memory of a group of `scatter.comp.glsl`: the batch, counts of eight teams, how far digits move, sums. Vulkan promises no more than
/// 16 KiB.
const SHARED_BYTES: u32 = 4 * (BATCH_ITEMS + 8 * DIGITS + DIGITS + 256);

/// How many low bits of a key decide. The others are carried along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeyBits {
    /// One step.
    Low8,
    /// Two steps.
    Low16,
    /// Three steps.
    Low24,
    /// Four steps: the whole key.
    All32,
}

impl KeyBits {
    /// Every number of bits, ascending.
    pub const ALL: [Self; 4] = [Self::Low8, Self::Low16, Self::Low24, Self::All32];

    /// The fewest bits that tell keys from 0 to `largest_key` apart.
    pub const fn up_to(largest_key: u32) -> Self {
        match largest_key.leading_zeros() {
            24.. => Self::Low8,
            16..24 => Self::Low16,
            8..16 => Self::Low24,
            _ => Self::All32,
        }
    }

    /// Digits of 8 bits, each a step of the sort.
    pub const fn steps(self) -> u32 {
        match self {
            Self::Low8 => 1,
            Self::Low16 => 2,
            Self::Low24 => 3,
            Self::All32 => 4,
        }
    }

    /// The bits of a key that decide.
    pub const fn mask(self) -> u32 {
        u32::MAX >> (32 - 8 * self.steps())
    }

    /// Lowest bit of each digit, the least significant first.
    pub fn shifts(self) -> impl Iterator<Item = u32> {
        (0..self.steps()).map(|step| 8 * step)
    }
}

/// Items on the device: a key and a value each, 32 bits, in two buffers. There is room for as many as the smaller buffer holds.
#[derive(Debug)]
pub struct Items {
    /// Keys.
    pub keys: BufferHandle,
    /// Values.
    pub values: BufferHandle,
}

impl Items {
    /// Items that there is room for.
    pub fn capacity(&self) -> u32 {
        u32::try_from(self.keys.bytes().min(self.values.bytes()) / 4).unwrap_or(u32::MAX)
    }
}

/// How many items there are.
#[derive(Clone, Copy, Debug)]
pub enum ItemCount<'a> {
    /// Known when the frame is recorded.
    Known(u32),
    /// The word of that number in a buffer, which holds the count when the sort runs. A word that the buffer does not have counts nothing.
    OnDevice(&'a BufferHandle, u32),
}

/// Items in order.
#[derive(Debug)]
pub struct Sorted {
    /// The items. Their buffers are those that were given where the number of steps is even or nothing is to be sorted, else others; what
    /// stands behind the last item is undefined.
    pub items: Items,
    /// Where the count was on the device: items asked for, and those that found no room and are not sorted, as
    /// [`Frame::watch`] reads them; the capacity is that of the items before the sort.
    pub demand: Option<BufferHandle>,
}

/// Declares the passes `name/…` that sort items by the low bits of their keys; items whose bits are equal keep their order.
///
/// The count of items may stand on the device. One that is above the capacity is cut to it, and what is left out is told by
/// [`Sorted::demand`].
///
/// # Errors
/// A known count above the capacity, buffers that one binding does not reach, a device whose groups share too little memory:
/// [`TechniqueError::TooLarge`]. A shader that is not compiled in.
pub fn by_key(
    graph: &mut Graph,
    frame: &Frame<'_>,
    name: &str,
    roles: (PassRole, BufferRole),
    items: Items,
    count: ItemCount<'_>,
    key_bits: KeyBits,
) -> Result<Sorted, TechniqueError> {
    for (what, buffer) in [("keys", &items.keys), ("values", &items.values)] {
        frame.check_binding(name, &format!("{what} to sort"), buffer.bytes())?;
    }
    check_shared(name, frame.features().max_shared_memory_bytes)?;
    let capacity = items.capacity();
    let (most, size) = match count {
        ItemCount::Known(found) if found > capacity => {
            let what = format!("{name}: items to sort");
            return Err(TechniqueError::TooLarge { what, found: found.into(), limit: capacity.into() });
        }
        // Nothing to put in order.
        ItemCount::Known(0 | 1) => return Ok(Sorted { items, demand: None }),
        ItemCount::Known(count) => (count, None),
        ItemCount::OnDevice(counts, word) => {
            (capacity, Some(declare_size(graph, frame, (name, roles), (counts, word), capacity)?))
        }
    };
    let sort = Sort { frame, name, roles, most, size };
    let items = sort.declare(graph, items, key_bits)?;
    Ok(Sorted { items, demand: sort.size.map(|size| size.demand) })
}

/// Whether a group of a device has the shared memory that a sort takes.
pub fn fits(features: &Features) -> bool {
    SHARED_BYTES <= features.max_shared_memory_bytes
}

/// Checks that a group of a device has the shared memory.
fn check_shared(name: &str, limit: u32) -> Result<(), TechniqueError> {
    if SHARED_BYTES > limit {
        let what = format!("{name}: bytes of shared memory to sort");
        return Err(TechniqueError::TooLarge { what, found: SHARED_BYTES.into(), limit: limit.into() });
    }
    Ok(())
}

/// What is known on the device alone.
struct DeviceSize {
    /// Items asked for, and those without room.
    demand: BufferHandle,
    /// A group a batch: the arguments of a dispatch.
    groups: BufferHandle,
}

/// Declares the pass that reads the number of items.
fn declare_size(
    graph: &mut Graph,
    frame: &Frame<'_>,
    (name, (pass_role, buffer_role)): (&str, (PassRole, BufferRole)),
    (counts, word): (&BufferHandle, u32),
    capacity: u32,
) -> Result<DeviceSize, TechniqueError> {
    let demand = graph.buffer(&format!("{name}/sort demand"), buffer_role, 8);
    let groups = graph.buffer(&format!("{name}/sort groups"), buffer_role, 12);
    let shader = frame.shader("shared/sort/size.comp")?;
    let mut pass = graph.compute(&format!("{name}/sort size"), pass_role, &shader);
    pass.push(&[capacity, word, frame.features().max_workgroup_count[0], BATCH_ITEMS]);
    pass.read("Counts", counts);
    let demand = pass.write("SortDemand", demand);
    let groups = pass.write("SortGroups", groups);
    pass.dispatch([1, 1, 1]);
    pass.finish();
    Ok(DeviceSize { demand, groups })
}

/// What all passes of a sort are declared from.
struct Sort<'a> {
    frame: &'a Frame<'a>,
    name: &'a str,
    roles: (PassRole, BufferRole),
    /// The number of items, or the room for them where the device has the number.
    most: u32,
    size: Option<DeviceSize>,
}

/// Counts of digits: of each batch, and of all.
struct Digits {
    histogram: BufferHandle,
    totals: BufferHandle,
}

impl Sort<'_> {
    /// Items go from one pair of buffers to the other at each step.
    fn declare(
        &self,
        graph: &mut Graph,
        mut items: Items,
        key_bits: KeyBits,
    ) -> Result<Items, TechniqueError> {
        let item_bytes = 4 * u64::from(self.most.max(1));
        let batches = u64::from(self.most.div_ceil(BATCH_ITEMS).max(1));
        let mut other = Items {
            keys: self.buffer(graph, "keys", item_bytes),
            values: self.buffer(graph, "values", item_bytes),
        };
        let mut digits = Digits {
            histogram: self.buffer(graph, "histogram", 4 * u64::from(DIGITS) * batches),
            totals: self.buffer(graph, "totals", 4 * u64::from(DIGITS)),
        };
        for shift in key_bits.shifts() {
            digits = self.count(graph, shift, &items, digits)?;
            let moved = self.scatter(graph, shift, &items, other, &digits)?;
            other = std::mem::replace(&mut items, moved);
        }
        Ok(items)
    }

    fn buffer(&self, graph: &mut Graph, what: &str, bytes: u64) -> BufferHandle {
        graph.buffer(&format!("{}/sort {what}", self.name), self.roles.1, bytes)
    }

    /// A pass of a step, which binds how many items there are.
    fn pass<'g>(
        &self,
        graph: &'g mut Graph,
        what: &str,
        shift: u32,
    ) -> Result<ComputePass<'g>, TechniqueError> {
        let counted = if self.size.is_some() { "#counted" } else { "" };
        let shader = self.frame.shader(&format!("shared/sort/{what}.comp{counted}"))?;
        let name = format!("{}/sort {what} {}", self.name, shift / 8 + 1);
        let mut pass = graph.compute(&name, self.roles.0, &shader);
        pass.push(&[shift, self.most]);
        if let Some(size) = &self.size {
            pass.read("SortDemand", &size.demand);
        }
        Ok(pass)
    }

    /// A group a batch.
    fn dispatch_batches(&self, mut pass: ComputePass<'_>) {
        match &self.size {
            Some(size) => pass.dispatch_indirect(&size.groups, 0),
            None => pass.dispatch(self.frame.groups_in_rows(self.most.div_ceil(BATCH_ITEMS))),
        };
    }

    /// Counts the digits of batches, and sums them.
    fn count(
        &self,
        graph: &mut Graph,
        shift: u32,
        items: &Items,
        digits: Digits,
    ) -> Result<Digits, TechniqueError> {
        let mut pass = self.pass(graph, "count", shift)?;
        pass.read("Keys", &items.keys);
        let histogram = pass.write("Histogram", digits.histogram);
        self.dispatch_batches(pass);

        let mut pass = self.pass(graph, "scan", shift)?;
        let histogram = pass.write("Histogram", histogram);
        let totals = pass.write("DigitTotals", digits.totals);
        pass.dispatch([DIGITS, 1, 1]);
        pass.finish();
        Ok(Digits { histogram, totals })
    }

    /// Moves items to their place by one digit.
    fn scatter(
        &self,
        graph: &mut Graph,
        shift: u32,
        from: &Items,
        to: Items,
        digits: &Digits,
    ) -> Result<Items, TechniqueError> {
        let mut pass = self.pass(graph, "scatter", shift)?;
        pass.read("Keys", &from.keys).read("Values", &from.values);
        pass.read("Histogram", &digits.histogram).read("DigitTotals", &digits.totals);
        let keys = pass.write("KeysOut", to.keys);
        let values = pass.write("ValuesOut", to.values);
        self.dispatch_batches(pass);
        Ok(Items { keys, values })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_have_as_many_steps_as_they_need() {
        for (largest_key, bits) in [
            (0, KeyBits::Low8),
            (0xff, KeyBits::Low8),
            (0x100, KeyBits::Low16),
            (0xffff, KeyBits::Low16),
            (0x1_0000, KeyBits::Low24),
            (0xff_ffff, KeyBits::Low24),
            (0x100_0000, KeyBits::All32),
            (u32::MAX, KeyBits::All32),
        ] {
            assert_eq!(KeyBits::up_to(largest_key), bits, "{largest_key:#x}");
            assert_eq!(largest_key & bits.mask(), largest_key);
        }
        assert_eq!(KeyBits::ALL.map(KeyBits::mask), [0xff, 0xffff, 0xff_ffff, u32::MAX]);
        assert_eq!(KeyBits::Low24.shifts().collect::<Vec<_>>(), [0, 8, 16]);
    }

    #[test]
    fn a_device_of_too_little_shared_memory_is_told() {
        assert!(check_shared("s", 26_624).is_ok());
        let error = check_shared("s", 26_623).expect_err("a byte less").to_string();
        assert_eq!(error, "s: bytes of shared memory to sort: found 26624, expected at most 26623");
    }

    proptest::proptest! {
        #[test]
        fn bits_of_floats_are_in_their_order(a in proptest::num::f32::ANY, b in proptest::num::f32::ANY) {
            proptest::prop_assert_eq!(sortable_bits(a).cmp(&sortable_bits(b)), a.total_cmp(&b));
            proptest::prop_assert_eq!(from_sortable_bits(sortable_bits(a)).to_bits(), a.to_bits());
        }
    }
}
