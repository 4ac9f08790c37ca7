//! The sort on the device against its CPU twin.

mod common;

use afterlight_renderer::Prepared;
use afterlight_stages::shared::sort::{self, ItemCount, Items, KeyBits, twin};
use afterlight_techniques::{
    Frame, Info, Params, SHADERS, Settings, Technique, TechniqueError,
    cost::{Cost, Workload},
    find,
    graph::{BufferRole, Graph, ImageHandle, PassRole, gpu::vk},
    scene::rng::SplitMix64,
    shader::Shader,
};
use common::{Stage, compiled_variant, found_by, subgroup_sizes};

/// Items of a group: those of `items.glsl`.
const BATCH_ITEMS: u32 = 4096;

/// Items to sort: as many as there is room for.
#[derive(Clone)]
struct Case {
    what: String,
    items: Vec<(u32, u32)>,
    asked: Asked,
    key_bits: KeyBits,
    /// Values behind the last key: room that is not for items.
    more_values: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
enum Asked {
    Known(u32),
    OnDevice(u32),
}

/// Sorts one case after the other, and nothing else.
struct Sorts<'a>(&'a [Case]);

const ROLES: (PassRole, BufferRole) = (PassRole::Upkeep, BufferRole::Counters);

impl Technique for Sorts<'_> {
    fn shaders(&self) -> &[Shader] {
        &SHADERS
    }
    fn info(&self) -> &Info {
        find("forward").unwrap().info()
    }
    fn predict(&self, _: &Workload, _: &Params) -> Cost {
        Cost::default()
    }
    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        for (number, case) in self.0.iter().enumerate() {
            case.record(graph, frame, &format!("{number}"))?;
        }
        let image =
            graph.image("image", BufferRole::Targets, frame.image_info(vk::Format::R16G16B16A16_SFLOAT));
        Ok(graph.clear_image("clear", PassRole::Upkeep, image, [0.0; 4]))
    }
}

/// A buffer of the frame with words in it.
fn filled(
    graph: &mut Graph,
    frame: &Frame<'_>,
    name: &str,
    words: &[u32],
) -> Result<afterlight_techniques::graph::BufferHandle, TechniqueError> {
    let table = frame.table(graph, &format!("{name} table"), ROLES.1, words)?;
    let buffer = graph.buffer(name, ROLES.1, table.bytes());
    Ok(graph.copy_buffer(&format!("{name} copy"), ROLES.0, &table, buffer))
}

impl Case {
    fn record(&self, graph: &mut Graph, frame: &Frame<'_>, name: &str) -> Result<(), TechniqueError> {
        let (keys, mut values): (Vec<u32>, Vec<u32>) = self.items.iter().copied().unzip();
        values.extend(&self.more_values);
        let items = Items {
            keys: filled(graph, frame, &format!("{name}/keys"), &keys)?,
            values: filled(graph, frame, &format!("{name}/values"), &values)?,
        };
        let counts;
        let count = match self.asked {
            Asked::Known(count) => ItemCount::Known(count),
            Asked::OnDevice(count) => {
                counts = filled(graph, frame, &format!("{name}/counts"), &[77, count])?;
                ItemCount::OnDevice(&counts, 1)
            }
        };
        let sorted = sort::by_key(graph, frame, name, ROLES, items, count, self.key_bits)?;
        for (what, buffer) in [("keys", &sorted.items.keys), ("values", &sorted.items.values)] {
            let copy = graph.buffer(&format!("{name}/sorted {what}"), ROLES.1, buffer.bytes());
            let copy = graph.copy_buffer(&format!("{name}/copy {what}"), ROLES.0, buffer, copy);
            graph.keep(&copy);
        }
        if let Some(demand) = &sorted.demand {
            graph.keep(demand);
        }
        Ok(())
    }

    fn count(&self) -> usize {
        let (Asked::Known(count) | Asked::OnDevice(count)) = self.asked;
        self.items.len().min(count as usize)
    }

    fn expected(&self) -> Vec<(u32, u32)> {
        twin::by_key(&self.items[..self.count()], self.key_bits)
    }
}

/// What the device made of a case.
#[derive(PartialEq)]
struct Found {
    items: Vec<(u32, u32)>,
    values_behind: Vec<u32>,
    /// Items asked for and dropped, where they were counted on the device.
    demand: Option<[u32; 2]>,
}

fn words(prepared: &mut Prepared, name: &str) -> Vec<u32> {
    let bytes = prepared.executor().read_buffer(name).unwrap_or_else(|e| panic!("{e}"));
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

fn found(prepared: &mut Prepared, cases: &[Case]) -> Vec<Found> {
    prepared.run().unwrap_or_else(|e| panic!("{e}"));
    let mut of = |(number, case): (usize, &Case)| {
        let [keys, values] =
            ["keys", "values"].map(|what| words(prepared, &format!("{number}/sorted {what}")));
        let demand = matches!(case.asked, Asked::OnDevice(_))
            .then(|| words(prepared, &format!("{number}/sort demand")))
            .map(|demand| [demand[0], demand[1]]);
        let (items, room) = (case.count(), case.items.len());
        Found {
            items: keys.into_iter().zip(values.iter().copied()).take(items).collect(),
            values_behind: values.get(room..).unwrap_or_default().to_vec(),
            demand,
        }
    };
    cases.iter().enumerate().map(&mut of).collect()
}

fn tiny_stage(device: &afterlight_testkit::GpuTest) -> (Stage, Settings) {
    let stage = Stage::new(device, "builtin:intersect");
    let settings = stage.settings((8, 8), 1);
    (stage, settings)
}

/// What the device makes of cases with shaders in place of the stage's own.
fn sorted_with((stage, settings): &(Stage, Settings), cases: &[Case], shaders: &[Shader]) -> Vec<Found> {
    let mut prepared =
        stage.prepare_shaders(&Sorts(cases), settings, &Params::default(), shaders.iter().cloned());
    found(&mut prepared, cases)
}

/// Checks cases against the twin, three times over.
fn check(on: &(Stage, Settings), cases: &[Case], shaders: &[Shader]) {
    let mut prepared =
        on.0.prepare_shaders(&Sorts(cases), &on.1, &Params::default(), shaders.iter().cloned());
    let first = found(&mut prepared, cases);
    for (case, found) in cases.iter().zip(&first) {
        let expected = case.expected();
        let place = found.items.iter().zip(&expected).position(|(found, expected)| found != expected);
        let what = format!("{}, {:?}, {:?}", case.what, case.asked, case.key_bits);
        if let Some(place) = place {
            panic!("{what}: item {place} is {:?}, expected {:?}", found.items[place], expected[place]);
        }
        assert_eq!(found.items.len(), expected.len(), "{what}");
        if let Asked::OnDevice(asked) = case.asked {
            let dropped = asked - case.count() as u32;
            assert_eq!(found.demand, Some([asked, dropped]), "{what}: asked for and dropped");
        }
    }
    for _ in 0..2 {
        assert!(found(&mut prepared, cases) == first, "another run gives other bits");
    }
}

/// Keys of every kind; values are numbers of items, which tell a sort that is not stable.
fn keys_of_every_kind(count: u32, random: &mut SplitMix64) -> Vec<(&'static str, Vec<(u32, u32)>)> {
    let mut bits = || random.next_u64() as u32;
    let kinds: [(&str, Vec<u32>); 7] = [
        ("random keys", (0..count).map(|_| bits()).collect()),
        ("equal keys", vec![0xdead_beef; count as usize]),
        ("keys of all ones", vec![u32::MAX; count as usize]),
        ("sorted keys", (0..count).map(|i| i * 7).collect()),
        ("reversed keys", (0..count).rev().map(|i| i * 41).collect()),
        ("five keys", (0..count).map(|_| bits() % 5 * 0x0101_0101).collect()),
        (
            "keys of one digit at a time",
            (0..count).map(|_| bits()).map(|b| (b & 0xff) << (8 * (b >> 8 & 3))).collect(),
        ),
    ];
    kinds.into_iter().map(|(what, keys)| (what, keys.into_iter().zip(0..).collect())).collect()
}

fn case(what: &str, items: Vec<(u32, u32)>, asked: Asked, key_bits: KeyBits) -> Case {
    Case { what: what.to_owned(), items, asked, key_bits, more_values: Vec::new() }
}

/// Random keys with values that number them.
fn random_items(count: u32) -> Vec<(u32, u32)> {
    let mut random = SplitMix64::new(7);
    (0..count).map(|i| (random.next_u64() as u32, i)).collect()
}

#[test]
fn items_are_those_of_the_cpu_twin() {
    let gpu = afterlight_testkit::gpu();
    let on = tiny_stage(&gpu);
    let mut random = SplitMix64::new(1);
    for count in [0, 1, 2, BATCH_ITEMS - 1, BATCH_ITEMS, BATCH_ITEMS + 1, 3 * BATCH_ITEMS + 77] {
        let kinds = keys_of_every_kind(count, &mut random);
        let cases: Vec<Case> = kinds
            .into_iter()
            .zip(KeyBits::ALL.into_iter().rev().cycle())
            .map(|((what, items), bits)| case(&format!("{count} {what}"), items, Asked::Known(count), bits))
            .collect();
        check(&on, &cases, &[]);
    }
}

#[test]
fn a_hundred_thousand_items_by_each_number_of_bits() {
    let gpu = afterlight_testkit::gpu();
    let on = tiny_stage(&gpu);
    let mut random = SplitMix64::new(2);
    for (what, items) in keys_of_every_kind(100_003, &mut random) {
        let cases = KeyBits::ALL.map(|bits| case(what, items.clone(), Asked::Known(100_003), bits));
        check(&on, &cases, &[]);
    }
}

/// Fewer items than the buffers hold, by a count that the host knows or the device.
#[test]
fn counts_on_the_device() {
    let gpu = afterlight_testkit::gpu();
    let on = tiny_stage(&gpu);
    let capacity = 3 * BATCH_ITEMS + 5;
    let counts = [
        0,
        1,
        2,
        BATCH_ITEMS - 1,
        BATCH_ITEMS,
        BATCH_ITEMS + 1,
        capacity - 1,
        capacity,
        capacity + 1,
        2 * capacity,
        u32::MAX,
    ];
    let asked = counts.map(Asked::OnDevice).into_iter().chain([Asked::Known(2), Asked::Known(5000)]);
    let cases: Vec<Case> = asked
        .zip(KeyBits::ALL.into_iter().cycle())
        .map(|(asked, bits)| case("a part of the room", random_items(capacity), asked, bits))
        .collect();
    check(&on, &cases, &[]);
    let last = case("", random_items(100_003), Asked::OnDevice(100_003), KeyBits::All32);
    check(&on, &[last], &[]);
}

/// Items behind which the buffer of values goes on: a count above the capacity.
fn above_the_capacity() -> Case {
    let count = 2 * BATCH_ITEMS + 100;
    Case {
        more_values: (0..BATCH_ITEMS).map(|i| !i).collect(),
        ..case("above the capacity", random_items(count), Asked::OnDevice(count + 300), KeyBits::Low16)
    }
}

/// Nothing is written behind the room that keys and values both have; the mutant that does is caught.
#[test]
fn nothing_is_written_behind_the_room() {
    let gpu = afterlight_testkit::gpu();
    let on = tiny_stage(&gpu);
    let case = above_the_capacity();
    let untouched = |shaders: &[Shader]| {
        let found = sorted_with(&on, std::slice::from_ref(&case), shaders).remove(0);
        found.values_behind == case.more_values && found.items == case.expected()
    };
    assert!(untouched(&[]));
    let (from, to) = ("return min(items_needed, sort.most);", "return items_needed;");
    let unbounded: Vec<Shader> = ["count", "scatter"]
        .map(|pass| {
            let name = format!("shared/sort/{pass}.comp#counted");
            compiled_variant(&name, "shared/sort/items.glsl", &[(from, to)])
        })
        .to_vec();
    assert!(!untouched(&unbounded), "items without room go unseen");
}

/// A count that is known and has no room is refused, with what was found and what is there.
#[test]
fn a_known_count_without_room_is_refused() {
    let gpu = afterlight_testkit::gpu();
    let (stage, settings) = tiny_stage(&gpu);
    let try_count = |count| {
        let cases = [case("", random_items(100), Asked::Known(count), KeyBits::Low8)];
        stage
            .try_prepare_shaders(&Sorts(&cases), &settings, &Params::default(), Vec::new())
            .map(|_| ())
            .map_err(|e| e.to_string())
    };
    assert_eq!(try_count(100), Ok(()));
    assert_eq!(try_count(101), Err("0: items to sort: found 101, expected at most 100".to_owned()));
}

/// More batches than the scan has threads, so that each sums several.
#[test]
fn more_batches_than_threads_that_sum_them() {
    let gpu = afterlight_testkit::gpu();
    let on = tiny_stage(&gpu);
    let count = 257 * BATCH_ITEMS + 1;
    let case = case("many batches", random_items(count), Asked::OnDevice(count), KeyBits::Low16);
    check(&on, std::slice::from_ref(&case), &[]);
    let wrong = mutant("scan", "scan.comp.glsl", "before += count;", "before += 1u;");
    let found = sorted_with(&on, std::slice::from_ref(&case), &[wrong]).remove(0);
    assert!(found.items != case.expected(), "a batch that is not summed goes unseen");
}

/// Rows of dispatches: 25 batches in seven rows of four groups, three of which have no batch.
#[test]
fn more_batches_than_groups_of_a_row() {
    let gpu = afterlight_testkit::gpu();
    let on = tiny_stage(&gpu);
    let size = "shared/sort/size.comp";
    let rows_of = |groups: &str| {
        compiled_variant(
            size,
            &format!("{size}.glsl"),
            &[("uint rows = max(groups / size.row_groups + min(groups % size.row_groups, 1u), 1u);", groups)],
        )
    };
    let case = case("rows", random_items(24 * BATCH_ITEMS + 9), Asked::OnDevice(u32::MAX), KeyBits::Low24);
    let rows_of_four = rows_of("uint rows = max(groups / 4u + min(groups % 4u, 1u), 1u);");
    check(&on, std::slice::from_ref(&case), &[rows_of_four]);
    // The last batch has no group.
    let too_few = rows_of("uint rows = 6u; groups -= 1u;");
    let found = sorted_with(&on, std::slice::from_ref(&case), &[too_few]).remove(0);
    assert!(found.items != case.expected(), "a batch without a group goes unseen");
}

/// No result depends on the size of subgroups.
#[test]
fn items_do_not_depend_on_the_size_of_subgroups() {
    let gpu = afterlight_testkit::gpu();
    let (stage, settings) = tiny_stage(&gpu);
    let cases =
        [case("", random_items(2 * BATCH_ITEMS + 9), Asked::Known(2 * BATCH_ITEMS + 9), KeyBits::Low8)];
    for size in subgroup_sizes(&gpu) {
        for pass in ["count", "scan", "scatter"] {
            let sorts = (&Sorts(&cases) as &dyn Technique, &Params::default());
            let pass = format!("0/sort {pass} 1");
            let mut prepared = stage.prepare_in_subgroups(sorts, &settings, &[], (&pass, Some(size)));
            let found = found(&mut prepared, &cases).remove(0);
            assert!(found.items == cases[0].expected(), "{pass} in subgroups of {size}: another order");
        }
    }
}

/// A pass of a sort of a count on the device that is wrong in one place.
fn mutant(pass: &str, header: &str, from: &str, to: &str) -> Shader {
    let header = format!("shared/sort/{header}");
    compiled_variant(&format!("shared/sort/{pass}.comp#counted"), &header, &[(from, to)])
}

#[test]
fn wrong_sorts_are_caught() {
    let gpu = afterlight_testkit::gpu();
    let on = tiny_stage(&gpu);
    let count = 3 * BATCH_ITEMS + 77;
    // Room of a batch behind the last item, farther than which no mutant writes; nor does any reach out of shared memory.
    let few: Vec<(u32, u32)> =
        (0..count + BATCH_ITEMS).map(|i| (i.wrapping_mul(0x9e37_79b9) >> 28, i)).collect();
    let by_one_digit = case("mutant", few, Asked::OnDevice(count), KeyBits::Low8);
    let by_two_digits = case("mutant", random_items(count), Asked::OnDevice(count), KeyBits::Low16);
    let (scan, scatter) = ("scan.comp.glsl", "scatter.comp.glsl");
    let mutants = [
        // The histogram off by one: sums that hold their own batch.
        ("scan", scan, "histogram[first + batch] = before;", "histogram[first + batch] = before + count;"),
        ("scatter", scatter, "const uint NO_ITEM = 0xffffffffu;", "const uint NO_ITEM = 0u;"),
        (
            "scatter",
            scatter,
            "places[slot] += uint(bitCount(peers));",
            "places[slot] = uint(bitCount(peers));",
        ),
        ("scatter", scatter, "places[t * DIGITS + digit] = of_digit;", "places[t * DIGITS + digit] = 0u;"),
        ("count", "count.comp.glsl", "first + round * THREADS < end", "first + round * THREADS + 1u < end"),
        ("count", "items.glsl", "key >> sort.shift", "key >> (sort.shift + 1u)"),
    ];
    for (pass, header, from, to) in mutants {
        let shader = mutant(pass, header, from, to);
        let found = sorted_with(&on, std::slice::from_ref(&by_one_digit), &[shader]).remove(0);
        assert!(found.items != by_one_digit.expected(), "{pass}: {to:?} goes unseen");
    }
    // Ranks that are right but for the order of equal keys: lanes from last to first, teams in another order than that of their items.
    let unstable = [
        ("peers & ((1u << lane()) - 1u)", "peers & ~((2u << lane()) - 1u)"),
        (
            "(team() * ROUNDS + round) * TEAM_THREADS",
            "((TEAMS - 1u - team()) * ROUNDS + round) * TEAM_THREADS",
        ),
    ];
    for (from, to) in unstable {
        let shader = mutant("scatter", scatter, from, to);
        let found =
            sorted_with(&on, std::slice::from_ref(&by_one_digit), std::slice::from_ref(&shader)).remove(0);
        let (found, expected) = (found.items, by_one_digit.expected());
        let keys = |items: &[(u32, u32)]| items.iter().map(|(key, _)| *key).collect::<Vec<_>>();
        assert_eq!(keys(&found), keys(&expected), "{to}: not even the keys are in order");
        assert!(found != expected, "{to}: a sort that is not stable goes unseen");
        // Digits above the first ask for the order of those below.
        let found = sorted_with(&on, std::slice::from_ref(&by_two_digits), &[shader]).remove(0);
        let low = |(key, _): &(u32, u32)| key & 0xffff;
        assert!(!found.items.is_sorted_by_key(low), "{to}: goes unseen by two digits");
    }
}

/// Bits of floats as the shaders make them are those that the host makes.
#[test]
fn sortable_bits_of_the_device_are_those_of_the_host() {
    let gpu = afterlight_testkit::gpu();
    let (stage, _) = tiny_stage(&gpu);
    let header = "shared/sort/sortable.glsl";
    let different = |replaced: &[(&str, &str)]| {
        let found = found_by(&stage, "sortable.comp", (header, replaced), (3 * 256, 4));
        let differs = |(place, found): &(usize, &[f64])| {
            let value = f32::from_bits(*place as u32 * 0x00ef_fff1);
            let bits = (found[0] as u32) << 16 | found[1] as u32;
            bits != sort::sortable_bits(value) || found[2] != 1.0
        };
        found.chunks_exact(3).enumerate().filter(differs).count()
    };
    assert_eq!(different(&[]), 0);
    assert!(different(&[("? ~bits : bits | 0x80000000u", "? bits : bits | 0x80000000u")]) > 100);
}
