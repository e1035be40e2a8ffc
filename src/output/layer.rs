//! The layers of a frame: what their rows say, and which scenes have them.

use std::{collections::HashMap, num::NonZeroU8, sync::LazyLock};

use super::layer_table::{Layer, LayerNeed, TofQuantity};
use crate::error::{Error, Result};
use crate::scene::{
    ChargeUnit, CountedElectrons, IndirectLight, MAX_BOUNCES, MAX_FREQUENCIES, MAX_PHASES, Scene,
    TimeOfFlight,
};

/// The names of a layer and of its channels.
struct Names {
    layer: &'static str,
    channels: &'static [&'static str],
}

static NAMES: LazyLock<HashMap<Layer, Names>> = LazyLock::new(|| {
    Layer::all()
        .map(|layer| (layer, Names::of(layer)))
        .collect()
});

impl Names {
    /// It lives as long as the program.
    fn of(layer: Layer) -> Names {
        let row = layer.row();
        let own = match layer.number() {
            Some(number) => format!("{}{number}", row.name),
            None => row.name.into(),
        };
        let name: &'static str = match layer {
            Layer::Tof(frequency, _) => format!("tof{frequency}.{own}").leak(),
            _ => own.leak(),
        };
        let channel = |part: &&str| -> &'static str { format!("{name}.{part}").leak() };
        let channels = match row.channels {
            [] => vec![name],
            parts => parts.iter().map(channel).collect(),
        };
        Names {
            layer: name,
            channels: channels.leak(),
        }
    }
}

impl Layer {
    /// Every layer, in the order of the documentation.
    pub fn all() -> impl Iterator<Item = Layer> {
        let bounces = || (1..=MAX_BOUNCES).filter_map(NonZeroU8::new);
        let quantities = move |of_row: TofQuantity| match of_row {
            TofQuantity::PhasorBounce(_) => bounces().map(TofQuantity::PhasorBounce).collect(),
            TofQuantity::Taps(_) => (0..MAX_PHASES as u8).map(TofQuantity::Taps).collect(),
            _ => vec![of_row],
        };
        let of_frequency = move |frequency| {
            let quantities = TofQuantity::OF_ROWS.iter().copied().flat_map(quantities);
            quantities.map(move |quantity| Layer::Tof(frequency, quantity))
        };
        let plain = move |of_row: Layer| match of_row {
            Layer::Bounce(_) => bounces().map(Layer::Bounce).collect(),
            _ => vec![of_row],
        };
        let plain = Layer::OF_ROWS.iter().copied().flat_map(plain);
        plain.chain((0..MAX_FREQUENCIES as u8).flat_map(of_frequency))
    }

    /// The number of bounces or of the phase image, with which the layer's name ends.
    pub(crate) fn number(self) -> Option<u8> {
        match self {
            Layer::Bounce(bounces) | Layer::Tof(_, TofQuantity::PhasorBounce(bounces)) => {
                Some(bounces.get())
            }
            Layer::Tof(_, TofQuantity::Taps(phase)) => Some(phase),
            _ => None,
        }
    }

    /// The number of bounces of the light that the layer has alone.
    pub(crate) fn bounces(self) -> Option<u32> {
        let has_bounces = matches!(self.need(), LayerNeed::MoreBounces);
        self.number().filter(|_| has_bounces).map(u32::from)
    }

    /// The name in OpenEXR files and on the command line.
    pub fn name(self) -> &'static str {
        let names = NAMES.get(&self);
        names.map_or(self.row().name, |names| names.layer)
    }

    /// The layer of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::all().find(|layer| layer.name() == name)
    }

    /// Full OpenEXR channel names, in the order in which [`LayerData`](super::LayerData) interleaves them.
    pub fn channel_names(self) -> &'static [&'static str] {
        let names = NAMES.get(&self);
        names.map_or(self.row().channels, |names| names.channels)
    }

    /// The channels in a [plain](super::ExrOptions::plain) file: Y for one value, R, G, B for three. Of two values, B is 0: some programs
    /// read no R and G alone.
    pub fn plain_channel_names(self) -> &'static [&'static str] {
        match self.channel_names().len() {
            1 => &["Y"],
            _ => &["R", "G", "B"],
        }
    }

    /// The channels in a [part](super::ExrOptions::multipart) of its own: the last parts of [`Layer::channel_names`], Y for a whole number.
    pub fn part_channel_names(self) -> &'static [&'static str] {
        match self.row().channels {
            [] => &["Y"],
            parts => parts,
        }
    }

    /// The unit of the values; "1" for a plain number.
    pub fn unit(self) -> &'static str {
        self.row().unit
    }

    /// The unit in a frame of this time-of-flight camera, which may output charges as digital numbers.
    pub fn unit_by(self, tof: Option<&TimeOfFlight>) -> &'static str {
        match (self, tof.map(|tof| tof.output), self.unit()) {
            (Layer::Tof(..), Some(ChargeUnit::DigitalNumbers), "e-") => "DN",
            (_, _, unit) => unit,
        }
    }

    /// What a frame needs to have the layer.
    pub fn need(self) -> LayerNeed {
        self.row().need
    }

    /// Whether a frame has the layer only where it is named. Others are there by default.
    pub fn is_on_request(self) -> bool {
        self.row().is_on_request
    }

    /// Whether the layer is one of these; `None` stands for the layers that a frame has by default.
    pub fn is_among(self, wanted: Option<&[Layer]>) -> bool {
        wanted.map_or(!self.is_on_request(), |wanted| wanted.contains(&self))
    }

    /// What the layer is: a few sentences, in lines.
    pub fn meaning(self) -> String {
        let lines = self.row().text.iter().map(|line| line.trim());
        let paragraph: Vec<&str> = lines.take_while(|line| !line.is_empty()).collect();
        paragraph.join("\n")
    }

    /// Name and value of the constant of the C interface, for the first frequency and phase image; `None` for layers that it does not
    /// have.
    #[doc(hidden)]
    pub fn c_constant(self) -> Option<(&'static str, i32)> {
        self.row().c_constant.first().copied()
    }

    /// Whether the values are whole numbers ([`LayerData::Id`](super::LayerData::Id)).
    pub fn is_id(self) -> bool {
        self.row().channels.is_empty()
    }

    /// The layer that holds the standard error of this one; `None` for a layer without noise.
    pub fn standard_error(self) -> Option<Layer> {
        match self {
            Layer::Radiance | Layer::Indirect => Some(Layer::StandardError),
            Layer::Tof(frequency, TofQuantity::Phasor | TofQuantity::PhasorIndirect) => {
                Some(Layer::Tof(frequency, TofQuantity::PhasorStandardError))
            }
            _ => None,
        }
    }

    /// Whether a render can have the layer; false for layers that only reference images or sequences have.
    pub fn is_rendered(self) -> bool {
        !matches!(self.need(), LayerNeed::Reference | LayerNeed::Sequence)
    }

    /// Whether a frame of this scene has the layer, at least on request.
    pub fn is_made_for(self, scene: &Scene) -> bool {
        let gather = scene.indirect.as_ref().and_then(IndirectLight::gather);
        self.is_made_with(FrameParts {
            has_sensor: scene.sensor.is_some(),
            counted: scene.sensor.and_then(|sensor| sensor.counted_electrons()),
            has_indirect: scene.indirect.is_some(),
            bounces: gather.map_or(1, |gather| gather.bounces),
            has_emission: scene.has_emission(),
            has_samples: scene.camera.pixel_sampling.is_some(),
            has_stderr: gather.is_some_and(|gather| gather.stderr_layer),
            tof: FrameParts::of_tof(scene.tof.as_ref()),
        })
    }

    /// The layers that a frame of this scene has by default, and these.
    pub fn made_for(scene: &Scene, and: &[Layer]) -> Vec<Layer> {
        let is_one = |layer: &Layer| {
            let is_by_default = !layer.is_on_request() && layer.is_made_for(scene);
            is_by_default || and.contains(layer)
        };
        Layer::all().filter(is_one).collect()
    }

    /// Refuses, before any rendering, a layer that a frame of this scene will not have.
    ///
    /// # Errors
    /// [`Error::Scene`](crate::Error::Scene) names what the scene lacks.
    pub fn check_made_for(self, scene: &Scene) -> Result<()> {
        if self.is_made_for(scene) {
            return Ok(());
        }
        Err(Error::Scene {
            at: "layers".into(),
            problem: format!("a frame of this scene has no layer {}", self.name()),
            hint: format!("{}, or leave it out", self.hint(scene.tof.as_ref())),
        })
    }

    /// What to do for the layer, if a frame with this time of flight has none.
    pub(crate) fn hint(self, tof: Option<&TimeOfFlight>) -> String {
        match (self, tof) {
            (Layer::Tof(..), None) => LayerNeed::Tof.hint().into(),
            (Layer::Tof(frequency, _), Some(tof))
                if usize::from(frequency) >= tof.frequencies_hz.len() =>
            {
                let (count, last) = (tof.frequencies_hz.len(), tof.frequencies_hz.len() - 1);
                format!("choose one of its {count} frequencies, tof0 to tof{last}")
            }
            (Layer::Tof(_, TofQuantity::Taps(_)), Some(tof)) => {
                let (count, last) = (tof.phase_count, tof.phase_count - 1);
                format!("choose one of its {count} phase images, phase0 to phase{last}")
            }
            _ if self.bounces().is_some() => {
                let least = self.bounces().unwrap_or_default().max(2);
                format!("let final-gather gather {least} bounces or more (bounces)")
            }
            _ if self.is_on_request() && self.need() == LayerNeed::Nothing => {
                "name it in the layers of the render".into()
            }
            _ => self.need().hint().into(),
        }
    }

    /// Whether a frame with these parts has the layer.
    pub(crate) fn is_made_with(self, parts: FrameParts) -> bool {
        let [frequencies, phases] = parts.tof.unwrap_or_default();
        let is_in_range = match self {
            Layer::Tof(frequency, _) if u32::from(frequency) >= frequencies => false,
            Layer::Tof(_, TofQuantity::Taps(phase)) => u32::from(phase) < phases,
            _ => self
                .bounces()
                .is_none_or(|bounces| bounces <= parts.bounces),
        };
        is_in_range
            && match self.need() {
                LayerNeed::Nothing => true,
                LayerNeed::Sensor => parts.has_sensor,
                LayerNeed::BandElectrons => parts.counted.is_some_and(|counted| !counted.is_raw),
                LayerNeed::RawElectrons => parts.counted.is_some_and(|counted| counted.is_raw),
                LayerNeed::RawNoise => parts
                    .counted
                    .is_some_and(|counted| counted.is_raw && counted.has_noise),
                LayerNeed::Indirect => parts.has_indirect,
                LayerNeed::MoreBounces => parts.bounces > 1,
                LayerNeed::StderrLayer => parts.has_stderr,
                LayerNeed::Samples => parts.has_samples,
                LayerNeed::Emission => parts.has_emission,
                LayerNeed::Tof => parts.tof.is_some(),
                LayerNeed::Reference | LayerNeed::Sequence => false,
            }
    }
}

/// The parts of a frame that decide its layers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FrameParts {
    pub has_sensor: bool,
    pub counted: Option<CountedElectrons>,
    pub has_indirect: bool,
    /// Most bounces of its light.
    pub bounces: u32,
    /// Whether surfaces emit.
    pub has_emission: bool,
    /// Whether pixels are averaged over samples.
    pub has_samples: bool,
    pub has_stderr: bool,
    /// Time of flight: number of frequencies, and of phase images per frequency.
    pub tof: Option<[u32; 2]>,
}

impl FrameParts {
    pub fn of_tof(tof: Option<&TimeOfFlight>) -> Option<[u32; 2]> {
        tof.map(|tof| [tof.frequencies_hz.len() as u32, tof.phase_count])
    }
}
