//! Reads the parts of a scene file that name no other file.

use super::{
    Camera, DEFAULT_TARGET_ERROR, Direct, IndirectLight, Intrinsics, Lens, Light, Material, Sensor,
    Shadow, SpotCone,
};
use crate::Result;
use crate::keys::{Keys, Value};

pub(super) fn camera(keys: &mut Keys) -> Result<Camera> {
    keys.only(&[
        "resolution",
        "position",
        "look_at",
        "up",
        "fov_y_deg",
        "intrinsics_px",
    ])?;
    Ok(Camera {
        resolution_px: keys
            .need("resolution", "resolution = [800, 800]")?
            .counts()?,
        position_m: keys.need("position", "position = [x, y, z]")?.vec3()?,
        look_at_m: keys.need("look_at", "look_at = [x, y, z]")?.vec3()?,
        up: keys.need("up", "up = [0.0, 1.0, 0.0]")?.vec3()?,
        lens: lens(keys)?,
    })
}

fn lens(keys: &mut Keys) -> Result<Lens> {
    match keys.take_one(&["fov_y_deg", "intrinsics_px"])? {
        Some(("fov_y_deg", fov)) => Ok(Lens::FovY {
            fov_y_deg: fov.number()?,
        }),
        Some((_, intrinsics)) => {
            let mut keys = intrinsics.table("intrinsics_px")?;
            keys.only(&["fx", "fy", "cx", "cy"])?;
            let mut pixels = |key| keys.need(key, "all four of fx, fy, cx, cy")?.number();
            Ok(Lens::Intrinsics(Intrinsics {
                fx: pixels("fx")?,
                fy: pixels("fy")?,
                cx: pixels("cx")?,
                cy: pixels("cy")?,
            }))
        }
        None => Err(keys.error(
            "[camera] has neither \"fov_y_deg\" nor \"intrinsics_px\"",
            "add fov_y_deg = 50.0 or intrinsics_px = { fx = .., fy = .., cx = .., cy = .. }",
        )),
    }
}

pub(super) fn sensor(keys: &mut Keys) -> Result<Sensor> {
    keys.only(&["pixel_pitch_um", "exposure_time_s", "duty_cycle"])?;
    Ok(Sensor {
        pixel_pitch_um: keys
            .need("pixel_pitch_um", "pixel_pitch_um = [width, height]")?
            .numbers()?,
        exposure_time_s: keys
            .need("exposure_time_s", "exposure_time_s = 1.0e-3")?
            .number()?,
        duty_cycle: keys.need("duty_cycle", "duty_cycle = 0.5")?.number()?,
    })
}

pub(super) fn light(keys: &mut Keys) -> Result<Light> {
    const POSITION: &str = "position = [x, y, z]";
    const DIRECTION: &str = "direction = [x, y, z], the way the light travels";
    const POWER: &str = "power_w = 50.0 or power_w = [r, g, b]";

    let kind = keys.need(
        "kind",
        &format!("kind = \"{}\"", Light::KINDS.join("\" or \"")),
    )?;
    match kind.text()? {
        "point" => {
            keys.only(&["position", "power_w"])?;
            Ok(Light::Point {
                position_m: keys.need("position", POSITION)?.vec3()?,
                power_w: keys.need("power_w", POWER)?.bands()?,
            })
        }
        "spot" => {
            keys.only(&[
                "position",
                "direction",
                "inner_half_angle_deg",
                "outer_half_angle_deg",
                "power_w",
            ])?;
            Ok(Light::Spot {
                position_m: keys.need("position", POSITION)?.vec3()?,
                direction: keys.need("direction", DIRECTION)?.vec3()?,
                cone: SpotCone {
                    inner_half_angle_deg: keys
                        .need("inner_half_angle_deg", "inner_half_angle_deg = 20.0")?
                        .number()?,
                    outer_half_angle_deg: keys
                        .need("outer_half_angle_deg", "outer_half_angle_deg = 30.0")?
                        .number()?,
                },
                power_w: keys.need("power_w", POWER)?.bands()?,
            })
        }
        "directional" => {
            keys.only(&["direction", "irradiance_w_m2"])?;
            Ok(Light::Directional {
                direction: keys.need("direction", DIRECTION)?.vec3()?,
                irradiance_w_m2: keys
                    .need("irradiance_w_m2", "irradiance_w_m2 = 1000.0 or [r, g, b]")?
                    .bands()?,
            })
        }
        word => Err(keys.unknown_word(&kind, word, &Light::KINDS)),
    }
}

pub(super) fn direct(keys: &mut Keys) -> Result<Direct> {
    keys.only(&["shadow"])?;
    let names = Shadow::ALL.map(Shadow::name);
    let word = keys.need(
        "shadow",
        &format!("shadow = \"{}\"", names.join("\" or \"")),
    )?;
    let shadow = Shadow::from_name(word.text()?)
        .ok_or_else(|| keys.unknown_word(&word, word.text().unwrap_or_default(), &names))?;
    Ok(Direct {
        shadow: Some(shadow),
    })
}

pub(super) fn indirect(keys: &mut Keys) -> Result<IndirectLight> {
    const RSM_SIZE: &str = "rsm_size = 64, texels along one face's edge";
    refuse_visibility(keys)?;
    keys.only(&[
        "estimator",
        "rsm_size",
        "target_error",
        "interpolation_error",
    ])?;
    let names = IndirectLight::NAMES;
    let estimator = keys.need(
        "estimator",
        &format!("estimator = \"{}\"", names.join("\" or \"")),
    )?;
    let target_error = keys.take("target_error");
    let interpolation_error = keys.take("interpolation_error");
    match estimator.text()? {
        "final-gather" => {
            refuse(
                interpolation_error,
                "counts against a sum over VPLs, which final-gather does not take",
                "use target_error, which counts against the true bounce",
            )?;
            let target_error = target_error.map(|v| v.number()).transpose()?;
            Ok(IndirectLight::FinalGather {
                target_error: target_error.unwrap_or(DEFAULT_TARGET_ERROR),
                rsm_size: keys.take("rsm_size").map(|v| v.count()).transpose()?,
            })
        }
        "rsm-average" => {
            refuse(
                target_error,
                "counts against the true bounce, to which rsm-average does not converge",
                "use interpolation_error, which counts against the sum at every pixel",
            )?;
            Ok(IndirectLight::RsmAverage {
                rsm_size: keys.need("rsm_size", RSM_SIZE)?.count()?,
                interpolation_error: interpolation_error.map(|v| v.number()).transpose()?,
            })
        }
        "instant-radiosity" => {
            refuse(
                target_error,
                "counts against the true bounce, to which instant-radiosity does not converge",
                &format!("remove it, or set {FINAL_GATHER}"),
            )?;
            refuse(
                interpolation_error,
                "belongs to rsm-average: instant-radiosity is summed at every pixel",
                "remove it",
            )?;
            let example = format!("{RSM_SIZE}; or set {FINAL_GATHER}");
            Ok(IndirectLight::InstantRadiosity {
                rsm_size: keys.need("rsm_size", &example)?.count()?,
            })
        }
        word => Err(keys.unknown_word(&estimator, word, &names)),
    }
}

const FINAL_GATHER: &str =
    "estimator = \"final-gather\", which finds visibility by rays and meets a target_error";

/// Names what replaces this key of former versions.
fn refuse_visibility(keys: &mut Keys) -> Result<()> {
    let visibility = keys.take("visibility");
    let hint = match visibility.as_ref().map(|v| v.text()) {
        Some(Ok("none")) => "remove it: rsm-average and instant-radiosity have none".into(),
        _ => format!("remove it, and set {FINAL_GATHER}"),
    };
    refuse(visibility, "follows from the estimator", &hint)
}

fn refuse(value: Option<Value>, problem: &str, hint: &str) -> Result<()> {
    value.map_or(Ok(()), |value| Err(value.error(problem, hint)))
}

pub(super) fn material(keys: &mut Keys, name: String) -> Result<Material> {
    keys.only(&["kd", "ks", "shininess"])?;
    let mut material = Material::lambert(
        name,
        keys.need("kd", "kd = 0.8 or kd = [r, g, b]")?.bands()?,
    );
    if let Some(ks) = keys.take("ks") {
        material.ks = ks.bands()?;
    }
    match keys.take("shininess") {
        Some(shininess) => material.shininess = shininess.number()?,
        // An exponent of 1 would be a silent choice of a very wide lobe.
        None if material.is_specular() => {
            keys.need("shininess", "shininess = 20.0, the exponent of ks")?;
        }
        None => {}
    }
    Ok(material)
}
