//! Predicts what smoothing leaves of an image's error, with the samples that its pixels have or with more.

/// The image's samples of a pixel.
#[derive(Debug, Clone, Copy)]
pub(super) struct ImageSamples {
    /// As in [`PixelEstimate`](super::error_estimate::PixelEstimate).
    pub weight: f64,
    /// The square that errors are relative to, times the pixel's part of the relRMSE.
    pub share: f64,
    /// Variance of a sample over that square.
    pub variance: f64,
    /// 0: the pixel is interpolated.
    pub packets: f64,
    pub model: Option<Model>,
}

/// The pixel's neighbours as its model.
#[derive(Debug, Clone, Copy)]
pub(super) struct Model {
    /// Squared error, less that of the model's noise, over the square that errors are relative to.
    pub error: f64,
    /// Variance of the model's value over that of a pixel's.
    pub leverage: f64,
}

/// How samples are distributed to the pixels of an image.
#[derive(Debug, Clone, Copy)]
pub(super) struct Distribution<'f> {
    /// As in [`SampleAllocation`](crate::passes::refinement::SampleAllocation).
    pub packets_scale: f64,
    pub packet_variance: f64,
    pub falloff: &'f VarianceFalloff,
    /// Error that a pixel must save for each packet that it takes.
    price: f64,
}

impl Distribution<'_> {
    pub fn new(
        packets_scale: f64,
        packet_variance: f64,
        falloff: &VarianceFalloff,
    ) -> Distribution<'_> {
        let rate = falloff.rate;
        Distribution {
            packets_scale,
            packet_variance,
            falloff,
            price: rate * packets_scale.powf(-1.0 - rate),
        }
    }
}

/// How the variance of a gather falls with its packets.
#[derive(Debug)]
pub(super) struct VarianceFalloff {
    rate: f64,
    /// For each number of packets from 1 on.
    shares: Vec<f64>,
}

impl VarianceFalloff {
    pub fn new(rate: f64, max_packets: u32) -> VarianceFalloff {
        let shares = (1..=max_packets).map(|packets| f64::from(packets).powf(-rate));
        VarianceFalloff {
            rate,
            shares: shares.collect(),
        }
    }

    fn max_packets(&self) -> u32 {
        self.shares.len() as u32
    }

    /// Variance with this many packets, over that with one.
    pub fn share(&self, packets: f64) -> f64 {
        let index = packets as usize;
        let known = self.shares.get(index.wrapping_sub(1));
        let known = known.filter(|_| index as f64 == packets);
        known.copied().unwrap_or_else(|| packets.powf(-self.rate))
    }
}

impl ImageSamples {
    /// Squared error after smoothing with this many packets, over that of a packet with variance 1.
    fn error_with(&self, packets: f64, with: Distribution) -> f64 {
        let own = self.variance * with.falloff.share(packets);
        self.model.map_or(own, |Model { error, leverage }| {
            let of_model = error / with.packet_variance + leverage * own;
            own * of_model / (own + of_model).max(f64::MIN_POSITIVE)
        })
    }

    /// The packets that the pixel takes, as in `shaders/sample_counts.wgsl`. It keeps those that it has.
    pub fn packets_with(&self, with: Distribution) -> f64 {
        let max_packets = with.falloff.max_packets();
        if self.model.is_none() {
            let power = 1.0 / (1.0 + with.falloff.rate);
            let scaled = with.packets_scale * self.variance.powf(power);
            return packets(scaled, max_packets).max(self.packets);
        }
        let (mut best, mut least) = (1.0, f64::INFINITY);
        let mut packets = 1;
        while packets <= max_packets {
            let total = self.error_with(packets.into(), with) + with.price * f64::from(packets);
            if total < least {
                (best, least) = (packets.into(), total);
            }
            packets += 1 + packets / 4;
        }
        self.packets.max(best)
    }
}

/// What smoothing leaves.
#[derive(Debug, Clone, Copy)]
pub(super) struct Smoothed {
    /// Squared error, in units of a packet's variance.
    pub error: f64,
    /// Mean packets of a gathered pixel.
    pub mean_packets: f64,
}

impl Smoothed {
    /// With so many packets for each pixel that is gathered.
    pub fn of(
        image: &[ImageSamples],
        with: Distribution,
        packets: impl Fn(&ImageSamples) -> f64,
    ) -> Smoothed {
        let (mut error, mut sum, mut weights) = (0.0, 0.0, 0.0);
        for pixel in image.iter().filter(|pixel| pixel.packets > 0.0) {
            let packets = packets(pixel);
            error += pixel.share * pixel.error_with(packets, with);
            sum += pixel.weight * packets;
            weights += pixel.weight;
        }
        Smoothed {
            error,
            mean_packets: sum / f64::max(weights, f64::MIN_POSITIVE),
        }
    }
}

/// Packets of a pixel, as in `shaders/sample_counts.wgsl`.
pub(super) fn packets(scaled: f64, max_packets: u32) -> f64 {
    scaled.ceil().clamp(1.0, f64::from(max_packets))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_that_neighbours_predict_take_few_samples() {
        let pixel = |error: f64| ImageSamples {
            weight: 1.0,
            share: 1.0,
            variance: 1.0,
            packets: 1.0,
            model: Some(Model {
                error,
                leverage: 0.2,
            }),
        };
        let falloff = VarianceFalloff::new(1.4, 1024);
        let with = Distribution::new(20.0, 0.005, &falloff);
        let packets = [0.0, 1e-4, 1.0].map(|error| pixel(error).packets_with(with));
        assert!(
            packets.is_sorted() && 1.5 * packets[0] < packets[2],
            "{packets:?}"
        );
        // A model that says nothing changes nothing.
        let alone = ImageSamples {
            model: None,
            ..pixel(0.0)
        };
        let ratio = packets[2] / alone.packets_with(with);
        assert!((0.8..=1.25).contains(&ratio), "{ratio}");
        let image = [pixel(1e-4); 4];
        let now = Smoothed::of(&image, with, |pixel| pixel.packets);
        let then = Smoothed::of(&image, with, |pixel| pixel.packets_with(with));
        assert!(then.error < now.error);
        assert_eq!(then.mean_packets, packets[1]);
    }
}
