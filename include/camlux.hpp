/*
 * camlux for C++17 and later: camlux.h with handles that own, exceptions or results, and typed views. Header only; link libcamlux.
 *
 * camlux.h is the manual: what a function does, its units and its threads stand there, under the same name. Here stands what
 * differs.
 *
 *
 * A COMPLETE EXAMPLE
 *
 *     camlux::scene scene = camlux::scene::load("scenes/cornell.toml");
 *     camlux::renderer renderer(camlux::device::open());
 *     camlux::frame frame = renderer.render(scene);
 *     camlux::view<float> radiance = frame.view<float>(camlux::layer::radiance);
 *     std::printf("%g %s\n", radiance(400, 400, 0), radiance.unit());
 *
 *
 * HANDLES
 *
 * device, scene, renderer and frame hold one reference each. Copies share the object, moves hand the reference on, destructors give
 * it back. One that was made without arguments, or moved from, is empty: it is false, and calls with it end with
 * CAMLUX_ERROR_INVALID_HANDLE. get() is the handle for camlux.h.
 *
 *
 * ERRORS
 *
 * Every function has two forms. The plain one throws camlux::error, with the status and the message of camlux_last_error, also
 * where a render was cancelled (CAMLUX_CANCELLED). The one that begins with try_ returns a result<T> instead, which has a value or a
 * status and message, and throws nothing of camlux's. With -fno-exceptions, where only try_ makes sense, a plain one that fails
 * aborts the program.
 *
 *
 * CALLBACKS
 *
 * Callbacks are std::function, and may throw: no exception crosses the library. One of a progress callback cancels the render. All
 * are thrown again, on the same thread, by the call that caused them or, where that cannot throw, by the next one; by both forms,
 * for they are the host's own.
 */

#ifndef CAMLUX_HPP
#define CAMLUX_HPP

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#if __cplusplus >= 202002L && __has_include(<span>)
#include <span>
#endif

#include "camlux.h"

#if defined(__cpp_exceptions) || defined(_CPPUNWIND)
#define CAMLUX_HPP_EXCEPTIONS 1
#else
#define CAMLUX_HPP_EXCEPTIONS 0
#endif

namespace camlux {

#ifdef __cpp_lib_span
template <class T>
using span = std::span<T>;
#else
/** Some values that lie one behind the other: as much of std::span as is needed here. */
template <class T>
class span {
public:
    using value_type = std::remove_cv_t<T>;

    constexpr span() noexcept = default;
    constexpr span(T *data, std::size_t size) noexcept : data_(data), size_(size) {}
    template <class Container, class = decltype(static_cast<T *>(std::declval<Container &>().data()))>
    constexpr span(Container &&container) noexcept : data_(container.data()), size_(container.size())
    {
    }
    template <std::size_t Size>
    constexpr span(T (&array)[Size]) noexcept : data_(array), size_(Size)
    {
    }

    constexpr T *data() const noexcept { return data_; }
    constexpr std::size_t size() const noexcept { return size_; }
    constexpr std::size_t size_bytes() const noexcept { return size_ * sizeof(T); }
    constexpr bool empty() const noexcept { return size_ == 0; }
    constexpr T *begin() const noexcept { return data_; }
    constexpr T *end() const noexcept { return data_ + size_; }
    constexpr T &operator[](std::size_t index) const noexcept { return data_[index]; }

private:
    T *data_ = nullptr;
    std::size_t size_ = 0;
};
#endif

/** A call that did not end with CAMLUX_OK. */
class error : public std::runtime_error {
public:
    error(camlux_status status, const std::string &message) : std::runtime_error(message), status_(status) {}

    /** CAMLUX_CANCELLED, CAMLUX_ERROR_SCENE and so on. */
    camlux_status status() const noexcept { return status_; }

private:
    camlux_status status_;
};

namespace detail {

[[noreturn]] inline void fail(camlux_status status, const std::string &message)
{
#if CAMLUX_HPP_EXCEPTIONS
    throw error(status, message);
#else
    std::fprintf(stderr, "camlux: %s: %s\n", camlux_status_text(status), message.c_str());
    std::abort();
#endif
}

/** What a callback of this thread has thrown, until a call can throw it. */
inline std::exception_ptr &thrown()
{
    thread_local std::exception_ptr thrown;
    return thrown;
}

/** Calls a function of the host's from the library, through which nothing may be thrown. The first exception is kept. */
template <class Function>
bool guarded(Function &&function) noexcept
{
#if CAMLUX_HPP_EXCEPTIONS
    try {
        function();
        return true;
    } catch (...) {
        if (!thrown())
            thrown() = std::current_exception();
        return false;
    }
#else
    function();
    return true;
#endif
}

}  // namespace detail

/** What a try_ function returns: a T, or a status and its message. */
template <class T>
class [[nodiscard]] result {
public:
    result(T value) : value_(std::move(value)) {}
    result(camlux_status status, std::string message) : status_(status), message_(std::move(message)) {}

    bool ok() const noexcept { return value_.has_value(); }
    explicit operator bool() const noexcept { return ok(); }
    camlux_status status() const noexcept { return status_; }
    const std::string &message() const noexcept { return message_; }

    /** The value; without one, throws the error. */
    T &value() &
    {
        if (!ok())
            detail::fail(status_, message_);
        return *value_;
    }
    T &&value() && { return std::move(value()); }
    /** The value, of a result that is ok. */
    T &operator*() { return *value_; }
    T *operator->() { return &*value_; }

private:
    std::optional<T> value_;
    camlux_status status_ = CAMLUX_OK;
    std::string message_;
};

/** Of a function that returns nothing else. */
template <>
class [[nodiscard]] result<void> {
public:
    result() = default;
    result(camlux_status status, std::string message) : status_(status), message_(std::move(message)) {}

    bool ok() const noexcept { return status_ == CAMLUX_OK; }
    explicit operator bool() const noexcept { return ok(); }
    camlux_status status() const noexcept { return status_; }
    const std::string &message() const noexcept { return message_; }

    /** Throws the error, if it is one. */
    void value() const
    {
        if (!ok())
            detail::fail(status_, message_);
    }

private:
    camlux_status status_ = CAMLUX_OK;
    std::string message_;
};

namespace detail {

inline result<void> ended(camlux_status status)
{
#if CAMLUX_HPP_EXCEPTIONS
    if (thrown())
        std::rethrow_exception(std::exchange(thrown(), nullptr));
#endif
    if (status == CAMLUX_OK)
        return {};
    return {status, camlux_last_error()};
}

template <class T>
result<std::decay_t<T>> ended(camlux_status status, T &&value)
{
    result<void> end = ended(status);
    if (!end)
        return {end.status(), end.message()};
    return std::forward<T>(value);
}

/** One reference to an object of the library. */
template <class Raw, camlux_status (*retain)(Raw *), camlux_status (*release)(Raw *)>
class handle {
public:
    handle() noexcept = default;
    /** Takes over a reference that came from camlux.h. */
    explicit handle(Raw *raw) noexcept : raw_(raw) {}
    handle(const handle &other) : raw_(other.raw_)
    {
        if (raw_ != nullptr && retain(raw_) != CAMLUX_OK) {
            raw_ = nullptr;
            fail(CAMLUX_ERROR_INVALID_HANDLE, camlux_last_error());
        }
    }
    handle(handle &&other) noexcept : raw_(std::exchange(other.raw_, nullptr)) {}
    handle &operator=(handle other) noexcept
    {
        std::swap(raw_, other.raw_);
        return *this;
    }
    ~handle() { release(raw_); }

    /** For functions of camlux.h. The reference stays here. */
    Raw *get() const noexcept { return raw_; }
    explicit operator bool() const noexcept { return raw_ != nullptr; }
    friend bool operator==(const handle &a, const handle &b) noexcept { return a.raw_ == b.raw_; }
    friend bool operator!=(const handle &a, const handle &b) noexcept { return a.raw_ != b.raw_; }

private:
    Raw *raw_ = nullptr;
};

/** An enumeration's number, for camlux.h. */
template <class Enum>
constexpr std::int32_t number(Enum value) noexcept
{
    static_assert(std::is_same_v<std::underlying_type_t<Enum>, std::int32_t>);
    return static_cast<std::int32_t>(value);
}

}  // namespace detail

/** x, y, z. */
struct vec3 {
    double x = 0, y = 0, z = 0;
};

/** A value for each band. */
struct rgb {
    double r = 0, g = 0, b = 0;
};

/** A rotation, of length 1. */
struct quaternion {
    double x = 0, y = 0, z = 0, w = 1;
};

/** camlux_pose: what takes a part's own space to world space. */
struct pose {
    vec3 position_m;
    quaternion orientation;
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
};

enum class log_level : std::int32_t {
    off = CAMLUX_LOG_OFF,
    error = CAMLUX_LOG_ERROR,
    warning = CAMLUX_LOG_WARNING,
    info = CAMLUX_LOG_INFO,
    debug = CAMLUX_LOG_DEBUG,
};

enum class estimator : std::int32_t {
    instant_radiosity = CAMLUX_ESTIMATOR_INSTANT_RADIOSITY,
    rsm_average = CAMLUX_ESTIMATOR_RSM_AVERAGE,
};

enum class visibility : std::int32_t {
    standard = CAMLUX_VISIBILITY_DEFAULT,
    none = CAMLUX_VISIBILITY_NONE,
    rays = CAMLUX_VISIBILITY_RAYS,
};

enum class shadow : std::int32_t {
    standard = CAMLUX_SHADOW_DEFAULT,
    map = CAMLUX_SHADOW_MAP,
    rays = CAMLUX_SHADOW_RAYS,
};

enum class component : std::int32_t { u8 = CAMLUX_COMPONENT_U8, u16 = CAMLUX_COMPONENT_U16, f32 = CAMLUX_COMPONENT_F32 };

enum class encoding : std::int32_t { linear = CAMLUX_ENCODING_LINEAR, srgb = CAMLUX_ENCODING_SRGB };

/** The lens of a camera by its focal lengths and principal point, pixels. */
struct intrinsics {
    double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;
};

/** camlux_camera. With `lens`, fov_y_deg is not looked at. */
struct camera {
    std::uint32_t width_px = 640, height_px = 480;
    vec3 position_m;
    vec3 look_at_m = {0, 0, 1};
    vec3 up = {0, -1, 0};
    double fov_y_deg = 45;
    std::optional<intrinsics> lens;
};

/** camlux_sensor. */
struct sensor {
    std::array<double, 2> pixel_pitch_um = {0, 0};
    double exposure_time_s = 0;
    double duty_cycle = 1;
};

/** camlux_indirect. */
struct indirect {
    camlux::estimator estimator = camlux::estimator::instant_radiosity;
    camlux::visibility visibility = camlux::visibility::standard;
    std::uint32_t rsm_size = 0;
    double target_error = 0;
};

/** camlux_material. */
struct material {
    rgb kd;
    rgb ks;
    double shininess = -1;
    std::uint32_t kd_texture = CAMLUX_NONE;
    std::string name;
};

/** camlux_texture. The pixels are looked at during scene::add_texture only. */
struct texture {
    std::uint32_t width_px = 0, height_px = 0;
    camlux::component component = camlux::component::u8;
    std::uint32_t channels = 3;
    camlux::encoding encoding = camlux::encoding::srgb;
    const void *pixels = nullptr;
    std::size_t row_stride_bytes = 0;
    std::string name;
};

/** camlux_light; point, spot and directional make those that are complete. */
struct light {
    std::int32_t kind = CAMLUX_LIGHT_POINT;
    vec3 position_m;
    vec3 direction;
    rgb power_w;
    rgb irradiance_w_m2;
    double inner_half_angle_deg = 0;
    double outer_half_angle_deg = 0;

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
        made.kind = CAMLUX_LIGHT_SPOT;
        made.direction = direction;
        made.inner_half_angle_deg = inner_half_angle_deg;
        made.outer_half_angle_deg = outer_half_angle_deg;
        return made;
    }
    static light directional(vec3 direction, rgb irradiance_w_m2)
    {
        light made;
        made.kind = CAMLUX_LIGHT_DIRECTIONAL;
        made.direction = direction;
        made.irradiance_w_m2 = irradiance_w_m2;
        return made;
    }
};

/**
 * Elements of a mesh as they lie in the host's memory: camlux_array with its count. They are looked at during scene::add_mesh only.
 *
 * The numbers are float or double for vertices, uint16_t or uint32_t for indices.
 */
class elements {
public:
    /** None. */
    constexpr elements() noexcept = default;

    /** `count` elements, the first of which begins at `first`. \param stride_bytes from one to the next; 0: without gaps. */
    template <class Number>
    constexpr elements(const Number *first, std::size_t count, std::size_t stride_bytes = 0) noexcept
        : first_(first), count_(count), stride_bytes_(stride_bytes), format_(format_of<Number>())
    {
    }

    /** A vector, array or span whose elements are std::array<Number, N>, without gaps. N is 3 for positions, and so on. */
    template <class Container, class Element = typename std::decay_t<Container>::value_type,
              class Number = typename std::remove_cv_t<Element>::value_type,
              class = std::enable_if_t<sizeof(Element) == std::tuple_size<std::remove_cv_t<Element>>::value * sizeof(Number)>>
    constexpr elements(const Container &container) noexcept
        : first_(container.data()), count_(container.size()), stride_bytes_(sizeof(Element)), format_(format_of<Number>())
    {
    }

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

/** camlux_mesh. Arrays that are not empty have as many elements as there are vertices, or triangles. */
struct mesh {
    elements positions_m;
    elements normals;
    elements texcoords;
    /** Three indices of vertices for each triangle. */
    elements triangles;
    /** One for all triangles, where triangle_materials is empty. */
    std::uint32_t material = 0;
    elements triangle_materials;
    std::string name;
};

/** camlux_render_options. */
struct render_options {
    std::uint32_t submission_target_ms = 500;
    /** Receives the fraction that is done and the pass that runs next; false cancels the render. */
    std::function<bool(double fraction, std::string_view pass)> progress;
    /** The images stay on the device: see frame::vulkan_image. */
    bool on_device = false;
};

/** camlux_exr_options. */
struct exr_options {
    bool half = false;
    /** None: all that the frame has. */
    std::vector<layer> layers;
};

/** camlux_device_options: the best device, or that of an index, or that of a name. */
struct device_options {
    std::optional<std::uint32_t> index;
    std::string name;
    bool validation = false;
};

/** camlux_pass_time. */
struct pass_time {
    std::string name;
    double ms = 0;
};

