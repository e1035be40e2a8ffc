//! Scenes that easily fool an error estimate.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3, dvec3};

use super::openings::{Opening, room_behind};
use crate::{
    Scene,
    hard_cases::scenes::{
        COLOURED, GLOSSY, GREY, append, cuboid, empty_room, lit_by, point_light, quad, room,
        scene_of, sphere, spot_light, turned,
    },
    scene::{Lens, Light, Material, Mesh},
};

/// A scene and its known properties.
pub struct Subject {
    pub scene: Scene,
    /// The openings in front of the first light, if it is behind openings.
    pub openings: Vec<Opening>,
    /// The scene tests its number of pixels, which must not change.
    pub keeps_size: bool,
}

impl Subject {
    fn new(scene: Scene) -> Subject {
        Subject {
            scene,
            openings: Vec::new(),
            keeps_size: false,
        }
    }

    fn behind(openings: Vec<Opening>, lamp_m: DVec3, [camera_m, look_at_m]: [DVec3; 2]) -> Subject {
        let lamp = watts(point_light(lamp_m), 100.0);
        let mut scene = room_behind(&openings, lamp, camera_m, look_at_m);
        scene.camera.lens = Lens::FovY { fov_y_deg: 50.0 };
        Subject {
            scene,
            openings,
            keeps_size: false,
        }
    }
}

impl Subject {
    /// The scene at another size, unless it depends on its size.
    pub fn resized(mut self, size_px: u32) -> Subject {
        if !self.keeps_size {
            self.scene.camera.resolution_px = [size_px; 2];
        }
        self
    }
}

/// The light with this power in each band, W.
fn watts(light: Light, power_w: f64) -> Light {
    light.with_emission([power_w; 3])
}

/// Metres from the lamp to the wall with the openings.
const LAMP_DISTANCE_M: f64 = 1.5;
/// The size on that wall of one texel, for a face of 128² texels of the lamp's map.
const TEXEL_M: f64 = 2.0 * LAMP_DISTANCE_M / 128.0;
/// Off the middle of the openings.
const LAMP_M: DVec3 = dvec3(-1.0 - LAMP_DISTANCE_M, 0.17, 0.011);
/// A view of the side wall, which receives no direct light.
const SIDE_WALL: [DVec3; 2] = [dvec3(0.11, 0.05, 0.8), dvec3(0.16, 0.0, -1.0)];

/// A room that is lit through a slit of `texels` texels. The camera sees the side wall.
pub fn slit(texels: f64) -> Subject {
    Subject::behind(
        vec![Opening::slit(0.0, texels * TEXEL_M)],
        LAMP_M,
        SIDE_WALL,
    )
}

/// A slit of 4 cm (1.7 texels) and a lamp that moves sideways by 4 mm per step.
pub fn moved_lamp(step: u32) -> Subject {
    let offset_m = 0.004 * f64::from(step);
    let slit = Opening::slit(0.0, 0.04);
    Subject::behind(vec![slit], LAMP_M + offset_m * DVec3::Z, SIDE_WALL)
}

/// A hole of one by two texels.
pub fn keyhole() -> Subject {
    let hole = Opening {
        y_m: [-0.06, -0.06 + 2.0 * TEXEL_M],
        ..Opening::slit(0.0, TEXEL_M)
    };
    Subject::behind(vec![hole], LAMP_M, SIDE_WALL)
}

/// Fifteen slits of a fifth of a texel, spaced a little more than two texels apart.
pub fn blinds() -> Subject {
    let slits = (-7..=7).map(|i| Opening::slit(0.053 * f64::from(i), 0.2 * TEXEL_M));
    Subject::behind(slits.collect(), LAMP_M, SIDE_WALL)
}

/// The same room; the camera sees the lit strip itself, and floor and wall beside it.
pub fn visible_strip() -> Subject {
    let look = [dvec3(-0.7, 0.2, 0.7), dvec3(0.8, -0.5, -0.1)];
    Subject::behind(vec![Opening::slit(0.0, 0.04)], LAMP_M, look)
}

/// A lamp of 10⁴ times the power behind a hole: it contributes about as much light as the weak lamp inside the room.
pub fn unequal_lamps() -> Subject {
    let hole = Opening {
        y_m: [-0.02, 0.025],
        ..Opening::slit(0.0, 0.045)
    };
    let mut subject = Subject::behind(vec![hole], LAMP_M, SIDE_WALL);
    let weak = watts(point_light(dvec3(0.4, 0.5, 0.35)), 0.01);
    subject.scene.lights.push(weak.into());
    subject
}

/// Three spots with a full angle of half a degree. The camera sees none of the surfaces that they light.
pub fn three_spots() -> Subject {
    let spots = [
        [dvec3(0.33, 0.81, 0.2), dvec3(-0.3, -1.0, 0.5)],
        [dvec3(-0.4, 0.9, -0.1), dvec3(0.45, 0.1, 1.0)],
        [dvec3(0.0, -0.2, 0.6), dvec3(-0.5, 1.0, 0.7)],
    ];
    let spots = spots.map(|[at, target]| spot_light(at, target - at, [0.1, 0.25]));
    Subject::new(lit_by(&room(), spots.into()))
}

/// A lamp 2 mm from the side wall.
pub fn lamp_off_a_wall() -> Subject {
    let lamp = point_light(dvec3(-0.998, 0.3, 0.1));
    Subject::new(lit_by(&room(), vec![lamp]))
}

/// 120 wires of 4 mm across a room, thinner than a pixel.
pub fn wires() -> Subject {
    let mut random = fastrand::Rng::with_seed(120);
    let mut scene = empty_room();
    let mut wires = Mesh {
        name: "wires".into(),
        ..Mesh::default()
    };
    for wire in 0..120 {
        let axis = DVec3::AXES[wire % 3];
        let size_m = DVec3::splat(0.004) + 1.6 * axis;
        let middle_m = DVec3::from([0; 3].map(|_| 1.8 * random.f64() - 0.9));
        let at_m = middle_m - axis * middle_m.dot(axis) - 0.5 * size_m;
        append(&mut wires, cuboid("", at_m, size_m, COLOURED));
    }
    scene.meshes.push(wires.into());
    Subject::new(scene)
}

/// A spot on a plate that reflects only by its Phong lobe: the room has no other light.
pub fn highlights_alone() -> Subject {
    let lamp = spot_light(dvec3(-0.35, 0.6, 0.1), dvec3(0.3, -1.0, 0.05), [14.0, 20.0]);
    let mut scene = lit_by(&empty_room(), vec![lamp]);
    let polished = Material {
        ks: [0.8, 0.7, 0.6],
        shininess: 200.0,
        ..Material::lambert("polished", [0.0; 3])
    };
    let material = scene.materials.len() as u32;
    scene.materials.push(polished);
    let corner_m = dvec3(-0.9, -0.95, -0.9);
    let plate = quad("plate", corner_m, 1.8 * DVec3::Z, 1.8 * DVec3::X, material);
    scene.meshes.push(plate.into());
    scene.camera.look_at_m = dvec3(0.1, 0.5, -0.9);
    Subject::new(scene)
}

/// A small block in the sky over a lit yard that is out of sight. About 227 of 25 600 pixels show the block.
pub fn few_pixels() -> Subject {
    let [x, z] = [DVec3::X, DVec3::Z].map(|axis| 4.0 * axis);
    let ground = quad("ground", dvec3(-2.0, 0.0, -2.0), z, x, COLOURED);
    let wall = quad("wall", dvec3(-2.0, 0.0, -1.0), x, 0.9 * DVec3::Y, GREY);
    let block = cuboid("block", dvec3(-0.1, 2.0, -0.1), DVec3::splat(0.22), GREY);
    let lamp = point_light(dvec3(0.5, 0.25, -0.6));
    let eye_m = dvec3(0.2, 0.3, 0.9);
    let mut scene = scene_of(
        vec![ground, wall, block],
        lamp,
        eye_m,
        dvec3(0.0, 2.1, 0.15),
    );
    scene.camera.resolution_px = [160, 160];
    Subject {
        keeps_size: true,
        ..Subject::new(scene)
    }
}

/// 160 balls of 1 to 4 cm, matte and glossy, in the lower half of a room.
pub fn small_objects() -> Subject {
    let mut random = fastrand::Rng::with_seed(160);
    let mut scene = empty_room();
    for material in [GREY, COLOURED, GLOSSY] {
        let mut balls = Mesh {
            name: "balls".into(),
            ..Mesh::default()
        };
        for _ in 0..53 {
            let unit = DVec3::from([0; 3].map(|_| random.f64()));
            let at_m = unit * dvec3(1.9, 0.8, 1.5) - dvec3(0.95, 0.95, 0.95);
            let radius_m = 0.01 + 0.03 * random.f64();
            append(&mut balls, sphere(at_m, radius_m, 2, material));
        }
        scene.meshes.push(balls.into());
    }
    Subject::new(scene)
}

/// The scene turned by up to two degrees; the number is the seed. The image stays the same, but the texels of all maps differ. 0 leaves the
/// scene as it is.
pub fn varied(scene: &Scene, variation: u32) -> Scene {
    if variation == 0 {
        return scene.clone();
    }
    let mut random = fastrand::Rng::with_seed(variation.into());
    let turn = TAU * random.f64();
    let height = 2.0 * random.f64() - 1.0;
    let axis =
        (dvec3(turn.cos(), turn.sin(), 0.0) * (1.0 - height * height).sqrt()) + height * DVec3::Z;
    let angle = 2.0_f64.to_radians() * (2.0 * random.f64() - 1.0);
    turned(scene, DMat3::from_axis_angle(axis, angle))
}
