//! The passes of a frame, one file each, named as its shader and its timestamp. `frame.rs` puts them in order.

pub(crate) mod compact;
pub(crate) mod direct;
pub(crate) mod gather;
pub(crate) mod gbuffer;
pub(crate) mod receivers;
pub(crate) mod rsm;
pub(crate) mod sensor;
pub(crate) mod shadow;
pub(crate) mod surface;
pub(crate) mod view;
pub(crate) mod vpl;
