//! Parameters of `clustered`.

/// Those of clusters alone.
pub type ClusteredParams = super::clusters::ClusterParams;
