//! The kernels of `shaders/smooth.wgsl` and `shaders/smooth_residuals.wgsl` alone, on gathers that a test provides.

use std::sync::Arc;

use crate::{
    Device, Result,
    model::Lobe,
    vulkan::{
        CommandPool, Image, ImageShape, Pipelines, Readback, Resource, groups_in_rows,
        shaders::{Brdf, Key, SmoothParameters, SmoothResidualsParameters},
    },
};

/// State of a gathered pixel: the bits of 1.0 with kind 2 of `shaders/shared/refinement.wgsl` in the lowest ones.
const GATHERED: f32 = f32::from_bits(0x3f80_0002);

/// A lobe's light at a pixel, estimated from its samples.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GatheredLobe {
    /// W/sr/m² for a reflectance of 1.
    pub mean: [f32; 3],
    /// Variance of one sample, all bands together.
    pub variance: f32,
}

/// A pixel with a surface.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GatheredPixel {
    pub position: [f32; 3],
    pub normal: [f32; 3],
    pub lobe: Lobe,
    /// Packets of 64 samples. 0: the pixel was not gathered.
    pub packets: u32,
    pub diffuse: GatheredLobe,
    pub specular: GatheredLobe,
}

/// How the noise of gathers falls, and the spacing of gathered pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SmoothOptions {
    pub size_px: [u32; 2],
    pub stride_px: u32,
    pub is_specular: bool,
    /// Variance of a packet, relative to the same number of random samples.
    pub evenness: f32,
    /// The exponent with which the variance falls with the number of packets.
    pub variance_rate: f32,
}

/// The diffuse and the specular light of each pixel after the passes, row by row. A pixel that is `None` has no surface.
///
/// # Errors
/// [`Error::Memory`](crate::Error::Memory) and [`Error::Vulkan`](crate::Error::Vulkan) if the device fails.
pub fn smooth(
    device: &Device,
    pixels: &[Option<GatheredPixel>],
    options: SmoothOptions,
) -> Result<Vec<[[f32; 3]; 2]>> {
    let SmoothOptions {
        size_px,
        stride_px,
        is_specular,
        ..
    } = options;
    let commands = CommandPool::new(device);
    let image = |what, layers: Option<u32>, texels: Vec<[f32; 4]>| {
        let shape = ImageShape {
            layers,
            ..ImageShape::plain(size_px)
        };
        let image = Arc::new(Image::new(device, what, shape)?);
        commands.upload_image(what, &texels, &image)?;
        Ok::<_, crate::Error>(image)
    };
    let layer = |texel: &dyn Fn(&GatheredPixel) -> [f32; 4]| -> Vec<[f32; 4]> {
        let texel = |pixel: &Option<GatheredPixel>| pixel.as_ref().map_or([0.0; 4], texel);
        pixels.iter().map(texel).collect()
    };
    let with = |[x, y, z]: [f32; 3], w| [x, y, z, w];
    let sums = |pixel: &GatheredPixel, lobe: &GatheredLobe| {
        let samples = 64.0 * pixel.packets as f32;
        with(
            lobe.mean.map(|mean| mean * samples),
            lobe.variance * samples,
        )
    };
    let lobe_layers = |[diffuse, specular]: [Vec<[f32; 4]>; 2]| match is_specular {
        true => [diffuse, specular].concat(),
        false => diffuse,
    };
    let lobes = 1 + u32::from(is_specular);
    let gathered = lobe_layers([
        layer(&|pixel| {
            let is_gathered = pixel.packets > 0;
            with(pixel.diffuse.mean, if is_gathered { GATHERED } else { 1.0 })
        }),
        layer(&|pixel| with(pixel.specular.mean, 0.0)),
    ]);
    let sums = lobe_layers([
        layer(&|pixel| sums(pixel, &pixel.diffuse)),
        layer(&|pixel| sums(pixel, &pixel.specular)),
    ]);
    let packets = layer(&|pixel| [pixel.packets as f32, 0.0, 0.0, 0.0]);
    // What this pass finds out, and what the unoccluded pass computes.
    let rest = vec![[0.0; 4]; 2 * pixels.len()];
    let gathered = image("gathered light", Some(lobes), gathered)?;
    let images = [
        (
            "position_instance",
            image("positions", None, layer(&|pixel| with(pixel.position, 1.0)))?,
        ),
        (
            "normal_geometric",
            image("normals", None, layer(&|pixel| with(pixel.normal, 0.0)))?,
        ),
        (
            "lobe_parameters",
            image("lobes", None, layer(&|pixel| pixel.lobe.texel()))?,
        ),
        (
            "samples",
            image("samples", Some(3 + lobes), [packets, rest, sums].concat())?,
        ),
        ("gathered", gathered.clone()),
        (
            "modelled",
            image(
                "models",
                Some(lobes),
                vec![[0.0; 4]; lobes as usize * pixels.len()],
            )?,
        ),
    ];
    let resources: Vec<_> = images
        .iter()
        .map(|(name, image)| (*name, Resource::Image(image)))
        .collect();
    let [columns, rows] = size_px.map(|px| px.div_ceil(stride_px));
    let parameters = SmoothParameters {
        stride: stride_px,
        columns,
        item_count: columns * rows,
        evenness: options.evenness,
        variance_rate: options.variance_rate,
        by_ratio: 0,
    };
    let brdf = match is_specular {
        true => Brdf::Specular,
        false => Brdf::Lambert,
    };
    let of_residuals = SmoothResidualsParameters {
        stride: parameters.stride,
        columns: parameters.columns,
        item_count: parameters.item_count,
    };
    let pipelines = Pipelines::new(device);
    let model = pipelines.compute(Key::Smooth {
        phasors: false,
        brdf,
    })?;
    let residuals = pipelines.compute(Key::SmoothResiduals {
        phasors: false,
        brdf,
    })?;
    let groups = groups_in_rows(
        parameters
            .item_count
            .div_ceil(model.module.workgroup_size[0]),
    );
    let mut recorder = commands.begin()?;
    recorder.pass("smooth", |recorder| {
        recorder.dispatch(&model, &resources, &parameters, groups)
    })?;
    recorder.pass("smooth_residuals", |recorder| {
        recorder.dispatch(&residuals, &resources, &of_residuals, groups)
    })?;
    recorder.submit()?;
    let mut readback = Readback::new(device);
    let texels = readback.pixels(&gathered)?;
    let rgb = |i: usize| texels.get(i).map_or([0.0; 3], |&[r, g, b, _]| [r, g, b]);
    Ok((0..pixels.len())
        .map(|i| [rgb(i), rgb(pixels.len() + i)])
        .collect())
}
