//! Gather kernels compared with the native loop.

use std::path::Path;

use camlux::{
    Device, GatherKernel, RenderOptions, Renderer, Scene,
    output::Layer,
    scene::{IndirectLight, VplSum},
};

use crate::{Failure, Spread, verdict};

const SIZE_PX: [u32; 2] = [400, 400];
/// Texels along a face's edge, for the kernel with a bar and for the slower ones.
const RSM_SIZE: u32 = 64;
const SLOW_RSM_SIZE: u32 = 32;
/// Turns of each side, after one for warm-up.
const TURNS: usize = 7;
/// Required share of the native loop's speed, for the Lambert gather of instant-radiosity.
const BAR: f64 = 0.6;

pub fn report(device: &Device, threads: usize) -> Result<(), Failure> {
    let [width, height] = SIZE_PX;
    println!(
        "gather   Cornell box, {width} x {height} px; medians of {TURNS} turns; G: 10⁹ pixel-VPL pairs/s"
    );
    println!(
        "{:<18} {:<11} {:<12} {:>6} {:>9} {:>9}  {:<20} bar",
        "estimator", "kernel", "surfaces", "VPLs", "camlux G", "native G", "ratio (min to max)"
    );
    let matte = scene("cornell")?;
    let best = GatherKernel::best_for(device.info());
    for estimator in VplSum::ALL {
        let has_bar = estimator == VplSum::InstantRadiosity;
        let mut side = Side::new(device, &matte, estimator, RSM_SIZE, best)?;
        duel(&mut side, threads, has_bar)?;
    }
    let others = GatherKernel::ALL
        .into_iter()
        .filter(|&kernel| kernel != best);
    for kernel in others.filter(|kernel| kernel.runs_on(device.info())) {
        for estimator in VplSum::ALL {
            let mut side = Side::new(device, &matte, estimator, SLOW_RSM_SIZE, kernel)?;
            duel(&mut side, threads, false)?;
        }
    }
    let mut phong = matte.clone();
    for material in &mut phong.materials {
        (material.ks, material.shininess) = ([0.2; 3], 50.0);
    }
    let some_glossy = scene("glossy")?;
    for estimator in VplSum::ALL {
        for (what, scene) in [("all Phong", &phong), ("glossy.toml", &some_glossy)] {
            let mut side = Side::new(device, scene, estimator, SLOW_RSM_SIZE, best)?;
            alone(&mut side, what)?;
        }
    }
    println!(
        "native G: r1, r2 or r4 vectors of receivers in registers, whichever is fastest; Lambert only."
    );
    Ok(())
}

fn scene(name: &str) -> Result<Scene, Failure> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut scene = Scene::load(&folder.join(format!("{name}.toml")))?;
    scene.camera.resolution_px = SIZE_PX;
    Ok(scene)
}

/// camlux's side: one scene and one kernel.
struct Side {
    renderer: Renderer,
    scene: Scene,
    estimator: VplSum,
    kernel: GatherKernel,
    /// The number of VPLs of the latest frame.
    vpl_count: u64,
}

impl Side {
    fn new(
        device: &Device,
        scene: &Scene,
        estimator: VplSum,
        rsm_size: u32,
        kernel: GatherKernel,
    ) -> Result<Side, Failure> {
        let mut scene = scene.clone();
        scene.indirect = Some(IndirectLight::vpl_sum(estimator, rsm_size));
        Ok(Side {
            renderer: Renderer::new(device)?,
            scene,
            estimator,
            kernel,
            vpl_count: 0,
        })
    }

    fn options(&self) -> RenderOptions<'static> {
        RenderOptions {
            gather_kernel: Some(self.kernel),
            ..RenderOptions::default()
        }
    }

    /// Renders a frame and returns the rate of its gather in 10⁹ pairs per second.
    fn turn(&mut self) -> Result<f64, Failure> {
        let frame = self.renderer.render(&self.scene, &mut self.options())?;
        self.vpl_count = frame.stats.vpl_count;
        let rate = frame.stats.pairs_per_second();
        Ok(rate.ok_or("the frame has no gather")? * 1e-9)
    }
}

/// Alternates camlux and the native loop. Both must compute the same result.
#[cfg(target_arch = "x86_64")]
fn duel(side: &mut Side, threads: usize, has_bar: bool) -> Result<(), Failure> {
    let (frame, kept) = side
        .renderer
        .render_with_intermediates(&side.scene, &mut side.options())?;
    let work = crate::native::Work::of(&kept, side.estimator);
    let Some(opponent) = work.opponent(threads) else {
        println!("this CPU has no AVX2 and FMA: no native loop to compare with");
        return alone(side, "Lambert");
    };
    let indirect = frame.values(Layer::Indirect).unwrap_or_default();
    let sum: f64 = indirect.iter().map(|&value| f64::from(value)).sum();
    let (_, native_sum) = opponent.run();
    let apart = (native_sum / sum - 1.0).abs();
    // The native loop is less exact: it adds thousands of f32 in one level.
    if work.pairs() != frame.stats.pixel_vpl_pairs as f64 || apart > 1e-3 {
        return Err(format!("the native loop computes something else: {apart:e} apart").into());
    }
    let (mut rates, mut native_rates, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..TURNS {
        let rate = side.turn()?;
        let native = work.pairs() * 1e-9 / opponent.run().0.as_secs_f64();
        rates.push(rate);
        native_rates.push(native);
        ratios.push(rate / native);
    }
    let Spread { median, min, max } = Spread::of(ratios);
    let bar = format!("≥ {BAR:.2} {}", verdict(median >= BAR));
    row(
        side,
        "Lambert",
        Spread::of(rates).median,
        &format!(
            "{:.2} r{}",
            Spread::of(native_rates).median,
            opponent.vectors
        ),
        &format!("{median:.2} ({min:.2} to {max:.2})"),
        if has_bar { &bar } else { "" },
    );
    Ok(())
}

#[cfg(not(target_arch = "x86_64"))]
fn duel(side: &mut Side, _: usize, _: bool) -> Result<(), Failure> {
    println!("the native loop is written for AVX2: none to compare with on this CPU");
    alone(side, "Lambert")
}

/// camlux's rate if there is no native loop for comparison.
fn alone(side: &mut Side, surfaces: &str) -> Result<(), Failure> {
    side.turn()?;
    let rates: Result<Vec<f64>, Failure> = (0..TURNS).map(|_| side.turn()).collect();
    row(side, surfaces, Spread::of(rates?).median, "-", "-", "");
    Ok(())
}

fn row(side: &Side, surfaces: &str, rate: f64, native: &str, ratio: &str, bar: &str) {
    let (estimator, kernel) = (side.estimator.name(), side.kernel.name());
    let vpls = side.vpl_count;
    let line = format!(
        "{estimator:<18} {kernel:<11} {surfaces:<12} {vpls:>6} {rate:>9.2} {native:>9}  {ratio:<20} {bar}"
    );
    println!("{}", line.trim_end());
}
