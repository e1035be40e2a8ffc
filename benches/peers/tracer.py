"""A scene in Mitsuba, and its images through pixel centres. Import this after the variant is set."""

import math

import drjit as dr
import mitsuba as mi
import numpy as np

import microfacets  # noqa: F401 (registers)
import plugins  # noqa: F401 (registers)
from material import Facets, Image, Material
from scene import Light, Mesh, Scene


# The depth from which Mitsuba's `path` ends paths by chance (Russian roulette), and its least chance to end one.
ROULETTE_DEPTH = 5
MOST_SURVIVAL = 0.95


class Tracer:
    """Renders a scene. Images are unevaluated Dr.Jit arrays of 3 bands by pixels, row by row from the top."""

    def __init__(self, scene: Scene, bsdf_of=None):
        """`bsdf_of` gives Mitsuba's BSDF of a material. Without it, it is camlux's."""
        self.pixel_count = scene.size_px[0] * scene.size_px[1]
        self.tof = scene.tof
        self.bounces = scene.bounces
        self.origin = mi.Point3f(scene.camera_position)
        self.directions = floats(scene.ray_directions)
        bsdfs = {name: mi.load_dict((bsdf_of or bsdf)(material)) for name, material in scene.materials.items()}
        parts = {"type": "scene"}
        for number, light in enumerate(scene.lights):
            parts[f"light_{number}"] = emitter(light)
        for number, mesh in enumerate(scene.meshes):
            parts[f"mesh_{number}"] = shape(mesh, bsdfs[mesh.material])
        self.scene = mi.load_dict(parts)

    def max_depth(self) -> int:
        """Segments of the longest path, for Mitsuba's plugins."""
        return self.bounces + 2

    def primary_rays(self):
        pixel = dr.arange(mi.UInt32, self.pixel_count)
        return mi.RayDifferential3f(self.origin, dr.gather(mi.Vector3f, self.directions, pixel))

    def primary_hits(self):
        return self.scene.ray_intersect(self.primary_rays(), mi.RayFlags.All, coherent=True)

    def sees_emitter(self):
        """Whether a pixel shows a light that has an area."""
        return self.primary_hits().emitter(self.scene) != None  # noqa: E711 (Dr.Jit compares)

    def direct(self):
        """Direct light, and Z of each modulation frequency. Both are exact if no light has an area."""
        return self._direct_at(self.primary_hits())

    def direct_and_features(self):
        """Direct light, and the guides of the denoiser: albedo, and the normal on the camera's side."""
        si = self.primary_hits()
        albedo = si.bsdf().eval_diffuse_reflectance(si, si.is_valid())
        normal = dr.select(si.is_valid(), si.sh_frame.n * dr.sign(si.wi.z), 0)
        return self._direct_at(si)[0], albedo & si.is_valid(), normal

    def _direct_at(self, si):
        context = mi.BSDFContext()
        radiance = mi.Color3f(0)
        phasors = self.no_phasors()
        for light in self.scene.emitters():
            ds, irradiance = light.sample_direction(si, mi.Point2f(0), si.is_valid())
            active = si.is_valid() & (ds.pdf > 0)
            active &= ~self.scene.ray_test(si.spawn_ray_to(ds.p), active)
            value = si.bsdf().eval(context, si, si.to_local(ds.d), active) * irradiance & active
            radiance += value
            phasors = self.added(phasors, value, dr.select(active, si.t + ds.dist, 0))
        return radiance, phasors

    def no_phasors(self) -> list:
        """A zero phasor for each modulation frequency; an empty list without time of flight."""
        return [mi.Complex2f(0) for _ in self.tof.turns_per_unit] if self.tof else []

    def added(self, phasors: list, radiance, length) -> list:
        """The phasors plus the radiance of a path of this length."""
        turns = self.tof.turns_per_unit if self.tof else []
        return [z + self.seen(radiance) * unit_phasor(turns[index], length) for index, z in enumerate(phasors)]

    def seen(self, radiance):
        """The radiance weighted by the pixels' sensitivity to each band."""
        return dr.dot(radiance, mi.Color3f(self.tof.band_weights))

    def by_transient_path(self, samples: int, seed: int):
        """Direct and indirect light, and Z of each modulation frequency, by mitransient's plugin `transient_path`. All samples are
        traced at once and added up as in its `phasor_hdr_film`."""
        path = mi.load_dict({"type": "transient_path", "max_depth": self.max_depth()})
        lane_count = self.pixel_count * samples
        pixel = dr.arange(mi.UInt32, lane_count) // dr.opaque(mi.UInt32, samples)
        ray = mi.RayDifferential3f(self.origin, dr.gather(mi.Vector3f, self.directions, pixel))
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(seed, lane_count)
        radiance = [dr.zeros(mi.Float, self.pixel_count) for _ in range(3)]
        phasors = [[dr.zeros(mi.Float, self.pixel_count) for _ in range(2)] for _ in self.tof.turns_per_unit]

        def add_transient(spec, distance, _wavelengths, active):
            for band, value in zip(radiance, mi.Color3f(spec)):
                dr.scatter_add(band, value, pixel, active)
            seen = self.seen(mi.Color3f(spec))
            for parts, turns in zip(phasors, self.tof.turns_per_unit):
                z = seen * unit_phasor(turns, distance)
                finite = active & dr.isfinite(distance)
                dr.scatter_add(parts[0], dr.real(z), pixel, finite)
                dr.scatter_add(parts[1], dr.imag(z), pixel, finite)

        path.sample(dr.ADMode.Primal, self.scene, sampler, ray, mi.Spectrum(1), None, None, mi.Bool(True), add_transient)
        share = dr.opaque(mi.Float, 1 / samples)
        means = [[part * share for part in parts] for parts in phasors]
        return mi.Color3f(*radiance) * share, [mi.Complex2f(re, im) for re, im in means]

    @dr.syntax
    def indirect(self, pattern: "Pattern", iterations: int):
        """The light of all bounces, and Z of each modulation frequency, as the mean of the first `iterations` samples of the pattern.

        It is what `path` estimates, minus the direct light. Z uses the path length of each sample. `iterations` is not compiled
        into the kernel."""
        si = self.primary_hits()
        bsdf_at_pixel = si.bsdf()
        # A local variable, so that Dr.Jit carries its state from one sample to the next.
        jitter = pattern.jitter
        radiance = mi.Color3f(0)
        phasors = self.no_phasors()
        index = mi.UInt32(0)
        count = dr.opaque(mi.UInt32, iterations)
        while index < count:
            radiance, phasors = self._with_path(radiance, phasors, si, bsdf_at_pixel, pattern, index, jitter)
            index += 1
        return radiance / mi.Float(count), [z / mi.Float(count) for z in phasors]

    def _with_path(self, radiance, phasors: list, si, bsdf_at_pixel, pattern: "Pattern", index, jitter):
        """Radiance and phasors plus those of a path from the pixel, which reflects a lamp's light at each hit."""
        context = mi.BSDFContext()
        at, bsdf_at, throughput, length = si, bsdf_at_pixel, mi.Color3f(1), si.t
        active = si.is_valid()
        for bounce in range(self.bounces):
            first = 3 * bounce
            bs, weight = bsdf_at.sample(
                context, at, pattern.point_1d(index, first, jitter), pattern.point_2d(index, first + 1, jitter), active
            )
            throughput = throughput * weight
            active &= dr.max(throughput) > 0
            if bounce + 1 >= ROULETTE_DEPTH:
                survival = dr.minimum(dr.max(throughput), MOST_SURVIVAL)
                active &= jitter.next_1d() < survival
                throughput = dr.select(active, throughput / survival, 0)
            lit = self.scene.ray_intersect(at.spawn_ray(at.to_world(bs.wo)), active)
            active = lit.is_valid()
            ds, irradiance = self.scene.sample_emitter_direction(
                lit, pattern.point_2d(index, first + 2, jitter), True, active
            )
            bsdf_at = lit.bsdf()
            value = bsdf_at.eval(context, lit, lit.to_local(ds.d), active & (ds.pdf > 0))
            sample = throughput * value * irradiance
            length = length + lit.t
            radiance += sample
            phasors = self.added(phasors, sample, dr.select(active, length + ds.dist, 0))
            at = lit
        return radiance, phasors

    @dr.syntax
    def by_path_plugin(self, samples: int, seed: int):
        """Direct and indirect light by the unmodified plugin `path`, with independent samples."""
        path = mi.load_dict({"type": "path", "max_depth": self.max_depth()})
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(seed, self.pixel_count)
        radiance = mi.Color3f(0)
        index = mi.UInt32(0)
        count = dr.opaque(mi.UInt32, samples)
        while index < count:
            radiance += path.sample(self.scene, sampler, self.primary_rays())[0]
            index += 1
        return radiance / mi.Float(count)


class Pattern:
    """Correlated multi-jittered points (Kensler 2013) as in Mitsuba's sampler `multijitter`, `samples` per pixel.

    That plugin cannot run inside a loop of a kernel, because Dr.Jit does not see its sample index."""

    def __init__(self, samples: int, pixel_count: int, seed: int):
        rows = next(n for n in range(math.isqrt(samples), 0, -1) if samples % n == 0)
        self.samples, self.rows, self.columns = samples, rows, samples // rows
        pixel = dr.arange(mi.UInt32, pixel_count)
        self.permutation = mi.sample_tea_32(pixel, dr.opaque(mi.UInt32, seed))[0]
        self.jitter = mi.load_dict({"type": "independent"})
        self.jitter.seed(seed, pixel_count)

    def point_1d(self, index, dimension: int, jitter):
        stratum = mi.permute_kensler(index, self.samples, (self.permutation + dimension) * 0x45FBE943)
        return (mi.Float(stratum) + jitter.next_1d()) / self.samples

    def point_2d(self, index, dimension: int, jitter):
        seed = self.permutation + dimension
        cell = mi.permute_kensler(index, self.samples, seed * 0x51633E2D)
        y = cell // self.columns
        x = cell - y * self.columns
        finer_x = mi.Float(mi.permute_kensler(y, self.rows, seed * 0x02E5BE93))
        finer_y = mi.Float(mi.permute_kensler(x, self.columns, seed * 0x68BC21EB))
        offset = jitter.next_2d()
        return mi.Point2f(
            (mi.Float(x) + (finer_x + offset.x) / self.rows) / self.columns,
            (mi.Float(y) + (finer_y + offset.y) / self.columns) / self.rows,
        )


def unit_phasor(turns_per_unit: float, length):
    turns = length * turns_per_unit
    sine, cosine = dr.sincos(2 * math.pi * (turns - dr.floor(turns)))
    return mi.Complex2f(cosine, sine)


def bsdf(material: Material) -> dict:
    kd = srgb(material.kd) if material.kd_texture is None else colour_texture(material)
    if material.facets is not None:
        properties = metallic_roughness(material.facets, kd)
        if material.normal_texture is None:
            return properties
        # Mitsuba's own shadows of facets on mapped normals are not part of camlux's model.
        own = {"use_shadowing_function": False, "flip_invalid_normals": False}
        return {"type": "normalmap", "normalmap": texture(encoded(material.normal_texture)), "bsdf": properties, **own}
    if any(material.ks):
        return {"type": "modified_phong", "kd": kd, "ks": srgb(material.ks), "shininess": material.shininess}
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": kd}}


def srgb(reflectance: list[float]) -> dict:
    return {"type": "srgb", "color": mi.ScalarColor3f(reflectance)}


def metallic_roughness(facets: Facets, base_color: dict) -> dict:
    numbers = {"roughness": facets.roughness, "metallic": facets.metallic, "dielectric": facets.dielectric}
    factors = {} if facets.texture is None else {"factors": texture(encoded(facets.texture))}
    return {"type": "metallic_roughness", "base_color": base_color, **numbers, **factors}


def colour_texture(material: Material) -> dict:
    values = encoded(material.kd_texture)
    # The sRGB transfer function, IEC 61966-2-1.
    linear = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    return texture(linear * material.kd)


def encoded(image: Image) -> np.ndarray:
    """The values of the file, 0 to 1."""
    if isinstance(image, bytes):
        stream = mi.MemoryStream()
        stream.write(image)
        stream.seek(0)
        bitmap = mi.Bitmap(stream)
    else:
        bitmap = mi.Bitmap(str(image))
    pixels = np.array(bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt16, bitmap.srgb_gamma()))
    return pixels.astype(np.float64) / 65535.0


def texture(values: np.ndarray) -> dict:
    data = mi.TensorXf(values.astype(np.float32))
    return {"type": "bitmap", "data": data, "raw": True, "filter_type": "bilinear", "wrap_mode": "repeat"}


def emitter(light: Light) -> dict:
    emission = {"type": "rgb", "value": light.emission.tolist()}
    if light.kind == "point":
        return {"type": "point", "position": light.position.tolist(), "intensity": emission}
    if light.kind == "directional":
        return {"type": "directional", "direction": light.direction.tolist(), "irradiance": emission}
    if light.kind == "projector":
        return projector(light)
    if light.kind == "area":
        to_world = np.identity(4)
        to_world[:3, 0], to_world[:3, 1] = light.half_axes
        to_world[:3, 2], to_world[:3, 3] = light.direction, light.position
        return {
            "type": "disk" if light.is_disc else "rectangle",
            "to_world": mi.ScalarTransform4f(to_world),
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}},
            "emitter": {"type": "area", "radiance": emission},
        }
    return {
        "type": "cosine_spot",
        "position": mi.ScalarVector3f(light.position),
        "direction": mi.ScalarVector3f(light.direction),
        "intensity": mi.ScalarVector3f(light.emission),
        "inner_rad": light.inner_rad,
        "outer_rad": light.outer_rad,
    }


def projector(light: Light) -> dict:
    """Mitsuba's own projector. Its intensity is π·image/cos³θ. camlux's is image/cos³θ, scaled so that its integral is the power."""
    bitmap = mi.Bitmap(str(light.image)).convert(mi.Bitmap.PixelFormat.Y, mi.Struct.Type.Float32, False)
    grey = np.array(bitmap).reshape(bitmap.height(), bitmap.width())
    pixel = 2 * math.tan(math.radians(light.fov_y_deg) / 2) / bitmap.height()
    per_band = light.emission / (math.pi * grey.sum(dtype=np.float64) * pixel**2)
    values = (grey[..., None] * per_band).astype(np.float32)
    return {
        "type": "projector",
        "to_world": mi.ScalarTransform4f().look_at(
            light.position.tolist(), (light.position + light.direction).tolist(), light.up.tolist()
        ),
        "fov": light.fov_y_deg,
        "fov_axis": "y",
        "irradiance": {"type": "bitmap", "bitmap": mi.Bitmap(values), "filter_type": "nearest", "wrap_mode": "clamp", "raw": True},
    }


def shape(mesh: Mesh, material):
    properties = mi.Properties()
    properties["bsdf"] = material
    count = len(mesh.positions)
    built = mi.Mesh(
        mesh.material,
        count,
        count // 3,
        props=properties,
        has_vertex_normals=mesh.normals is not None,
        has_vertex_texcoords=mesh.texcoords is not None,
    )
    parameters = mi.traverse(built)
    parameters["vertex_positions"] = floats(mesh.positions)
    parameters["faces"] = dr.arange(mi.UInt32, count)
    if mesh.normals is not None:
        parameters["vertex_normals"] = floats(mesh.normals)
    if mesh.texcoords is not None:
        # Mitsuba's v runs downwards.
        parameters["vertex_texcoords"] = floats(mesh.texcoords * [1.0, -1.0] + [0.0, 1.0])
    parameters.update()
    return built


def floats(values: np.ndarray):
    return mi.Float(np.ascontiguousarray(values, dtype=np.float32).ravel())
