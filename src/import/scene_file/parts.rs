//! Reads the parts of a scene file that name no other file.

use std::path::Path;

use glam::DVec3;

use crate::import::lamp;
use crate::keys::{Keys, Value};
use crate::scene::{
    AreaShape, Carrier, Direct, Encoding, Light, Parameter, Parameters, PatternIntegral, Profile,
    ProjectedImage, Sensor, Shadow, SpotCone, VignettingMap,
};
use crate::{Error, Result};

use super::camera::lens;
use super::{read_parameters, sensor_noise, value_of};

/// What `[sensor]` and `[lens]` hold.
pub(super) struct ReadSensor {
    pub sensor: Sensor,
    pub vignetting_map: Option<VignettingMap>,
    /// What the file of the map holds and camlux does not use.
    pub warning: Option<String>,
}

/// Reads `[sensor]`, and `[lens]` with the rest of its parameters.
pub(super) fn sensor(mut sensor: Keys, lens: Option<Keys>, folder: &Path) -> Result<ReadSensor> {
    let is_of_lens = |parameter: &Parameter| Sensor::OF_LENS.contains(&parameter.name);
    let known = Sensor::DEFAULT.rows().iter().filter(|row| !is_of_lens(row));
    let known: Vec<&str> = known.map(|row| row.name).chain(["noise"]).collect();
    sensor.only(&known)?;
    let noise = sensor.table("noise")?;
    let mut read = Sensor {
        noise: noise.map(sensor_noise).transpose()?,
        ..Sensor::DEFAULT
    };
    read_parameters(sensor, &mut read, |parameter| !is_of_lens(parameter))?;
    let mut map = None;
    if let Some(mut lens) = lens {
        if let Some(named) = lens.take_text("vignetting") {
            let path = folder.join(named.text()?);
            map = Some(VignettingMap::load(&path, &named.at)?);
        }
        read_parameters(lens, &mut read, is_of_lens)?;
    }
    let (vignetting_map, warning) = map.unzip();
    Ok(ReadSensor {
        sensor: read,
        vignetting_map,
        warning: warning.flatten(),
    })
}

/// A light with coordinates relative to its carrier, unless they are in the world.
pub(super) struct ReadLight<'t> {
    pub light: Light,
    /// The value of the key `modulated`.
    pub modulated: Option<Value<'t>>,
    /// The carrier, and the value that names it.
    pub carrier: Option<(Carrier, Value<'t>)>,
    /// Whether the coordinates are in the world, although the light has a carrier.
    pub is_in_world: bool,
    /// What its file holds and camlux does not use.
    pub warning: Option<String>,
}

/// The carrier, the value that names it, and whether coordinates are in the world.
fn carrier<'t>(keys: &mut Keys<'t>) -> Result<Option<(Carrier, Value<'t>, bool)>> {
    let Some((key, named)) = keys.take_one(&["relative_to", "moves_with"])? else {
        return Ok(None);
    };
    let is_in_world = key == "moves_with";
    let carriers: &[&str] = match is_in_world {
        true => &["mesh"],
        false => &["camera", "mesh"],
    };
    Ok(Some(match named.choice(carriers, |name| name)? {
        "camera" => (Carrier::Camera, named, is_in_world),
        _ => {
            let mesh = keys.need("mesh", "mesh = 0, its place in this file")?;
            (Carrier::Mesh(mesh.count()? as usize), mesh, is_in_world)
        }
    }))
}

/// Reads a light. `folder`: the folder of the scene file.
pub(super) fn light<'t>(mut keys: Keys<'t>, folder: &Path) -> Result<ReadLight<'t>> {
    const POSITION: &str = "position = [x, y, z]";
    const DIRECTION: &str = "direction = [x, y, z], the way the light travels";
    const POWER: &str = "power_w = 50.0 or power_w = [r, g, b]";
    const IRRADIANCE: &str = "irradiance_w_m2 = 1000.0 or [r, g, b]";

    let kinds = format!("kind = \"{}\"", Light::KINDS.join("\" or \""));
    let kind = keys.need("kind", &kinds)?;
    let modulated = keys.take("modulated");
    let carrier = carrier(&mut keys)?;
    let mut warning = None;
    let light = match kind.choice(&Light::KINDS, |kind| kind)? {
        "pattern" => {
            keys.only(&[
                "position",
                "direction",
                "up",
                "pattern",
                "encoding",
                "inner_half_angle_deg",
                "outer_half_angle_deg",
                "scale",
                "power_w",
            ])?;
            let named = keys.need("pattern", "pattern = \"lamp.ies\"")?;
            let encoding = encoding(&mut keys)?;
            let path = folder.join(named.text()?);
            let file = lamp::read(&path, encoding, &named.at)?;
            warning = file.unused.warning(&path);
            let pattern = match opening(&mut keys)? {
                None => file.pattern,
                Some(cone) => file.pattern.within(cone),
            };
            let power = keys.take_one(&["power_w", "scale"])?;
            let power_w = match power {
                Some(("power_w", power)) => power.bands()?,
                Some((_, scale)) => {
                    scale.choice(&["file"], |name| name)?;
                    if let Some(problem) = file.without_unit {
                        return Err(Error::scene(scale.at, problem, format!("give {POWER}")));
                    }
                    [pattern.peak * PatternIntegral::new(&pattern).total(); 3]
                }
                None => {
                    let hint = format!("add {POWER}, or scale = \"file\"");
                    return Err(keys.error("[[light]] has no \"power_w\"", hint));
                }
            };
            let position_m = keys.need("position", POSITION)?.vec3()?;
            let direction = keys.need("direction", DIRECTION)?.vec3()?;
            let up = keys.need("up", "up = [x, y, z], towards the plane C = 0")?;
            Light::with_profile(position_m, direction, up.vec3()?, pattern, power_w)
        }
        "projector" => {
            keys.only(&[
                "position",
                "direction",
                "up",
                "image",
                "encoding",
                "white",
                "fov_y_deg",
                "intrinsics_px",
                "power_w",
            ])?;
            let named = keys.need("image", "image = \"stripes.png\"")?;
            let encoding = encoding(&mut keys)?;
            let path = folder.join(named.text()?);
            let white = white(&mut keys)?;
            // A projector's lens is described like a camera's.
            let lens = lens(&mut keys, "[[light]]")?;
            let (image, unused) = ProjectedImage::load(&path, encoding, white, lens, &named.at)?;
            warning = unused;
            let position_m = keys.need("position", POSITION)?.vec3()?;
            let direction = keys.need("direction", DIRECTION)?.vec3()?;
            let up = keys.need("up", "up = [x, y, z], up in the image")?.vec3()?;
            let power_w = keys.need("power_w", POWER)?.bands()?;
            Light::with_profile(position_m, direction, up, image, power_w)
        }
        "area" => {
            keys.only(&["position", "direction", "up", "size", "radius", "power_w"])?;
            let direction = keys.need("direction", DIRECTION)?.vec3()?;
            let shape = keys.take_one(&["size", "radius"])?;
            let (shape, up) = match shape {
                Some(("size", size)) => {
                    let size_m = size.numbers()?;
                    let up = keys.need("up", "up = [x, y, z], along its height")?;
                    (AreaShape::Rectangle { size_m }, Some(up.vec3()?))
                }
                Some((_, radius)) => {
                    // The rotation of a disc about its axis may be given, but need not be.
                    let up = keys.optional("up", |up| up.vec3())?;
                    let radius_m = radius.number()?;
                    (AreaShape::Disc { radius_m }, up)
                }
                None => {
                    let hint = "add size = [width, height], or radius = 0.1, metres";
                    return Err(keys.error("[[light]] has no \"size\"", hint));
                }
            };
            let position_m = keys.need("position", POSITION)?.vec3()?;
            let power_w = keys.need("power_w", POWER)?.bands()?;
            Light::area(position_m, direction, up, shape, power_w)
        }
        kind => match Profile::of_kind(kind) {
            Some(mut profile) => {
                let direction = profile.has_axis().then_some("direction");
                let numbers = profile
                    .numbers()
                    .into_iter()
                    .flat_map(|numbers| numbers.rows());
                let known = ["position"].into_iter().chain(direction);
                let known = known.chain(numbers.map(|row| row.name)).chain(["power_w"]);
                keys.only(&Vec::from_iter(known))?;
                let position_m = keys.need("position", POSITION)?.vec3()?;
                let direction = direction.map(|key| keys.need(key, DIRECTION)?.vec3());
                let direction = direction.transpose()?.unwrap_or(DVec3::Z);
                if let Some(numbers) = profile.numbers_mut() {
                    numbers.read(|row| value_of(row, &mut keys))?;
                }
                let power_w = keys.need("power_w", POWER)?.bands()?;
                Light::spot(position_m, direction, profile, power_w)
            }
            None => {
                keys.only(&["direction", "irradiance_w_m2"])?;
                let direction = keys.need("direction", DIRECTION)?.vec3()?;
                let irradiance = keys.need("irradiance_w_m2", IRRADIANCE)?;
                Light::directional(direction, irradiance.bands()?)
            }
        },
    };
    let is_in_world = carrier.as_ref().is_some_and(|(.., is)| *is);
    Ok(ReadLight {
        light,
        modulated,
        carrier: carrier.map(|(carrier, named, _)| (carrier, named)),
        is_in_world,
        warning,
    })
}

/// How integers of an image encode values.
fn encoding(keys: &mut Keys) -> Result<Encoding> {
    let chosen = keys.optional("encoding", |value| {
        value.choice(&Encoding::ALL, Encoding::name)
    })?;
    Ok(chosen.unwrap_or(Encoding::Srgb))
}

/// The value of an OpenEXR image that stands for 1.
fn white(keys: &mut Keys) -> Result<Option<f32>> {
    keys.optional("white", |value| match value.number()? as f32 {
        white if white > 0.0 && white.is_finite() => Ok(white),
        white => Err(value.error(format!("is {white}"), "give a number above 0")),
    })
}

/// The opening of a spot light that limits a pattern, if it is given.
fn opening(keys: &mut Keys) -> Result<Option<SpotCone>> {
    let outer = keys.take("outer_half_angle_deg");
    let (outer, inner) = match (outer, keys.take("inner_half_angle_deg")) {
        (None, None) => return Ok(None),
        (Some(outer), Some(inner)) => (outer, inner),
        (Some(one), None) | (None, Some(one)) => {
            return Err(one.error(
                "is only one of the two angles of an opening",
                "give both inner_half_angle_deg and outer_half_angle_deg, or neither",
            ));
        }
    };
    let [inner_deg, outer_deg] = [inner.number()?, outer.number()?];
    if !(0.0 <= inner_deg && inner_deg <= outer_deg && outer_deg <= 180.0) {
        return Err(outer.error(
            format!("is {outer_deg}, and inner_half_angle_deg is {inner_deg}"),
            "give degrees from 0 to 180, and an inner angle no larger than the outer",
        ));
    }
    Ok(Some(SpotCone {
        inner_half_angle_deg: inner_deg,
        outer_half_angle_deg: outer_deg,
    }))
}

pub(super) fn direct(mut keys: Keys) -> Result<Direct> {
    keys.only(&["shadow"])?;
    let shadow = keys.need("shadow", "shadow = \"map\" or \"rays\"")?;
    Ok(Direct {
        shadow: Some(shadow.choice(&Shadow::ALL, Shadow::name)?),
    })
}
