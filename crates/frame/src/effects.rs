//! Effects of a frame, whatever the technique. Adding one is declaring it here, once, with its place in [`Effects`], and a stage that reads it:
//! command lines, specifications and records of settings go by the declaration.

use afterlight_params::{choices, parameters};

choices! {
    /// Anti-aliasing after shading.
    pub enum Post {
        /// None.
        None = "none",
        /// Fast approximate anti-aliasing 3.11, quality (Lottes 2009).
        Fxaa = "fxaa",
        /// Enhanced subpixel morphological anti-aliasing, one sample (Jimenez et al. 2012).
        Smaa = "smaa",
        /// Subpixel reconstruction anti-aliasing (Chajdas et al. 2011).
        Sraa = "sraa",
    }
}

parameters! {
    /// Anti-aliasing after shading.
    #[derive(Copy)]
    pub struct PostEffect {
        /// Anti-aliasing after shading
        filter: Post = Post::None, "post";
    }
}

/// Shortest edge that tessellation aims at, pixels.
pub const MIN_TESSELLATE_PX: f32 = 1.0;
/// Longest edge that tessellation aims at, pixels.
pub const MAX_TESSELLATE_PX: f32 = 64.0;
/// Farthest displacement along each axis, mm: beyond an eighth of the field's period the surface would fold.
pub const MAX_DISPLACEMENT_MM: f32 = 100.0;

parameters! {
    /// Tessellation of surfaces, and their displacement, which does nothing without it.
    #[derive(Copy)]
    pub struct TessellationEffect {
        /// Tessellates surfaces to triangles with edges of about PX pixels
        edge_px: Option<f32> = None, "tessellate" <PX>, MIN_TESSELLATE_PX..=MAX_TESSELLATE_PX;
        /// Displaces tessellated surfaces by up to MM millimetres along each axis
        displacement_mm: f32 = 0.0, "displacement" <MM>, 0.0..=MAX_DISPLACEMENT_MM;
    }
}

impl TessellationEffect {
    /// How far surfaces are displaced along each axis at most, m.
    pub fn displacement_m(self) -> f32 {
        self.displacement_mm * 1e-3
    }
}

choices! {
    /// Shadows of direct light.
    pub enum Shadows {
        /// None: light passes through surfaces.
        None = "none",
        /// Of one light, by a shadow map.
        Map = "map",
    }
}

parameters! {
    /// Shadows of one light.
    #[derive(Copy)]
    pub struct ShadowEffect {
        /// Shadows of one light: the first directional or spot light, else the strongest point light
        method: Shadows = Shadows::None, "shadows";
        /// Width and height of a light's view, texels
        map_size_px: u32 = 2048, "shadow-map-size" <N>, 1..;
        /// Scale of the shadow map's bias: 1 is what its filter needs, less makes surfaces shadow themselves, more takes shadows
        /// off what casts them.
        bias: f32 = 1.0;
    }
}

choices! {
    /// Light that surfaces reflect onto each other.
    pub enum Indirect {
        /// None but the constant ambient term.
        None = "none",
        /// One bounce of one light, by a reflective shadow map.
        Rsm = "rsm",
    }
}

parameters! {
    /// Light that surfaces reflect onto each other.
    #[derive(Copy)]
    pub struct IndirectEffect {
        /// Indirect light
        method: Indirect = Indirect::None, "indirect";
        /// Width and height of a light's view, texels
        map_size_px: u32 = 512, "shadow-map-size" <N>, 1..;
    }
}

choices! {
    /// How surfaces with alpha blending are drawn.
    pub enum Transparency {
        /// From back to front, after the opaque surfaces.
        Sorted = "sorted",
        /// Not at all.
        None = "none",
    }
}

parameters! {
    /// How surfaces with alpha blending are drawn.
    #[derive(Copy)]
    pub struct TransparencyEffect {
        /// Surfaces with alpha blending: sorted back to front, or left out
        order: Transparency = Transparency::Sorted, "transparency";
    }
}

parameters! {
    /// Effects of a frame.
    #[derive(Copy)]
    pub struct Effects {
        /// Anti-aliasing after shading.
        ..post: PostEffect;
        /// Tessellation of surfaces.
        ..tessellation: TessellationEffect;
        /// Shadows of one light.
        ..shadows: ShadowEffect;
        /// Light that surfaces reflect onto each other.
        ..indirect: IndirectEffect;
        /// How surfaces with alpha blending are drawn.
        ..transparency: TransparencyEffect;
    }
}
