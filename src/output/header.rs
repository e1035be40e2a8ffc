//! The OpenEXR header of a frame: what was rendered, by what, in which units.

use std::collections::HashSet;

use exr::math::Vec2;
use exr::meta::attribute::{AttributeValue, Text};
use exr::meta::header::LayerAttributes;
use glam::{DMat4, DVec3, DVec4};

use super::frame::{Frame, FrameDescription, Layer};
use crate::scene::{Camera, CameraBasis, Intrinsics, Light, SpotCone};

/// The attributes of a file that holds these layers of the frame. Lists and lights are written as in a scene file, where
/// every digit of an f64 is kept; matrices are f32, as the format has them.
pub(super) fn attributes(
    frame: &Frame,
    written_layers: &HashSet<Layer>,
    more: &[(String, String)],
) -> LayerAttributes {
    let FrameDescription {
        indirect,
        reference,
        lights,
        camera,
        sensor,
        scene_hash,
    } = &frame.description;
    let mut header = LayerAttributes {
        software_name: Some(text(concat!("camlux ", env!("CARGO_PKG_VERSION")))),
        exposure: sensor.map(|sensor| sensor.exposure_time_s as f32),
        world_to_camera: Some(matrix(world_to_camera(camera))),
        world_to_normalized_device: Some(matrix(world_to_ndc(camera))),
        ..LayerAttributes::default()
    };
    let mut add = |name: &str, value: AttributeValue| {
        header.other.insert(text(&format!("camlux.{name}")), value);
    };
    let text_value = |value: &str| AttributeValue::Text(text(value));
    let vector = |v: DVec3| text_value(&format!("{:?}", v.to_array()));

    add("version", text_value(env!("CARGO_PKG_VERSION")));
    add("scene_hash", text_value(scene_hash));
    add("device", text_value(&frame.stats.device));
    add("driver", text_value(&frame.stats.driver));
    for layer in written_layers {
        add(&format!("unit.{}", layer.name()), text_value(layer.unit()));
    }
    let count = |value: u32| AttributeValue::I32(i32::try_from(value).unwrap_or(i32::MAX));
    match (indirect, reference) {
        (Some(indirect), _) => {
            add("estimator", text_value(indirect.name()));
            if let Some(rsm_size) = indirect.rsm_size() {
                add("rsm_size", count(rsm_size));
            }
            for (name, error) in [
                ("target_error", indirect.target_error()),
                ("estimated_error", frame.stats.estimated_error),
                ("interpolation_error", indirect.interpolation_error()),
                (
                    "estimated_interpolation_error",
                    frame.stats.estimated_interpolation_error,
                ),
            ] {
                if let Some(error) = error {
                    add(name, AttributeValue::F64(error));
                }
            }
        }
        (None, Some(samples)) => {
            add("estimator", text_value("path-sampled"));
            add("samples_per_pixel", count(samples.samples_per_pixel));
            add("samples_per_round", count(samples.samples_per_round));
        }
        (None, None) => add("estimator", text_value("none")),
    }
    for (index, light) in lights.iter().enumerate() {
        add(
            &format!("light.{index}"),
            text_value(&describe_light(light)),
        );
    }
    if let Some(sensor) = sensor {
        let pitch_um = sensor.pixel_pitch_um.map(|pitch_um| pitch_um as f32);
        add(
            "sensor.pixel_pitch_um",
            AttributeValue::FloatVec2(Vec2(pitch_um[0], pitch_um[1])),
        );
        add(
            "sensor.exposure_time_s",
            AttributeValue::F64(sensor.exposure_time_s),
        );
        add("sensor.duty_cycle", AttributeValue::F64(sensor.duty_cycle));
    }
    let Intrinsics { fx, fy, cx, cy } = camera.intrinsics_px();
    let resolution_px = format!("{:?}", camera.resolution_px);
    add("camera.resolution_px", text_value(&resolution_px));
    add(
        "camera.intrinsics_px",
        text_value(&format!("{:?}", [fx, fy, cx, cy])),
    );
    add("camera.position_m", vector(camera.position_m));
    add("camera.look_at_m", vector(camera.look_at_m));
    add("camera.up", vector(camera.up));
    add(
        "cameraToWorld",
        AttributeValue::Matrix4x4(matrix(camera_to_world(camera))),
    );
    for (name, value) in more {
        add(name, text_value(value));
    }
    header
}

/// A light as a scene file has it.
fn describe_light(light: &Light) -> String {
    let kind = light.kind();
    let list = |v: &DVec3| format!("{:?}", v.to_array());
    match light {
        Light::Point {
            position_m,
            power_w,
        } => format!(
            "kind = \"{kind}\", position = {}, power_w = {power_w:?}",
            list(position_m)
        ),
        Light::Spot {
            position_m,
            direction,
            cone:
                SpotCone {
                    inner_half_angle_deg,
                    outer_half_angle_deg,
                },
            power_w,
        } => format!(
            "kind = \"{kind}\", position = {}, direction = {}, inner_half_angle_deg = {inner_half_angle_deg:?}, \
             outer_half_angle_deg = {outer_half_angle_deg:?}, power_w = {power_w:?}",
            list(position_m),
            list(direction)
        ),
        Light::Directional {
            direction,
            irradiance_w_m2,
        } => format!(
            "kind = \"{kind}\", direction = {}, irradiance_w_m2 = {irradiance_w_m2:?}",
            list(direction)
        ),
    }
}

/// From camera axes (x right, y down, z forward: those of the intrinsics) to the world. Column vectors.
fn camera_to_world(camera: &Camera) -> DMat4 {
    let CameraBasis {
        right,
        down,
        forward,
    } = camera.basis();
    DMat4::from_cols(
        right.extend(0.0),
        down.extend(0.0),
        forward.extend(0.0),
        camera.position_m.extend(1.0),
    )
}

/// The OpenEXR attribute `worldToCamera`, whose camera has x right, y up, z forward. Column vectors.
fn world_to_camera(camera: &Camera) -> DMat4 {
    let y_up_from_y_down = DMat4::from_scale(DVec3::new(1.0, -1.0, 1.0));
    y_up_from_y_down * camera_to_world(camera).inverse()
}

/// The OpenEXR attribute `worldToNDC`: x and y from 0 at the left and bottom edge of the image to 1 at the right and top
/// one. Column vectors.
fn world_to_ndc(camera: &Camera) -> DMat4 {
    let Intrinsics { fx, fy, cx, cy } = camera.intrinsics_px();
    let [width, height] = camera.resolution_px.map(f64::from);
    // x = (fx·X/Z + cx)/width, y = 1 − (cy − fy·Y/Z)/height; z is not used by the format, 1/Z keeps it invertible.
    let ndc_from_camera = DMat4::from_cols(
        DVec4::new(fx / width, 0.0, 0.0, 0.0),
        DVec4::new(0.0, fy / height, 0.0, 0.0),
        DVec4::new(cx / width, 1.0 - cy / height, 0.0, 1.0),
        DVec4::new(0.0, 0.0, 1.0, 0.0),
    );
    ndc_from_camera * world_to_camera(camera)
}

/// In the layout of the format: rows for row vectors, which are the columns for column vectors.
fn matrix(column_vectors: DMat4) -> [f32; 16] {
    column_vectors.to_cols_array().map(|value| value as f32)
}

/// The format's strings have no encoding; ASCII is what every reader agrees on.
fn text(value: &str) -> Text {
    let ascii: String = value
        .chars()
        .map(|c| {
            if c.is_ascii() && !c.is_control() {
                c
            } else {
                '?'
            }
        })
        .collect();
    Text::new_or_none(ascii).unwrap_or_default()
}
