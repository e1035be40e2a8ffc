/* Part of camlux.hpp: the structs of camlux.h as C++ values. Units and ranges are those of the C struct that each comment names. */

#ifndef CAMLUX_VALUES_HPP
#define CAMLUX_VALUES_HPP

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "result.hpp"

namespace camlux {

/** x, y, z. */
struct vec3 {
    double x = 0, y = 0, z = 0;
};

/** A value for each band. */
struct rgb {
    double r = 0, g = 0, b = 0;
};

/** A rotation: a quaternion of length 1. */
struct quaternion {
    double x = 0, y = 0, z = 0, w = 1;
};

/** The axes of a camera: x right, y down, z forward (OpenCV, camlux), or x right, y up, z backward (OpenGL, Blender). */
enum class axes : std::int32_t { opencv = CAMLUX_AXES_OPENCV, opengl = CAMLUX_AXES_OPENGL };

/** camlux_pose: maps a part's own space to world space. */
struct pose {
    vec3 position_m = {};
    quaternion orientation = {};
    /** Scale of an instance; 1 for other parts. */
    double scale = 1;

    /**
     * The pose of a matrix from own space to world space, such as camera-to-world: camlux_pose_from_matrix.
     *
     * \param rows 12 numbers (3 x 4) or 16 (4 x 4), row by row.
     */
    static pose from_matrix(span<const double> rows, axes own = axes::opencv) { return try_from_matrix(rows, own).value(); }
    static result<pose> try_from_matrix(span<const double> rows, axes own = axes::opencv);

    /** At `from_m`, facing `to_m`: cameras and spot lights face along +z of their pose; a camera's +y points down, against `up`. */
    static pose facing(const vec3 &from_m, const vec3 &to_m, const vec3 &up = {0, 1, 0})
    {
        const auto cross = [](const vec3 &a, const vec3 &b) {
            return vec3{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
        };
        const auto unit = [](const vec3 &a, const vec3 &otherwise) {
            const double length = std::sqrt(a.x * a.x + a.y * a.y + a.z * a.z);
            // What is not a number stays so, and is refused.
            return length == 0 ? otherwise : vec3{a.x / length, a.y / length, a.z / length};
        };
        const vec3 z = unit({to_m.x - from_m.x, to_m.y - from_m.y, to_m.z - from_m.z}, {0, 0, 1});
        // Straight up or down, any horizontal direction will do.
        const vec3 any = std::abs(z.x) < 0.9 ? vec3{1, 0, 0} : vec3{0, 0, 1};
        const vec3 x = unit(cross(z, up), unit(cross(z, any), {1, 0, 0}));
        const vec3 y = cross(z, x);
        // The quaternion of the matrix with these columns, by its largest component (Shepperd 1978).
        const double trace = x.x + y.y + z.z;
        const double squares[4] = {1 + 2 * x.x - trace, 1 + 2 * y.y - trace, 1 + 2 * z.z - trace, 1 + trace};
        int largest = 0;
        for (int i = 1; i < 4; ++i)
            largest = squares[i] > squares[largest] ? i : largest;
        const double twice = std::sqrt(squares[largest]), f = 0.5 / twice;
        const quaternion candidates[4] = {
            {0.5 * twice, (y.x + x.y) * f, (z.x + x.z) * f, (y.z - z.y) * f},
            {(y.x + x.y) * f, 0.5 * twice, (z.y + y.z) * f, (z.x - x.z) * f},
            {(z.x + x.z) * f, (z.y + y.z) * f, 0.5 * twice, (x.y - y.x) * f},
            {(y.z - z.y) * f, (z.x - x.z) * f, (x.y - y.x) * f, 0.5 * twice},
        };
        return {from_m, candidates[largest], 1};
    }
};

enum class part : std::int32_t {
    camera = CAMLUX_PART_CAMERA,
    light = CAMLUX_PART_LIGHT,
    instance = CAMLUX_PART_INSTANCE,
};

enum class layer : std::int32_t {
    radiance = CAMLUX_LAYER_RADIANCE,
    direct = CAMLUX_LAYER_DIRECT,
    indirect = CAMLUX_LAYER_INDIRECT,
    energy = CAMLUX_LAYER_ENERGY,
    position = CAMLUX_LAYER_POSITION,
    normal = CAMLUX_LAYER_NORMAL,
    depth = CAMLUX_LAYER_DEPTH,
    range = CAMLUX_LAYER_RANGE,
    instance_id = CAMLUX_LAYER_INSTANCE_ID,
    material_id = CAMLUX_LAYER_MATERIAL_ID,
    standard_error = CAMLUX_LAYER_STDERR,
    half_path = CAMLUX_LAYER_HALF_PATH,
    depth_mean = CAMLUX_LAYER_DEPTH_MEAN,
    depth_nearest = CAMLUX_LAYER_DEPTH_NEAREST,
    camera_position = CAMLUX_LAYER_CAMERA_POSITION,
    tof_phasor = CAMLUX_LAYER_TOF_PHASOR,
    tof_phasor_direct = CAMLUX_LAYER_TOF_PHASOR_DIRECT,
    tof_phasor_indirect = CAMLUX_LAYER_TOF_PHASOR_INDIRECT,
    tof_range = CAMLUX_LAYER_TOF_RANGE,
    tof_amplitude = CAMLUX_LAYER_TOF_AMPLITUDE,
    tof_intensity = CAMLUX_LAYER_TOF_INTENSITY,
    tof_mpi = CAMLUX_LAYER_TOF_MPI,
    tof_wraps = CAMLUX_LAYER_TOF_WRAPS,
    tof_taps = CAMLUX_LAYER_TOF_TAPS,
};

/** A time-of-flight layer at the frequency with that index; -1 if there is no such layer. \param phase of tof_taps: the index of the phase image. */
constexpr layer of_frequency(std::int32_t frequency, layer of_first, std::int32_t phase = 0) noexcept
{
    const std::int32_t most_phases = of_first == layer::tof_taps ? 8 : 1;
    const bool is_there = frequency >= 0 && frequency < 4 && of_first >= layer::tof_phasor && of_first <= layer::tof_taps &&
                          phase >= 0 && phase < most_phases;
    const std::int32_t number = static_cast<std::int32_t>(of_first) + frequency * CAMLUX_TOF_NEXT_FREQUENCY + phase;
    return static_cast<layer>(is_there ? number : -1);
}

enum class device_kind : std::int32_t {
    discrete = CAMLUX_DEVICE_KIND_DISCRETE,
    integrated = CAMLUX_DEVICE_KIND_INTEGRATED,
    virtual_machine = CAMLUX_DEVICE_KIND_VIRTUAL,
    cpu = CAMLUX_DEVICE_KIND_CPU,
    other = CAMLUX_DEVICE_KIND_OTHER,
};

/** Why final gathering stopped. */
enum class stop_reason : std::int32_t {
    none = CAMLUX_STOP_NONE,
    target_met = CAMLUX_STOP_TARGET_MET,
    budget_spent = CAMLUX_STOP_BUDGET_SPENT,
    samples_exhausted = CAMLUX_STOP_SAMPLES_EXHAUSTED,
};

enum class light_kind : std::int32_t {
    point = CAMLUX_LIGHT_POINT,
    spot = CAMLUX_LIGHT_SPOT,
    directional = CAMLUX_LIGHT_DIRECTIONAL,
    pattern = CAMLUX_LIGHT_PATTERN,
    projector = CAMLUX_LIGHT_PROJECTOR,
    area = CAMLUX_LIGHT_AREA,
};

enum class log_level : std::int32_t {
    off = CAMLUX_LOG_OFF,
    error = CAMLUX_LOG_ERROR,
    warning = CAMLUX_LOG_WARNING,
    info = CAMLUX_LOG_INFO,
    debug = CAMLUX_LOG_DEBUG,
};

enum class shadow : std::int32_t {
    standard = CAMLUX_SHADOW_DEFAULT,
    map = CAMLUX_SHADOW_MAP,
    rays = CAMLUX_SHADOW_RAYS,
};

enum class charge : std::int32_t { electrons = CAMLUX_CHARGE_ELECTRONS, dn = CAMLUX_CHARGE_DN };

enum class component : std::int32_t { u8 = CAMLUX_COMPONENT_U8, u16 = CAMLUX_COMPONENT_U16, f32 = CAMLUX_COMPONENT_F32 };

enum class encoding : std::int32_t {
    standard = CAMLUX_ENCODING_DEFAULT,
    linear = CAMLUX_ENCODING_LINEAR,
    srgb = CAMLUX_ENCODING_SRGB,
};

enum class lens_model : std::int32_t {
    pinhole = CAMLUX_LENS_INTRINSICS,
    rational = CAMLUX_LENS_RATIONAL,
    fisheye = CAMLUX_LENS_FISHEYE,
};

enum class pixel_filter : std::int32_t {
    box = CAMLUX_FILTER_BOX,
    gaussian = CAMLUX_FILTER_GAUSSIAN,
};

/** The lens of a camera: focal lengths and principal point, in pixels, and OpenCV's coefficients. */
struct intrinsics {
    double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;
    lens_model model = lens_model::pinhole;
    std::array<double, 8> distortion = {};
};

/** camlux_camera. If `lens` is set, fov_y_deg is ignored. */
struct camera {
    std::uint32_t width_px = 640, height_px = 480;
    vec3 position_m = {};
    vec3 look_at_m = {0, 0, 1};
    vec3 up = {0, 1, 0};
    double fov_y_deg = 45;
    std::optional<intrinsics> lens = std::nullopt;
    std::uint32_t samples = 1;
    pixel_filter filter = pixel_filter::box;
};

/** camlux_sensor. */
struct sensor {
    std::array<double, 2> pixel_pitch_um = {0, 0};
    double exposure_time_s = 0;
    double duty_cycle = 1;
    double wavelength_nm = 0;
    double quantum_efficiency = 0;
    double f_number = 0;
};

/** camlux_tof_noise. */
struct tof_noise {
    std::uint32_t bits = 12;
    std::uint64_t seed = 0;
    double dark_e_per_s = 0;
    double read_noise_e = 0;
    double full_well_e = 0;
    double gain_dn_per_e = 1;
    double black_level_dn = 0;
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

namespace detail {

/** The number type in an element of N numbers; no type if it is not such an element. */
template <class Element, std::size_t N, class = void>
struct number_in {};

template <class Number, std::size_t N>
struct number_in<std::array<Number, N>, N> {
    using type = Number;
};

template <class Number>
struct number_in<Number, 1, std::enable_if_t<std::is_arithmetic_v<Number>>> {
    using type = Number;
};

}  // namespace detail

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

/**
 * Elements of N numbers each in the host's memory: camlux_array with its count. They are read only during
 * scene::add_mesh or scene::set_mesh.
 *
 * The numbers are float or double for vertices, uint16_t or uint32_t for indices.
 */
template <std::size_t N>
class elements {
public:
    /** No elements. */
    constexpr elements() noexcept = default;

    /**
     * `count` elements from `first`. \param stride_bytes from one element to the next, such as sizeof(Vertex), or
     * 3 * sizeof(float) in a list of numbers with three for each element.
     */
    template <class Number>
    constexpr elements(const Number *first, std::size_t count, std::size_t stride_bytes) noexcept
        : first_(first), count_(count), stride_bytes_(stride_bytes), format_(format_of<Number>())
    {
    }

    /** A vector, array or span of std::array<Number, N>; if N is 1, of numbers. */
    template <class Container, class Element = std::remove_cv_t<typename std::decay_t<Container>::value_type>,
              class Number = typename detail::number_in<Element, N>::type>
    constexpr elements(const Container &container) noexcept
        : elements(static_cast<const Number *>(static_cast<const void *>(container.data())), container.size(), sizeof(Element))
    {
        static_assert(sizeof(Element) == N * sizeof(Number), "elements have no gaps inside");
    }

    /** Elements refer to the container's, which must live as long: no temporary vector. */
    template <class Container, class = typename Container::allocator_type, class = std::enable_if_t<!std::is_reference_v<Container>>>
    elements(Container &&container) = delete;

    constexpr std::size_t count() const noexcept { return count_; }
    camlux_array raw() const noexcept { return {count_ == 0 ? nullptr : first_, stride_bytes_, format_, 0}; }

private:
    template <class Number>
    static constexpr std::int32_t format_of() noexcept
    {
        constexpr bool is_f32 = std::is_same_v<Number, float>, is_f64 = std::is_same_v<Number, double>;
        constexpr bool is_u16 = std::is_same_v<Number, std::uint16_t>, is_u32 = std::is_same_v<Number, std::uint32_t>;
        static_assert(is_f32 || is_f64 || is_u16 || is_u32, "float, double, uint16_t or uint32_t");
        return is_f32 ? CAMLUX_FORMAT_F32 : is_f64 ? CAMLUX_FORMAT_F64 : is_u16 ? CAMLUX_FORMAT_U16 : CAMLUX_FORMAT_U32;
    }

    const void *first_ = nullptr;
    std::size_t count_ = 0;
    std::size_t stride_bytes_ = 0;
    std::int32_t format_ = CAMLUX_FORMAT_F32;
};

/** camlux_mesh. Arrays that are not empty have one element for each vertex, or for each triangle. */
struct mesh {
    elements<3> positions_m = {};
    elements<3> normals = {};
    elements<2> texcoords = {};
    /** Three indices of vertices for each triangle. */
    elements<3> triangles = {};
    /** One material for all triangles, used if triangle_materials is empty. */
    std::uint32_t material = 0;
    elements<1> triangle_materials = {};
    std::string name = {};
};

/** camlux_cancel_token: cancels renders from another thread. Copies refer to the same token. */
class cancel_token
    : public detail::handle<camlux_cancel_token, camlux_cancel_token_retain, camlux_cancel_token_release> {
public:
    using handle::handle;

    static cancel_token create() { return try_create().value(); }
    static result<cancel_token> try_create()
    {
        camlux_cancel_token *created = nullptr;
        const camlux_status status = camlux_cancel_token_create(&created);
        return detail::ended(status, cancel_token(created));
    }

    /** Cancels all renders with this token, running and future ones. */
    void cancel() { try_cancel().value(); }
    result<void> try_cancel() { return detail::ended(camlux_cancel_token_cancel(get())); }
};

/** camlux_target: a layer, and the memory for it. The memory must be valid until the render has ended. */
struct target : camlux_target {
    /** \param stride_bytes 0: rows are contiguous. */
    target(camlux::layer which, void *to, std::size_t bytes, std::size_t stride_bytes = 0) noexcept
        : camlux_target(CAMLUX_TARGET_INIT)
    {
        layer = static_cast<std::int32_t>(which);
        data = to;
        size_bytes = bytes;
        row_stride_bytes = stride_bytes;
    }
};

/** camlux_render_options. */
struct render_options {
    std::uint32_t submission_target_ms = 500;
    /** Receives the completed fraction and the name of the next pass; returning false cancels the render. */
    std::function<bool(double fraction, std::string_view pass)> progress = {};
    /** The images stay on the device: see frame::vulkan_image. */
    bool on_device = false;
    /** Index of the frame in a sequence. Each frame has its own noise. Empty: the renderer counts; frame_stats tells the index. */
    std::optional<std::uint32_t> frame_index = std::nullopt;
    /** Another seed gives other samples of indirect light, and other noise. */
    std::uint32_t seed = 0;
    /** An empty token: none. */
    camlux::cancel_token cancel_token = {};
    /** Where layers go; empty: they stay with the frame. */
    std::vector<target> targets = {};
};

/** camlux_exr_options. */
struct exr_options {
    bool half = false;
    /** Empty: all layers of the frame. A time-of-flight layer stands for this layer at every frequency. */
    std::vector<layer> layers = {};
    /** Each layer in a file of its own with the channels R, G, B or Y, which programs such as OpenCV read: x.depth.exr for x.exr. */
    bool plain = false;
};

/** camlux_device_options: the best device, or the one with an index, else with a name, a UUID or a PCI address. */
struct device_options {
    std::optional<std::uint32_t> index = std::nullopt;
    std::string name = {}, uuid = {}, pci = {};
    bool validation = false;
};

/** camlux_device_info. */
struct device_info {
    std::uint32_t index = 0;
    device_kind kind = device_kind::other;
    bool is_usable = false;
    std::uint32_t max_image_px = 0, subgroup_lanes = 0;
    std::uint64_t max_allocation_bytes = 0;
    std::string name = {}, driver = {}, lacks = {}, api_version = {}, uuid = {}, pci = {};
};

/** camlux_frame_stats. Estimates that do not exist are NaN. */
struct frame_stats {
    double wall_ms = 0, passes_ms = 0, snapshot_ms = 0, preparation_ms = 0;
    std::uint64_t vpl_count = 0, ray_count = 0, pixel_vpl_pairs = 0;
    /** Of the first image, which final gathering makes whatever max_ms and max_rays are. */
    double least_ms = 0;
    std::uint64_t least_rays = 0;
    double estimated_error = 0, estimated_error_upper = 0, estimated_interpolation_error = 0, estimated_area_light_error = 0;
    std::uint32_t submissions = 0;
    stop_reason stop = stop_reason::none;
    std::string device = {}, driver = {};
    /** Index of the frame in its sequence, and of its camera among those of one call. */
    std::uint32_t frame_index = 0, camera_index = 0;
};

/** camlux_pass_time. */
struct pass_time {
    std::string name = {};
    double ms = 0;
};

namespace detail {

/** The number of an enumeration's value, for camlux.h. */
template <class Enum>
constexpr std::int32_t number(Enum value) noexcept
{
    static_assert(std::is_same_v<std::underlying_type_t<Enum>, std::int32_t>);
    return static_cast<std::int32_t>(value);
}

inline void set(double (&to)[3], const vec3 &from) noexcept
{
    to[0] = from.x;
    to[1] = from.y;
    to[2] = from.z;
}

inline void set(double (&to)[3], const rgb &from) noexcept { set(to, vec3{from.r, from.g, from.b}); }

inline vec3 vec3_of(const double (&from)[3]) noexcept { return {from[0], from[1], from[2]}; }

inline rgb rgb_of(const double (&from)[3]) noexcept { return {from[0], from[1], from[2]}; }

inline const char *name_of(const std::string &name) noexcept { return name.empty() ? nullptr : name.c_str(); }

inline camlux_pose raw_of(const pose &from) noexcept
{
    camlux_pose to = CAMLUX_POSE_INIT;
    set(to.position_m, from.position_m);
    to.orientation_xyzw[0] = from.orientation.x;
    to.orientation_xyzw[1] = from.orientation.y;
    to.orientation_xyzw[2] = from.orientation.z;
    to.orientation_xyzw[3] = from.orientation.w;
    to.scale = from.scale;
    return to;
}

inline pose pose_of(const camlux_pose &from) noexcept
{
    const double(&q)[4] = from.orientation_xyzw;
    return {vec3_of(from.position_m), {q[0], q[1], q[2], q[3]}, from.scale};
}

}  // namespace detail

inline result<pose> pose::try_from_matrix(span<const double> rows, axes own)
{
    camlux_pose raw = CAMLUX_POSE_INIT;
    const camlux_status status = camlux_pose_from_matrix(rows.data(), rows.size(), detail::number(own), &raw);
    return detail::ended(status, detail::pose_of(raw));
}

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
    if (from.lens) {
        to.lens = static_cast<std::int32_t>(from.lens->model);
        to.fx_px = from.lens->fx_px;
        to.fy_px = from.lens->fy_px;
        to.cx_px = from.lens->cx_px;
        to.cy_px = from.lens->cy_px;
        std::copy(from.lens->distortion.begin(), from.lens->distortion.end(), to.distortion);
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
    if (from.lens != CAMLUX_LENS_FOV_Y) {
        to.lens = intrinsics{from.fx_px, from.fy_px, from.cx_px, from.cy_px, static_cast<lens_model>(from.lens)};
        std::copy(std::begin(from.distortion), std::end(from.distortion), to.lens->distortion.begin());
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

inline camlux_material raw_of(const material &from) noexcept
{
    camlux_material to = CAMLUX_MATERIAL_INIT;
    to.kd_texture = from.kd_texture;
    to.normal_texture = from.normal_texture;
    to.alpha_texture = from.alpha_texture;
    set(to.kd, from.kd);
    set(to.ks, from.ks);
    to.shininess = from.shininess;
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

inline camlux_mesh raw_of(const mesh &from) noexcept
{
    camlux_mesh to = CAMLUX_MESH_INIT;
    to.material = from.material;
    to.vertex_count = from.positions_m.count();
    to.triangle_count = from.triangles.count();
    to.positions_m = from.positions_m.raw();
    to.normals = from.normals.raw();
    to.texcoords = from.texcoords.raw();
    to.indices = from.triangles.raw();
    to.triangle_materials = from.triangle_materials.raw();
    to.name = name_of(from.name);
    return to;
}

/** The error for a text with a NUL inside: C would read no further. */
inline result<void> check_texts(std::initializer_list<std::string_view> texts)
{
    for (const std::string_view text : texts)
        if (const std::size_t end = text.find('\0'); end != std::string_view::npos)
            return {CAMLUX_ERROR_INVALID_ARGUMENT,
                    "camlux: a text has a NUL after \"" + std::string(text.substr(0, end)) + "\"; remove it"};
    return {};
}

/** The error for layers that no frame has: what of_frequency returns for a wrong index, or a number that is no layer. */
inline result<void> check_layers(const std::vector<layer> &layers)
{
    for (const layer wanted : layers) {
        const std::int32_t value = number(wanted), of_tof = value - CAMLUX_LAYER_TOF_PHASOR;
        const bool is_there = of_tof < 0 ? value >= 0 && value < 32 : of_tof < 4 * CAMLUX_TOF_NEXT_FREQUENCY;
        if (!is_there)
            return {CAMLUX_ERROR_INVALID_ARGUMENT, "camlux::exr_options: layers has a layer that does not exist (" +
                                                       std::to_string(value) + "); see of_frequency for the frequencies"};
    }
    return {};
}

/** Checks what camlux.h cannot check: texts, and that arrays have the same count. */
inline result<void> check_mesh(const mesh &mesh)
{
    const auto fits = [](const auto &list, const auto &whole) {
        return list.count() == 0 || list.count() == whole.count();
    };
    if (!fits(mesh.normals, mesh.positions_m) || !fits(mesh.texcoords, mesh.positions_m) ||
        !fits(mesh.triangle_materials, mesh.triangles))
        return {CAMLUX_ERROR_INVALID_ARGUMENT, "camlux::mesh: normals, texcoords and triangle_materials are empty, or as many as "
                                               "positions_m and triangles"};
    return check_texts({mesh.name});
}

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
        return check_texts({pattern.path});
    }
    if (light.image) {
        const projected_image &image = *light.image;
        if (image.values.size() != std::size_t(image.width_px) * image.height_px)
            return {CAMLUX_ERROR_INVALID_ARGUMENT,
                    "camlux::projected_image: values has another size than width_px times height_px; give one for each pixel"};
        return check_texts({image.path});
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

inline material material_of(const camlux_material &from)
{
    material to;
    to.kd = rgb_of(from.kd);
    to.ks = rgb_of(from.ks);
    to.shininess = from.shininess;
    to.kd_texture = from.kd_texture;
    to.normal_texture = from.normal_texture;
    to.alpha_texture = from.alpha_texture;
    return to;
}

inline device_info device_info_of(const camlux_device_info &from)
{
    device_info to;
    to.index = from.index;
    to.kind = static_cast<device_kind>(from.kind);
    to.is_usable = from.is_usable != 0;
    to.max_image_px = from.max_image_px;
    to.subgroup_lanes = from.subgroup_lanes;
    to.max_allocation_bytes = from.max_allocation_bytes;
    to.name = from.name;
    to.driver = from.driver;
    to.lacks = from.lacks;
    to.api_version = from.api_version;
    to.uuid = from.uuid;
    to.pci = from.pci;
    return to;
}

inline frame_stats frame_stats_of(const camlux_frame_stats &from)
{
    frame_stats to;
    to.wall_ms = from.wall_ms;
    to.passes_ms = from.passes_ms;
    to.snapshot_ms = from.snapshot_ms;
    to.preparation_ms = from.preparation_ms;
    to.vpl_count = from.vpl_count;
    to.ray_count = from.ray_count;
    to.pixel_vpl_pairs = from.pixel_vpl_pairs;
    to.least_ms = from.least_ms;
    to.least_rays = from.least_rays;
    to.estimated_error = from.estimated_error;
    to.estimated_error_upper = from.estimated_error_upper;
    to.estimated_interpolation_error = from.estimated_interpolation_error;
    to.estimated_area_light_error = from.estimated_area_light_error;
    to.frame_index = from.frame_index;
    to.camera_index = from.camera_index;
    to.submissions = from.submissions;
    to.stop = static_cast<stop_reason>(from.stop);
    to.device = from.device ? from.device : "";
    to.driver = from.driver ? from.driver : "";
    return to;
}

inline camlux_exr_options raw_of(const exr_options &from) noexcept
{
    camlux_exr_options to = CAMLUX_EXR_OPTIONS_INIT;
    to.half = from.half ? 1 : 0;
    to.plain = from.plain ? 1 : 0;
    for (const layer wanted : from.layers) {
        const std::int32_t of_tof = number(wanted) - CAMLUX_LAYER_TOF_PHASOR;
        if (of_tof < 0)
            to.layers |= std::uint32_t(1) << number(wanted);
        else
            to.tof_layers |= std::uint32_t(1) << of_tof % CAMLUX_TOF_NEXT_FREQUENCY;
    }
    return to;
}

}  // namespace detail

}  // namespace camlux

#endif  /* CAMLUX_VALUES_HPP */
