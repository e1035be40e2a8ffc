/* Part of camlux.hpp: camera, sensor and time of flight, and how light is computed. */

#ifndef CAMLUX_CAMERA_HPP
#define CAMLUX_CAMERA_HPP

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <vector>

#include "values.hpp"

namespace camlux {

enum class shadow : std::int32_t {
    standard = CAMLUX_SHADOW_DEFAULT,
    map = CAMLUX_SHADOW_MAP,
    rays = CAMLUX_SHADOW_RAYS,
};

enum class charge : std::int32_t { electrons = CAMLUX_CHARGE_ELECTRONS, dn = CAMLUX_CHARGE_DN };

enum class lens_model : std::int32_t {
    pinhole = CAMLUX_LENS_INTRINSICS,
    rational = CAMLUX_LENS_RATIONAL,
    fisheye = CAMLUX_LENS_FISHEYE,
};

enum class pixel_filter : std::int32_t {
    box = CAMLUX_FILTER_BOX,
    gaussian = CAMLUX_FILTER_GAUSSIAN,
};

/** The lens of a camera: focal lengths, principal point and skew, in pixels, and OpenCV's coefficients in its order. */
struct intrinsics {
    double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;
    lens_model model = lens_model::pinhole;
    std::array<double, 14> distortion = {};
    double skew_px = 0;
};

/** camlux_camera. If `fov_x_deg` is set, fov_y_deg is ignored; if `lens`, `equirectangular` or `orthographic_height_m` is set, both are. */
struct camera {
    std::uint32_t width_px = 640, height_px = 480;
    vec3 position_m = {};
    vec3 look_at_m = {0, 0, 1};
    vec3 up = {0, 1, 0};
    double fov_y_deg = 45;
    std::optional<intrinsics> lens = std::nullopt;
    std::uint32_t samples = 1;
    pixel_filter filter = pixel_filter::box;
    std::optional<double> fov_x_deg = std::nullopt;
    bool equirectangular = false;
    /** Parallel rays; the height of the image. */
    std::optional<double> orthographic_height_m = std::nullopt;
};

/** The colour filters of four pixels: the upper two, then the lower two. */
enum class bayer_pattern : std::int32_t {
    none = CAMLUX_BAYER_NONE,
    rggb = CAMLUX_BAYER_RGGB,
    grbg = CAMLUX_BAYER_GRBG,
    gbrg = CAMLUX_BAYER_GBRG,
    bggr = CAMLUX_BAYER_BGGR,
};

/** camlux_tof_noise: of a sensor with or without time of flight. */
struct tof_noise {
    std::uint32_t bits = 12;
    std::uint64_t seed = 0;
    double dark_e_per_s = 0;
    double read_noise_e = 0;
    double full_well_e = 0;
    double gain_dn_per_e = 1;
    double black_level_dn = 0;
    double dsnu_e = 0;
    double prnu = 0;
};

/** camlux_sensor. */
struct sensor {
    std::array<double, 2> pixel_pitch_um = {0, 0};
    double exposure_time_s = 0;
    double duty_cycle = 1;
    double wavelength_nm = 0;
    double quantum_efficiency = 0;
    double f_number = 0;
    rgb band_weights = {1, 1, 1};
    bayer_pattern bayer = bayer_pattern::none;
    bool monochrome = false;
    /** std::nullopt: cos^4. */
    std::optional<std::array<double, 3>> vignetting = std::nullopt;
    /** std::nullopt: layers hold expected values. */
    std::optional<tof_noise> noise = std::nullopt;
};

/** camlux_vignetting_map: a file, or width_px * height_px values. */
struct vignetting_map {
    std::string path = {};
    std::uint32_t width_px = 0, height_px = 0;
    /** Light over that on the axis, row by row from the top. */
    std::vector<float> values = {};
};

/** camlux_tof. */
struct tof {
    /** A modulation frequency and its contrast. */
    struct frequency {
        double hz = 0;
        double contrast = 1;
    };
    /** One to four. */
    std::vector<frequency> frequencies = {};
    rgb band_weights = {1, 0, 0};
    double phase_offset_deg = 0;
    std::uint32_t phase_count = 4;
    charge output = charge::electrons;
    /** std::nullopt: charges are expected values. */
    std::optional<tof_noise> noise = std::nullopt;
    std::vector<std::uint32_t> ambient_lights = {};
};

/** camlux_indirect, initialised with CAMLUX_INDIRECT_INIT. */
struct indirect : camlux_indirect {
    indirect() noexcept : camlux_indirect CAMLUX_INDIRECT_INIT {}
};

namespace detail {

inline camlux_camera raw_of(const camera &from) noexcept
{
    camlux_camera to = CAMLUX_CAMERA_INIT;
    to.width_px = from.width_px;
    to.height_px = from.height_px;
    set(to.position_m, from.position_m);
    set(to.look_at_m, from.look_at_m);
    set(to.up, from.up);
    to.fov_y_deg = from.fov_y_deg;
    if (from.fov_x_deg) {
        to.lens = CAMLUX_LENS_FOV_X;
        to.fov_x_deg = *from.fov_x_deg;
    }
    if (from.equirectangular)
        to.lens = CAMLUX_LENS_EQUIRECTANGULAR;
    if (from.orthographic_height_m) {
        to.lens = CAMLUX_LENS_ORTHOGRAPHIC;
        to.height_m = *from.orthographic_height_m;
    }
    if (from.lens) {
        to.lens = static_cast<std::int32_t>(from.lens->model);
        to.fx_px = from.lens->fx_px;
        to.fy_px = from.lens->fy_px;
        to.cx_px = from.lens->cx_px;
        to.cy_px = from.lens->cy_px;
        to.skew_px = from.lens->skew_px;
        const auto prism_tilt = from.lens->distortion.begin() + 8;
        std::copy(from.lens->distortion.begin(), prism_tilt, to.distortion);
        std::copy(prism_tilt, from.lens->distortion.end(), to.prism_tilt);
    }
    to.samples = from.samples;
    to.filter = static_cast<std::int32_t>(from.filter);
    return to;
}

inline camera camera_of(const camlux_camera &from)
{
    camera to;
    to.width_px = from.width_px;
    to.height_px = from.height_px;
    to.position_m = vec3_of(from.position_m);
    to.look_at_m = vec3_of(from.look_at_m);
    to.up = vec3_of(from.up);
    to.fov_y_deg = from.fov_y_deg;
    if (from.lens == CAMLUX_LENS_FOV_X) {
        to.fov_x_deg = from.fov_x_deg;
    } else if (from.lens == CAMLUX_LENS_EQUIRECTANGULAR) {
        to.equirectangular = true;
    } else if (from.lens == CAMLUX_LENS_ORTHOGRAPHIC) {
        to.orthographic_height_m = from.height_m;
    } else if (from.lens != CAMLUX_LENS_FOV_Y) {
        to.lens = intrinsics{from.fx_px, from.fy_px, from.cx_px, from.cy_px, static_cast<lens_model>(from.lens)};
        const auto prism_tilt = std::copy(std::begin(from.distortion), std::end(from.distortion), to.lens->distortion.begin());
        std::copy(std::begin(from.prism_tilt), std::end(from.prism_tilt), prism_tilt);
        to.lens->skew_px = from.skew_px;
    }
    to.samples = from.samples;
    to.filter = static_cast<pixel_filter>(from.filter);
    return to;
}

inline camlux_sensor raw_of(const sensor &from) noexcept
{
    camlux_sensor to = CAMLUX_SENSOR_INIT;
    to.pixel_pitch_um[0] = from.pixel_pitch_um[0];
    to.pixel_pitch_um[1] = from.pixel_pitch_um[1];
    to.exposure_time_s = from.exposure_time_s;
    to.duty_cycle = from.duty_cycle;
    to.wavelength_nm = from.wavelength_nm;
    to.quantum_efficiency = from.quantum_efficiency;
    to.f_number = from.f_number;
    set(to.band_weights, from.band_weights);
    to.bayer = number(from.bayer);
    to.monochrome = from.monochrome ? 1 : 0;
    if (from.vignetting) {
        std::copy(from.vignetting->begin(), from.vignetting->end(), to.vignetting);
        to.has_vignetting = 1;
    }
    return to;
}

inline camlux_vignetting_map raw_of(const vignetting_map &from) noexcept
{
    camlux_vignetting_map to = CAMLUX_VIGNETTING_MAP_INIT;
    to.path = name_of(from.path);
    to.width_px = from.width_px;
    to.height_px = from.height_px;
    to.values = from.values.data();
    return to;
}

/** Checks what camlux.h cannot check. */
inline result<void> check_map(const vignetting_map &map)
{
    if (map.values.size() != std::size_t(map.width_px) * map.height_px)
        return {CAMLUX_ERROR_INVALID_ARGUMENT,
                "camlux::vignetting_map: values has another size than width_px times height_px; give one for each pixel"};
    return check_texts({{"vignetting_map.path", map.path}});
}

inline sensor sensor_of(const camlux_sensor &from) noexcept
{
    sensor to;
    to.pixel_pitch_um = {from.pixel_pitch_um[0], from.pixel_pitch_um[1]};
    to.exposure_time_s = from.exposure_time_s;
    to.duty_cycle = from.duty_cycle;
    to.wavelength_nm = from.wavelength_nm;
    to.quantum_efficiency = from.quantum_efficiency;
    to.f_number = from.f_number;
    to.band_weights = rgb_of(from.band_weights);
    to.bayer = static_cast<bayer_pattern>(from.bayer);
    to.monochrome = from.monochrome != 0;
    if (from.has_vignetting != 0) {
        to.vignetting = {from.vignetting[0], from.vignetting[1], from.vignetting[2]};
    }
    return to;
}

inline camlux_tof_noise raw_of(const tof_noise &from) noexcept
{
    camlux_tof_noise to = CAMLUX_TOF_NOISE_INIT;
    to.bits = from.bits;
    to.seed = from.seed;
    to.dark_e_per_s = from.dark_e_per_s;
    to.read_noise_e = from.read_noise_e;
    to.full_well_e = from.full_well_e;
    to.gain_dn_per_e = from.gain_dn_per_e;
    to.black_level_dn = from.black_level_dn;
    to.dsnu_e = from.dsnu_e;
    to.prnu = from.prnu;
    return to;
}

/** The result points to the ambient lights of `from` and to `noise`: both must live as long as the result. */
inline camlux_tof raw_of(const tof &from, const camlux_tof_noise *noise) noexcept
{
    camlux_tof to = CAMLUX_TOF_INIT;
    // The library refuses a count larger than the arrays.
    to.frequency_count = static_cast<std::uint32_t>(from.frequencies.size());
    for (std::size_t i = 0; i < from.frequencies.size() && i < 4; ++i) {
        to.frequencies_hz[i] = from.frequencies[i].hz;
        to.contrasts[i] = from.frequencies[i].contrast;
    }
    set(to.band_weights, from.band_weights);
    to.phase_offset_deg = from.phase_offset_deg;
    to.phase_count = from.phase_count;
    to.output = number(from.output);
    to.noise = noise;
    to.ambient_lights = from.ambient_lights.empty() ? nullptr : from.ambient_lights.data();
    to.ambient_light_count = from.ambient_lights.size();
    return to;
}

inline tof_noise noise_of(const camlux_tof_noise &from) noexcept
{
    tof_noise to;
    to.bits = from.bits;
    to.seed = from.seed;
    to.dark_e_per_s = from.dark_e_per_s;
    to.read_noise_e = from.read_noise_e;
    to.full_well_e = from.full_well_e;
    to.gain_dn_per_e = from.gain_dn_per_e;
    to.black_level_dn = from.black_level_dn;
    to.dsnu_e = from.dsnu_e;
    to.prnu = from.prnu;
    return to;
}

inline tof tof_of(const camlux_tof &from)
{
    tof to;
    for (std::size_t i = 0; i < from.frequency_count && i < 4; ++i)
        to.frequencies.push_back({from.frequencies_hz[i], from.contrasts[i]});
    to.band_weights = rgb_of(from.band_weights);
    to.phase_offset_deg = from.phase_offset_deg;
    to.phase_count = from.phase_count;
    to.output = static_cast<charge>(from.output);
    if (from.noise)
        to.noise = noise_of(*from.noise);
    if (from.ambient_lights)
        to.ambient_lights.assign(from.ambient_lights, from.ambient_lights + from.ambient_light_count);
    return to;
}

}  // namespace detail

}  // namespace camlux

#endif  /* CAMLUX_CAMERA_HPP */
