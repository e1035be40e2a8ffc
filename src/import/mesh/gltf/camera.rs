//! Cameras of a glTF file.

use std::path::Path;

use glam::{DMat4, DVec3};

use super::file::GltfFile;
use crate::import::calibration::CameraOfFile;
use crate::import::unused::Unused;
use crate::keys::did_you_mean;
use crate::scene::Lens;
use crate::{Error, Result};

/// A node with a camera.
struct Found {
    node: usize,
    node_name: Option<String>,
    camera_name: Option<String>,
    to_world: DMat4,
    lens: Lens,
}

impl Found {
    /// The name of a node or camera without one, as for meshes.
    fn number(&self) -> String {
        format!("node{}", self.node)
    }

    fn is_called(&self, name: &str) -> bool {
        [&self.node_name, &self.camera_name]
            .iter()
            .any(|own| own.as_deref() == Some(name))
    }

    fn names(&self) -> Vec<String> {
        let own = [&self.node_name, &self.camera_name].map(Clone::clone);
        let own: Vec<String> = own.into_iter().flatten().collect();
        if own.is_empty() {
            return vec![self.number()];
        }
        own
    }
}

/// The pose and the lens of a camera of the file: the one of that name, or the only one.
pub(in crate::import) fn camera(
    path: &Path,
    named_at: &str,
    name: Option<&str>,
) -> Result<CameraOfFile> {
    let file = GltfFile::read(path, named_at)?;
    let mut found = Vec::new();
    file.for_each_node(&mut |index, node, to_world| {
        let Some(camera) = node.camera else {
            return Ok(());
        };
        let cameras = &file.document.cameras;
        let of_node = file.find(cameras, camera, "camera", &format!("node {index}"))?;
        found.push(Found {
            node: index,
            node_name: node.name.clone(),
            camera_name: of_node.name.clone(),
            to_world,
            lens: of_node.lens,
        });
        Ok(())
    })?;
    let refuse = |problem: String, hint: String| Err(Error::scene(named_at, problem, hint));
    let mut chosen: Vec<&Found> = match name {
        Some(name) => found.iter().filter(|found| found.is_called(name)).collect(),
        None => found.iter().collect(),
    };
    if chosen.is_empty() {
        chosen.extend(found.iter().filter(|found| Some(&*found.number()) == name));
    }
    // The names of nodes go before those of cameras, which several nodes may share.
    if chosen.len() > 1 {
        let by_node = |found: &&Found| name.is_some() && found.node_name.as_deref() == name;
        let by_node: Vec<&Found> = chosen.iter().copied().filter(by_node).collect();
        if by_node.len() == 1 {
            chosen = by_node;
        }
    }
    let file_name = path.display();
    let (problem, hint) = match (&chosen[..], name) {
        ([one], _) => return place(one, named_at),
        ([], _) if found.is_empty() => (
            format!("{file_name} has no camera"),
            "give position, look_at, up and a lens".to_owned(),
        ),
        ([], _) => {
            let names: Vec<String> = found.iter().flat_map(Found::names).collect();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let name = name.unwrap_or_default();
            (
                format!("{file_name} has no camera \"{name}\""),
                did_you_mean(name, &names),
            )
        }
        (several, _) => {
            let what = match name {
                Some(name) => format!("cameras \"{name}\""),
                None => "cameras".into(),
            };
            let names = several.iter().map(|found| match &found.node_name {
                Some(own) if name != Some(own) => own.clone(),
                _ => found.number(),
            });
            let names: Vec<String> = names.collect();
            (
                format!("{file_name} has {} {what}", several.len()),
                format!("give the name of one: {}", names.join(", ")),
            )
        }
    };
    refuse(problem, hint)
}

fn place(found: &Found, named_at: &str) -> Result<CameraOfFile> {
    let name = found.names().swap_remove(0);
    let refuse = |problem: &str, hint: &str| {
        let problem = format!("camera \"{name}\" {problem}");
        Err(Error::scene(named_at, problem, hint))
    };
    let to_world = found.to_world;
    if to_world.determinant() < 0.0 {
        return refuse(
            "is mirrored by the scale of its node or of one above it, and no camera takes a mirrored image",
            "make the scale positive, or give position, look_at, up and a lens instead",
        );
    }
    let up = to_world.transform_vector3(DVec3::Y);
    // glTF does not say whether the height of the image is scaled, too.
    if matches!(found.lens, Lens::Orthographic { .. }) && (up.length() - 1.0).abs() > 1e-3 {
        return refuse(
            "is orthographic, and scaled by its node or by one above it, so the height of its image is not certain",
            "make the scale 1, or give position, look_at, up, projection = \"orthographic\" and height_m instead",
        );
    }
    // A glTF camera looks along -z, with y up.
    let position_m = to_world.transform_point3(DVec3::ZERO);
    let look_at_m = position_m + to_world.transform_vector3(DVec3::NEG_Z).normalize_or_zero();
    Ok(CameraOfFile {
        resolution_px: None,
        lens: found.lens,
        pose: Some([position_m, look_at_m, up]),
        on_body: None,
        unused: Unused::default(),
    })
}
