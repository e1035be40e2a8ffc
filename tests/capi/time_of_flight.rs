//! Time-of-flight cameras through the C interface.

use std::ffi::CStr;

use crate::host::*;
use camlux::{
    Renderer,
    capi::*,
    glam::DVec3,
    scene::{ChargeUnit, IndirectLight, Light, SensorNoise},
};

/// The corner with a second light that is not modulated, and a sensor that counts in DN.
fn noisy_corner() -> camlux::Scene {
    let mut scene = engine_scene("tof_corner", [16, 12]);
    scene.indirect = Some(IndirectLight::final_gather(0.2));
    scene
        .lights
        .push(Light::directional(DVec3::new(-1.0, -2.0, -1.5), [0.01; 3]).into());
    let tof = scene.tof.as_mut().expect("it has one");
    tof.ambient_lights = vec![1];
    tof.phase_count = 3;
    tof.phase_offset_deg = 7.0;
    tof.output = ChargeUnit::DigitalNumbers;
    tof.noise = Some(SensorNoise {
        seed: 5,
        dark_e_per_s: 100.0,
        read_noise_e: 12.0,
        full_well_e: 1e5,
        gain_dn_per_e: 0.5,
        black_level_dn: 3.0,
        bits: 16,
        ..SensorNoise::DEFAULT
    });
    scene
}

#[test]
fn layers_are_those_of_the_engine() {
    let scene = noisy_corner();
    let engine = {
        let device = camlux::Device::open(&Default::default()).expect("a device");
        let mut renderer = Renderer::new(&device).expect("a renderer");
        [0, 9].map(|frame_index| {
            let mut options = camlux::RenderOptions {
                frame_index: Some(frame_index),
                ..Default::default()
            };
            let frame = renderer.render(&scene, &mut options);
            layers_of(&frame.expect("the scene renders"))
        })
    };
    assert!(engine[0] != engine[1], "each frame has its own noise");
    let device = Device::open();
    let renderer = device.renderer();
    let built = from_arrays(&scene);
    for (frame_index, expected) in [0, 9].into_iter().zip(&engine) {
        for on_device in [0, 1] {
            let options = init!(camlux_render_options {
                frame_index: frame_index,
                on_device: on_device
            });
            let frame = renderer.try_render(&built, &options).expect("it renders");
            assert!(frame.layers() == *expected, "{frame_index} {on_device}");
        }
    }
}

/// Frames count up, cameras of one frame share its index, and each camera and seed has its own noise.
#[test]
fn no_two_frames_share_their_noise() {
    let device = Device::open();
    let renderer = device.renderer();
    let scene = from_arrays(&noisy_corner());
    let taps = |frame: Frame| {
        let mut taps = frame.layers();
        taps.retain(|(layer, _)| *layer == CAMLUX_LAYER_TOF_TAPS);
        let stats = frame.stats();
        ((stats.frame_index, stats.camera_index), taps)
    };
    let camera = scene.camera();
    let of_cameras = |options: camlux_render_options| {
        let frames = renderer.render_cameras(&scene, &[camera; 2], &options);
        frames.expect("they render").into_iter().map(taps)
    };
    let one = |options| taps(renderer.try_render(&scene, &options).expect("it renders"));
    let counted = init!(camlux_render_options {});
    let fixed = init!(camlux_render_options { frame_index: 0 });
    let seeded = init!(camlux_render_options {
        frame_index: 0,
        seed: 7
    });
    let mut all: Vec<_> = vec![one(counted), one(counted)];
    all.extend(of_cameras(counted));
    all.push(one(seeded));
    let keys: Vec<_> = all.iter().map(|(key, _)| *key).collect();
    assert_eq!(keys, [(0, 0), (1, 0), (2, 0), (2, 1), (0, 0)]);
    for (i, (_, taps)) in all.iter().enumerate() {
        assert!(all[..i].iter().all(|(_, others)| others != taps), "{i}");
    }
    assert!(one(fixed) == all[0] && one(seeded) == all[4]);
    let again = of_cameras(init!(camlux_render_options { frame_index: 2 }));
    assert!(again.eq(all[2..4].iter().cloned()));
}

#[test]
fn views_and_files_name_what_they_hold() {
    let device = Device::open();
    let renderer = device.renderer();
    let scene = from_arrays(&noisy_corner());
    let frame = renderer.render(&scene);
    // SAFETY: strings of the library.
    let text = |text| unsafe { CStr::from_ptr(text) }.to_str().expect("ASCII");
    let second = CAMLUX_TOF_NEXT_FREQUENCY;
    for (layer, name, unit, channels) in [
        (CAMLUX_LAYER_HALF_PATH, "half_path", "m", 1),
        (CAMLUX_LAYER_TOF_PHASOR, "tof0.phasor", "W/sr/m^2", 2),
        (CAMLUX_LAYER_TOF_MPI + second, "tof1.mpi", "m", 1),
        (CAMLUX_LAYER_TOF_WRAPS + second, "tof1.wraps", "1", 1),
        (CAMLUX_LAYER_TOF_AMPLITUDE, "tof0.amplitude", "DN", 1),
        (CAMLUX_LAYER_TOF_TAPS + second + 2, "tof1.phase2", "DN", 2),
    ] {
        let view = frame.view(layer);
        assert_eq!((text(view.name), text(view.unit)), (name, unit));
        assert_eq!((view.layer, view.channels), (layer, channels), "{name}");
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("picked.exr");
    let picked = c_path(&path);
    let layers = [CAMLUX_LAYER_HALF_PATH, CAMLUX_LAYER_TOF_RANGE + second];
    let options = init!(camlux_exr_options {
        layers: layers.as_ptr(),
        layer_count: 2
    });
    // SAFETY: a string, and a struct of that size.
    ok(unsafe { camlux_frame_write_exr(frame.raw(), picked.as_ptr(), &options) });
    let image = camlux::output::LayeredImage::read(path).expect("an image");
    let names: Vec<&str> = image.layers().iter().map(|layer| &layer.name[..]).collect();
    assert_eq!(names, ["half_path", "tof1.range"]);
    // A layer of a frequency or a phase image that this frame lacks is no other layer, in any call.
    for (layer, words) in [
        (
            CAMLUX_LAYER_TOF_RANGE + 2 * second,
            "no layer tof2.range; choose one of its 2 frequencies, tof0 to tof1",
        ),
        (
            CAMLUX_LAYER_TOF_TAPS + 7,
            "no layer tof0.phase7; choose one of its 3 phase images, phase0 to phase2",
        ),
    ] {
        let options = init!(camlux_exr_options {
            layers: &layer,
            layer_count: 1
        });
        let (mut view, mut room) = (init!(camlux_view {}), [0_f32; 4]);
        let target = init!(camlux_target {
            layer: layer,
            data: room.as_mut_ptr().cast(),
            size_bytes: 1 << 30
        });
        let to_target = init!(camlux_render_options {
            targets: &target,
            target_count: 1
        });
        // SAFETY: structs of their size; nothing is written to the memory of a layer that does not exist.
        unsafe {
            let written = camlux_frame_write_exr(frame.raw(), picked.as_ptr(), &options);
            fails(written, ARGUMENT, words);
            fails(
                camlux_frame_view(frame.raw(), layer, &mut view),
                ARGUMENT,
                words,
            );
            let copied = camlux_frame_copy(frame.raw(), layer, room.as_mut_ptr().cast(), 16, 0);
            fails(copied, ARGUMENT, words);
        }
        let rendered = renderer.try_render(&scene, &to_target).unwrap_err();
        fails(rendered, SCENE, words);
    }
}

#[test]
fn what_does_not_go_together_is_refused() {
    let scene = from_arrays(&noisy_corner());
    let one = init!(camlux_tof {
        frequency_count: 1,
        frequencies_hz: [2e7, 0.0, 0.0, 0.0]
    });
    let refuses = |change: &dyn Fn(&mut camlux_tof), status, words| {
        let mut tof = one;
        change(&mut tof);
        fails(scene.set_tof(&tof), status, words);
    };
    let old_noise = init!(camlux_tof_noise { struct_size: 3 });
    refuses(&|tof| tof.frequency_count = 5, ARGUMENT, "give 1 to 4");
    refuses(&|tof| tof.output = 2, ARGUMENT, "output is 2");
    let words = "ambient_lights is NULL";
    refuses(&|tof| tof.ambient_light_count = 1, ARGUMENT, words);
    refuses(
        &|tof| tof.noise = &old_noise,
        ARGUMENT,
        "CAMLUX_TOF_NOISE_INIT",
    );

    ok(scene.validate());
    ok(scene.set_tof(&one));
    let words = "light 1 (directional) is modulated";
    fails(scene.validate(), SCENE, words);
    let ambient = [1, 7];
    let with_ambient = |count| camlux_tof {
        ambient_lights: ambient.as_ptr(),
        ambient_light_count: count,
        ..one
    };
    ok(scene.set_tof(&with_ambient(2)));
    fails(scene.validate(), SCENE, "ambient light 7");
    // What does not depend on the rest of the scene is checked at once.
    let without_gain = |tof: &mut camlux_tof| {
        *tof = with_ambient(1);
        tof.output = CAMLUX_CHARGE_DN;
    };
    refuses(&without_gain, SCENE, "there is no gain");
    refuses(
        &|tof| tof.frequency_count = 0,
        SCENE,
        "there are 0 frequencies",
    );
    refuses(&|tof| tof.contrasts = [2.0; 4], SCENE, "contrast 0 is 2");
    let empty_well = init!(camlux_tof_noise {});
    refuses(&|tof| tof.noise = &empty_well, SCENE, "full_well_e is 0");
    fails(scene.validate(), SCENE, "ambient light 7");
    ok(scene.set_tof(&with_ambient(1)));
    ok(scene.validate());
    let sensor = init!(camlux_sensor {
        pixel_pitch_um: [1.0; 2],
        exposure_time_s: 1.0
    });
    ok(scene.set_sensor(&sensor));
    fails(scene.validate(), SCENE, "wavelength_nm");
    scene.unset_tof();
    ok(scene.validate());
}
