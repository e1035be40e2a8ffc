//! Model error: how far the two sums over VPLs are from the true single bounce. The error is not small; these tests fix its value,
//! so that the documentation's figures stay true. `kernels` tests the kernel error.

use crate::common::gpu::{Gpu, demo_scene};
use crate::common::rmse;
use crate::common::truth::Truth;
use camlux::{
    output::Layer,
    scene::{Bands, IndirectLight, VplSum},
};

/// Error of the Cornell box's indirect light against the path-traced image, whose own standard error is 1.5 %.
struct ModelError {
    /// Σx/Σt
    mean_ratio: f64,
    /// sqrt(Σ(x−t)²/Σt²)
    relative_rmse: f64,
}

fn measure(estimator: VplSum) -> ModelError {
    let truth: Vec<Bands> = Truth::read().indirect;
    let mut scene = demo_scene("cornell", [200, 200]);
    scene.indirect = Some(IndirectLight::vpl_sum(estimator, 64));
    let frame = Gpu::open().render(&scene);
    let indirect = frame.values(Layer::Indirect).expect("it was asked for");
    let sum: f64 = indirect.iter().map(|&x| f64::from(x)).sum();
    let error = ModelError {
        mean_ratio: sum / truth.as_flattened().iter().sum::<f64>(),
        relative_rmse: rmse::relative_rmse(indirect, &truth),
    };
    println!(
        "{}: mean / truth {:.3}, relRMSE {:.3}",
        estimator.name(),
        error.mean_ratio,
        error.relative_rmse
    );
    error
}

/// The mean over the RSM has no distance falloff. It is dimmer than the reference by a factor that depends on the scene's size.
#[test]
fn rsm_average_is_a_fifth_of_the_truth() {
    let error = measure(VplSum::RsmAverage);
    assert!((error.mean_ratio - 0.21).abs() < 0.01);
    assert!((error.relative_rmse - 0.84).abs() < 0.02);
}

/// Without visibility, light passes through the two blocks. 1/d² makes bright spots in the corners.
#[test]
fn instant_radiosity_without_visibility_is_a_fifth_too_bright() {
    let error = measure(VplSum::InstantRadiosity);
    assert!((error.mean_ratio - 1.22).abs() < 0.02);
    assert!((error.relative_rmse - 0.31).abs() < 0.03);
}
