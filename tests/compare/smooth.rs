//! The kernels of `shaders/smooth.wgsl` and `shaders/smooth_residuals.wgsl` against the same fit in f64, and on pixels that a fit of their
//! neighbours could spoil.

use crate::common::gpu::Gpu;
use camlux::internals::smooth_probe::{GatheredLobe, GatheredPixel, SmoothOptions, smooth};
use camlux::model::Lobe;
use glam::{DMat4, DVec3, DVec4, Vec3};

const SIZE: [u32; 2] = [25, 18];

fn options(stride_px: u32, is_specular: bool) -> SmoothOptions {
    SmoothOptions {
        size_px: SIZE,
        stride_px,
        is_specular,
        evenness: 0.4,
        variance_rate: 1.44,
    }
}

/// A hill of facets as small as pixels, lit from afar, without noise. The light is linear in the normal.
fn hill() -> Vec<Option<GatheredPixel>> {
    let mut random = fastrand::Rng::with_seed(5);
    let pixel = |i: u32| {
        let [x, y] = [i % SIZE[0], i / SIZE[0]].map(|v| v as f32 / 10.0);
        let mut tilt = || 0.4 * (random.f32() - 0.5);
        let normal = Vec3::new(x - 1.2 + tilt(), y - 0.9 + tilt(), 1.0).normalize();
        let light = 2.0 + normal.dot(Vec3::new(1.0, 0.5, 0.3));
        Some(GatheredPixel {
            position: [x, y, -0.3 * (x * x + y * y)],
            normal: normal.to_array(),
            packets: 2,
            diffuse: lobe([light, 0.5 * light, 0.2 * light], 0.1),
            specular: lobe([0.3 * light, 0.2, 0.1], 0.05),
            ..GatheredPixel::default()
        })
    };
    (0..SIZE[0] * SIZE[1]).map(pixel).collect()
}

fn lobe(mean: [f32; 3], variance: f32) -> GatheredLobe {
    GatheredLobe { mean, variance }
}

/// Variance of the mean of a pixel's samples.
fn variance_of_mean(lobe: &GatheredLobe, pixel: &GatheredPixel, options: &SmoothOptions) -> f64 {
    let fall = f64::from(pixel.packets).powf(-f64::from(options.variance_rate));
    f64::from(options.evenness) * f64::from(lobe.variance) / 64.0 * fall
}

/// A pixel of a test's image; `None` outside it, and where no surface is.
fn at(
    pixels: &[Option<GatheredPixel>],
    options: SmoothOptions,
    [x, y]: [i32; 2],
) -> Option<GatheredPixel> {
    let [width, height] = options.size_px.map(|px| px as i32);
    let is_inside = (0..width).contains(&x) && (0..height).contains(&y);
    is_inside
        .then(|| pixels[(y * width + x) as usize])
        .flatten()
}

fn vector(v: [f32; 3]) -> DVec3 {
    Vec3::from(v).as_dvec3()
}

/// The pixels on the grid up to `reach` steps around one, itself included, with their places, and the weights that both kernels give them.
fn around(
    pixels: &[Option<GatheredPixel>],
    options: SmoothOptions,
    [x, y]: [i32; 2],
    (reach, distance): (i32, f64),
) -> Vec<([i32; 2], f64, GatheredPixel)> {
    let Some(own) = at(pixels, options, [x, y]) else {
        return Vec::new();
    };
    let stride = options.stride_px as i32;
    let [width, height] = options.size_px.map(|px| px as i32);
    // As in the kernel, a position outside the image becomes the last pixel inside.
    let nearest = [[-1, 0], [1, 0], [0, -1], [0, 1]].map(|[dx, dy]| {
        let place = [
            (x + stride * dx).clamp(0, width - 1),
            (y + stride * dy).clamp(0, height - 1),
        ];
        at(pixels, options, place).filter(|_| place != [x, y])
    });
    let nearest: Vec<_> = nearest.into_iter().flatten().collect();
    if nearest.iter().all(|other| other.packets == 0) {
        return Vec::new();
    }
    let spacing_squared = nearest
        .iter()
        .map(|other| vector(other.position).distance_squared(vector(own.position)))
        .fold(f64::INFINITY, f64::min);
    // k_s and s.
    let texel = |pixel: &GatheredPixel| pixel.lobe.texel();
    let is_glossy = |[r, g, b, _]: [f32; 4]| r.max(g).max(b) > 0.0;
    let mut around = Vec::new();
    for [dx, dy] in (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| [dx, dy])) {
        let other = at(pixels, options, [x + stride * dx, y + stride * dy]);
        let Some(other) = other.filter(|other| other.packets > 0) else {
            continue;
        };
        let is_one_lobe = texel(&own)[3] == texel(&other)[3]
            && is_glossy(texel(&own)) == is_glossy(texel(&other));
        if options.is_specular && !is_one_lobe {
            continue;
        }
        let turn_squared = vector(other.normal).distance_squared(vector(own.normal)) / 0.36;
        let distance_squared = vector(other.position).distance_squared(vector(own.position))
            / (distance * distance * spacing_squared);
        around.push(([dx, dy], (-turn_squared - distance_squared).exp(), other));
    }
    around
}

/// `smooth.wgsl` for one pixel, as a textbook least-squares fit: the model of each lobe, and the weight of the pixel's own light. `None` if
/// the pixel has no model.
fn model(
    pixels: &[Option<GatheredPixel>],
    options: SmoothOptions,
    [x, y]: [i32; 2],
) -> Option<[(DVec3, f64); 2]> {
    let own = at(pixels, options, [x, y])?;
    let stride = options.stride_px as i32;
    if own.packets == 0 || x % stride != 0 || y % stride != 0 {
        return None;
    }
    let unchanged = [own.diffuse, own.specular].map(|lobe| vector(lobe.mean));
    let (right, up) = vector(own.normal).any_orthonormal_pair();
    let around: Vec<_> = around(pixels, options, [x, y], (2, 3.0))
        .into_iter()
        .filter(|(place, ..)| *place != [0, 0])
        .map(|([dx, dy], weight, other)| {
            let features = DVec4::new(
                f64::from(dx) / 2.0,
                f64::from(dy) / 2.0,
                vector(other.normal).dot(right),
                vector(other.normal).dot(up),
            );
            (weight, features, [other.diffuse, other.specular], other)
        })
        .collect();
    let weight: f64 = around.iter().map(|(weight, ..)| weight).sum();
    let count = weight.powi(2)
        / around
            .iter()
            .map(|(weight, ..)| weight.powi(2))
            .sum::<f64>();
    if around.is_empty() || count < 7.0 {
        return None;
    }
    let mean_features = around.iter().map(|(w, f, ..)| *f * *w).sum::<DVec4>() / weight;
    let mut covariance = DMat4::from_diagonal(DVec4::splat(1e-3));
    for (w, f, ..) in &around {
        let f = *f - mean_features;
        covariance += DMat4::from_cols(f * f.x, f * f.y, f * f.z, f * f.w) * (*w / weight);
    }
    Some(std::array::from_fn(|i| {
        let mean_of = |value: &dyn Fn(&GatheredLobe, &GatheredPixel) -> f64| {
            let sum =
                |(w, _, lobes, other): &(_, _, [GatheredLobe; 2], _)| w * value(&lobes[i], other);
            around.iter().map(sum).sum::<f64>() / weight
        };
        // The fit of each band: its value at the pixel, and its residual.
        let mut modelled = DVec3::ZERO;
        let mut scatter = 0.0;
        for band in 0..3 {
            let mean = mean_of(&|lobe, _| f64::from(lobe.mean[band]));
            let mut with_features = DVec4::ZERO;
            for (w, f, lobes, _) in &around {
                with_features +=
                    (*f - mean_features) * (f64::from(lobes[i].mean[band]) - mean) * *w;
            }
            let slope = covariance.inverse() * (with_features / weight);
            modelled[band] = mean - slope.dot(mean_features);
            for (w, f, lobes, _) in &around {
                let expected = mean + slope.dot(*f - mean_features);
                scatter += w * (f64::from(lobes[i].mean[band]) - expected).powi(2) / weight;
            }
        }
        scatter *= count / (count - 5.0);
        let own_variance = variance_of_mean(&[own.diffuse, own.specular][i], &own, &options);
        let mean_variance = mean_of(&|lobe, other| variance_of_mean(lobe, other, &options));
        let mean_square = mean_of(&|lobe, _| vector(lobe.mean).length_squared());
        let variance = if own_variance == 0.0 && mean_variance > 0.1 * mean_square {
            mean_variance
        } else {
            mean_variance.min(4.0 * own_variance)
        };
        let deviation_squared = unchanged[i].distance_squared(modelled);
        let signal = (scatter - variance)
            .max(deviation_squared - 16.0 * variance)
            .max(0.0);
        // The model has noise of its own.
        let leverage = 1.0 + mean_features.dot(covariance.inverse() * mean_features);
        let of_model = signal + (leverage / count).min(1.0) * variance;
        let own_share = if of_model + variance > 0.0 {
            of_model / (of_model + variance)
        } else {
            1.0
        };
        (modelled, own_share)
    }))
}

/// Both kernels for one pixel: what the neighbours' gathers have more than their models is added to the pixel's model.
fn smoothed(
    pixels: &[Option<GatheredPixel>],
    models: &[Option<[(DVec3, f64); 2]>],
    options: SmoothOptions,
    [x, y]: [i32; 2],
) -> [DVec3; 2] {
    let width = options.size_px[0] as i32;
    let Some(own) = at(pixels, options, [x, y]) else {
        return [DVec3::ZERO; 2];
    };
    let unchanged = [own.diffuse, own.specular].map(|lobe| vector(lobe.mean));
    let Some(own_model) = models[(y * width + x) as usize] else {
        return unchanged;
    };
    let stride = options.stride_px as i32;
    std::array::from_fn(|lobe| {
        let (mut sum, mut weights, mut squares) = (DVec3::ZERO, 0.0, 0.0);
        for ([dx, dy], weight, other) in around(pixels, options, [x, y], (4, 6.0)) {
            let index = (y + stride * dy) * width + x + stride * dx;
            let Some(model) = models[index as usize] else {
                continue;
            };
            let (modelled, own_share) = model[lobe];
            let weight = weight * (1.0 - own_share);
            let gathered = vector([other.diffuse, other.specular][lobe].mean);
            sum += weight * (gathered - modelled);
            weights += weight;
            squares += weight * weight;
        }
        let is_enough = weights * weights >= 20.0 * squares && weights > 0.0;
        let residual = if is_enough {
            sum / weights
        } else {
            DVec3::ZERO
        };
        let (modelled, own_share) = own_model[lobe];
        (modelled + residual)
            .lerp(unchanged[lobe], own_share)
            .max(DVec3::ZERO)
    })
}

#[test]
fn the_fit_matches_the_model() {
    let gpu = Gpu::open();
    let mut random = fastrand::Rng::with_seed(9);
    for (stride_px, is_specular) in [(1, false), (1, true), (2, false), (2, true)] {
        let options = options(stride_px, is_specular);
        let mut pixels = hill();
        for pixel in &mut pixels {
            let mut noise = || 0.3 * (random.f32() + random.f32() - 1.0);
            if let Some(pixel) = pixel {
                pixel.diffuse.mean = pixel.diffuse.mean.map(|v| v + noise());
                pixel.specular.mean = pixel.specular.mean.map(|v| (v + noise()).max(0.0));
                pixel.packets = [0, 1, 1, 2, 3, 3, 4, 9][random.usize(..8)];
                pixel.lobe = match random.usize(..4) {
                    0 => Lobe::default(),
                    _ => Lobe::Phong {
                        ks: [0.4, 0.3, 0.2],
                        shininess: 20.0,
                    },
                };
                match random.usize(..12) {
                    0 => pixel.diffuse = lobe([9.0, 4.0, 1.0], 0.2),
                    1 => pixel.diffuse = lobe([0.0; 3], 0.0),
                    2 => pixel.specular = lobe([0.0; 3], 0.0),
                    _ => {}
                }
            }
            if random.usize(..15) == 0 {
                *pixel = None;
            }
        }
        let found = smooth(&gpu.device, &pixels, options).expect("the kernel runs");
        let place = |i: usize| [i as i32 % SIZE[0] as i32, i as i32 / SIZE[0] as i32];
        let models: Vec<_> = (0..pixels.len())
            .map(|i| model(&pixels, options, place(i)))
            .collect();
        let (mut worst, mut changed) = (0.0_f64, 0);
        for (i, found) in found.iter().enumerate() {
            let expected = smoothed(&pixels, &models, options, place(i));
            for lobe in 0..1 + usize::from(is_specular) {
                let error = Vec3::from(found[lobe]).as_dvec3().distance(expected[lobe]);
                worst = worst.max(error);
            }
            let before = pixels[i].map_or([0.0; 3], |pixel| pixel.diffuse.mean);
            changed += usize::from(found[0] != before);
        }
        println!("stride {stride_px} specular {is_specular}: {worst:.1e}, {changed} changed");
        let of_grid = SIZE
            .map(|px| px.div_ceil(stride_px))
            .iter()
            .product::<u32>() as usize;
        assert!(changed > of_grid / 4, "{changed} of {of_grid}");
        // The light is about 2.5.
        assert!(worst < 3e-6, "{worst:e}");
    }
}

fn rms(values: impl Iterator<Item = DVec3>) -> f64 {
    let squares: Vec<_> = values.map(DVec3::length_squared).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

fn diffuse_of(pixels: &[Option<GatheredPixel>]) -> impl Iterator<Item = DVec3> {
    pixels.iter().map(|pixel| {
        pixel.map_or(DVec3::ZERO, |pixel| {
            Vec3::from(pixel.diffuse.mean).as_dvec3()
        })
    })
}

#[test]
fn noise_is_lowered_where_light_is_linear_in_the_normal() {
    let gpu = Gpu::open();
    let options = options(1, false);
    let mut truth = hill();
    for pixel in truth.iter_mut().flatten() {
        pixel.diffuse.variance = 10.0;
    }
    let mut noisy = truth.clone();
    let mut random = fastrand::Rng::with_seed(3);
    for pixel in noisy.iter_mut().flatten() {
        // About normally distributed, with a variance of 1 in each band.
        let mut noise = || (0..12).map(|_| random.f32()).sum::<f32>() - 6.0;
        let deviation = (variance_of_mean(&pixel.diffuse, pixel, &options) / 3.0).sqrt() as f32;
        pixel.diffuse.mean = pixel.diffuse.mean.map(|v| v + deviation * noise());
    }
    let found = smooth(&gpu.device, &noisy, options).expect("the kernel runs");
    let found = found.iter().map(|lobes| Vec3::from(lobes[0]).as_dvec3());
    let before = rms(diffuse_of(&noisy)
        .zip(diffuse_of(&truth))
        .map(|(a, b)| a - b));
    let after = rms(found.zip(diffuse_of(&truth)).map(|(a, b)| a - b));
    println!("noise {before:.4} to {after:.4}");
    assert!(after < 0.6 * before, "{before} to {after}");
}

/// A pixel that is dark by chance, however, takes the light around it.
#[test]
fn what_stands_out_by_more_than_noise_is_kept() {
    let gpu = Gpu::open();
    let options = options(1, false);
    let middle = (SIZE[1] / 2 * SIZE[0] + SIZE[0] / 2) as usize;
    let smooth_middle = |around: GatheredLobe, own: GatheredLobe| {
        let mut pixels = hill();
        for pixel in pixels.iter_mut().flatten() {
            pixel.diffuse = around;
        }
        let pixel = pixels[middle].as_mut().expect("every pixel has a surface");
        pixel.diffuse = own;
        smooth(&gpu.device, &pixels, options).expect("the kernel runs")[middle][0]
    };
    let lit = lobe([1.0, 0.8, 0.6], 2.0);
    let faint = lobe([0.01, 0.008, 0.006], 1e-4);
    let dark = lobe([0.0; 3], 0.0);
    let found = smooth_middle(faint, lit);
    assert!(found[0] > 0.95, "lit among faint ones: {found:?}");
    assert_eq!(smooth_middle(lit, dark), [0.0; 3], "dark among lit ones");
    // One sample in a hundred finds the light.
    let seldom = lobe([0.01, 0.01, 0.01], 0.03);
    let found = smooth_middle(seldom, dark);
    assert!(found[0] > 0.005, "dark by chance: {found:?}");
}
