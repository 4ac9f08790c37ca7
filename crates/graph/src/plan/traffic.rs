//! What a pass reads and writes, in bytes.

use afterlight_roles::BufferRole;

use super::access::WRITES;
use super::{Plan, PlannedPass};

/// A resource that the frame allocates, as one pass uses it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Traffic<'a> {
    /// The resource's name.
    pub name: &'a str,
    /// What it holds.
    pub role: BufferRole,
    /// Bytes by the device's memory requirements, of the whole resource.
    pub bytes: u64,
    /// Whether the pass reads what stood there before it.
    pub read: bool,
    /// Whether it writes.
    pub written: bool,
}

impl Plan {
    /// What a pass reads and writes of the resources that the frame allocates, each once, in the order of first use; imported ones are
    /// left out. How much of each it touches the plan does not know.
    pub fn traffic(&self, pass: &PlannedPass) -> Vec<Traffic<'_>> {
        let mut traffic: Vec<Traffic<'_>> = Vec::new();
        for access in &pass.accesses {
            let resource = &self.resources[access.resource.0 as usize];
            if resource.imported {
                continue;
            }
            let index = traffic.iter().position(|one| one.name == resource.name).unwrap_or_else(|| {
                let (name, role, bytes) = (resource.name.as_str(), resource.role, resource.need.bytes);
                traffic.push(Traffic { name, role, bytes, read: false, written: false });
                traffic.len() - 1
            });
            let reads = !access.discard && access.access.as_raw() & !WRITES.as_raw() != 0;
            traffic[index].read |= reads;
            traffic[index].written |= access.write;
        }
        traffic
    }
}
