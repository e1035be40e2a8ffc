//! Final gathering with other parameters than the usual ones.

/// `IndirectLight::final_gather(target_error)` with parameters that are set: `gather!(0.02, max_rays = Some(9))`.
macro_rules! gather {
    ($target_error:expr, $($parameter:ident = $value:expr),+ $(,)?) => {
        camlux::scene::IndirectLight::FinalGather(camlux::scene::FinalGather {
            $($parameter: $value,)+
            ..camlux::scene::FinalGather::new($target_error)
        })
    };
}
pub(crate) use gather;
