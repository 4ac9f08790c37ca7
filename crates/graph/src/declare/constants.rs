//! Values of specialization constants.

/// A value that a specialization constant can take.
pub trait ConstantBits {
    /// Returns the 32 bits that the constant is set to.
    fn bits(self) -> u32;
}

impl ConstantBits for u32 {
    fn bits(self) -> u32 {
        self
    }
}

impl ConstantBits for i32 {
    fn bits(self) -> u32 {
        self.cast_unsigned()
    }
}

impl ConstantBits for f32 {
    fn bits(self) -> u32 {
        self.to_bits()
    }
}

impl ConstantBits for bool {
    fn bits(self) -> u32 {
        u32::from(self)
    }
}
