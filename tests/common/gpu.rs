//! A renderer under the Khronos validation layer, for every test that needs a device.

use std::{path::Path, sync::OnceLock};

use camlux::{
    Device, DeviceKind, DeviceOptions, GatherKernel, RenderOptions, Renderer, Scene, Tracer,
    output::{Frame, Layer},
    scene::{Distortion, IndirectLight, Lens, VplSum},
};

/// A renderer. Dropping it asserts that the validation layer reported nothing. New memory holds NaN, so that reads of unwritten memory show,
/// as on drivers that do not return zeros.
pub struct Gpu {
    pub device: Device,
    pub renderer: Renderer,
}

impl Gpu {
    /// Opens the best device with the validation layer. The test fails if the machine lacks either.
    pub fn open() -> Gpu {
        let options = DeviceOptions {
            validation: true,
            ..DeviceOptions::default()
        };
        let device = Device::open(&options).expect("scripts/test installs a driver and the layer");
        device.poison_memory();
        let renderer = Renderer::new(&device).expect("a renderer");
        Gpu { device, renderer }
    }

    /// Renders the scene with each tracer that the device runs.
    pub fn render_by_each_tracer(&mut self, scene: &Scene) -> Vec<Frame> {
        let tracers = tracers(&self.device).into_iter();
        tracers
            .map(|tracer| self.render_with(scene, |options| options.tracer = Some(tracer)))
            .collect()
    }

    /// Renders with another seed.
    pub fn render_seeded(&mut self, scene: &Scene, seed: u32) -> Frame {
        self.render_with(scene, |options| options.seed = seed)
    }

    /// Renders with options that `change` sets.
    pub fn render_with<'o>(
        &mut self,
        scene: &Scene,
        change: impl FnOnce(&mut RenderOptions<'o>),
    ) -> Frame {
        let frame = self.try_render_with(scene, change);
        frame.expect("the scene renders")
    }

    pub fn try_render_with<'o>(
        &mut self,
        scene: &Scene,
        change: impl FnOnce(&mut RenderOptions<'o>),
    ) -> camlux::Result<Frame> {
        let mut options = RenderOptions::default();
        change(&mut options);
        self.renderer.render(scene, &mut options)
    }

    /// Renders with the tracer that `scripts/test-rust --tracer` names, or else with the device's best.
    pub fn render(&mut self, scene: &Scene) -> Frame {
        let name = std::env::var("CAMLUX_TEST_TRACER").ok();
        let named = |name: String| {
            let mut tracers = Tracer::ALL.into_iter();
            tracers
                .find(|tracer| tracer.name() == name)
                .expect("a tracer")
        };
        self.render_with(scene, |options| options.tracer = name.map(named))
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        let messages = self.device.validation_messages();
        if std::thread::panicking() {
            // The messages may show the cause of the panic, which a second panic would hide.
            eprintln!("validation: {messages:#?}");
        } else {
            assert!(messages.is_empty(), "validation: {messages:#?}");
        }
    }
}

/// The number of sub-pixel bits to which the device rounds vertices when it rasterises.
pub fn sub_pixel_bits() -> u32 {
    static BITS: OnceLock<u32> = OnceLock::new();
    *BITS.get_or_init(|| {
        let device = Device::open(&DeviceOptions::default());
        let device = device.expect("scripts/test installs a driver");
        device.info().limits.sub_pixel_bits
    })
}

/// Asserts that a layer is not black. Two images of an engine that draws nothing would be equal.
#[track_caller]
pub fn assert_is_lit(frame: &Frame, layer: Layer) {
    let values = frame.values(layer).expect("the layer is there");
    assert!(
        values.iter().any(|&value| value > 0.0),
        "a black layer {} proves nothing",
        layer.name()
    );
}

/// The gather kernels that the device runs. Asserts that a CPU driver runs several, to compare with each other, and a GPU one.
#[track_caller]
pub fn gather_kernels(device: &Device) -> Vec<GatherKernel> {
    let kernels = GatherKernel::ALL.into_iter();
    let kernels: Vec<_> = kernels
        .filter(|kernel| kernel.runs_on(device.info()))
        .collect();
    let is_cpu = device.info().kind == DeviceKind::Cpu;
    assert_eq!(
        kernels.len() > 1,
        is_cpu,
        "{} runs {kernels:?}",
        device.info().name
    );
    kernels
}

/// The tracers that the device runs. Asserts that the host traces for a CPU driver, and that a device with ray queries uses them.
pub fn tracers(device: &Device) -> Vec<Tracer> {
    let info = device.info();
    let tracers = Tracer::ALL.into_iter();
    let tracers: Vec<_> = tracers.filter(|tracer| tracer.runs_on(info)).collect();
    let is_there = |tracer: &Tracer| tracers.contains(tracer);
    let expected = [info.kind == DeviceKind::Cpu, info.has_ray_query, true];
    let found = Tracer::ALL.each_ref().map(is_there);
    assert_eq!(found, expected, "{info:?}");
    tracers
}

/// A scene of the repository, at another resolution.
pub fn demo_scene(name: &str, resolution_px: [u32; 2]) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"));
    let mut scene = Scene::load(&path).expect("a demo scene loads");
    let scale = f64::from(resolution_px[1]) / f64::from(scene.camera.resolution_px[1]);
    scale_lens(&mut scene.camera.lens, scale);
    scene.camera.resolution_px = resolution_px;
    scene
}

/// The lens for an image of so many times the pixels along each edge.
pub fn scale_lens(lens: &mut Lens, factor: f64) {
    let (Lens::Intrinsics(px) | Lens::Distorted { intrinsics: px, .. }) = lens else {
        return;
    };
    for length_px in [&mut px.fx, &mut px.fy, &mut px.cx, &mut px.cy, &mut px.skew] {
        *length_px *= factor;
    }
}

/// Puts a lens with distortion before the camera.
pub fn distort(scene: &mut Scene, distortion: Distortion) {
    scene.camera.lens = Lens::Distorted {
        intrinsics: scene.camera.intrinsics_px(),
        distortion,
    };
}

pub fn radial(k1: f64, k2: f64) -> Distortion {
    rational([k1, k2, 0.0, 0.0])
}

/// The model of these coefficients, in OpenCV's order.
pub fn rational<const N: usize>(coefficients: [f64; N]) -> Distortion {
    Distortion::from_opencv(&coefficients).expect("a length of OpenCV's")
}

/// The scene with a VPL sum: its own kind, or instant radiosity if the scene uses final gathering.
pub fn plain_sum(mut scene: Scene, rsm_size: u32) -> Scene {
    let indirect = scene.indirect.expect("the scene has indirect light");
    let sum = indirect.sum().unwrap_or(VplSum::InstantRadiosity);
    scene.indirect = Some(IndirectLight::vpl_sum(sum, rsm_size));
    scene
}

/// Scenes of the repository, for tests that render several.
pub const DEMO_SCENES: [&str; 5] = ["cornell", "cornell_spot", "glossy", "textured", "knot"];
