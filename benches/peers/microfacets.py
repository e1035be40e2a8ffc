"""camlux's metallic-roughness BRDF, written from the formulas of docs/model.md, "Microfacets". Import this after the variant is set."""

import drjit as dr
import mitsuba as mi

from material import SMOOTHEST


class MetallicRoughness(mi.BSDF):
    """Two-sided f = k_d/π + D·V·F.

    It is sampled by a mixture of the cosine lobe and of mirrors at visible normals (Dupuy & Benyoub 2023, "Sampling visible GGX normals with
    spherical caps").
    """

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.base_color = props["base_color"]
        self.roughness = mi.Float(props["roughness"])
        self.metallic = mi.Float(props["metallic"])
        self.dielectric = mi.Float(props["dielectric"])
        self.factors = props["factors"] if props.has_property("factors") else None
        both = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [mi.BSDFFlags.DiffuseReflection | both, mi.BSDFFlags.GlossyReflection | both]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def traverse(self, callback):
        for name in ("base_color", "roughness", "metallic", "dielectric"):
            callback.put(name, getattr(self, name), mi.ParamFlags.Differentiable)
        if self.factors is not None:
            callback.put("factors", self.factors, mi.ParamFlags.Differentiable)

    def _surface(self, si, active):
        """k_d, F_0, α."""
        base, roughness, metallic = self.base_color.eval(si, active), self.roughness, self.metallic
        if self.factors is not None:
            factors = self.factors.eval(si, active)
            roughness, metallic = roughness * factors.y, metallic * factors.z
        kd = base * ((1 - metallic) * (1 - self.dielectric))
        f0 = self.dielectric + metallic * (base - self.dielectric)
        return kd, f0, dr.square(dr.clip(roughness, SMOOTHEST, 1))

    def _value_and_pdf(self, surface, wi, wo):
        kd, f0, alpha = surface
        squared = dr.square(alpha)
        h = dr.normalize(wi + wo)
        # 1 − (n·h)² is h.x² + h.y², which does not cancel.
        d = squared * dr.inv_pi / dr.square(squared * dr.square(h.z) + dr.square(h.x) + dr.square(h.y))
        root_i, root_o = (dr.sqrt(squared + (1 - squared) * dr.square(w.z)) for w in (wi, wo))
        v = 0.5 / dr.maximum(wo.z * root_i + wi.z * root_o, 1e-20)
        value = (kd * dr.inv_pi + d * v * fresnel(f0, dr.dot(h, wi))) * wo.z
        # Smith's G_1·D/(4·n·wi).
        pdf_facets = 0.5 * d / (wi.z + root_i)
        return value, dr.lerp(wo.z * dr.inv_pi, pdf_facets, lobe_probability(kd, f0, wi))

    def sample(self, ctx, si, sample1, sample2, active=True):
        surface = self._surface(si, active)
        kd, f0, alpha = surface
        wi = mi.Vector3f(si.wi.x, si.wi.y, dr.abs(si.wi.z))
        is_lobe = sample1 < lobe_probability(kd, f0, wi)
        h = visible_normal(alpha, wi, sample2)
        wo = dr.select(is_lobe, 2 * dr.dot(wi, h) * h - wi, mi.warp.square_to_cosine_hemisphere(sample2))
        value, pdf = self._value_and_pdf(surface, wi, wo)
        active &= (wi.z > 0) & (wo.z > 0) & (pdf > 0)

        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = upright(si, wo)
        bs.pdf = dr.select(active, pdf, 0)
        bs.eta = 1.0
        bs.sampled_component = dr.select(is_lobe, mi.UInt32(1), mi.UInt32(0))
        bs.sampled_type = dr.select(
            is_lobe, mi.UInt32(+mi.BSDFFlags.GlossyReflection), mi.UInt32(+mi.BSDFFlags.DiffuseReflection)
        )
        return bs, dr.select(active, value / pdf, 0)

    def eval(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[1]

    def eval_pdf(self, ctx, si, wo, active=True):
        wi = mi.Vector3f(si.wi.x, si.wi.y, dr.abs(si.wi.z))
        wo = upright(si, wo)
        value, pdf = self._value_and_pdf(self._surface(si, active), wi, wo)
        active &= (wi.z > 0) & (wo.z > 0)
        return dr.select(active, value, 0), dr.select(active, pdf, 0)

    def eval_diffuse_reflectance(self, si, active=True):
        return self._surface(si, active)[0]

    def to_string(self):
        return "MetallicRoughness[]"


def upright(si, wo):
    return mi.Vector3f(wo.x, wo.y, dr.mulsign(wo.z, si.wi.z))


def fresnel(f0, cosine):
    f90 = dr.minimum(50 * dr.max(f0), 1)
    return f0 + (f90 - f0) * dr.power(dr.clip(1 - cosine, 0, 1), 5)


def lobe_probability(kd, f0, wi):
    specular = dr.mean(fresnel(f0, wi.z))
    return specular / dr.maximum(specular + dr.mean(kd), 1e-20)


def visible_normal(alpha, wi, sample):
    stretched = dr.normalize(mi.Vector3f(alpha * wi.x, alpha * wi.y, wi.z))
    z = dr.fma(1 - sample.y, 1 + stretched.z, -stretched.z)
    sine = dr.safe_sqrt(1 - z * z)
    sine_phi, cosine_phi = dr.sincos(dr.two_pi * sample.x)
    h = stretched + mi.Vector3f(sine * cosine_phi, sine * sine_phi, z)
    return dr.normalize(mi.Vector3f(alpha * h.x, alpha * h.y, dr.maximum(h.z, 1e-20)))


mi.register_bsdf("metallic_roughness", MetallicRoughness)
