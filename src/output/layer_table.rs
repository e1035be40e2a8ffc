//! The table of layers: everything that is known of a layer, whatever the scene, is its row here.

use std::num::NonZeroU8;

/// What a frame needs to have a layer. A layer of a time-of-flight frequency needs that frequency, too.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LayerNeed {
    Nothing,
    /// [`Scene::sensor`](crate::Scene::sensor)
    Sensor,
    /// A sensor with [noise](crate::scene::Sensor::noise), and a value for each band.
    BandElectrons,
    /// A sensor with [colour filters](crate::scene::Sensor::bayer), or a monochrome one.
    RawElectrons,
    /// Such a sensor, with noise.
    RawNoise,
    /// [`Scene::indirect`](crate::Scene::indirect)
    Indirect,
    /// [`FinalGather::bounces`](crate::scene::FinalGather::bounces) above 1.
    MoreBounces,
    /// `stderr_layer` of [`IndirectLight::FinalGather`](crate::scene::IndirectLight::FinalGather). Reference images need nothing.
    StderrLayer,
    /// [Samples](crate::scene::PixelSampling) that pixels are averaged over.
    Samples,
    /// A material that [emits](crate::scene::Material::emission_w_sr_m2).
    Emission,
    /// [`Scene::tof`](crate::Scene::tof)
    Tof,
    /// Only reference images have the layer.
    Reference,
    /// Only frames of a sequence have the layer.
    Sequence,
}

impl LayerNeed {
    /// What to do for a layer with this need.
    pub(super) fn hint(self) -> &'static str {
        match self {
            LayerNeed::Sensor => "give the scene a sensor",
            LayerNeed::BandElectrons => "give the sensor noise, and neither bayer nor monochrome",
            LayerNeed::RawElectrons => "give the sensor bayer or monochrome",
            LayerNeed::RawNoise => "give the sensor noise, and bayer or monochrome",
            LayerNeed::Indirect => "give the scene indirect light",
            LayerNeed::MoreBounces => "let final-gather gather more bounces (bounces)",
            LayerNeed::StderrLayer => "set stderr_layer of its indirect light",
            LayerNeed::Samples => "set samples of its camera",
            LayerNeed::Emission => "give a material an emission",
            LayerNeed::Tof => "give the scene time of flight (tof)",
            LayerNeed::Nothing | LayerNeed::Reference | LayerNeed::Sequence => {
                "take it from a reference or a sequence"
            }
        }
    }
}

/// A row of the table.
pub(super) struct Row {
    /// Without the frequency and the index of a phase image.
    pub name: &'static str,
    /// The last parts of the channels' names; none for whole numbers, whose channel has the name of the layer.
    pub channels: &'static [&'static str],
    pub unit: &'static str,
    pub need: LayerNeed,
    /// Whether a frame has the layer only where it is named.
    pub is_on_request: bool,
    /// Lines of the documentation.
    pub text: &'static [&'static str],
    /// The constant of the C interface, if it has the layer. Of a layer with an index: the constant of the first.
    pub c_constant: &'static [(&'static str, i32)],
}

/// Declares an enum of layers by their rows: name, channels, unit, need, C constant. After `need`, `on_request` marks a layer that a frame
/// has only where it is named. The first paragraph of a row's comment also describes
/// the layer in `docs/output.md` and in `camlux.h`. After `+`: a variant whose rows are those of another enum.
macro_rules! layers {
    (@is_there) => { false };
    (@is_there on_request) => { true };
    (
        $(#[$of_enum:meta])*
        pub enum $layers:ident {
            $(
                $(#[doc = $text:literal])+
                $variant:ident $(($index:ty))?:
                $name:literal [$($channel:literal),*] $unit:literal, $need:ident $($on_request:ident)? $(, $constant:ident = $number:literal)?;
            )+
        }
        $(
            $(#[doc = $of_more:literal])+
            + $more:ident($($field:ty),+): $pattern:pat => $row:expr;
        )?
    ) => {
        $(#[$of_enum])*
        pub enum $layers {
            $(
                $(#[doc = $text])+
                #[doc = ""]
                #[doc = concat!("`", $name, "`, ", $unit $(, ", ", $channel)*)]
                $variant $(($index))?,
            )+
            $(
                $(#[doc = $of_more])+
                $more($($field),+),
            )?
        }

        impl $layers {
            /// A layer of each row, in the order of the documentation; of layers with an index, the first.
            pub(super) const OF_ROWS: &'static [$layers] = &[$($layers::$variant $((<$index>::MIN))?),+];

            pub(super) fn row(self) -> &'static Row {
                match self {
                    $($layers::$variant { .. } => const { &Row {
                        name: $name,
                        channels: &[$($channel),*],
                        unit: $unit,
                        need: LayerNeed::$need,
                        is_on_request: layers!(@is_there $($on_request)?),
                        text: &[$($text),+],
                        c_constant: &[$((stringify!($constant), $number))?],
                    } },)+
                    $($pattern => $row,)?
                }
            }
        }
    };
}

layers! {
    /// A quantity that a frame holds for each pixel. P is the surface point seen at the pixel centre, C the camera centre. If pixels are
    /// averaged over [samples](crate::scene::PixelSampling), light is the mean over the samples, but P, normals, ids, `depth` and `range`
    /// are those of the centre.
    ///
    /// Background pixels (no P) hold 0, except depths and `range`, which hold +∞.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
    pub enum Layer {
        /// Light from the surface to the camera, direct + indirect + emission.
        /// Without an f-number of the sensor it is numerically also the irradiance at the pixel, W/m^2.
        Radiance: "radiance" ["R", "G", "B"] "W/sr/m^2", Nothing, CAMLUX_LAYER_RADIANCE = 0;
        /// Light straight from the lights: by way of one surface.
        ///
        /// L_{P→C} = Σ over lights of f_P(l, n_P, v) · L_{L→P} · cosθ_{P→L} · V(L,P).
        Direct: "direct" ["R", "G", "B"] "W/sr/m^2", Nothing, CAMLUX_LAYER_DIRECT = 1;
        /// Light from other surfaces: by one bounce or more, and what they emit.
        ///
        /// Computed by the [`IndirectLight`](crate::scene::IndirectLight) in
        /// [`FrameDescription::indirect`](super::FrameDescription::indirect).
        Indirect: "indirect" ["R", "G", "B"] "W/sr/m^2", Indirect, CAMLUX_LAYER_INDIRECT = 2;
        /// Light of one number of bounces alone, counted from 1; with that of 1 what other surfaces emit. Together they are `indirect`.
        ///
        /// Each is gathered by itself, until its error is within the target, relative to all indirect light. They share the frame's limits.
        Bounce(NonZeroU8): "indirect." ["R", "G", "B"] "W/sr/m^2", MoreBounces on_request, CAMLUX_LAYER_INDIRECT_BOUNCE = 24;
        /// Light that the surface emits by itself.
        Emission: "emission" ["R", "G", "B"] "W/sr/m^2", Emission, CAMLUX_LAYER_EMISSION = 15;
        /// Standard error of `indirect`, and thus of `radiance`, per band.
        StandardError: "stderr" ["R", "G", "B"] "W/sr/m^2", StderrLayer, CAMLUX_LAYER_STDERR = 10;
        /// Energy that the pixel receives.
        ///
        /// Q_C = E_C · SensorPixelArea · SignalDutyCycle · ExposureTime.
        Energy: "energy" ["R", "G", "B"] "J", Sensor, CAMLUX_LAYER_ENERGY = 3;
        /// Electrons that the pixel counts in each band, noise included.
        Electrons: "electrons" ["R", "G", "B"] "e-", BandElectrons, CAMLUX_LAYER_ELECTRONS = 16;
        /// Digital number of these electrons.
        DigitalNumber: "dn" ["R", "G", "B"] "DN", BandElectrons, CAMLUX_LAYER_DN = 17;
        /// Electrons that the pixel counts through its colour filter, or of all bands; noise included.
        RawElectrons: "raw_electrons" ["Y"] "e-", RawElectrons, CAMLUX_LAYER_RAW_ELECTRONS = 18;
        /// Digital number of these electrons: the raw image.
        RawDigitalNumber: "raw_dn" ["Y"] "DN", RawNoise, CAMLUX_LAYER_RAW_DN = 19;
        /// Surface point in the world, rounded to f32: far from the origin it is coarse, and camlux warns.
        ///
        /// P; at 10⁵ m from the origin it has steps of 8 mm. [`Layer::CameraPosition`], `depth` and `range` keep their precision there.
        Position: "P" ["X", "Y", "Z"] "m", Nothing, CAMLUX_LAYER_POSITION = 4;
        /// Surface point in the camera's axes, from its centre: x right, y down, z forward.
        /// Exact to 1e-6 of the scene wherever it is; `cameraToWorld` of a file's header takes it to the world.
        CameraPosition: "P_camera" ["X", "Y", "Z"] "m", Nothing, CAMLUX_LAYER_CAMERA_POSITION = 14;
        /// Normal of the surface in the world, of unit length, on the camera's side.
        Normal: "N" ["X", "Y", "Z"] "1", Nothing, CAMLUX_LAYER_NORMAL = 5;
        /// The same normal in the camera's axes: x right, y down, z forward.
        CameraNormal: "N_camera" ["X", "Y", "Z"] "1", Nothing on_request, CAMLUX_LAYER_CAMERA_NORMAL = 20;
        /// Diffuse reflectance of the surface: k_d with its textures and colours of vertices. Of metallic-roughness it is
        /// what scatters below the surface, so a metal has 0.
        Albedo: "albedo" ["R", "G", "B"] "1", Nothing on_request, CAMLUX_LAYER_ALBEDO = 21;
        /// Distance along the viewing axis, +infinity without a surface; below 0 where a fisheye sees behind the camera.
        Depth: "depth" ["Z"] "m", Nothing, CAMLUX_LAYER_DEPTH = 6;
        /// Distance along the ray, from where it starts: the camera's centre, or its plane if rays are parallel; +infinity without a surface.
        Range: "range" ["Z"] "m", Nothing, CAMLUX_LAYER_RANGE = 7;
        /// Mean depth of the pixel's samples that show a surface.
        MeanDepth: "depth_mean" ["Z"] "m", Samples, CAMLUX_LAYER_DEPTH_MEAN = 12;
        /// Smallest depth of the pixel's samples.
        NearestDepth: "depth_nearest" ["Z"] "m", Samples, CAMLUX_LAYER_DEPTH_NEAREST = 13;
        /// 0: no surface; otherwise 1 + the index of the instance.
        ///
        /// That is its index in [`Scene::meshes`](crate::Scene::meshes).
        InstanceId: "id.instance" [] "1", Nothing, CAMLUX_LAYER_INSTANCE_ID = 8;
        /// 0: no surface; otherwise 1 + the index of the material.
        ///
        /// That is its index in [`Scene::materials`](crate::Scene::materials).
        MaterialId: "id.material" [] "1", Nothing, CAMLUX_LAYER_MATERIAL_ID = 9;
        /// 0: no surface; otherwise 1 + the index of the triangle in its mesh, in the order of the mesh's file or of its maker.
        /// A polygon of a file becomes successive triangles.
        ///
        /// That is its index in [`Mesh::triangles`](crate::scene::Mesh::triangles).
        TriangleId: "id.triangle" [] "1", Nothing on_request, CAMLUX_LAYER_TRIANGLE_ID = 22;
        /// Texture coordinates of the surface, of the mesh's first set: v = 0 is the bottom of a texture. 0 where the mesh has none.
        ///
        /// They are interpolated as they are, without a texture's own transform and without repeating.
        Texcoord: "uv" ["U", "V"] "1", Nothing on_request, CAMLUX_LAYER_TEXCOORD = 23;
        /// 1 where rounding decides which of two surfaces the pixel shows, otherwise 0.
        ///
        /// The pixel's centre is then within 1/128 pixel of an edge. [`Comparison`](crate::metrics::Comparison) can exclude these pixels.
        Edge: "edge" [] "1", Reference;
        /// Half the length of the shortest path from a modulated light via the surface to the camera; +infinity without a surface.
        /// Equal to `range` if the light is at the camera.
        HalfPath: "half_path" ["Z"] "m", Tof, CAMLUX_LAYER_HALF_PATH = 11;
        /// Movement in the image of the point that the pixel shows, from this frame to the next (right, down), through the next frame's
        /// lens.
        ///
        /// NaN for the background, where the next frame's lens does not see the point, and without a next frame.
        Flow: "flow" ["X", "Y"] "px", Sequence;
        /// Movement of that point in the world.
        ///
        /// NaN for the background and without a next frame.
        SceneFlow: "scene_flow" ["X", "Y", "Z"] "m", Sequence;
        /// 1 where the next frame does not show the point that the pixel shows: another surface hides it, it is outside the image, or there is
        /// no next frame.
        ///
        /// 0 in the background.
        FlowOcclusion: "flow_occlusion" [] "1", Sequence on_request;
        /// As `flow`, to the previous frame.
        BackwardFlow: "flow_backward" ["X", "Y"] "px", Sequence on_request;
        /// As `scene_flow`, to the previous frame.
        BackwardSceneFlow: "scene_flow_backward" ["X", "Y", "Z"] "m", Sequence on_request;
        /// As `flow_occlusion`, in the previous frame.
        BackwardFlowOcclusion: "flow_occlusion_backward" [] "1", Sequence on_request;
    }
    /// A time-of-flight quantity of a frequency, given by its index in
    /// [`TimeOfFlight::frequencies_hz`](crate::scene::TimeOfFlight::frequencies_hz).
    + Tof(u8, TofQuantity): Layer::Tof(_, quantity) => quantity.row();
}

layers! {
    /// A quantity of one frequency. Pixels without light hold 0, but NaN in `range` and `mpi`. Charges are electrons, or digital numbers
    /// if the scene requests them ([`Layer::unit_by`]).
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
    pub enum TofQuantity {
        /// Phasor Z of all modulated light, a sum over paths.
        Phasor: "phasor" ["re", "im"] "W/sr/m^2", Nothing, CAMLUX_LAYER_TOF_PHASOR = 64;
        /// Z of the direct light.
        PhasorDirect: "phasor_direct" ["re", "im"] "W/sr/m^2", Nothing, CAMLUX_LAYER_TOF_PHASOR_DIRECT = 65;
        /// Z of the indirect light.
        PhasorIndirect: "phasor_indirect" ["re", "im"] "W/sr/m^2", Indirect, CAMLUX_LAYER_TOF_PHASOR_INDIRECT = 66;
        /// Z of the light of one number of bounces alone, as `indirect.1` and so on have its radiance.
        PhasorBounce(NonZeroU8): "phasor_indirect." ["re", "im"] "W/sr/m^2", MoreBounces on_request, CAMLUX_LAYER_TOF_PHASOR_BOUNCE = 192;
        /// Standard error of Z of the indirect light.
        PhasorStandardError: "phasor_stderr" ["re", "im"] "W/sr/m^2", Reference;
        /// Half the path length computed from the phase images, noise included, from 0 to c/(2f); NaN where they give no range.
        /// With noise, pixels without light have the range of their noise: mask the background with `id.instance`.
        Range: "range" ["Z"] "m", Nothing, CAMLUX_LAYER_TOF_RANGE = 67;
        /// Point cloud: `range` along the ray of the pixel, in the camera's axes, from its centre: x right, y down, z forward.
        /// NaN where `range` is NaN. Only where the light is at the camera is the surface there.
        Point: "point" ["X", "Y", "Z"] "m", Nothing on_request, CAMLUX_LAYER_TOF_POINT = 128;
        /// K|Q_Z|, the contrast times the energy of Z, computed from the phase images as they are read out.
        Amplitude: "amplitude" ["Y"] "e-", Nothing, CAMLUX_LAYER_TOF_AMPLITUDE = 68;
        /// Sum of both taps over all phase images as they are read out, above their black level.
        Intensity: "intensity" ["Y"] "e-", Nothing, CAMLUX_LAYER_TOF_INTENSITY = 69;
        /// Multipath error, from -c/(4f) to c/(4f): how much farther away the pixel appears than by its direct light alone.
        /// Without noise, like the phasors; NaN where the phasor of all or of the direct light is 0.
        MultipathError: "mpi" ["Z"] "m", Indirect, CAMLUX_LAYER_TOF_MPI = 70;
        /// How often the phase of `half_path` has wrapped.
        Wraps: "wraps" [] "1", Nothing, CAMLUX_LAYER_TOF_WRAPS = 71;
        /// Charges of both taps in the phase image, as they are read out.
        Taps(u8): "phase" ["A", "B"] "e-", Nothing, CAMLUX_LAYER_TOF_TAPS = 72;
    }
}
