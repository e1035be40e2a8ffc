//! Renders planned frames, and goes on with another device if one is lost.

use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard};

use camlux::output::{Exposure, FLOW_LAYERS, Frame, FrameDescription, Layer};
use camlux::scene::ChargeUnit;
use camlux::{Device, DeviceInfo, DeviceOptions, Error, RenderOptions, Renderer, Scene};

use super::blur;
use super::flow;
use super::frames::{Moment, Planned};

/// A renderer, and what the engines of a job share.
pub struct Engine {
    pub renderer: Renderer,
    /// How often the device had been lost when the renderer was made.
    losses: u32,
    pub shared: Arc<EngineDevice>,
}

/// The device of all engines of a job. On it, their renderers share the scene.
pub struct EngineDevice {
    options: DeviceOptions,
    /// An engine that renders reads it, and one that renders alone writes it.
    opened: RwLock<Opened>,
}

/// The device that is open now.
pub struct Opened {
    pub device: Device,
    /// How often a device has been lost before.
    losses: u32,
}

impl Engine {
    pub fn open(options: &DeviceOptions) -> Result<Engine, Error> {
        Engine::on(&EngineDevice::new(Device::open(options)?, options))
    }

    pub fn on(shared: &Arc<EngineDevice>) -> Result<Engine, Error> {
        let opened = shared.read();
        Ok(Engine {
            renderer: Renderer::new(&opened.device)?,
            losses: opened.losses,
            shared: shared.clone(),
        })
    }

    pub fn device_info(&self) -> DeviceInfo {
        self.shared.read().device.info().clone()
    }

    pub fn render(&mut self, planned: &Planned) -> Result<Frame, Error> {
        let shared = self.shared.clone();
        let is_one_of_several = Arc::strong_count(&shared) > 2;
        let opened = shared.read();
        self.follow(&opened)?;
        let rendered = self.try_to_render(planned);
        drop(opened);
        if !is_device_lost(&rendered) {
            return rendered;
        }
        // A lost device cannot be used again; the remaining frames need a new one.
        let mut opened = shared
            .opened
            .write()
            .unwrap_or_else(PoisonError::into_inner);
        self.replace_lost(&mut opened)?;
        if !is_one_of_several {
            return rendered;
        }
        // The frame of another engine may have lost it. So this one renders again, alone.
        let again = self.try_to_render(planned);
        if is_device_lost(&again) {
            self.replace_lost(&mut opened)?;
        }
        again
    }

    /// Opens another device unless another engine has.
    fn replace_lost(&mut self, opened: &mut Opened) -> Result<(), Error> {
        if self.losses == opened.losses {
            opened.device = Device::open(&self.shared.options)?;
            opened.losses += 1;
        }
        self.follow(opened)
    }

    /// Renders on the device that is open now.
    fn follow(&mut self, opened: &Opened) -> Result<(), Error> {
        if self.losses != opened.losses {
            self.renderer = Renderer::new(&opened.device)?;
            self.losses = opened.losses;
        }
        Ok(())
    }

    fn try_to_render(&mut self, planned: &Planned) -> Result<Frame, Error> {
        let begin = planned.begin.scene();
        let samples = &planned.exposed.frame;
        let scene = Scene {
            // With motion blur, the light of this frame itself is not used.
            indirect: begin.indirect.filter(|_| samples.is_empty()),
            ..begin.clone()
        };
        let layers = planned.layers_to_read(&scene);
        let mut options = RenderOptions {
            frame_index: Some(planned.index as u32),
            layers: layers.as_deref(),
            repeat_unchanged: true,
            ..RenderOptions::default()
        };
        let mut frame = self.renderer.render(&scene, &mut options)?;
        let mut mean = blur::Mean::default();
        for moment in samples {
            let mut scene = moment.scene();
            if let Some(sensor) = &mut scene.sensor {
                sensor.noise = None;
            }
            let layers = Layer::made_for(&scene, &planned.averaged_on_request());
            let mut options = RenderOptions {
                layers: Some(&layers),
                ..RenderOptions::default()
            };
            let sample = self.renderer.render(&scene, &mut options)?;
            mean.add(&sample);
            frame.stats.include(&sample.stats);
            self.renderer.return_buffers(sample);
        }
        if !samples.is_empty() {
            mean.put_into(&mut frame);
            frame.description = FrameDescription {
                key: frame.description.key,
                ..FrameDescription::new(&begin, begin.hash())
            };
            frame.count_electrons();
        }
        let images = &planned.exposed.phase_images;
        for of_frequency in images.chunk_by(|(a, _), (b, _)| a.frequency == b.frequency) {
            let mut exposures = Vec::new();
            for (image, moments) in of_frequency {
                let mut exposure = Exposure::default();
                for moment in moments {
                    let mut scene = moment.scene();
                    if let Some(tof) = &mut scene.tof {
                        tof.keep_frequency(image.frequency);
                        tof.noise = None;
                        tof.output = ChargeUnit::Electrons;
                    }
                    let sample = self
                        .renderer
                        .render(&scene, &mut RenderOptions::default())?;
                    exposure.add(&sample, 0)?;
                    frame.stats.include(&sample.stats);
                    self.renderer.return_buffers(sample);
                }
                exposures.push(exposure);
            }
            if let Some((image, _)) = of_frequency.first() {
                frame.expose(image.frequency, &exposures)?;
            }
        }
        if !planned.flow.is_empty() {
            let mut others = [None, None];
            for ((place, moment), layers) in others.iter_mut().zip(&planned.others).zip(FLOW_LAYERS)
            {
                let [.., occlusion] = layers;
                let is_shown = planned.flow.contains(&occlusion);
                if let Some(moment) = moment {
                    let shown = is_shown.then(|| self.geometry(moment)).transpose()?;
                    *place = Some(flow::Other { moment, shown });
                }
            }
            flow::add(&mut frame, &planned.begin, &planned.flow, &others);
        }
        Ok(frame)
    }

    /// What a frame shows, without light.
    fn geometry(&mut self, moment: &Moment) -> Result<Frame, Error> {
        let scene = moment.scene().geometry();
        let mut options = RenderOptions {
            layers: Some(&[Layer::Range, Layer::InstanceId]),
            ..RenderOptions::default()
        };
        self.renderer.render(&scene, &mut options)
    }
}

impl EngineDevice {
    pub fn new(device: Device, options: &DeviceOptions) -> Arc<EngineDevice> {
        Arc::new(EngineDevice {
            options: options.clone(),
            opened: RwLock::new(Opened { device, losses: 0 }),
        })
    }

    pub fn read(&self) -> RwLockReadGuard<'_, Opened> {
        self.opened.read().unwrap_or_else(PoisonError::into_inner)
    }
}

fn is_device_lost(rendered: &Result<Frame, Error>) -> bool {
    matches!(rendered, Err(Error::DeviceLost { .. }))
}
