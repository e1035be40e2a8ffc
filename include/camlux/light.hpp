/* Part of camlux.hpp: lights. */

#ifndef CAMLUX_LIGHT_HPP
#define CAMLUX_LIGHT_HPP

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "camera.hpp"
#include "material.hpp"
#include "values.hpp"

namespace camlux {

enum class light_kind : std::int32_t {
    point = CAMLUX_LIGHT_POINT,
    spot = CAMLUX_LIGHT_SPOT,
    directional = CAMLUX_LIGHT_DIRECTIONAL,
    pattern = CAMLUX_LIGHT_PATTERN,
    projector = CAMLUX_LIGHT_PROJECTOR,
    area = CAMLUX_LIGHT_AREA,
};

/** camlux_pattern: a file, or angles and intensities. */
struct pattern {
    std::string path = {};
    camlux::encoding encoding = camlux::encoding::standard;
    std::vector<double> gammas_deg = {}, planes_deg = {};
    /** For each plane one value for each gamma. */
    std::vector<double> intensities = {};
};

/** camlux_projected_image: a file, or width_px * height_px values. If `lens` is set, fov_y_deg is ignored. */
struct projected_image {
    std::string path = {};
    camlux::encoding encoding = camlux::encoding::standard;
    std::uint32_t width_px = 0, height_px = 0;
    /** Row by row from the top. */
    std::vector<float> values = {};
    double fov_y_deg = 0;
    /** A pinhole: a projector has no distortion. */
    std::optional<intrinsics> lens = std::nullopt;
};

/** What position and directions of a light are relative to. */
enum class relative_to : std::int32_t {
    world = CAMLUX_RELATIVE_TO_WORLD,
    /** The camera's axes: x right, y down, z forward, from its centre. The light moves with the camera. */
    camera = CAMLUX_RELATIVE_TO_CAMERA,
};

/** camlux_light. The functions point, spot, directional, rectangle, disc, lamp and projector create complete lights. */
struct light {
    light_kind kind = light_kind::point;
    vec3 position_m = {};
    vec3 direction = {};
    rgb power_w = {};
    rgb irradiance_w_m2 = {};
    double inner_half_angle_deg = 0;
    double outer_half_angle_deg = 0;
    /** None for a disc. */
    vec3 up = {};
    double width_m = 0, height_m = 0;
    double radius_m = 0;
    /** Of a lamp; std::nullopt in scene::set_light: the pattern that the light has. Not set when read. */
    std::optional<camlux::pattern> pattern = std::nullopt;
    /** Of a projector, likewise. */
    std::optional<projected_image> image = std::nullopt;
    camlux::relative_to relative_to = camlux::relative_to::world;

    static light point(vec3 position_m, rgb power_w)
    {
        light made;
        made.position_m = position_m;
        made.power_w = power_w;
        return made;
    }
    static light spot(vec3 position_m, vec3 direction, rgb power_w, double inner_half_angle_deg, double outer_half_angle_deg)
    {
        light made = point(position_m, power_w);
        made.kind = light_kind::spot;
        made.direction = direction;
        made.inner_half_angle_deg = inner_half_angle_deg;
        made.outer_half_angle_deg = outer_half_angle_deg;
        return made;
    }
    /** \param up the direction of its height. */
    static light rectangle(vec3 position_m, vec3 direction, vec3 up, double width_m, double height_m, rgb power_w)
    {
        light made = point(position_m, power_w);
        made.kind = light_kind::area;
        made.direction = direction;
        made.up = up;
        made.width_m = width_m;
        made.height_m = height_m;
        return made;
    }
    static light disc(vec3 position_m, vec3 direction, double radius_m, rgb power_w)
    {
        light made = point(position_m, power_w);
        made.kind = light_kind::area;
        made.direction = direction;
        made.radius_m = radius_m;
        return made;
    }
    /** A measured lamp. \param up the direction of the plane C = 0. */
    static light lamp(vec3 position_m, vec3 direction, vec3 up, camlux::pattern pattern, rgb power_w)
    {
        light made = point(position_m, power_w);
        made.kind = light_kind::pattern;
        made.direction = direction;
        made.up = up;
        made.pattern = std::move(pattern);
        return made;
    }
    /** \param up the upward direction in the image. */
    static light projector(vec3 position_m, vec3 direction, vec3 up, projected_image image, rgb power_w)
    {
        light made = point(position_m, power_w);
        made.kind = light_kind::projector;
        made.direction = direction;
        made.up = up;
        made.image = std::move(image);
        return made;
    }
    static light directional(vec3 direction, rgb irradiance_w_m2)
    {
        light made;
        made.kind = light_kind::directional;
        made.direction = direction;
        made.irradiance_w_m2 = irradiance_w_m2;
        return made;
    }
};

namespace detail {

inline camlux_light raw_of(const light &from) noexcept
{
    camlux_light to = CAMLUX_LIGHT_INIT;
    to.kind = number(from.kind);
    set(to.position_m, from.position_m);
    set(to.direction, from.direction);
    set(to.power_w, from.power_w);
    set(to.irradiance_w_m2, from.irradiance_w_m2);
    to.inner_half_angle_deg = from.inner_half_angle_deg;
    to.outer_half_angle_deg = from.outer_half_angle_deg;
    set(to.up, from.up);
    to.size_m[0] = from.width_m;
    to.size_m[1] = from.height_m;
    to.radius_m = from.radius_m;
    to.relative_to = number(from.relative_to);
    return to;
}

inline camlux_pattern raw_of(const pattern &from) noexcept
{
    camlux_pattern to = CAMLUX_PATTERN_INIT;
    to.encoding = number(from.encoding);
    to.path = name_of(from.path);
    to.gammas_deg = from.gammas_deg.data();
    to.gamma_count = from.gammas_deg.size();
    to.planes_deg = from.planes_deg.data();
    to.plane_count = from.planes_deg.size();
    to.intensities = from.intensities.data();
    return to;
}

inline camlux_projected_image raw_of(const projected_image &from) noexcept
{
    camlux_projected_image to = CAMLUX_PROJECTED_IMAGE_INIT;
    to.encoding = number(from.encoding);
    to.path = name_of(from.path);
    to.width_px = from.width_px;
    to.height_px = from.height_px;
    to.values = from.values.data();
    to.fov_y_deg = from.fov_y_deg;
    if (from.lens) {
        to.lens = number(from.lens->model);
        to.fx_px = from.lens->fx_px;
        to.fy_px = from.lens->fy_px;
        to.cx_px = from.lens->cx_px;
        to.cy_px = from.lens->cy_px;
    }
    return to;
}

/** A light with the pattern or the image that it points to. */
class whole_light {
public:
    explicit whole_light(const light &from) : light_(raw_of(from))
    {
        if (from.pattern) {
            pattern_ = raw_of(*from.pattern);
            light_.pattern = &pattern_;
        }
        if (from.image) {
            image_ = raw_of(*from.image);
            light_.image = &image_;
        }
    }
    whole_light(const whole_light &) = delete;
    whole_light &operator=(const whole_light &) = delete;

    const camlux_light &raw() const noexcept { return light_; }

private:
    camlux_light light_;
    camlux_pattern pattern_ = CAMLUX_PATTERN_INIT;
    camlux_projected_image image_ = CAMLUX_PROJECTED_IMAGE_INIT;
};

/** Checks what camlux.h cannot check: texts, and the counts of arrays. */
inline result<void> check_light(const light &light)
{
    if (light.pattern) {
        const pattern &pattern = *light.pattern;
        if (pattern.intensities.size() != pattern.gammas_deg.size() * pattern.planes_deg.size())
            return {CAMLUX_ERROR_INVALID_ARGUMENT,
                    "camlux::pattern: intensities has another size than gammas_deg times planes_deg; give one for each pair"};
        return check_texts({{"pattern.path", pattern.path}});
    }
    if (light.image) {
        const projected_image &image = *light.image;
        if (image.values.size() != std::size_t(image.width_px) * image.height_px)
            return {CAMLUX_ERROR_INVALID_ARGUMENT,
                    "camlux::projected_image: values has another size than width_px times height_px; give one for each pixel"};
        return check_texts({{"projected_image.path", image.path}});
    }
    return {};
}

inline light light_of(const camlux_light &from) noexcept
{
    light to;
    to.kind = static_cast<light_kind>(from.kind);
    to.position_m = vec3_of(from.position_m);
    to.direction = vec3_of(from.direction);
    to.power_w = rgb_of(from.power_w);
    to.irradiance_w_m2 = rgb_of(from.irradiance_w_m2);
    to.inner_half_angle_deg = from.inner_half_angle_deg;
    to.outer_half_angle_deg = from.outer_half_angle_deg;
    to.up = vec3_of(from.up);
    to.width_m = from.size_m[0];
    to.height_m = from.size_m[1];
    to.radius_m = from.radius_m;
    to.relative_to = static_cast<relative_to>(from.relative_to);
    return to;
}

}  // namespace detail

}  // namespace camlux

#endif  /* CAMLUX_LIGHT_HPP */
