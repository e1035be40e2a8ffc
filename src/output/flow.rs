//! Flow: how far the surface that a pixel shows moves to another frame of a sequence, and whether that frame shows it.

use glam::{DMat3, DMat4, DVec2, DVec3};

use super::{Frame, Layer, LayerData, LayerNeed};
use crate::scene::Camera;

/// The next or the previous frame of a sequence.
#[derive(Clone, Copy)]
pub struct OtherFrame<'o> {
    pub camera: &'o Camera,
    /// How each mesh moves in the world to that frame; `None`: not at all. NaN for one that moves in another way.
    pub mesh_moves: &'o [Option<DMat4>],
    /// Its layers `range` and `id.instance`. Only occlusion needs them.
    pub shown: Option<&'o Frame>,
}

/// Flow, scene flow and occlusion: to the next frame, and to the previous one.
pub const FLOW_LAYERS: [[Layer; 3]; 2] = [
    [Layer::Flow, Layer::SceneFlow, Layer::FlowOcclusion],
    [
        Layer::BackwardFlow,
        Layer::BackwardSceneFlow,
        Layer::BackwardFlowOcclusion,
    ],
];

/// The layers of a sequence that files have: those that these are, and with `flow` the flow to the next frame, which is added to these.
#[doc(hidden)]
pub fn flow_layers(layers: &mut Option<Vec<Layer>>, flow: bool) -> Vec<Layer> {
    let is_of_sequence = |layer: &Layer| layer.need() == LayerNeed::Sequence;
    let usual =
        Layer::all().filter(|layer| flow && is_of_sequence(layer) && !layer.is_on_request());
    match layers {
        None => usual.collect(),
        Some(layers) => {
            layers.extend(usual);
            let layers = layers.iter().copied();
            layers.filter(is_of_sequence).collect()
        }
    }
}

impl Frame {
    /// Adds layers of flow, of [`FLOW_LAYERS`]. `camera`: that of this frame. `others`: the next and the previous frame, `None` at the ends of
    /// a sequence. Without the layers of ids, ranges and, for occlusion, normals it adds nothing.
    pub fn add_flow(&mut self, camera: &Camera, wanted: &[Layer], others: [Option<OtherFrame>; 2]) {
        for (layers, other) in FLOW_LAYERS.iter().zip(others) {
            let [flow, scene_flow, occlusion] = layers.map(|layer| wanted.contains(&layer));
            if !(flow || scene_flow || occlusion) {
                continue;
            }
            let normals = self.values(Layer::Normal).filter(|_| occlusion);
            let (Some(ranges_m), Some(ids)) =
                (self.values(Layer::Range), self.ids(Layer::InstanceId))
            else {
                return;
            };
            let width = self.resolution_px[0] as usize;
            let pixels = ranges_m.iter().zip(ids).enumerate();
            let moved = pixels.map(|(i, (&range_m, &id))| {
                let place = [i % width, i / width];
                let normal = normals.and_then(|normals| normals.as_chunks::<3>().0.get(i));
                let seen = Seen {
                    camera,
                    id,
                    centre: DVec2::from(place.map(|place| place as f64 + 0.5)),
                    range_m: range_m.into(),
                    normal: normal.map(|&normal| DVec3::from(normal.map(f64::from))),
                };
                seen.moved_to(other.as_ref())
            });
            let moved: Vec<Moved> = moved.collect();
            let pixels = moved.iter();
            let flows = pixels.clone().flat_map(|m| m.flow_px.as_vec2().to_array());
            let steps = pixels.clone().flat_map(|m| m.step_m.as_vec3().to_array());
            let hidden = pixels.map(|moved| u32::from(moved.is_hidden));
            let made = [
                (flow, LayerData::Float(flows.collect())),
                (scene_flow, LayerData::Float(steps.collect())),
                (normals.is_some(), LayerData::Id(hidden.collect())),
            ];
            for (&layer, (is_wanted, data)) in layers.iter().zip(made) {
                if is_wanted {
                    self.layers.push((layer, data));
                }
            }
        }
    }
}

/// What a pixel shows.
struct Seen<'s> {
    camera: &'s Camera,
    /// 1 + the index of the instance; 0: no surface.
    id: u32,
    /// Of the pixel.
    centre: DVec2,
    range_m: f64,
    /// For occlusion.
    normal: Option<DVec3>,
}

struct Moved {
    flow_px: DVec2,
    step_m: DVec3,
    is_hidden: bool,
}

impl Seen<'_> {
    fn moved_to(&self, other: Option<&OtherFrame>) -> Moved {
        let (Some(other), 1..) = (other, self.id) else {
            return Moved {
                flow_px: DVec2::NAN,
                step_m: DVec3::NAN,
                is_hidden: self.id > 0,
            };
        };
        // The layer P is not used, because it loses digits far from the origin.
        let DVec2 { x, y } = self.centre;
        let direction = self.camera.ray_direction(x, y).normalize();
        let point_m = self.camera.ray_origin_m(x, y) + direction * self.range_m;
        let of_mesh = other.mesh_moves.get(self.id as usize - 1);
        let of_mesh = of_mesh.copied().flatten();
        // Meshes that do not move get a scene flow of exactly 0.
        let step_m = match of_mesh {
            Some(of_mesh) => of_mesh.transform_point3(point_m) - point_m,
            None => DVec3::ZERO,
        };
        let is_still = step_m == DVec3::ZERO && other.camera == self.camera;
        let place = match other.camera.project(point_m + step_m) {
            _ if is_still => self.centre,
            Some(place) => place,
            None => DVec2::NAN,
        };
        let normal = self.normal.map(|normal| match of_mesh {
            Some(of_mesh) => DMat3::from_mat4(of_mesh).inverse().transpose() * normal,
            None => normal,
        });
        Moved {
            flow_px: place - self.centre,
            step_m,
            is_hidden: normal.is_some_and(|n| !other.shows(self.id, point_m + step_m, n, place)),
        }
    }
}

impl OtherFrame<'_> {
    /// Whether the frame shows a point of an instance at a place of its image.
    ///
    /// The frame knows its ranges at the centres of pixels alone. It shows the point if, at one of the four around the place, it shows the same
    /// instance, and not nearer than the plane that is tangent to the surface at the point. A tolerance of a pixel's width w there
    /// covers curved surfaces: around the point, at most √2·w/cosθ away on the surface, one of curvature κ leaves that plane by at most
    /// κw²/cos³θ along the ray. That is below w if the radius of curvature is above w/cos³θ, so if pixels resolve the surface.
    fn shows(&self, id: u32, point_m: DVec3, normal: DVec3, place: DVec2) -> bool {
        let Some((ranges_m, ids)) = self
            .shown
            .and_then(|shown| Some((shown.values(Layer::Range)?, shown.ids(Layer::InstanceId)?)))
        else {
            return false;
        };
        let size_px = DVec2::from(self.camera.resolution_px.map(f64::from));
        let is_inside = place.cmpge(DVec2::ZERO).all() && place.cmple(size_px).all();
        if !is_inside {
            return false;
        }
        let last = size_px - 1.0;
        let ray = |place: DVec2| self.camera.ray_direction(place.x, place.y).normalize();
        let origin_m = |place: DVec2| self.camera.ray_origin_m(place.x, place.y);
        let range_m = self.camera.range_to(point_m - self.camera.position_m);
        let pixel = place.floor().min(last);
        let diagonal_m =
            range_m * (ray(pixel) - ray(pixel + 1.0)) + (origin_m(pixel) - origin_m(pixel + 1.0));
        let pixel_m = diagonal_m.length() / std::f64::consts::SQRT_2;
        let first = (place - 0.5).floor();
        [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE]
            .into_iter()
            .any(|step| {
                let pixel = (first + step).clamp(DVec2::ZERO, last);
                let i = pixel.y as usize * size_px.x as usize + pixel.x as usize;
                let (Some(&range_m), true) = (ranges_m.get(i), ids.get(i) == Some(&id)) else {
                    return false;
                };
                let centre = pixel + 0.5;
                let to_plane_m = normal.dot(point_m - origin_m(centre)) / normal.dot(ray(centre));
                // A ray that does not meet the plane is above the surface.
                to_plane_m > 0.0 && f64::from(range_m) >= to_plane_m - pixel_m
            })
    }
}
