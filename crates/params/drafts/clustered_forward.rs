//! Parameters of `clustered-forward`.

/// Those of clusters alone.
pub type ClusteredForwardParams = super::clusters::ClusterParams;
