//! Images that a projector shows one after the other, such as a Gray code: one a frame.

use std::path::Path;

use camlux::Scene;
use camlux::keys::{Keys, Value};
use camlux::scene::{Encoding, Lens, Light, Profile, ProjectedImage};

use crate::{Failure, warn};

/// The images of one light.
pub struct LightImages {
    /// The line of the job that names them.
    at: String,
    light: usize,
    /// With any lens.
    images: Vec<ProjectedImage>,
}

impl LightImages {
    /// Reads the keys `images` and `encoding` of a `[[light]]`, if they are there.
    pub fn read(keys: &mut Keys, light: usize, folder: &Path) -> Result<Option<Self>, Failure> {
        let encoding = keys.take("encoding");
        let Some(images) = keys.take("images") else {
            return match encoding {
                Some(encoding) => Err(encoding.error(
                    "is given, but there are no images",
                    "add images = [\"0.png\", \"1.png\"], or remove it",
                ))?,
                None => Ok(None),
            };
        };
        let encoding = match encoding {
            None => Encoding::Srgb,
            Some(encoding) => encoding.choice(&Encoding::ALL, Encoding::name)?,
        };
        let at = images.at.clone();
        let load = |named: Value| {
            let path = folder.join(named.text()?);
            // Values of OpenEXR files are what the scene's projector emits as well, so they have one scale.
            let white = is_exr(&path).then_some(1.0);
            let lens = Lens::FovY { fov_y_deg: 90.0 };
            ProjectedImage::load(&path, encoding, white, lens, &named.at)
        };
        let loaded = images.filled("list one per frame")?.list()?.into_iter();
        let loaded: Vec<_> = loaded.map(load).collect::<camlux::Result<_>>()?;
        let (images, warnings): (Vec<_>, Vec<_>) = loaded.into_iter().unzip();
        warnings.iter().flatten().for_each(warn);
        Ok(Some(LightImages { at, light, images }))
    }

    /// The number of frames.
    pub fn len(&self) -> usize {
        self.images.len()
    }

    /// Tells these images from others.
    pub fn digest(&self) -> blake3::Hash {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&self.light.to_le_bytes());
        for image in &self.images {
            let size = image.size_px.iter().flat_map(|px| px.to_le_bytes());
            let values = image.values.iter().flat_map(|value| value.to_le_bytes());
            hasher.update(&size.chain(values).collect::<Vec<u8>>());
        }
        hasher.finalize()
    }

    /// Rejects a scene whose light is no projector, or one with an image of another size.
    pub fn check(&self, scene: &Scene) -> Result<(), Failure> {
        // That there is such a light is checked with the other indices.
        let Some(light) = scene.lights.get(self.light) else {
            return Ok(());
        };
        let Some(own) = projected(light) else {
            Err(format!(
                "{}: images are given for light {}, which is no projector but of the kind \"{}\"; choose a projector of the scene",
                self.at,
                self.light,
                light.kind()
            ))?
        };
        for (i, image) in self.images.iter().enumerate() {
            if image.size_px != own.size_px {
                let ([width, height], [own_width, own_height]) = (image.size_px, own.size_px);
                Err(format!(
                    "{}: image {i} has {width} x {height} pixels, but that of the scene's projector {own_width} x {own_height}; give images of one size, which the projector's lens is for",
                    self.at
                ))?;
            }
        }
        Ok(())
    }

    /// Shows the image of a frame. A pixel of some value emits what a pixel of that value of the scene's own image does.
    pub fn apply(&self, scene: &mut Scene, frame: usize) {
        let light = &mut scene.lights[self.light].light;
        let (Some(own), Some(image)) = (projected(light), self.images.get(frame)) else {
            return;
        };
        let sum = |image: &ProjectedImage| -> f64 {
            image.values.iter().map(|&value| f64::from(value)).sum()
        };
        let factor = sum(image) / sum(own);
        let shown = ProjectedImage {
            intrinsics: own.intrinsics,
            ..image.clone()
        };
        *light = light.with_emission(light.emission().map(|power_w| factor * power_w));
        // A black image is no profile: nothing is shown, with no power.
        if let (true, Some(lamp)) = (factor > 0.0, light.lamp_mut()) {
            lamp.profile = shown.into();
        }
    }
}

fn projected(light: &Light) -> Option<&ProjectedImage> {
    match &light.lamp()?.profile {
        Profile::Projected(image) => Some(image),
        _ => None,
    }
}

fn is_exr(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default();
    extension.eq_ignore_ascii_case("exr")
}
