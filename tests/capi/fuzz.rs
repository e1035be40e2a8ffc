//! Calls the C interface in random order, with valid, invalid and released handles, and with valid and invalid arguments.

use std::{
    collections::BTreeMap,
    ptr::{null, null_mut},
};

use crate::{
    host::*,
    sequence::{DEVICE, FRAME, MOST_LIVE, RENDERER, Random, SCENE, Sequence, TOKEN},
};
use camlux::capi::*;

impl Sequence {
    /// Any call, with any arguments of the right types.
    fn step(&mut self, device: *mut camlux_device) {
        // Frames are few and expensive: a sequence that may render does so early.
        let call = if self.renders > 0 && self.random.one_in(6) {
            35
        } else {
            self.random.below(36)
        };
        // SAFETY: pointers are null, misaligned, or point to structs of at least the size that they say.
        let status = unsafe { self.call(call, device) };
        assert_ne!(
            status,
            CAMLUX_ERROR_INTERNAL,
            "call {call}: {}",
            last_error()
        );
        *self.statuses.entry(status).or_default() += 1;
    }

    unsafe fn call(&mut self, call: usize, device: *mut camlux_device) -> camlux_status {
        let scene = self.handle(SCENE);
        let frame: *mut camlux_frame = self.handle(FRAME);
        let [scenes, renderers, tokens] = [SCENE, RENDERER, TOKEN].map(|kind| self.count(kind));
        let kind = self.random.below(5);
        let r = &mut self.random;
        let index = r.whole();
        let mut number = 0;
        let number = r.pointer(&mut number);
        // SAFETY: see `step`.
        unsafe {
            match call {
                0 | 1 if scenes < MOST_LIVE => {
                    let mut made = null_mut();
                    let status = camlux_scene_create(&mut made);
                    self.born(SCENE, status, made);
                    status
                }
                2 if renderers < MOST_LIVE => {
                    let mut made = null_mut();
                    let owner = if r.one_in(8) { frame.cast() } else { device };
                    let status = camlux_renderer_create(owner, &mut made);
                    self.born(RENDERER, status, made);
                    status
                }
                3..=5 => self.retain(kind),
                6..=9 => self.release(kind),
                10 => {
                    let mut camera = init!(camlux_camera {
                        width_px: 16,
                        height_px: 16,
                        lens: r.choice(),
                        position_m: r.reals(),
                        look_at_m: r.reals(),
                        up: r.reals(),
                        distortion: r.reals(),
                    });
                    camlux_scene_set_camera(scene, r.pointer(&mut camera))
                }
                11 => camlux_scene_get_camera(scene, r.pointer(&mut init!(camlux_camera {}))),
                12 => {
                    let mut sensor = init!(camlux_sensor {
                        pixel_pitch_um: r.reals(),
                        exposure_time_s: r.real(),
                        wavelength_nm: r.pick(&[0.0, 850.0]),
                        quantum_efficiency: 0.5
                    });
                    camlux_scene_set_sensor(scene, r.pointer(&mut sensor))
                }
                13 => {
                    let some_error = r.real();
                    let errors = [0.0, 0.0, 0.3, some_error];
                    let mut indirect = init!(camlux_indirect {
                        estimator: r.choice(),
                        rsm_size: r.pick(&[0, 4, 8]),
                        target_error: r.pick(&errors),
                        error_norm: r.pick(&[0, 0, 0, 1, 2]),
                        interpolation_error: r.pick(&errors),
                        max_ms: r.pick(&[0.0, 0.0, 50.0, some_error]),
                        max_rays: r.pick(&[0, 0, 1, 1 << 40]),
                        stderr_layer: r.pick(&[0, 0, 1, 2]),
                        bounces: r.pick(&[0, 0, 2, 17]),
                        target_range_error_mm: r.pick(&[0.0, 0.0, 5.0, some_error])
                    });
                    camlux_scene_set_indirect(scene, r.pointer(&mut indirect))
                }
                14 if r.one_in(2) => {
                    // The counts are within the array.
                    let values: [f64; 16] = r.reals();
                    let values = values.map(|value| value.abs() as f32);
                    let mut map = init!(camlux_vignetting_map {
                        width_px: r.below(5) as u32,
                        height_px: r.below(5) as u32,
                        values: values.as_ptr(),
                        row_stride_bytes: r.pick(&[0, 16]),
                    });
                    camlux_scene_set_vignetting_map(scene, r.pointer(&mut map))
                }
                14 => {
                    let mut direct = init!(camlux_direct { shadow: r.choice() });
                    camlux_scene_set_direct(scene, r.pointer(&mut direct))
                }
                15 | 16 => {
                    let mut light = init!(camlux_light {
                        kind: r.choice(),
                        position_m: r.reals(),
                        direction: r.reals(),
                        power_w: r.reals(),
                        irradiance_w_m2: r.reals(),
                        inner_half_angle_deg: r.real(),
                        outer_half_angle_deg: 30.0 * r.real(),
                        up: r.reals(),
                        size_m: [r.real().abs(), r.real()],
                        radius_m: r.pick(&[0.0, 0.1, -1.0])
                    });
                    // The counts are within these arrays.
                    let numbers: [f64; 16] = r.reals();
                    let intensities = numbers.map(f64::abs);
                    let values = intensities.map(|value| value as f32);
                    let angles_deg = r.pick(&[[0.0, 30.0, 60.0, 90.0], [0.0, 120.0, 240.0, 360.0]]);
                    let mut pattern = init!(camlux_pattern {
                        encoding: r.choice(),
                        gammas_deg: r.pick(&[angles_deg.as_ptr(), numbers.as_ptr()]),
                        gamma_count: r.below(5),
                        planes_deg: r.pick(&[angles_deg.as_ptr(), numbers.as_ptr()]),
                        plane_count: r.below(5),
                        intensities: intensities.as_ptr(),
                    });
                    let mut image = init!(camlux_projected_image {
                        encoding: r.choice(),
                        width_px: r.below(5) as u32,
                        height_px: r.below(5) as u32,
                        values: values.as_ptr(),
                        row_stride_bytes: r.pick(&[0, 16]),
                        lens: r.choice(),
                        fov_y_deg: 30.0 * r.real(),
                        fx_px: r.real(),
                        fy_px: r.real(),
                    });
                    light.pattern = r.pointer(&mut pattern);
                    light.image = r.pointer(&mut image);
                    if call == 15 {
                        camlux_scene_add_light(scene, r.pointer(&mut light), number)
                    } else {
                        camlux_scene_set_light(scene, index, r.pointer(&mut light))
                    }
                }
                17 | 18 => {
                    let mut material = init!(camlux_material {
                        kd: r.reals().map(f64::abs),
                        kd_texture: r.pick(&[0, 1, 4]),
                        normal_texture: r.pick(&[0, 1, 4]),
                        alpha_texture: r.pick(&[0, 1, 4]),
                        shininess: r.real()
                    });
                    if call == 17 {
                        camlux_scene_add_material(scene, r.pointer(&mut material), number)
                    } else {
                        camlux_scene_set_material(scene, index, r.pointer(&mut material))
                    }
                }
                19 | 20 => {
                    let positions_m: [[f64; 3]; 5] = std::array::from_fn(|_| r.reals());
                    let indices: [[u32; 3]; 4] =
                        std::array::from_fn(|_| std::array::from_fn(|_| r.whole()));
                    let mut mesh = init!(camlux_mesh {
                        vertex_count: r.pick(&[0, 4, 5, usize::MAX]),
                        triangle_count: r.pick(&[0, 1, 4, 4]),
                        material: r.pick(&[0, 0, 1]),
                        positions_m: array(&positions_m, CAMLUX_FORMAT_F64),
                        indices: array(&indices, CAMLUX_FORMAT_U32),
                    });
                    mesh.positions_m.stride_bytes = r.pick(&[0, 0, 24, 8, 7, usize::MAX - 7]);
                    if r.one_in(20) {
                        mesh.indices.data = null();
                    }
                    if r.one_in(20) {
                        mesh.positions_m.data = mesh.positions_m.data.wrapping_byte_add(1);
                    }
                    match r.one_in(3) {
                        true => camlux_scene_set_mesh(scene, index, r.pointer(&mut mesh)),
                        false => camlux_scene_add_mesh(scene, r.pointer(&mut mesh), number),
                    }
                }
                21 => {
                    let texels = [0_u8; 64];
                    let mut texture = init!(camlux_texture {
                        width_px: r.pick(&[0, 1, 4]),
                        height_px: r.pick(&[0, 1, 4]),
                        channels: r.whole(),
                        encoding: r.choice(),
                        row_stride_bytes: r.pick(&[0, 0, 1, 16]),
                        pixels: texels.as_ptr().cast(),
                    });
                    match r.one_in(3) {
                        true => camlux_scene_set_texture(scene, index, r.pointer(&mut texture)),
                        false => camlux_scene_add_texture(scene, r.pointer(&mut texture), number),
                    }
                }
                22 | 23 => {
                    let mut pose = pose(r);
                    camlux_scene_add_instance(scene, index, r.pointer(&mut pose), number)
                }
                24 | 25 => {
                    let mut poses = [pose(r), pose(r)];
                    let part = r.choice();
                    let stride_bytes =
                        r.pick(&[size_of::<camlux_pose>(); 4]) + r.pick(&[0, 0, 0, 4]);
                    let indices = [index, r.whole()];
                    let rows: [f64; 16] = r.reals();
                    match r.below(6) {
                        5 => {
                            let numbers = r.pick(&[9, 12, 16]);
                            let pose = r.pointer(&mut poses[0]);
                            camlux_pose_from_matrix(rows.as_ptr(), numbers, part, pose)
                        }
                        0 => camlux_scene_set_visible(scene, part, index, r.pick(&[0, 1, 1, 2])),
                        1 if r.one_in(2) => camlux_scene_remove(scene, part, index),
                        2 => camlux_scene_set_poses(
                            scene,
                            part,
                            indices.as_ptr(),
                            r.pick(&[0, 1, 2]),
                            poses.as_ptr(),
                            stride_bytes,
                        ),
                        3 => camlux_scene_get_pose(scene, part, index, r.pointer(&mut poses[0])),
                        _ => camlux_scene_set_pose(scene, part, index, r.pointer(&mut poses[0])),
                    }
                }
                26 => match r.one_in(2) {
                    true => {
                        camlux_scene_get_light(scene, index, r.pointer(&mut init!(camlux_light {})))
                    }
                    false => {
                        let mut material = init!(camlux_material {});
                        camlux_scene_get_material(scene, index, r.pointer(&mut material))
                    }
                },
                27 => camlux_scene_get_counts(scene, r.pointer(&mut init!(camlux_scene_counts {}))),
                28 => camlux_scene_get_bounds(scene, r.pointer(&mut init!(camlux_bounds {}))),
                29 => camlux_scene_validate(scene),
                30 => camlux_cancel_token_cancel(self.handle(TOKEN)),
                31 => self.look_at(frame),
                32 => {
                    let mut stats = init!(camlux_frame_stats {});
                    match r.below(2) {
                        0 => camlux_frame_get_stats(frame, r.pointer(&mut stats)),
                        _ => camlux_frame_get_pass(
                            frame,
                            index,
                            r.pointer(&mut init!(camlux_pass_time {})),
                        ),
                    }
                }
                33 if tokens < MOST_LIVE => {
                    let mut made = null_mut();
                    let status = camlux_cancel_token_create(&mut made);
                    self.born(TOKEN, status, made);
                    status
                }
                34 => {
                    let ambient = [0, r.whole()];
                    let mut noise = init!(camlux_tof_noise {
                        full_well_e: r.real(),
                        read_noise_e: r.real()
                    });
                    let mut tof = init!(camlux_tof {
                        frequency_count: r.pick(&[0, 1, 2, 4, 5]),
                        frequencies_hz: [1e7, 2e7, 1e8, 1e9],
                        phase_offset_deg: r.real(),
                        phase_count: r.pick(&[3, 4, 8, 9]),
                        output: r.choice(),
                        noise: if r.one_in(2) {
                            r.pointer(&mut noise)
                        } else {
                            null_mut()
                        },
                        ambient_lights: ambient.as_ptr(),
                        ambient_light_count: r.pick(&[0, 0, 1, 2])
                    });
                    if r.one_in(4) {
                        let (mut room, mut is_set) = ([0; 2], 0);
                        let (at, count) = (room.as_mut_ptr(), r.pick(&[0, 1, 2]));
                        let noise = r.pointer(&mut noise);
                        let tof = r.pointer(&mut tof);
                        camlux_scene_get_tof(scene, tof, noise, at, count, &mut is_set)
                    } else {
                        camlux_scene_set_tof(scene, r.pointer(&mut tof))
                    }
                }
                _ => self.render(),
            }
        }
    }

    /// # Safety
    /// As for `step`.
    unsafe fn look_at(&mut self, frame: *mut camlux_frame) -> camlux_status {
        let r = &mut self.random;
        let mut view = init!(camlux_view {});
        let mut room = vec![0_u8; 16 * 16 * 12];
        let layer = r.choice();
        // SAFETY: see `step`. A returned view can be read, and `room` has at least `bytes` bytes.
        unsafe {
            let status = camlux_frame_view(frame, layer, r.pointer(&mut view));
            if status == CAMLUX_OK && !view.data.is_null() {
                let bytes = std::slice::from_raw_parts(view.data.cast::<u8>(), view.size_bytes);
                std::hint::black_box(bytes.iter().map(|&b| u64::from(b)).sum::<u64>());
            }
            let stride = r.pick(&[0, 0, 192, 200, usize::MAX]);
            let bytes = r.pick(&[room.len(), 10]);
            let copied = camlux_frame_copy(frame, layer, room.as_mut_ptr().cast(), bytes, stride);
            r.pick(&[status, copied])
        }
    }

    /// Renders at most `renders` frames: a frame takes as long as ten thousand other calls.
    ///
    /// # Safety
    /// As for `step`.
    unsafe fn render(&mut self) -> camlux_status {
        if self.renders == 0 || self.count(FRAME) >= MOST_LIVE {
            return CAMLUX_OK;
        }
        let (renderer, scene) = (self.handle(RENDERER), self.handle(SCENE));
        let mut options = init!(camlux_render_options {
            submission_target_ms: self.random.pick(&[0, 500, 500, 500]),
            cancel_token: if self.random.one_in(8) {
                self.handle(TOKEN)
            } else {
                null_mut()
            },
        });
        let (mut frame, mut job) = (null_mut(), null_mut());
        let is_job = self.random.one_in(2);
        let options = self.random.pointer(&mut options);
        // SAFETY: see `step`.
        let status = unsafe {
            match is_job {
                false => camlux_renderer_render(renderer, scene, options, &mut frame),
                true => match camlux_renderer_submit(renderer, scene, options, &mut job) {
                    CAMLUX_OK => camlux_job_wait(job, &mut frame),
                    failed => failed,
                },
            }
        };
        assert_eq!(camlux_job_release(job), CAMLUX_OK);
        self.born(FRAME, status, frame);
        self.renders -= usize::from(status == CAMLUX_OK);
        status
    }
}

fn pose(r: &mut Random) -> camlux_pose {
    let turns = [
        [0.0, 0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0, 0.0],
        [0.6, 0.0, 0.8, 0.0],
    ];
    init!(camlux_pose {
        position_m: r.reals(),
        orientation_xyzw: if r.one_in(10) {
            r.reals()
        } else {
            r.pick(&turns)
        },
        scale: r.pick(&[1.0, 1.0, 2.0, 0.0]),
    })
}

/// Begins a sequence. One that may render starts with a valid scene and a renderer.
fn begin(random: Random, device: &Device, renderer: &Renderer, renders: usize) -> Sequence {
    let mut lent = vec![(DEVICE, device.0.addr())];
    let mut live = BTreeMap::new();
    if renders > 0 {
        let scene = load_at("cornell", [16, 16]);
        scene.plain_sum(4);
        live.insert((SCENE, scene.into_raw().addr()), 1);
        lent.push((RENDERER, renderer.raw().addr()));
    }
    live.extend(lent.iter().map(|lent| (*lent, 1)));
    Sequence {
        random,
        live,
        lent,
        gone: Vec::new(),
        renders,
        statuses: BTreeMap::new(),
    }
}

fn run(sequences: u64, calls: usize, rendering_one_in: u64) {
    let device = Device::open();
    // All sequences that render share it, so that its pipelines are compiled once. Sequences also create others.
    let renderer = device.renderer();
    let mut statuses = BTreeMap::<i32, usize>::new();
    let mut rendered = 0;
    for seed in 0..sequences {
        let renders = 2 * usize::from(seed % rendering_one_in == 0);
        let mut sequence = begin(Random(seed), &device, &renderer, renders);
        for _ in 0..calls {
            sequence.step(device.0);
        }
        rendered += renders - sequence.renders;
        for (status, count) in sequence.end() {
            *statuses.entry(status).or_default() += count;
        }
        assert_eq!(handle_count(), 2, "sequence {seed}");
    }
    println!("{sequences} sequences, {rendered} frames, statuses {statuses:?}");
    // Without these statuses the sequences would test little.
    for status in [
        CAMLUX_OK,
        CAMLUX_ERROR_INVALID_HANDLE,
        CAMLUX_ERROR_INVALID_ARGUMENT,
        CAMLUX_ERROR_SCENE,
    ] {
        assert!(statuses[&status] > calls, "{status}");
    }
    assert!(rendered > 0);
    drop(renderer);
    drop(device);
    assert_eq!(handle_count(), 0);
}

#[test]
fn ten_thousand_sequences_of_calls_end_well() {
    run(10_000, 60, 40);
}
