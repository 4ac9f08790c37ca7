//! What a technique is.

use afterlight_graph::{Graph, ImageHandle, gpu};
use afterlight_shader::Shader;
use serde::Serialize;

use crate::{DrawParams, Frame, Params, TechniqueError};
use afterlight_cost::{Cost, Workload};

/// Where a technique comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Source {
    /// Key in REFERENCES.toml.
    pub key: &'static str,
    /// Section of that work.
    pub section: &'static str,
}

/// A technique's answers to the four questions of ARCHITECTURE.md.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Answers {
    /// What the geometry pass keeps of a visible surface.
    pub surface: &'static str,
    /// How lights and surfaces find each other.
    pub lights: &'static str,
    /// Where and at what rate shading is evaluated.
    pub schedule: &'static str,
    /// How samples become a pixel.
    pub resolve: &'static str,
}

/// A row of Petrescu et al. 2016, Appendix A; `y`, `n` or `p` (partial).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct AppendixA {
    /// The paper's abbreviation.
    pub id: &'static str,
    /// Light-object intersection: `imp` through the raster, `exp` explicit structure, `dec` decoupled.
    pub intersect: &'static str,
    /// Transparency.
    pub transparency: &'static str,
    /// Hardware multisampling.
    pub hardware_msaa: &'static str,
    /// Access to lights: `rand` or `seq`.
    pub light_access: &'static str,
    /// Access to materials: `rand` or `seq`.
    pub material_access: &'static str,
    /// Whether visibility and shading rates are decoupled, in space and in time.
    pub rates_decoupled: &'static str,
}

/// Whether a technique computes the reference's image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Exactness {
    /// The same image up to rounding: the least PSNR to `forward` at one sample, dB.
    Exact {
        /// Least PSNR at one sample.
        min_psnr_db: f64,
    },
    /// Another image within a bound that a test measured.
    Approximate {
        /// The bound in words.
        bound: &'static str,
        /// Least PSNR, dB.
        min_psnr_db: f64,
    },
}

/// What a way of a technique needs to be that way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Condition {
    /// A parameter, by its key, has this value.
    Param(&'static str, &'static str),
    /// Several samples a pixel.
    SeveralSamples,
}

impl Condition {
    /// Whether it holds of all parameters of a technique at so many samples a pixel.
    pub fn holds(self, params: &Params, samples: u32) -> bool {
        match self {
            Self::Param(key, value) => params.get(key).as_deref() == Some(value),
            Self::SeveralSamples => samples > 1,
        }
    }
}

impl std::fmt::Display for Condition {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Param(key, value) => write!(f, "{key}={value}"),
            Self::SeveralSamples => write!(f, "several samples"),
        }
    }
}

/// A way of a technique, often its paper's, that is further from `forward` than [`Info::exactness`] says.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Approximation {
    /// The way: all of these hold.
    pub when: &'static [Condition],
    /// The bound in words.
    pub bound: &'static str,
    /// Least PSNR to `forward` at as many samples, dB.
    pub min_psnr_db: f64,
}

impl Approximation {
    /// The way in words: `edges=pixel, several samples`.
    pub fn when_text(&self) -> String {
        self.when.iter().map(Condition::to_string).collect::<Vec<_>>().join(", ")
    }
}

/// A feature that a technique needs of the device.
#[derive(Clone, Copy)]
pub struct Need {
    /// Name for `devices`.
    pub name: &'static str,
    /// Whether the device has it.
    pub test: fn(&gpu::Features) -> bool,
}

/// A technique's constant facts.
pub struct Info {
    /// Name on the command line.
    pub id: &'static str,
    /// Title in full.
    pub title: &'static str,
    /// One sentence.
    pub summary: &'static str,
    /// Sources.
    pub sources: &'static [Source],
    /// Answers to the four questions.
    pub answers: Answers,
    /// Its row of Appendix A.
    pub appendix_a: AppendixA,
    /// Exact or approximate, by default.
    pub exactness: Exactness,
    /// Ways of it that are further from `forward` than that; the first whose conditions hold counts.
    pub approximations: &'static [Approximation],
    /// What differs from its sources and why, a sentence each.
    pub departures: &'static [&'static str],
    /// What it needs beyond what the program needs.
    pub needs: &'static [Need],
    /// Sample counts that it can render where the device has them.
    pub samples: &'static [u32],
    /// Whether it draws tessellated surfaces: everything that finds triangles again by the index buffer does not.
    pub tessellation: bool,
    /// Debug views of its own, by name; besides them it has those of stages that it uses.
    pub views: &'static [&'static str],
}

impl Info {
    /// What most techniques have in common, for `..Info::USUAL` after what is a technique's own: one sample a pixel, tessellated surfaces,
    /// no needs, no views, no ways that are further from `forward`, no departures.
    pub const USUAL: Info = Info {
        id: "",
        title: "",
        summary: "",
        sources: &[],
        answers: Answers { surface: "", lights: "", schedule: "", resolve: "" },
        appendix_a: AppendixA {
            id: "",
            intersect: "",
            transparency: "",
            hardware_msaa: "",
            light_access: "",
            material_access: "",
            rates_decoupled: "",
        },
        exactness: Exactness::Exact { min_psnr_db: 50.0 },
        approximations: &[],
        departures: &[],
        needs: &[],
        samples: &[1],
        tessellation: true,
        views: &[],
    };
}

/// Every sample count that a device may have.
pub const ANY_SAMPLES: &[u32] = &[1, 2, 4, 8, 16];
/// More than one sample.
pub const MULTIPLE_SAMPLES: &[u32] = &[2, 4, 8, 16];

/// A way to render a frame.
pub trait Technique: Send + Sync {
    /// Facts about it.
    fn info(&self) -> &Info;

    /// Compiled variants of its own shaders, which [`Frame::shader`] finds by their names; none where it uses those of stages alone.
    fn shaders(&self) -> &[Shader] {
        &[]
    }

    /// The defaults of its own parameters; what sets them by text asks for [`params_of`].
    fn params(&self) -> Params {
        Params::default()
    }

    /// Predicts its costs for a workload by the formulas of Petrescu et al. 2016, section 4. Pure arithmetic. The parameters are all of
    /// [`params_of`], whatever their values.
    fn predict(&self, workload: &Workload, params: &Params) -> Cost;

    /// Declares its passes, named `id/stage`, and returns the image of linear radiance, RGBA16F, that they end in.
    ///
    /// # Errors
    /// [`TechniqueError`] where the frame asks for what it cannot do.
    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError>;

    /// Whether its image is a sum over surfaces and lights of `light_radiance` and `unlit_radiance`, by weights, so that pairs of both can
    /// be counted in the place of radiance ([`crate::views::LightPairs`]); false where radiance is made into something else.
    fn counts_light_pairs(&self) -> bool {
        true
    }

    /// What of `info().needs` a device lacks.
    fn missing(&self, features: &gpu::Features) -> Vec<&'static str> {
        self.info().needs.iter().filter(|n| !(n.test)(features)).map(|n| n.name).collect()
    }
}

/// All parameters that a technique has, with their defaults: those of every technique, then its own.
pub fn params_of(technique: &dyn Technique) -> Params {
    Params::of(DrawParams::default()).and(technique.params())
}

/// All parameters of a technique, with the values that `params` has for them; what is not there has its default.
pub fn completed(technique: &dyn Technique, params: &Params) -> Params {
    params.over(params_of(technique))
}

/// How near to `forward` a technique's image is with these parameters at so many samples a pixel: [`Info::exactness`], or the first of
/// [`Info::approximations`] whose conditions hold.
pub fn exactness_of(technique: &dyn Technique, params: &Params, samples: u32) -> Exactness {
    let info = technique.info();
    let params = completed(technique, params);
    let mut ways = info.approximations.iter();
    let way = ways.find(|way| way.when.iter().all(|condition| condition.holds(&params, samples)));
    way.map_or(info.exactness, |way| Exactness::Approximate {
        bound: way.bound,
        min_psnr_db: way.min_psnr_db,
    })
}

/// Sets a parameter of a technique from text, among [`params_of`] it.
///
/// # Errors
/// A name that the technique does not have, a value out of range: both list what is known.
pub fn set_param(
    technique: &dyn Technique,
    params: &mut Params,
    key: &str,
    value: &str,
) -> Result<(), TechniqueError> {
    Ok(params.set(key, value).map_err(|error| error.of(technique.info().id))?)
}
