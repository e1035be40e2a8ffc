/* Part of camlux.hpp: textures and materials. */

#ifndef CAMLUX_MATERIAL_HPP
#define CAMLUX_MATERIAL_HPP

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "values.hpp"

namespace camlux {

enum class component : std::int32_t { u8 = CAMLUX_COMPONENT_U8, u16 = CAMLUX_COMPONENT_U16, f32 = CAMLUX_COMPONENT_F32 };

enum class encoding : std::int32_t {
    standard = CAMLUX_ENCODING_DEFAULT,
    linear = CAMLUX_ENCODING_LINEAR,
    srgb = CAMLUX_ENCODING_SRGB,
};

/** The members of camlux_material for metallic-roughness surfaces, as in glTF 2.0. */
struct metallic_roughness {
    /** 0.03 to 1. */
    double roughness = 1;
    double metallic = 0;
    double ior = 1.5;
    double specular = 1;
};

/** camlux_material. */
struct material {
    rgb kd = {};
    rgb ks = {};
    /** Below 0: not given, which is an error if ks is above 0. */
    double shininess = -1;
    /** Numbers of textures, from scene::add_texture; 0: none. */
    std::uint32_t kd_texture = 0;
    std::string name = {};
    std::uint32_t normal_texture = 0;
    std::uint32_t alpha_texture = 0;
    std::uint32_t ks_texture = 0;
    std::uint32_t shininess_texture = 0;
    double alpha_cutoff = 0.5;
    /** Of a metallic-roughness surface, whose base colour is kd. */
    std::optional<metallic_roughness> microfacets = std::nullopt;
    std::uint32_t metallic_roughness_texture = 0;
    rgb emission_w_sr_m2 = {};
    std::uint32_t emission_texture = 0;
    bool one_sided = false;
};

/** camlux_texture. The pixels are read only during scene::add_texture or scene::set_texture. */
struct texture {
    std::uint32_t width_px = 0, height_px = 0;
    camlux::component component = camlux::component::u8;
    std::uint32_t channels = 3;
    camlux::encoding encoding = camlux::encoding::standard;
    const void *pixels = nullptr;
    std::size_t row_stride_bytes = 0;
    std::string name = {};
};

namespace detail {

inline camlux_material raw_of(const material &from) noexcept
{
    camlux_material to = CAMLUX_MATERIAL_INIT;
    to.kd_texture = from.kd_texture;
    to.normal_texture = from.normal_texture;
    to.alpha_texture = from.alpha_texture;
    to.ks_texture = from.ks_texture;
    to.shininess_texture = from.shininess_texture;
    to.alpha_cutoff = from.alpha_cutoff;
    set(to.kd, from.kd);
    set(to.ks, from.ks);
    to.shininess = from.shininess;
    to.metallic_roughness_texture = from.metallic_roughness_texture;
    set(to.emission_w_sr_m2, from.emission_w_sr_m2);
    to.emission_texture = from.emission_texture;
    to.one_sided = from.one_sided ? 1 : 0;
    if (from.microfacets) {
        to.roughness = from.microfacets->roughness;
        to.metallic = from.microfacets->metallic;
        to.ior = from.microfacets->ior;
        to.specular = from.microfacets->specular;
    }
    to.name = name_of(from.name);
    return to;
}

inline camlux_texture raw_of(const texture &from) noexcept
{
    camlux_texture to = CAMLUX_TEXTURE_INIT;
    to.width_px = from.width_px;
    to.height_px = from.height_px;
    to.component = number(from.component);
    to.channels = from.channels;
    to.encoding = number(from.encoding);
    to.pixels = from.pixels;
    to.row_stride_bytes = from.row_stride_bytes;
    to.name = name_of(from.name);
    return to;
}

inline material material_of(const camlux_material &from)
{
    material to;
    to.kd = rgb_of(from.kd);
    to.ks = rgb_of(from.ks);
    to.shininess = from.shininess;
    to.kd_texture = from.kd_texture;
    to.normal_texture = from.normal_texture;
    to.alpha_texture = from.alpha_texture;
    to.ks_texture = from.ks_texture;
    to.shininess_texture = from.shininess_texture;
    to.alpha_cutoff = from.alpha_cutoff;
    to.metallic_roughness_texture = from.metallic_roughness_texture;
    to.emission_w_sr_m2 = rgb_of(from.emission_w_sr_m2);
    to.emission_texture = from.emission_texture;
    to.one_sided = from.one_sided != 0;
    if (from.roughness != 0)
        to.microfacets = metallic_roughness{from.roughness, from.metallic, from.ior, from.specular};
    return to;
}

}  // namespace detail

}  // namespace camlux

#endif  /* CAMLUX_MATERIAL_HPP */
