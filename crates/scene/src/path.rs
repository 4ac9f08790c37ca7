//! Camera paths: where the eye is and what it looks at, over time.
//!
//! A path comes from keyframes (a JSON file, whose form `docs/camera-paths.md` tells, or one of the paths that come with the
//! program), from the bounds of a scene, or from a camera of a glTF file whose node is animated.

mod named;

use std::path::Path;

use glam::{Affine3A, DAffine3, DQuat, DVec3, Quat, Vec3};
use serde::{Deserialize, Serialize};

use crate::{
    Aabb, Camera, Scene, SceneError,
    animation::{NodeTrack, slerp},
    camera::{EXTERIOR_FOV_DEG, INTERIOR_FOV_DEG, NEAR_MAX_M, default_camera},
    pose::rigid,
};

/// Time between two keyframes where a path gives none, seconds: long enough that a walk through a hall is one.
const SPAN_S: f64 = 2.0;

/// Latest time of a path, seconds: ten days, within which 64 bits tell frames apart by less than a nanosecond.
const TIME_MAX_S: f64 = 864_000.0;

/// A place on a camera path. It has a target or a rotation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Keyframe {
    /// Time, seconds, 0 or more, rising from keyframe to keyframe; a cut may have that of the keyframe before. Either all keyframes of a
    /// path have times or none: then they are at even times.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    /// Position of the eye in the file's coordinates, metres.
    pub eye_ws: [f64; 3],
    /// Point that is looked at in the file's coordinates, metres; +Y is up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target_ws: Option<[f64; 3]>,
    /// The file's space from the camera's, a quaternion x, y, z, w of any length but 0, as glTF's nodes have it: the camera looks
    /// along its −Z, +Y up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<[f64; 4]>,
    /// Vertical angle of view, degrees, between 0 and 180.
    pub fov_deg: f32,
    /// Whether the view jumps here: the camera stands at the keyframe before until this one's time. What a frame keeps of the one before
    /// it is then of no use ([`CameraPath::shot_at`]).
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub cut: bool,
}

/// A camera path: a Catmull-Rom spline through keyframes, or the way of a camera of the file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CameraPath {
    /// Name for reports.
    pub name: String,
    /// Near plane, metres.
    pub near_m: f32,
    /// Whether the path returns from the last keyframe to the first.
    pub closed: bool,
    #[serde(rename = "duration_s", skip_serializing_if = "Option::is_none")]
    given_duration_s: Option<f64>,
    keyframes: Vec<Keyframe>,
    /// [`Scene::origin_file`] of the scene that the path leads through: what cameras of the path are relative to.
    #[serde(skip)]
    pub origin_file: DVec3,
    /// Times of the keyframes, seconds; of a closed path also the one at which the first is reached again.
    #[serde(skip)]
    times_s: Vec<f64>,
    /// The camera of the file that it is the way of.
    #[serde(skip)]
    rider: Option<Rider>,
}

/// A path as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    name: String,
    #[serde(default = "default_near_m")]
    near_m: f32,
    #[serde(default)]
    closed: bool,
    /// Time of a whole round, or from the first keyframe to the last, seconds. Of keyframes with times it may be left out, and says
    /// for a closed path when the first keyframe is reached again.
    #[serde(default)]
    duration_s: Option<f64>,
    keyframes: Vec<Keyframe>,
}

/// A camera on a node that an animation moves.
#[derive(Clone, Debug, PartialEq)]
struct Rider {
    /// The camera as it was loaded.
    camera: Camera,
    /// Nodes from the root to the camera's own, each at rest, with its motion.
    chain: Vec<(DAffine3, Option<NodeTrack>)>,
    /// Time after which it all begins again, seconds.
    duration_s: f64,
}

fn default_near_m() -> f32 {
    NEAR_MAX_M
}

/// What is interpolated between keyframes.
trait Spline:
    Copy + std::ops::Mul<f64, Output = Self> + std::ops::Add<Output = Self> + std::ops::Sub<Output = Self>
{
}
impl Spline for DVec3 {}
impl Spline for DQuat {}

/// A span of the path: the values of four keyframes in a row with their times; the time wanted is between the middle two.
struct Span {
    keys: [usize; 4],
    times_s: [f64; 4],
    /// Place between the middle two, 0 to 1.
    u: f64,
}

impl Span {
    /// The Catmull-Rom spline through values at uneven times (Catmull, Rom 1974): the slope at a keyframe is that of the chord between
    /// its neighbours.
    fn value<T: Spline>(&self, of: impl Fn(usize) -> T) -> T {
        let [p0, p1, p2, p3] = self.keys.map(of);
        let [t0, t1, t2, t3] = self.times_s;
        let slope = |a: T, b: T, span_s: f64| (b - a) * if span_s > 0.0 { (t2 - t1) / span_s } else { 0.0 };
        let (m1, m2) = (slope(p0, p2, t2 - t0), slope(p1, p3, t3 - t1));
        let (u, u2, u3) = (self.u, self.u * self.u, self.u * self.u * self.u);
        p1 * (2.0 * u3 - 3.0 * u2 + 1.0)
            + m1 * (u3 - 2.0 * u2 + u)
            + p2 * (3.0 * u2 - 2.0 * u3)
            + m2 * (u3 - u2)
    }
}

impl CameraPath {
    /// Reads a path from a JSON file.
    ///
    /// # Errors
    /// [`SceneError::Io`] where the file cannot be read, [`SceneError::Invalid`] where it is no path.
    pub fn load(file: &Path) -> Result<Self, SceneError> {
        let bytes = crate::load::read_file(file)?;
        let text = String::from_utf8(bytes)
            .map_err(|_| SceneError::invalid(file, "camera path", "bytes that are no UTF-8", "JSON"))?;
        Self::from_json(&text, file)
    }

    /// Reads a path from JSON; `file` is named in errors.
    ///
    /// # Errors
    /// [`SceneError::Invalid`] where the text is no path: no JSON, a field that is unknown or missing, a value out of its range, times out of
    /// order. The message names the place.
    pub fn from_json(text: &str, file: &Path) -> Result<Self, SceneError> {
        let written: Written = serde_json::from_str(text).map_err(|e| {
            SceneError::invalid(
                file,
                "camera path",
                e.to_string(),
                "keyframes with eye_ws, target_ws or rotation, fov_deg",
            )
        })?;
        let Written { name, near_m, closed, duration_s, keyframes } = written;
        let path = Self::of_keyframes(&name, near_m, closed, duration_s, keyframes);
        path.check(file)?;
        Ok(path)
    }

    fn check(&self, file: &Path) -> Result<(), SceneError> {
        let wrong =
            |at: String, found: String, expected: &str| Err(SceneError::invalid(file, at, found, expected));
        if self.keyframes.is_empty() {
            return wrong("keyframes".to_owned(), "none".to_owned(), "at least one");
        }
        if !(self.near_m > 0.0 && self.near_m.is_finite()) {
            return wrong("near_m".to_owned(), self.near_m.to_string(), "a positive number");
        }
        if let Some(duration_s) = self.given_duration_s.filter(|d| !(*d > 0.0 && *d <= TIME_MAX_S)) {
            return wrong(
                "duration_s".to_owned(),
                duration_s.to_string(),
                "seconds, more than 0, at most 864000",
            );
        }
        for (i, k) in self.keyframes.iter().enumerate() {
            let at = |field: &str| format!("keyframes[{i}]{field}");
            if !(k.fov_deg > 0.0 && k.fov_deg < 180.0) {
                return wrong(at(".fov_deg"), k.fov_deg.to_string(), "degrees between 0 and 180");
            }
            // Cameras have 32 bits.
            let numbers =
                k.eye_ws.iter().chain(k.target_ws.iter().flatten()).chain(k.rotation.iter().flatten());
            if !numbers.into_iter().all(|v| (*v as f32).is_finite()) {
                return wrong(at(""), "a number out of range".to_owned(), "finite numbers");
            }
            match (k.target_ws, k.rotation) {
                (Some(_), Some(_)) => {
                    return wrong(at(""), "target_ws and rotation".to_owned(), "one of them");
                }
                (None, None) => {
                    return wrong(at(""), "neither target_ws nor rotation".to_owned(), "one of them");
                }
                (Some(target_ws), None) if target_ws == k.eye_ws => {
                    return wrong(at(".target_ws"), "the eye".to_owned(), "a point off the eye");
                }
                (None, Some(rotation)) if rotation.map(|v| v as f32) == [0.0; 4] => {
                    return wrong(
                        at(".rotation"),
                        "a quaternion of length 0".to_owned(),
                        "a rotation x, y, z, w",
                    );
                }
                _ => {}
            }
            if k.rotation.is_some() != self.keyframes[0].rotation.is_some() {
                let form = |k: &Keyframe| if k.rotation.is_some() { "rotation" } else { "target_ws" };
                let expected = format!("{}, as keyframes[0] has", form(&self.keyframes[0]));
                return wrong(at(""), form(k).to_owned(), &expected);
            }
            if i == 0 && k.cut && !self.closed {
                return wrong(at(".cut"), "true".to_owned(), "false: nothing comes before it");
            }
        }
        self.check_times(file)
    }

    fn check_times(&self, file: &Path) -> Result<(), SceneError> {
        let wrong =
            |at: String, found: String, expected: String| Err(SceneError::invalid(file, at, found, expected));
        let said = |time_s: Option<f64>| time_s.map_or_else(|| "none".to_owned(), |t| t.to_string());
        let mut before = None;
        for (i, k) in self.keyframes.iter().enumerate() {
            let at = format!("keyframes[{i}].time_s");
            if k.time_s.is_some() != self.keyframes[0].time_s.is_some() {
                let expected = if k.time_s.is_some() {
                    "none, as keyframes[0] has"
                } else {
                    "a time, as keyframes[0] has"
                };
                return wrong(at, said(k.time_s), expected.to_owned());
            }
            let Some(time_s) = k.time_s else { continue };
            if !(0.0..=TIME_MAX_S).contains(&time_s) {
                return wrong(at, time_s.to_string(), "seconds, 0 to 864000".to_owned());
            }
            let is_later = before.is_none_or(|before| if k.cut { time_s >= before } else { time_s > before });
            if !is_later {
                let expected = format!("more than the {} of the keyframe before", said(before));
                return wrong(at, time_s.to_string(), expected);
            }
            before = Some(time_s);
        }
        let (first, last) = (self.keyframes[0].time_s, before);
        if let (Some(first), Some(last), Some(duration_s)) = (first, last, self.given_duration_s) {
            let fits = if self.closed {
                duration_s > last - first
            } else {
                (duration_s - (last - first)).abs() < 1e-6
            };
            if !fits {
                let from = last - first;
                let expected = if self.closed {
                    format!("more than the {from} from the first keyframe to the last")
                } else {
                    format!("the {from} from the first keyframe to the last, or none")
                };
                return wrong("duration_s".to_owned(), duration_s.to_string(), expected);
            }
        }
        Ok(())
    }

    /// The path with the times of its keyframes found.
    fn timed(mut self) -> Self {
        let count = self.keyframes.len();
        let spans = if self.closed { count } else { count.saturating_sub(1) };
        let given: Option<Vec<f64>> = self.keyframes.iter().map(|k| k.time_s).collect();
        self.times_s = match given.filter(|times_s| !times_s.is_empty()) {
            Some(mut times_s) => {
                if self.closed {
                    let (first, last) = (times_s[0], times_s[count - 1]);
                    let mean_s = if last > first { (last - first) / (count - 1) as f64 } else { SPAN_S };
                    times_s
                        .push(self.given_duration_s.map_or(last + mean_s, |duration_s| first + duration_s));
                }
                times_s
            }
            None => {
                let duration_s = self.given_duration_s.unwrap_or(SPAN_S * spans as f64);
                let even = |k: usize| duration_s * k as f64 / spans.max(1) as f64;
                (0..count + usize::from(self.closed)).map(even).collect()
            }
        };
        self
    }

    fn of_keyframes(
        name: &str,
        near_m: f32,
        closed: bool,
        given_duration_s: Option<f64>,
        keyframes: Vec<Keyframe>,
    ) -> Self {
        let name = name.to_owned();
        let (origin_file, times_s, rider) = (DVec3::ZERO, Vec::new(), None);
        Self { name, near_m, closed, given_duration_s, keyframes, origin_file, times_s, rider }.timed()
    }

    /// A fly-through of any scene, from its bounds alone: for an interior there and back along its
    /// longest axis at changing heights, else around its bounding sphere.
    pub fn fly_through(scene: &Scene) -> Self {
        let camera = default_camera(scene);
        let near_m = camera.clip_near_m();
        let bounds_ws = scene.bounds_ws();
        let (center_ws, size_m) = (bounds_ws.center(), bounds_ws.size());
        let sound = center_ws.is_finite() && size_m.is_finite() && size_m.max_element() > 0.0;
        let eye_ws = camera.eye_ws();
        let inside = sound && eye_ws.cmpge(bounds_ws.min).all() && eye_ws.cmple(bounds_ws.max).all();
        let mut keyframes = if inside { walk(&bounds_ws, eye_ws) } else { orbit(center_ws, eye_ws) };
        for point in keyframes.iter_mut().flat_map(|k| [Some(&mut k.eye_ws), k.target_ws.as_mut()]).flatten()
        {
            *point = (scene.origin_file + DVec3::from_array(*point)).to_array();
        }
        Self::of_keyframes(FLY_THROUGH, near_m, true, None, keyframes).through(scene)
    }

    /// The way of a camera of the scene, by its index, while the first animation plays; `None` where there is no such camera, or nothing moves
    /// it. After the animation's duration it begins again, as [`Scene::pose_at`] does.
    pub fn of_camera(scene: &Scene, index: usize) -> Option<Self> {
        let animation = scene.animations.first()?;
        let camera = scene.cameras.get(index)?;
        let attached = scene.camera_nodes.iter().find(|attached| attached.index as usize == index)?;
        let mut chain = Vec::new();
        let mut at = Some(attached.node);
        while let Some(node) = at {
            let found = scene.nodes.get(node as usize)?;
            let track = animation.tracks.iter().find(|track| track.node == node);
            chain.push((found.local, track.cloned()));
            // Parents come first: what does not is no way up.
            at = found.parent.filter(|&parent| parent < node);
        }
        chain.reverse();
        chain.iter().any(|(_, track)| track.is_some()).then_some(())?;
        let rider = Rider { camera: camera.clone(), chain, duration_s: animation.duration_s };
        let path = Self::of_keyframes(&camera.name, camera.clip_near_m(), true, None, Vec::new());
        Some(Self { rider: Some(rider), ..path }.through(scene))
    }

    /// Names of the paths through a scene that [`Self::select`] takes: those that come with the program for it, `fly-through`,
    /// and its cameras that the first animation moves.
    pub fn names(scene: &Scene) -> Vec<String> {
        let mut names: Vec<String> = named::of(scene).map(|route| route.name.to_owned()).collect();
        names.push(FLY_THROUGH.to_owned());
        let cameras = (0..scene.cameras.len()).filter_map(|index| Self::of_camera(scene, index));
        names.extend(cameras.map(|path| path.name));
        names
    }

    /// The path of that name through a scene; `None` where there is none.
    pub fn named(scene: &Scene, name: &str) -> Option<Self> {
        if let Some(route) = named::of(scene).find(|route| route.name == name) {
            return Some(route.path(scene));
        }
        if name == FLY_THROUGH {
            return Some(Self::fly_through(scene));
        }
        let mut cameras = (0..scene.cameras.len()).filter(|&index| *scene.cameras[index].name == *name);
        cameras.find_map(|index| Self::of_camera(scene, index))
    }

    /// The path that `--path` asks for: a name ([`Self::names`]) or a JSON file; without a request the first of the names.
    ///
    /// # Errors
    /// As [`Self::load`], where the request ends in `.json`; else [`SceneError::BadParameter`], which lists the names.
    pub fn select(scene: &Scene, request: Option<&str>) -> Result<Self, SceneError> {
        /// Names listed in a message.
        const LISTED_MAX: usize = 16;
        let Some(request) = request else {
            return Ok(named::of(scene)
                .next()
                .map_or_else(|| Self::fly_through(scene), |route| route.path(scene)));
        };
        if let Some(path) = Self::named(scene, request) {
            return Ok(path);
        }
        if Path::new(request).extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
            return Ok(Self::load(Path::new(request))?.through(scene));
        }
        let names: Vec<String> =
            Self::names(scene).iter().take(LISTED_MAX).map(|name| crate::error::one_line(name)).collect();
        Err(SceneError::BadParameter {
            name: "--path".to_owned(),
            found: format!("'{}'", crate::error::one_line(request)),
            expected: format!("one of {}, or a file named .json", names.join(", ")),
        })
    }

    /// The path through a scene: its cameras are relative to the scene's origin.
    pub fn through(self, scene: &Scene) -> Self {
        Self { origin_file: scene.origin_file, ..self }
    }

    /// The keyframes; none for a camera of the file.
    pub fn keyframes(&self) -> &[Keyframe] {
        &self.keyframes
    }

    /// Time from the beginning to the end, seconds; of a closed path that of a round. 0 for a single keyframe.
    pub fn duration_s(&self) -> f64 {
        match &self.rider {
            Some(rider) => rider.duration_s,
            None => self.end_s() - self.start_s(),
        }
    }

    /// Time of the first keyframe, seconds.
    fn start_s(&self) -> f64 {
        self.times_s.first().copied().unwrap_or(0.0)
    }

    fn end_s(&self) -> f64 {
        self.times_s.last().copied().unwrap_or(0.0)
    }

    /// The camera at `t` in [0, 1], clamped: 0 is the first keyframe, 1 the last (the first again where closed).
    pub fn at(&self, t: f32) -> Camera {
        let t = if t.is_finite() { f64::from(t.clamp(0.0, 1.0)) } else { 0.0 };
        self.camera_at(self.start_s() + t * self.duration_s())
    }

    /// The camera at a time, seconds. Before the first keyframe and after the last their views hold; a closed path goes round.
    pub fn camera_at(&self, time_s: f64) -> Camera {
        if let Some(rider) = &self.rider {
            return rider.camera_at(time_s, self.origin_file);
        }
        let Some(span) = self.span(self.within(time_s)) else {
            let fov_y_rad = EXTERIOR_FOV_DEG.to_radians();
            return Camera::look_at(&*self.name, Vec3::ZERO, Vec3::NEG_Z, fov_y_rad, self.near_m);
        };
        let key = |k: usize| &self.keyframes[k];
        let relative = |point: [f64; 3]| DVec3::from_array(point) - self.origin_file;
        let eye_ws = span.value(|k| relative(key(k).eye_ws)).as_vec3();
        let [from, to] = [key(span.keys[1]), key(span.keys[2])];
        let fov_deg = from.fov_deg + (to.fov_deg - from.fov_deg) * span.u as f32;
        let target = |k: usize| key(k).target_ws.map_or(DVec3::ZERO, relative);
        let target_ws = span.value(target).as_vec3();
        let camera = Camera::look_at(&*self.name, eye_ws, target_ws, fov_deg.to_radians(), self.near_m);
        if from.rotation.is_none() {
            return camera;
        }
        // Of the two quaternions of a rotation those on the side of the first.
        let turn = |k: usize| DQuat::from_array(key(k).rotation.unwrap_or([0.0, 0.0, 0.0, 1.0])).normalize();
        let side = turn(span.keys[1]);
        let near = |q: DQuat| if q.dot(side) < 0.0 { -q } else { q };
        let smooth = span.value(|k| near(turn(k)));
        let turned = if smooth.length_squared() > 0.01 {
            smooth.normalize()
        } else {
            // The spline has come near to nothing, as between opposite views.
            slerp(side, turn(span.keys[2]), span.u)
        };
        Camera { world_from_view: Affine3A::from_rotation_translation(turned.as_quat(), eye_ws), ..camera }
    }

    /// Number of the shot that a time is in, from 0: it rises by one at each cut, and at the end of a closed path where its first
    /// keyframe is a cut. Where it differs between two frames, what the one has kept of the other shows another view. A camera of the
    /// file has one shot, whose animation jumps where it begins again.
    pub fn shot_at(&self, time_s: f64) -> u64 {
        let round = |length_s: f64, from_s: f64| {
            let rounds = if length_s > 0.0 && time_s.is_finite() {
                ((time_s - from_s) / length_s).floor()
            } else {
                0.0
            };
            rounds.max(0.0) as u64
        };
        if let Some(rider) = &self.rider {
            return round(rider.duration_s, 0.0);
        }
        let within_s = self.within(time_s);
        let cuts = self.keyframes.iter().zip(&self.times_s).skip(1);
        let passed = cuts.filter(|(k, t)| k.cut && **t <= within_s).count() as u64;
        let cut_count = self.keyframes.iter().filter(|k| k.cut).count() as u64;
        let rounds = if self.closed { round(self.duration_s(), self.start_s()) } else { 0 };
        rounds * cut_count + passed
    }

    /// Whether the view jumps between two times, so that what the frame at the first has kept is of no use to that at the second.
    pub fn is_cut_between(&self, from_s: f64, to_s: f64) -> bool {
        self.shot_at(from_s) != self.shot_at(to_s)
    }

    /// The same between two places as [`Self::at`] takes them, 0 the first keyframe and 1 the last. Beyond 1 a closed path goes round.
    pub fn is_cut_between_places(&self, from: f64, to: f64) -> bool {
        let time_s = |place: f64| self.start_s() + place * self.duration_s();
        self.is_cut_between(time_s(from), time_s(to))
    }

    /// A time within the path's own: wrapped where it is closed.
    fn within(&self, time_s: f64) -> f64 {
        let (start_s, end_s) = (self.start_s(), self.end_s());
        if !time_s.is_finite() {
            return start_s;
        }
        if self.closed && end_s > start_s {
            return start_s + (time_s - start_s).rem_euclid(end_s - start_s);
        }
        time_s.clamp(start_s, end_s)
    }

    /// The span that a time within the path lies in; `None` without keyframes.
    fn span(&self, time_s: f64) -> Option<Span> {
        let count = self.keyframes.len();
        let spans = self.times_s.len().saturating_sub(1);
        if spans == 0 {
            return (count > 0).then_some(Span { keys: [0; 4], times_s: [0.0; 4], u: 0.0 });
        }
        let passed = self.times_s.partition_point(|&t| t <= time_s);
        let first = passed.saturating_sub(1);
        if first == spans {
            // The end of an open path is its last keyframe, that of a round its first.
            let end = if self.closed { 0 } else { count - 1 };
            return Some(Span { keys: [end; 4], times_s: [0.0; 4], u: 0.0 });
        }
        let is_cut = |k: usize| self.keyframes[k % count].cut;
        if is_cut(first + 1) {
            return Some(Span { keys: [first; 4], times_s: [0.0; 4], u: 0.0 });
        }
        let (t1, t2) = (self.times_s[first], self.times_s[first + 1]);
        let span_s = t2 - t1;
        // At an end and beside a cut the spline ends: the neighbour that is not there is the keyframe itself, a span away.
        let (before, t0) = match first {
            _ if is_cut(first) => (first, t1 - span_s),
            0 if self.closed => (count - 1, t1 - (self.times_s[spans] - self.times_s[spans - 1])),
            0 => (0, t1 - span_s),
            _ => (first - 1, self.times_s[first - 1]),
        };
        let second = (first + 1) % count;
        let (after, t3) = match first + 2 {
            k if (k <= spans || self.closed) && !is_cut(k) => {
                let t3 = match self.times_s.get(k) {
                    Some(&t3) => t3,
                    None => t2 + (self.times_s[1] - self.times_s[0]),
                };
                (k % count, t3)
            }
            _ => (second, t2 + span_s),
        };
        let u = if span_s > 0.0 { ((time_s - t1) / span_s).clamp(0.0, 1.0) } else { 0.0 };
        Some(Span { keys: [before, first, second, after], times_s: [t0, t1, t2, t3], u })
    }
}

/// Name of the path that every scene has.
const FLY_THROUGH: &str = "fly-through";

impl Rider {
    fn camera_at(&self, time_s: f64, origin_file: DVec3) -> Camera {
        let has_length = self.duration_s > 0.0 && time_s.is_finite();
        let time_s = if has_length { time_s.rem_euclid(self.duration_s) as f32 } else { 0.0 };
        let mut file_from_camera = DAffine3::IDENTITY;
        for (rest, track) in &self.chain {
            file_from_camera *= track.as_ref().map_or(*rest, |track| track.local_at(time_s));
        }
        file_from_camera.translation -= origin_file;
        let place = rigid(&file_from_camera.as_affine3a());
        Camera { world_from_view: place.unwrap_or(self.camera.world_from_view), ..self.camera.clone() }
    }
}

/// There and back between the eye and its mirror image at the centre, within the middle of the cross-section.
fn walk(bounds_ws: &Aabb, eye_ws: Vec3) -> Vec<Keyframe> {
    let center_ws = bounds_ws.center();
    let along_ws = Vec3::new(center_ws.x - eye_ws.x, 0.0, center_ws.z - eye_ws.z);
    let side_ws = along_ws.cross(Vec3::Y).normalize_or_zero() * 0.08 * bounds_ws.size().min_element();
    let rise_ws = Vec3::Y * (0.25 * bounds_ws.size().y).min(0.5 * (bounds_ws.max.y - eye_ws.y).max(0.0));
    let place = |a: f32, side: f32, rise: f32| eye_ws + along_ws * a + side_ws * side + rise_ws * rise;
    let key = |eye: Vec3, target: Vec3| looking(eye, target, INTERIOR_FOV_DEG);
    vec![
        key(place(0.1, 0.0, 0.0), place(1.1, 0.0, 0.1)),
        key(place(0.7, 1.0, 0.2), place(1.6, -1.0, 0.3)),
        key(place(1.3, 0.0, 0.6), place(1.9, 3.0, 0.5)),
        key(place(1.7, -1.0, 0.8), place(1.4, -4.0, 0.4)),
        key(place(1.3, 0.0, 0.9), place(0.5, 0.0, 0.5)),
        key(place(0.7, 1.0, 0.4), place(0.0, 1.0, 0.2)),
    ]
}

/// Around the centre at the eye's distance and height.
fn orbit(center_ws: Vec3, eye_ws: Vec3) -> Vec<Keyframe> {
    let arm = eye_ws - center_ws;
    (0..8u8)
        .map(|i| {
            let turned = Quat::from_rotation_y(f32::from(i) * std::f32::consts::FRAC_PI_4) * arm;
            looking(center_ws + turned, center_ws, EXTERIOR_FOV_DEG)
        })
        .collect()
}

fn looking(eye: Vec3, target: Vec3, fov_deg: f32) -> Keyframe {
    Keyframe {
        eye_ws: eye.as_dvec3().into(),
        target_ws: Some(target.as_dvec3().into()),
        fov_deg,
        ..Keyframe::default()
    }
}
