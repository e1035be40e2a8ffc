//! Gather kernels against the native loop.

use std::{path::Path, time::Duration};

use camlux::{
    Device, GatherKernel, RenderOptions, Renderer, Scene,
    output::{Frame, Layer},
    scene::{Estimator, Indirect},
};

use crate::{Failure, Spread, verdict};

const SIZE_PX: [u32; 2] = [400, 400];
const RSM_SIZE: u32 = 64;
/// Turns of either side, after one to warm up.
const TURNS: usize = 7;
/// Pairs per second over the native loop's, for the Lambert gather of instant-radiosity on a CPU driver.
const BAR: f64 = 0.6;

pub fn report(device: &Device, threads: usize) -> Result<(), Failure> {
    let [width, height] = SIZE_PX;
    println!(
        "gather   Cornell box, {width} x {height} px, 6 x {RSM_SIZE}² texels; {TURNS} turns; G = 10⁹ pixel-VPL pairs/s"
    );
    println!(
        "{:<18} {:<11} {:<16} {:>9} {:>9}  {:<20} bar",
        "estimator", "kernel", "surfaces", "camlux G", "native G", "ratio (min to max)"
    );
    let matte = scene("cornell")?;
    let best = GatherKernel::best_for(device.info());
    let mut kernels = vec![best];
    if best != GatherKernel::Tile {
        kernels.push(GatherKernel::Tile);
    }
    for kernel in kernels {
        for estimator in [Estimator::InstantRadiosity, Estimator::RsmAverage] {
            let has_bar = kernel == best && estimator == Estimator::InstantRadiosity;
            let mut side = Side::new(device, &matte, estimator, kernel)?;
            duel(&mut side, threads, has_bar)?;
        }
    }
    let mut glossy = matte.clone();
    for material in &mut glossy.materials {
        (material.ks, material.shininess) = ([0.2; 3], 50.0);
    }
    for estimator in [Estimator::InstantRadiosity, Estimator::RsmAverage] {
        for (what, scene) in [("all Phong", &glossy), ("glossy.toml", &scene("glossy")?)] {
            let mut side = Side::new(device, scene, estimator, best)?;
            side.turn()?;
            let rates = (0..TURNS).map(|_| side.turn()).collect::<Result<_, _>>()?;
            row(&side, what, Spread::of(rates).median, None);
        }
    }
    println!(
        "Phong rows: receivers and VPLs with a specular lobe; no native loop of the same formula, no bar."
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
    estimator: Estimator,
    kernel: GatherKernel,
}

impl Side {
    fn new(
        device: &Device,
        scene: &Scene,
        estimator: Estimator,
        kernel: GatherKernel,
    ) -> Result<Side, Failure> {
        let mut scene = scene.clone();
        scene.indirect = Some(Indirect {
            estimator,
            rsm_size: RSM_SIZE,
        });
        Ok(Side {
            renderer: Renderer::new(device)?,
            scene,
            estimator,
            kernel,
        })
    }

    fn options(&self) -> RenderOptions<'static> {
        RenderOptions {
            gather_kernel: Some(self.kernel),
            ..RenderOptions::default()
        }
    }

    /// Billions of pairs per second of one frame's gather.
    fn turn(&mut self) -> Result<f64, Failure> {
        let frame = self.renderer.render(&self.scene, &mut self.options())?;
        giga_pairs_per_second(&frame)
    }
}

fn giga_pairs_per_second(frame: &Frame) -> Result<f64, Failure> {
    let rate = frame.stats.pairs_per_second();
    Ok(rate.ok_or("the frame has no gather")? * 1e-9)
}

/// Turns of camlux and of the native loop, which have to agree on the result.
#[cfg(target_arch = "x86_64")]
fn duel(side: &mut Side, threads: usize, has_bar: bool) -> Result<(), Failure> {
    let (frame, kept) = side
        .renderer
        .render_with_intermediates(&side.scene, &mut side.options())?;
    let work = crate::native::Work::of(&kept, side.estimator);
    let Some(opponent) = work.opponent(threads) else {
        println!("this CPU has no AVX2 and FMA: no native loop to compare with");
        return alone(side);
    };
    let indirect = frame.values(Layer::Indirect).unwrap_or_default();
    let sum: f64 = indirect.iter().map(|&value| f64::from(value)).sum();
    let (_, native_sum) = opponent.run();
    let apart = (native_sum / sum - 1.0).abs();
    if work.pairs() != frame.stats.pixel_vpl_pairs as f64 || apart > 1e-5 {
        eprintln!(
            "{} vs {} pairs; {native_sum} vs {sum}",
            work.pairs(),
            frame.stats.pixel_vpl_pairs
        );
    }
    let giga_pairs = work.pairs() * 1e-9;
    let native_rate = |time: Duration| giga_pairs / time.as_secs_f64();
    let (mut rates, mut native_rates, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..TURNS {
        let rate = side.turn()?;
        let native = native_rate(opponent.run().0);
        rates.push(rate);
        native_rates.push(native);
        ratios.push(rate / native);
    }
    let native = Native {
        rate: Spread::of(native_rates).median,
        ratio: Spread::of(ratios),
        has_bar,
    };
    row(side, "Lambert", Spread::of(rates).median, Some(native));
    Ok(())
}

#[cfg(not(target_arch = "x86_64"))]
fn duel(side: &mut Side, _: usize, _: bool) -> Result<(), Failure> {
    println!("the native loop is written for AVX2: none to compare with on this CPU");
    alone(side)
}

/// camlux's rate where there is nothing to compare with.
fn alone(side: &mut Side) -> Result<(), Failure> {
    side.turn()?;
    let rates = (0..TURNS).map(|_| side.turn()).collect::<Result<_, _>>()?;
    row(side, "Lambert", Spread::of(rates).median, None);
    Ok(())
}

struct Native {
    rate: f64,
    ratio: Spread,
    has_bar: bool,
}

fn row(side: &Side, surfaces: &str, rate: f64, native: Option<Native>) {
    let (native, ratio, bar) = match native {
        None => ("-".into(), "-".into(), String::new()),
        Some(Native {
            rate,
            ratio: Spread { median, min, max },
            has_bar,
        }) => (
            format!("{rate:.2}"),
            format!("{median:.2} ({min:.2} to {max:.2})"),
            if has_bar {
                format!("≥ {BAR:.2} {}", verdict(median >= BAR))
            } else {
                String::new()
            },
        ),
    };
    let line = format!(
        "{:<18} {:<11} {surfaces:<16} {rate:>9.2} {native:>9}  {ratio:<20} {bar}",
        side.estimator.name(),
        side.kernel.name(),
    );
    println!("{}", line.trim_end());
}
