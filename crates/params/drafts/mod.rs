//! Parameters of every technique and stage as they were lists of constants, a file a folder, to be moved beside what reads them.
//! Compiled by `tests/drafts.rs` alone.

pub mod clustered;
pub mod clustered_forward;
pub mod clusters;
pub mod compute_raster;
pub mod dais;
pub mod dais_list;
pub mod dais_multirate;
pub mod deferred;
pub mod deferred_dedup;
pub mod deferred_msaa;
pub mod deferred_ssaa;
pub mod deferred_stencil;
pub mod depth_prepass;
pub mod draws;
pub mod effects;
pub mod forward;
pub mod forward_multipass;
pub mod forward_plus;
pub mod gbuffer_list;
pub mod hybrid;
pub mod light_indexed;
pub mod light_indexed_forward;
pub mod light_indices;
pub mod light_list;
pub mod light_list_forward;
pub mod light_lists;
pub mod light_prepass;
pub mod light_step;
pub mod tiled;
pub mod tiled_forward;
pub mod visibility;

use afterlight_params::{ParamSet, Params};

/// Every technique's id with its parameters, those that all have first.
pub fn techniques() -> Vec<(&'static str, Params)> {
    fn all(own: impl ParamSet) -> Params {
        Params::of(draws::DrawParams::default()).and(Params::of(own))
    }
    vec![
        ("forward", all(forward::ForwardParams::default())),
        ("forward-multipass", all(forward_multipass::ForwardMultipassParams::default())),
        ("depth-prepass", all(depth_prepass::DepthPrepassParams::default())),
        ("deferred", all(deferred::DeferredParams::default())),
        ("deferred-stencil", all(deferred_stencil::DeferredStencilParams::default())),
        ("light-indexed", all(light_indexed::LightIndexedParams::default())),
        ("light-list", all(light_list::LightListParams::default())),
        ("light-indexed-forward", all(light_indexed_forward::LightIndexedForwardParams::default())),
        ("light-list-forward", all(light_list_forward::LightListForwardParams::default())),
        ("light-prepass", all(light_prepass::LightPrepassParams::default())),
        ("hybrid", all(hybrid::HybridParams::default())),
        ("tiled", all(tiled::TiledParams::default())),
        ("clustered", all(clustered::ClusteredParams::default())),
        ("clustered-forward", all(clustered_forward::ClusteredForwardParams::default())),
        ("tiled-forward", all(tiled_forward::TiledForwardParams::default())),
        ("forward-plus", all(forward_plus::ForwardPlusParams::default())),
        ("visibility", all(visibility::VisibilityParams::default())),
        ("deferred-ssaa", all(deferred_ssaa::DeferredSsaaParams::default())),
        ("deferred-msaa", all(deferred_msaa::DeferredMsaaParams::default())),
        ("deferred-dedup", all(deferred_dedup::DeferredDedupParams::default())),
        ("gbuffer-list", all(gbuffer_list::GbufferListParams::default())),
        ("dais", all(dais::DaisParams::default())),
        ("dais-list", all(dais_list::DaisListParams::default())),
        ("dais-multirate", all(dais_multirate::DaisMultirateParams::default())),
    ]
}
