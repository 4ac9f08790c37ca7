//! Handles: versions of images and buffers, which passes take and give back.

use super::image_info::ImageInfo;

/// Identifies a resource of a graph across its versions; outlives the handles, so that a result can be read back.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ResourceId(pub(crate) u32);

/// One version of an image.
#[derive(Debug)]
#[must_use = "a write returns the next version of the image; dropping it loses the result"]
pub struct ImageHandle {
    pub(crate) graph: u64,
    pub(crate) resource: ResourceId,
    pub(super) info: ImageInfo,
}

impl ImageHandle {
    /// Returns the resource that this is a version of.
    pub fn id(&self) -> ResourceId {
        self.resource
    }

    /// Returns format and extents of the image.
    pub fn info(&self) -> ImageInfo {
        self.info
    }
}

/// One version of a buffer.
#[derive(Debug)]
#[must_use = "a write returns the next version of the buffer; dropping it loses the result"]
pub struct BufferHandle {
    pub(crate) graph: u64,
    pub(crate) resource: ResourceId,
    pub(super) bytes: u64,
}

impl BufferHandle {
    /// Returns the resource that this is a version of.
    pub fn id(&self) -> ResourceId {
        self.resource
    }

    /// Returns the buffer's size in bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}

/// A resource with history: what the frame before wrote, and what this frame writes.
#[derive(Debug)]
pub struct History<H> {
    /// What the frame before wrote as [`History::now`]. Passes may read it alone. Where the frame before is of no use, its contents are
    /// defined but mean nothing: zeros, or what some earlier frame wrote. Who runs the frames tells shaders so.
    pub before: H,
    /// What this frame writes, as any resource, and the next one reads.
    pub now: H,
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::ImageHandle {}
    impl Sealed for super::BufferHandle {}
}

/// A handle of either kind.
pub trait Handle: sealed::Sealed {
    /// Returns the graph that the handle belongs to and its resource.
    #[doc(hidden)]
    fn parts(&self) -> (u64, ResourceId);
}

impl Handle for ImageHandle {
    fn parts(&self) -> (u64, ResourceId) {
        (self.graph, self.resource)
    }
}

impl Handle for BufferHandle {
    fn parts(&self) -> (u64, ResourceId) {
        (self.graph, self.resource)
    }
}
