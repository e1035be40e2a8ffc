"""Parts of camlux's model that Mitsuba lacks: the BRDF and the falloff of the spot light.

They are traced into the same kernels as Mitsuba's own plugins. Import this after the variant is set."""

import drjit as dr
import mitsuba as mi


class ModifiedPhong(mi.BSDF):
    """Two-sided f = k_d/π + k_s·(s+2)/(2π)·max(0, r·v)^s (Lafortune & Willems 1994).

    It is sampled by a mixture of the cosine lobe and of (s+1)/(2π)·cos^s about the mirror direction, in the ratio of k_d
    to k_s.
    """

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.kd = props["kd"]
        self.ks = props["ks"]
        self.shininess = mi.Float(props["shininess"])
        both = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [mi.BSDFFlags.DiffuseReflection | both, mi.BSDFFlags.GlossyReflection | both]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def traverse(self, callback):
        callback.put("kd", self.kd, mi.ParamFlags.Differentiable)
        callback.put("ks", self.ks, mi.ParamFlags.Differentiable)
        callback.put("shininess", self.shininess, mi.ParamFlags.Differentiable)

    def _at(self, si, active):
        """k_d, k_s, probability of the lobe, and wi on the upper side."""
        kd, ks = self.kd.eval(si, active), self.ks.eval(si, active)
        diffuse, specular = dr.mean(kd), dr.mean(ks)
        wi = mi.Vector3f(si.wi.x, si.wi.y, dr.abs(si.wi.z))
        return kd, ks, specular / dr.maximum(diffuse + specular, 1e-20), wi

    def _lobe(self, wi, wo):
        """max(0, r·v)^s."""
        cosine = dr.dot(mi.Vector3f(-wi.x, -wi.y, wi.z), wo)
        return dr.select(cosine > 0, dr.power(dr.maximum(cosine, 1e-20), self.shininess), 0)

    def _value_and_pdf(self, kd, ks, lobe_probability, wi, wo):
        lobe = self._lobe(wi, wo) * dr.inv_two_pi
        cosine = dr.maximum(wo.z, 0)
        value = (kd * dr.inv_pi + ks * ((self.shininess + 2) * lobe)) * cosine
        pdf = dr.lerp(cosine * dr.inv_pi, (self.shininess + 1) * lobe, lobe_probability)
        return value, pdf

    def _upright(self, si, wo):
        return mi.Vector3f(wo.x, wo.y, dr.mulsign(wo.z, si.wi.z))

    def sample(self, ctx, si, sample1, sample2, active=True):
        kd, ks, lobe_probability, wi = self._at(si, active)
        is_lobe = sample1 < lobe_probability
        cosine = dr.power(dr.maximum(1 - sample2.x, 1e-20), 1 / (self.shininess + 1))
        sine = dr.safe_sqrt(1 - cosine * cosine)
        sine_phi, cosine_phi = dr.sincos(dr.two_pi * sample2.y)
        about_mirror = mi.Frame3f(mi.Vector3f(-wi.x, -wi.y, wi.z)).to_world(
            mi.Vector3f(sine * cosine_phi, sine * sine_phi, cosine)
        )
        wo = dr.select(is_lobe, about_mirror, mi.warp.square_to_cosine_hemisphere(sample2))
        value, pdf = self._value_and_pdf(kd, ks, lobe_probability, wi, wo)
        active &= (wi.z > 0) & (wo.z > 0) & (pdf > 0)

        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = self._upright(si, wo)
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
        kd, ks, lobe_probability, wi = self._at(si, active)
        wo = self._upright(si, wo)
        value, pdf = self._value_and_pdf(kd, ks, lobe_probability, wi, wo)
        active &= (wi.z > 0) & (wo.z > 0)
        return dr.select(active, value, 0), dr.select(active, pdf, 0)

    def eval_diffuse_reflectance(self, si, active=True):
        return self.kd.eval(si, active)

    def to_string(self):
        return "ModifiedPhong[]"


class CosineSpot(mi.Emitter):
    """I_0·cos(½π·(θ−θ_i)/(θ_o−θ_i)) between inner and outer half angle; Mitsuba's `spot` falls linearly in θ."""

    def __init__(self, props):
        mi.Emitter.__init__(self, props)
        self.position = mi.Point3f(props["position"])
        self.axis = mi.Vector3f(props["direction"])
        self.intensity = mi.Color3f(props["intensity"])
        self.inner_rad = mi.Float(props["inner_rad"])
        self.outer_rad = mi.Float(props["outer_rad"])
        self.m_flags = +mi.EmitterFlags.DeltaPosition

    def traverse(self, callback):
        callback.put("position", self.position, mi.ParamFlags.NonDifferentiable)
        callback.put("axis", self.axis, mi.ParamFlags.NonDifferentiable)
        callback.put("intensity", self.intensity, mi.ParamFlags.NonDifferentiable)
        callback.put("inner_rad", self.inner_rad, mi.ParamFlags.NonDifferentiable)
        callback.put("outer_rad", self.outer_rad, mi.ParamFlags.NonDifferentiable)

    def sample_direction(self, it, sample, active=True):
        ds = dr.zeros(mi.DirectionSample3f)
        ds.p = self.position
        ds.time = it.time
        ds.delta = mi.Bool(True)
        ds.pdf = 1.0
        ds.emitter = mi.EmitterPtr(self)
        offset = self.position - it.p
        ds.dist = dr.norm(offset)
        ds.d = offset / ds.dist
        # The arctangent, because the arccosine loses half the digits of a small angle.
        theta = dr.atan2(dr.norm(dr.cross(self.axis, -ds.d)), dr.dot(self.axis, -ds.d))
        ramp = (theta - self.inner_rad) / dr.maximum(self.outer_rad - self.inner_rad, 1e-9)
        falloff = dr.select(theta < self.outer_rad, dr.cos(0.5 * dr.pi * dr.clip(ramp, 0, 1)), 0)
        return ds, self.intensity * (falloff / dr.square(ds.dist)) & active

    def pdf_direction(self, it, ds, active=True):
        return mi.Float(0)

    def eval_direction(self, it, ds, active=True):
        return mi.Color3f(0)

    def eval(self, si, active=True):
        return mi.Color3f(0)

    def bbox(self):
        return mi.ScalarBoundingBox3f()

    def to_string(self):
        return "CosineSpot[]"


mi.register_bsdf("modified_phong", ModifiedPhong)
mi.register_emitter("cosine_spot", CosineSpot)
