//! Frames in flight along a camera path: what they take when nobody waits for them.

use afterlight_measure::{
    CapacityEvent, Distribution, HITCH_FACTOR, Hitch, PlanEvent, Play, PlayMemory, Played, SCHEMA,
    SettingsRecord, Spread,
};
use std::sync::Arc;

use afterlight_renderer::{Done, Event, FlightOptions, FrameContext, ScenePose, Shortfall};
use afterlight_scene::camera::CameraPath;
use afterlight_scene::{Camera, Moment, Pose, Scene};

use crate::{
    Chosen, FrameSpec, LabError, Listener, Session,
    spec::{check, check_samples},
    turns::{Flights, Turn},
};

/// Most frames of a path.
pub const PLAY_FRAMES_MAX: u64 = 1_000_000;

/// Neighbours on each side by which a hitch is judged.
const NEIGHBOURS: usize = 8;

/// How a path is played.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaySpec {
    /// Frames, 1 to [`PLAY_FRAMES_MAX`].
    pub frames: u64,
    /// Frames a second of the scene's time, above 0.
    pub fps: f64,
    /// Time that the path takes, seconds; its own where none is given.
    pub path_s: Option<f64>,
    /// Frames on their way at once, 1 to 8.
    pub in_flight: u32,
    /// Frames after which the next technique takes its turn.
    pub switch_every: Option<u32>,
    /// Image sizes, width and height in pixels, that take turns with the techniques; none for the size of the frames.
    pub sizes_px: Vec<[u32; 2]>,
    /// Samples a pixel that take turns with the techniques; none for those of the frames.
    pub samples: Vec<u32>,
}

impl Default for PlaySpec {
    fn default() -> Self {
        Self {
            frames: 300,
            fps: 60.0,
            path_s: None,
            in_flight: 3,
            switch_every: None,
            sizes_px: Vec::new(),
            samples: Vec::new(),
        }
    }
}

impl PlaySpec {
    /// Checks ranges.
    ///
    /// # Errors
    /// The first setting that is out of its range, with the range.
    pub fn check(&self) -> Result<(), LabError> {
        let expected = format!("a whole number from 1 to {PLAY_FRAMES_MAX}");
        check("frames", self.frames, (1..=PLAY_FRAMES_MAX).contains(&self.frames), expected)?;
        check("fps", self.fps, self.fps > 0.0 && self.fps.is_finite(), "a number above 0")?;
        check("in-flight", self.in_flight, (1..=8).contains(&self.in_flight), "a whole number from 1 to 8")?;
        if let Some(every) = self.switch_every {
            check("switch-every", every, every > 0, "a whole number above 0")?;
        }
        for [width_px, height_px] in &self.sizes_px {
            let size = format!("{width_px}x{height_px}");
            check("sizes", size, *width_px > 0 && *height_px > 0, "pixels, at least 1x1")?;
        }
        self.samples.iter().try_for_each(|count| check_samples(*count))?;
        let expected = "--switch-every, which says when they take turns";
        check("sizes", "none", !self.changes() || self.switch_every.is_some(), expected)
    }

    /// Whether size or samples take turns, so that each turn is prepared during the turn before.
    pub fn changes(&self) -> bool {
        !self.sizes_px.is_empty() || !self.samples.is_empty()
    }

    /// Time of the scene in a frame, seconds.
    fn time_s(&self, frame: u64) -> f64 {
        frame as f64 / self.fps
    }

    /// Place of a frame on a path that takes `path_s` seconds, 0 to 1. A path that is longer than the frames is flown in part; of a shorter one the
    /// end holds, unless it is `closed` and begins anew.
    fn place(&self, frame: u64, path_s: f64, closed: bool) -> f32 {
        self.rounds_and_place(frame, path_s, closed).1
    }

    /// Rounds of the path that lie behind a frame, and its place within the path.
    fn rounds_and_place(&self, frame: u64, path_s: f64, closed: bool) -> (f64, f32) {
        let path_s = self.path_s.unwrap_or(path_s);
        let rounds = if path_s > 0.0 { self.time_s(frame) / path_s } else { 0.0 };
        match closed && rounds > 1.0 {
            true => (rounds.floor(), rounds.fract() as f32),
            false => (0.0, rounds.min(1.0) as f32),
        }
    }

    /// Whether the camera jumps between two frames.
    fn is_cut_between(&self, path: &CameraPath, from: u64, to: u64) -> bool {
        let places = [from, to].map(|frame| {
            let (rounds, place) = self.rounds_and_place(frame, path.duration_s(), path.closed);
            rounds + f64::from(place)
        });
        path.is_cut_between_places(places[0], places[1])
    }

    /// The camera of a frame.
    fn camera(&self, path: &CameraPath, frame: u64) -> Camera {
        path.at(self.place(frame, path.duration_s(), path.closed))
    }
}

/// Sees the pictures of frames: RGBA with 8 bits a channel, sRGB-encoded, rows from the top.
pub type SeesPicture<'a> = dyn FnMut(u64, &[u8]) -> Result<(), LabError> + 'a;

/// What was seen of a frame.
struct Seen {
    /// What drew it, by its place in a round of turns.
    turn: usize,
    start_ns: Option<f64>,
    end_ns: Option<f64>,
    gpu_ns: Option<f64>,
    cpu_ms: f64,
    events: Vec<Event>,
    fell_short: bool,
}

/// Plays a path through a scene that plays its first animation, with one technique after another. `sees` gets every picture, where there is one
/// who wants them.
///
/// # Errors
/// A technique that cannot draw these frames, a motion that mirrors an instance, the device, those of `sees`.
pub fn play(
    (session, scene): (&Session, &Scene),
    spec: &FrameSpec,
    (path, how): (&CameraPath, &PlaySpec),
    chosen: &[Chosen],
    mut sees: Option<&mut SeesPicture<'_>>,
    listener: &dyn Listener,
) -> Result<Play, LabError> {
    how.check()?;
    let mut poses = Poses::of(scene, spec);
    let options = FlightOptions {
        in_flight: how.in_flight,
        shortfall: Shortfall::DrawAgain,
        pictures: sees.is_some(),
        scene_moves: poses.is_some(),
        plans_ahead: true,
    };
    let first = how.camera(path, 0);
    let task = listener.task("preparing", chosen.len() as u64);
    let turns = Turn::all(spec, how, chosen);
    let tell = |id: &str| {
        task.at(id);
        task.advance();
    };
    let mut flights = Flights::new(session, (chosen, &turns, how.changes()), (&first, options), &tell)?;
    drop(task);

    let task = listener.task("frames", how.frames);
    let mut seen: Vec<Option<Seen>> = (0..how.frames).map(|_| None).collect();
    let mut failed = None;
    // Of each turn.
    let mut last_frames: Vec<Option<u64>> = vec![None; turns.len()];
    for frame in 0..=how.frames {
        let mut done = |turn: usize, done: &Done<'_>| {
            seen[done.index as usize] = Some(Seen::of(turn, done));
            if let (Some(sees), Some(rgba8)) = (&mut sees, done.rgba8)
                && failed.is_none()
            {
                failed = sees(done.index, rgba8).err();
            }
            task.advance();
            Ok(())
        };
        if frame < how.frames {
            let camera = how.camera(path, frame);
            let turn = how.switch_every.map_or(0, |every| frame / u64::from(every));
            flights.turn_to(turn, (frame, &camera), &mut done)?;
            let time_s = how.time_s(frame);
            let pose = poses.as_mut().map(|poses| poses.at(time_s));
            let last = last_frames[turn as usize % turns.len()].replace(frame);
            let cut = last.is_some_and(|last| how.is_cut_between(path, last, frame));
            flights.frame(FrameContext { index: frame, time_s, cut, camera, pose }, &mut done)?;
        } else {
            flights.land(&mut done)?;
            flights.end(how.frames);
        }
        if let Some(error) = failed.take() {
            return Err(error);
        }
    }
    drop(task);
    let seen: Vec<Seen> = seen.into_iter().flatten().collect();
    Ok(record(session, spec, (path, how), (chosen, &turns, &flights), &seen))
}

/// Poses of a scene whose first animation plays.
struct Poses<'a> {
    scene: &'a Scene,
    pose: Pose,
    lights_move: bool,
}

impl<'a> Poses<'a> {
    /// `None` where nothing moves: without an animation, or where a time is fixed.
    fn of(scene: &'a Scene, spec: &FrameSpec) -> Option<Self> {
        // Seeded lights stand still.
        let lights_move = spec.lights == 0 && !scene.light_nodes.is_empty();
        (!scene.animations.is_empty() && spec.time_s.is_none()).then(|| Self {
            scene,
            pose: Pose::default(),
            lights_move,
        })
    }

    fn at(&mut self, time_s: f64) -> Arc<ScenePose> {
        self.scene.pose_into(Moment::at(time_s), &mut self.pose);
        Arc::new(ScenePose::of(self.scene, &self.pose, self.lights_move))
    }
}

impl Seen {
    fn of(turn: usize, done: &Done<'_>) -> Seen {
        Seen {
            turn,
            start_ns: done.times.start_ns,
            end_ns: done.times.end_ns,
            gpu_ns: done.times.frame_ns,
            cpu_ms: done.cpu.as_secs_f64() * 1e3,
            events: done.events.to_vec(),
            fell_short: done.fell_short,
        }
    }
}

/// From the end of each frame to the end of the next, milliseconds; the first frame has none.
fn intervals_ms(seen: &[Seen]) -> Option<Vec<f64>> {
    let ends_ns: Vec<f64> = seen.iter().map(|frame| frame.end_ns).collect::<Option<_>>()?;
    Some(ends_ns.windows(2).map(|ends| (ends[1] - ends[0]) * 1e-6).collect())
}

/// Fraction of the time in which the device had no frame to work on.
fn idle_fraction(seen: &[Seen]) -> Option<f64> {
    let spans: Vec<[f64; 2]> =
        seen.iter().map(|frame| Some([frame.start_ns?, frame.end_ns?])).collect::<Option<_>>()?;
    let ([start_ns, _], [_, end_ns]) = (*spans.first()?, *spans.last()?);
    let idle_ns: f64 = spans.windows(2).map(|pair| (pair[1][0] - pair[0][1]).max(0.0)).sum();
    (end_ns > start_ns).then(|| idle_ns / (end_ns - start_ns))
}

/// Frames that took longer than their neighbours. `intervals_ms[i]` is the time of frame `i + 1`.
fn hitches(intervals_ms: &[f64], seen: &[Seen], turns: &[String]) -> Vec<Hitch> {
    let mut hitches = Vec::new();
    for (i, ms) in intervals_ms.iter().copied().enumerate() {
        let from = i.saturating_sub(NEIGHBOURS);
        let end = (i + 1 + NEIGHBOURS).min(intervals_ms.len());
        // Another technique's frames are no neighbours, nor are those of another size.
        let is_beside = |k: &usize| *k != i && seen[k + 1].turn == seen[i + 1].turn;
        let beside: Vec<f64> = (from..end).filter(is_beside).map(|k| intervals_ms[k]).collect();
        let Some(Spread { median: neighbours_ms, .. }) = Spread::of(&beside) else { continue };
        if ms > HITCH_FACTOR * neighbours_ms {
            let frame = &seen[i + 1];
            let mut causes: Vec<String> = frame.events.iter().map(cause).collect();
            if seen[i].turn != frame.turn {
                causes.push(format!("switched to {}", turns[frame.turn]));
            }
            hitches.push(Hitch { frame: (i + 1) as u64, ms, neighbours_ms, causes });
        }
    }
    hitches
}

fn cause(event: &Event) -> String {
    match event {
        Event::Planned => "planned anew for its view".to_owned(),
        Event::Grown(counter) => format!("{} grew", counter.name),
        Event::PlanBegun => "began a larger plan".to_owned(),
        Event::PlanTaken => "first with a larger plan".to_owned(),
        Event::DrawnAgain => "drawn again".to_owned(),
    }
}

fn record(
    session: &Session,
    spec: &FrameSpec,
    (path, how): (&CameraPath, &PlaySpec),
    (chosen, turns, flights): (&[Chosen], &[Turn], &Flights<'_>),
    seen: &[Seen],
) -> Play {
    let ids: Vec<&str> = chosen.iter().map(Chosen::id).collect();
    let names: Vec<String> = turns.iter().map(|turn| turn.name(ids[turn.technique], how.changes())).collect();
    let played = |technique: usize| {
        let of = || seen.iter().filter(move |frame| turns[frame.turn].technique == technique);
        let gpu_ms: Vec<f64> = of().filter_map(|frame| frame.gpu_ns).map(|ns| ns * 1e-6).collect();
        let cpu_ms: Vec<f64> = of().map(|frame| frame.cpu_ms).collect();
        Played {
            technique: ids[technique].to_owned(),
            frames: of().count() as u64,
            gpu_ms: Distribution::of(&gpu_ms),
            cpu_ms: Distribution::of(&cpu_ms),
            moves_without_plans: of().all(|frame| !frame.events.contains(&Event::Planned)),
        }
    };
    let grown = |(frame, seen): (u64, &Seen)| -> Vec<CapacityEvent> {
        let one = |event: &Event| match event {
            Event::Grown(short) => Some(CapacityEvent {
                frame,
                list: short.name.to_owned(),
                needed: short.needed,
                capacity: short.capacity,
                dropped: short.dropped,
            }),
            Event::Planned | Event::PlanBegun | Event::PlanTaken | Event::DrawnAgain => None,
        };
        seen.events.iter().filter_map(one).collect()
    };
    let intervals_ms = intervals_ms(seen);
    let cpu_ms: Vec<f64> = seen.iter().map(|frame| frame.cpu_ms).collect();
    let bytes = flights.flights().iter().map(|(_, flight)| flight.bytes());
    let memory = bytes.fold(PlayMemory::default(), |sum, (plan, own)| PlayMemory {
        plan_bytes: sum.plan_bytes + plan,
        in_flight_bytes: sum.in_flight_bytes + own,
    });
    Play {
        schema: SCHEMA,
        device: session.device.clone(),
        scene: session.scene.clone(),
        settings: SettingsRecord {
            camera: how.camera(path, 0).name.to_string(),
            ..session.settings_record(spec, u32::try_from(how.frames).unwrap_or(u32::MAX), ids[0])
        },
        path: path.name.clone(),
        fps: how.fps,
        in_flight: how.in_flight,
        switch_every: how.switch_every,
        techniques: (0..chosen.len()).map(played).collect(),
        frame_ms: intervals_ms.as_deref().and_then(Distribution::of),
        cpu_ms: Distribution::of(&cpu_ms),
        idle_fraction: idle_fraction(seen),
        hitches: intervals_ms.map_or_else(Vec::new, |intervals_ms| hitches(&intervals_ms, seen, &names)),
        capacity_events: (0..).zip(seen).flat_map(grown).collect(),
        fell_short: (0..).zip(seen).filter(|(_, frame)| frame.fell_short).map(|(index, _)| index).collect(),
        plans: plans(seen),
        memory,
        held: flights.held.clone(),
    }
}

/// Larger plans by the frames that began and took them. Of one turn there is one at a time.
fn plans(seen: &[Seen]) -> Vec<PlanEvent> {
    let mut plans: Vec<(usize, PlanEvent)> = Vec::new();
    for (frame, Seen { turn, events, .. }) in (0..).zip(seen) {
        for event in events {
            let open = plans.iter_mut().rfind(|(of, plan)| of == turn && plan.taken.is_none());
            match (event, open) {
                (Event::PlanBegun, _) => {
                    plans.push((*turn, PlanEvent { begun: Some(frame), taken: None }));
                }
                (Event::PlanTaken, Some((_, plan))) => plan.taken = Some(frame),
                (Event::PlanTaken, None) => {
                    plans.push((*turn, PlanEvent { begun: None, taken: Some(frame) }));
                }
                _ => {}
            }
        }
    }
    plans.into_iter().map(|(_, plan)| plan).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(turn: usize, start_ms: f64, end_ms: f64) -> Seen {
        Seen {
            turn,
            start_ns: Some(start_ms * 1e6),
            end_ns: Some(end_ms * 1e6),
            gpu_ns: None,
            cpu_ms: 0.0,
            events: Vec::new(),
            fell_short: false,
        }
    }

    /// Frames of 10 ms, one of which takes 30 and waits 10 before it.
    fn frames() -> Vec<Seen> {
        let mut frames: Vec<Seen> =
            (0..20).map(|i| frame(0, 10.0 * f64::from(i), 10.0 * f64::from(i + 1))).collect();
        for (i, one) in frames.iter_mut().enumerate().skip(12) {
            let shift_ns = if i == 12 { [10e6, 30e6] } else { [30e6; 2] };
            one.start_ns = one.start_ns.map(|ns| ns + shift_ns[0]);
            one.end_ns = one.end_ns.map(|ns| ns + shift_ns[1]);
        }
        frames[12].events.push(Event::Planned);
        frames
    }

    #[test]
    fn a_frame_that_takes_four_times_as_long_is_a_hitch() {
        let seen = frames();
        let intervals_ms = intervals_ms(&seen).expect("timestamps");
        let found = hitches(&intervals_ms, &seen, &["a".to_owned()]);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!(
            (found[0].frame, found[0].causes.as_slice()),
            (12, &["planned anew for its view".to_owned()][..])
        );
        assert!((found[0].ms - 40.0).abs() < 1e-9 && (found[0].neighbours_ms - 10.0).abs() < 1e-9);
        let without = vec![Seen { end_ns: None, ..frame(0, 0.0, 1.0) }];
        assert_eq!(super::intervals_ms(&without), None);
    }

    #[test]
    fn idle_time_is_what_lies_between_frames() {
        let idle = idle_fraction(&frames()).expect("timestamps");
        assert!((idle - 10.0 / 230.0).abs() < 1e-9, "{idle}");
    }

    /// A slower technique is no hitch, unless its first frame is slower than its others.
    #[test]
    fn other_techniques_are_no_neighbours() {
        let (mut seen, mut now_ms) = (Vec::new(), 0.0);
        for i in 0..24 {
            let technique = i / 6 % 2;
            let ms = if technique == 1 { 40.0 } else { 10.0 };
            seen.push(frame(technique, now_ms, now_ms + ms));
            now_ms += ms;
        }
        let intervals_ms = intervals_ms(&seen).expect("timestamps");
        assert!(hitches(&intervals_ms, &seen, &["a", "b"].map(str::to_owned)).is_empty());
    }

    #[test]
    fn plans_are_told_by_the_frames_that_began_and_took_them() {
        let mut seen: Vec<Seen> = (0..9).map(|i| frame(i / 6, 0.0, 1.0)).collect();
        seen[1].events.push(Event::PlanBegun);
        seen[4].events.push(Event::PlanTaken);
        seen[5].events.push(Event::PlanTaken);
        seen[6].events.extend([Event::PlanBegun, Event::PlanTaken, Event::DrawnAgain]);
        seen[7].events.push(Event::PlanBegun);
        let told: Vec<_> = plans(&seen).iter().map(|plan| (plan.begun, plan.taken)).collect();
        assert_eq!(told, [(Some(1), Some(4)), (None, Some(5)), (Some(6), Some(6)), (Some(7), None)]);
    }

    /// A path that jumps in its middle, and where it begins anew.
    #[test]
    fn cuts_of_the_path_are_cuts_of_frames() {
        let json = r#"{"name": "jumps", "closed": true, "keyframes": [
            {"time_s": 0.0, "eye_ws": [0, 0, 0], "target_ws": [0, 0, -1], "fov_deg": 50, "cut": true},
            {"time_s": 1.0, "eye_ws": [1, 0, 0], "target_ws": [1, 0, -1], "fov_deg": 50},
            {"time_s": 1.0, "eye_ws": [9, 0, 0], "target_ws": [9, 0, -1], "fov_deg": 50, "cut": true},
            {"time_s": 2.0, "eye_ws": [9, 1, 0], "target_ws": [9, 1, -1], "fov_deg": 50}]}"#;
        let path = CameraPath::from_json(json, std::path::Path::new("jumps.json")).expect("a path");
        let how = PlaySpec { frames: 30, fps: 4.0, path_s: Some(2.0), ..PlaySpec::default() };
        let cuts = (1..30).filter(|frame| how.is_cut_between(&path, frame - 1, *frame));
        let jump = |frame: &u64| {
            let [from, to] = [frame - 1, *frame].map(|frame| how.camera(&path, frame).eye_ws());
            from.distance(to) > 2.0
        };
        let jumps: Vec<u64> = (1..30).filter(jump).collect();
        assert_eq!(cuts.collect::<Vec<_>>(), jumps);
        assert!(jumps.len() > 4, "{jumps:?}");
    }

    #[test]
    fn places_run_along_the_path() {
        let how = PlaySpec { frames: 11, fps: 10.0, ..PlaySpec::default() };
        assert_eq!([0, 5, 10].map(|frame| how.place(frame, 1.0, false)), [0.0, 0.5, 1.0]);
        assert_eq!([5, 10].map(|frame| how.place(frame, 0.5, false)), [1.0, 1.0], "the end holds");
        assert!((how.place(6, 0.5, true) - 0.2).abs() < 1e-6, "a closed path begins anew");
        assert_eq!(how.place(7, 0.0, false), 0.0, "a path of one keyframe");
        let slower = PlaySpec { path_s: Some(2.0), ..how.clone() };
        assert_eq!(slower.place(10, 1.0, false), 0.5);
    }
}
