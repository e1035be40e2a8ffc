//! Final gathering with other parameters than the usual ones.

/// `IndirectLight::final_gather(target_error)` with parameters that are set: `gather!(0.02, max_rays = Some(9))`.
macro_rules! gather {
    ($target_error:expr, $($parameter:ident = $value:expr),+ $(,)?) => {{
        let mut indirect = camlux::scene::IndirectLight::final_gather($target_error);
        $(
            let value = $value;
            if let camlux::scene::IndirectLight::FinalGather { $parameter, .. } = &mut indirect {
                *$parameter = value;
            }
        )+
        indirect
    }};
}
pub(crate) use gather;
