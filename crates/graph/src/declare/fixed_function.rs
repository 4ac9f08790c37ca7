//! Depth test, stencil test and blending of draws.

use afterlight_gpu::vk;

/// Depth comparison and writing of a draw. Depth is reversed: near is 1, infinitely far 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct DepthTest {
    /// Comparison of the fragment's depth (left) to the stored one (right).
    pub compare: vk::CompareOp,
    /// Whether a passing fragment stores its depth.
    pub write: bool,
}

impl DepthTest {
    /// Neither tests nor writes.
    pub const OFF: Self = Self { compare: vk::CompareOp::ALWAYS, write: false };

    /// Keeps the nearest surface (reversed depth).
    pub const NEAREST: Self = Self { compare: vk::CompareOp::GREATER, write: true };

    /// Passes where the depth equals that of a pre-pass.
    pub const EQUAL: Self = Self { compare: vk::CompareOp::EQUAL, write: false };
}

/// What one face does to the stencil buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct StencilFace {
    /// Comparison of the reference (left) to the stored value (right), both masked.
    pub compare: vk::CompareOp,
    /// Operation where the stencil test fails.
    pub fail: vk::StencilOp,
    /// Operation where the stencil test passes and the depth test fails.
    pub depth_fail: vk::StencilOp,
    /// Operation where both pass.
    pub pass: vk::StencilOp,
}

impl StencilFace {
    /// Passes always and keeps the stored value.
    pub const KEEP: Self = Self {
        compare: vk::CompareOp::ALWAYS,
        fail: vk::StencilOp::KEEP,
        depth_fail: vk::StencilOp::KEEP,
        pass: vk::StencilOp::KEEP,
    };

    fn writes(&self) -> bool {
        [self.fail, self.depth_fail, self.pass].iter().any(|op| *op != vk::StencilOp::KEEP)
    }
}

/// Stencil test of a draw; the reference value is part of the [`Draw`](crate::Draw).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct StencilTest {
    /// For front faces.
    pub front: StencilFace,
    /// For back faces.
    pub back: StencilFace,
    /// Bits that take part in the comparison.
    pub compare_mask: u32,
    /// Bits that operations may change.
    pub write_mask: u32,
}

impl StencilTest {
    /// Returns whether a draw with this test can change the stencil buffer.
    pub fn writes(&self) -> bool {
        self.write_mask != 0 && (self.front.writes() || self.back.writes())
    }
}

/// Blending of one colour attachment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Blend {
    /// The blend equation; `None` replaces.
    pub equation: Option<BlendEquation>,
    /// Channels that are written.
    pub write_mask: vk::ColorComponentFlags,
}

/// Factors and operations of a blend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BlendEquation {
    /// Factor of the fragment's colour.
    pub src_color: vk::BlendFactor,
    /// Factor of the stored colour.
    pub dst_color: vk::BlendFactor,
    /// How the two colours combine.
    pub color_op: vk::BlendOp,
    /// Factor of the fragment's alpha.
    pub src_alpha: vk::BlendFactor,
    /// Factor of the stored alpha.
    pub dst_alpha: vk::BlendFactor,
    /// How the two alphas combine.
    pub alpha_op: vk::BlendOp,
}

impl Blend {
    /// Replaces what is stored.
    pub const REPLACE: Self = Self { equation: None, write_mask: vk::ColorComponentFlags::RGBA };

    /// Writes nothing.
    pub const NONE: Self = Self { equation: None, write_mask: vk::ColorComponentFlags::empty() };

    /// Adds colour and alpha to what is stored.
    pub const ADD: Self = Self {
        equation: Some(BlendEquation {
            src_color: vk::BlendFactor::ONE,
            dst_color: vk::BlendFactor::ONE,
            color_op: vk::BlendOp::ADD,
            src_alpha: vk::BlendFactor::ONE,
            dst_alpha: vk::BlendFactor::ONE,
            alpha_op: vk::BlendOp::ADD,
        }),
        write_mask: vk::ColorComponentFlags::RGBA,
    };
}
