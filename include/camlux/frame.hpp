/* Part of camlux.hpp: frames and their layers. */

#ifndef CAMLUX_FRAME_HPP
#define CAMLUX_FRAME_HPP

#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "device.hpp"
#include "values.hpp"

namespace camlux {

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
    emission = CAMLUX_LAYER_EMISSION,
    electrons = CAMLUX_LAYER_ELECTRONS,
    dn = CAMLUX_LAYER_DN,
    raw_electrons = CAMLUX_LAYER_RAW_ELECTRONS,
    raw_dn = CAMLUX_LAYER_RAW_DN,
    camera_normal = CAMLUX_LAYER_CAMERA_NORMAL,
    albedo = CAMLUX_LAYER_ALBEDO,
    triangle_id = CAMLUX_LAYER_TRIANGLE_ID,
    texcoord = CAMLUX_LAYER_TEXCOORD,
    indirect_bounce = CAMLUX_LAYER_INDIRECT_BOUNCE,
    tof_phasor = CAMLUX_LAYER_TOF_PHASOR,
    tof_phasor_direct = CAMLUX_LAYER_TOF_PHASOR_DIRECT,
    tof_phasor_indirect = CAMLUX_LAYER_TOF_PHASOR_INDIRECT,
    tof_range = CAMLUX_LAYER_TOF_RANGE,
    tof_amplitude = CAMLUX_LAYER_TOF_AMPLITUDE,
    tof_intensity = CAMLUX_LAYER_TOF_INTENSITY,
    tof_mpi = CAMLUX_LAYER_TOF_MPI,
    tof_wraps = CAMLUX_LAYER_TOF_WRAPS,
    tof_taps = CAMLUX_LAYER_TOF_TAPS,
    tof_point = CAMLUX_LAYER_TOF_POINT,
    tof_phasor_bounce = CAMLUX_LAYER_TOF_PHASOR_BOUNCE,
};

/** The layer of light of so many bounces alone: of indirect_bounce or of tof_phasor_bounce; -1 if there is no such layer. */
constexpr layer of_bounces(std::int32_t bounces, layer of_one = layer::indirect_bounce) noexcept
{
    const bool is_there = (of_one == layer::indirect_bounce || of_one == layer::tof_phasor_bounce) && bounces >= 1 && bounces <= 16;
    return static_cast<layer>(is_there ? static_cast<std::int32_t>(of_one) + bounces - 1 : -1);
}

/** A time-of-flight layer at the frequency with that index; -1 if there is no such layer. \param phase of tof_taps: the index of the phase image. */
constexpr layer of_frequency(std::int32_t frequency, layer of_first, std::int32_t phase = 0) noexcept
{
    const std::int32_t most_phases = of_first == layer::tof_taps ? 8 : 1;
    const bool is_of_bounces = of_first >= layer::tof_phasor_bounce && of_first <= of_bounces(16, layer::tof_phasor_bounce);
    const bool is_of_tof = (of_first >= layer::tof_phasor && of_first <= layer::tof_taps) || of_first == layer::tof_point || is_of_bounces;
    const bool is_there = frequency >= 0 && frequency < 4 && is_of_tof && phase >= 0 && phase < most_phases;
    const std::int32_t number = static_cast<std::int32_t>(of_first) + frequency * CAMLUX_TOF_NEXT_FREQUENCY + phase;
    return static_cast<layer>(is_there ? number : -1);
}

/** Why final gathering stopped. */
enum class stop_reason : std::int32_t {
    none = CAMLUX_STOP_NONE,
    target_met = CAMLUX_STOP_TARGET_MET,
    budget_spent = CAMLUX_STOP_BUDGET_SPENT,
    samples_exhausted = CAMLUX_STOP_SAMPLES_EXHAUSTED,
};

/** camlux_exr_options. */
struct exr_options {
    bool half = false;
    /** Empty: all layers of the frame. */
    std::vector<layer> layers = {};
    /** Each layer in a file of its own with the channels R, G, B or Y, which programs such as OpenCV read: x.depth.exr for x.exr. */
    bool plain = false;
    /** Each layer in a part of its own, with its name, and channels without it: R of the part direct. Not together with plain. */
    bool multipart = false;
};

/** camlux_frame_stats. Estimates that do not exist are NaN. */
struct frame_stats {
    double wall_ms = 0, passes_ms = 0, host_ms = 0, snapshot_ms = 0, preparation_ms = 0;
    std::uint64_t vpl_count = 0, ray_count = 0, pixel_vpl_pairs = 0;
    /** Of the first image, which final gathering makes whatever max_ms and max_rays are. */
    double least_ms = 0;
    std::uint64_t least_rays = 0;
    double estimated_error = 0, estimated_error_upper = 0, estimated_interpolation_error = 0, estimated_area_light_error = 0;
    double estimated_range_error_mm = 0, estimated_range_error_upper_mm = 0;
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

/** The type of the values in a container whose memory a layer may be copied to; no type for others, such as constant ones. */
template <class Container, class Value = std::remove_pointer_t<decltype(std::declval<Container &>().data())>>
using value_in = std::enable_if_t<std::is_same_v<Value, float> || std::is_same_v<Value, std::uint32_t>, Value>;

inline frame_stats frame_stats_of(const camlux_frame_stats &from)
{
    frame_stats to;
    to.wall_ms = from.wall_ms;
    to.passes_ms = from.passes_ms;
    to.host_ms = from.host_ms;
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
    to.estimated_range_error_mm = from.estimated_range_error_mm;
    to.estimated_range_error_upper_mm = from.estimated_range_error_upper_mm;
    to.frame_index = from.frame_index;
    to.camera_index = from.camera_index;
    to.submissions = from.submissions;
    to.stop = static_cast<stop_reason>(from.stop);
    to.device = from.device ? from.device : "";
    to.driver = from.driver ? from.driver : "";
    return to;
}

/** The result points to `numbers`, which must live as long: the numbers of the layers. */
inline camlux_exr_options raw_of(const exr_options &from, std::vector<std::int32_t> &numbers)
{
    camlux_exr_options to = CAMLUX_EXR_OPTIONS_INIT;
    to.half = from.half ? 1 : 0;
    to.plain = from.plain ? 1 : 0;
    to.multipart = from.multipart ? 1 : 0;
    numbers.clear();
    for (const layer wanted : from.layers)
        numbers.push_back(number(wanted));
    to.layers = numbers.empty() ? nullptr : numbers.data();
    to.layer_count = numbers.size();
    return to;
}

}  // namespace detail

template <class T>
class view;

/** camlux_shared_memory: device memory that other interfaces can import. */
class shared_memory : public detail::handle<camlux_shared_memory, camlux_shared_memory_retain, camlux_shared_memory_release> {
public:
    using handle::handle;

    static shared_memory create(const device &device, std::uint64_t size_bytes) { return try_create(device, size_bytes).value(); }
    static result<shared_memory> try_create(const device &device, std::uint64_t size_bytes)
    {
        camlux_shared_memory *created = nullptr;
        const camlux_status status = camlux_shared_memory_create(device.get(), size_bytes, &created);
        return detail::ended(status, shared_memory(created));
    }

    camlux_shared_memory_info info() const { return try_info().value(); }
    result<camlux_shared_memory_info> try_info() const
    {
        camlux_shared_memory_info info = CAMLUX_SHARED_MEMORY_INFO_INIT;
        const camlux_status status = camlux_shared_memory_get_info(get(), &info);
        return detail::ended(status, info);
    }

    /** Opens a new file descriptor, which you import or close. */
    int export_fd() const { return try_export_fd().value(); }
    result<int> try_export_fd() const
    {
        std::int32_t fd = -1;
        const camlux_status status = camlux_shared_memory_export_fd(get(), &fd);
        return detail::ended(status, static_cast<int>(fd));
    }
};

/** camlux_frame: a rendered frame. It does not change. */
class frame : public detail::handle<camlux_frame, camlux_frame_retain, camlux_frame_release> {
public:
    using handle::handle;

    /** The layers that it has; none if it was rendered to targets, which have them. */
    std::vector<camlux::layer> layers() const { return try_layers().value(); }
    result<std::vector<camlux::layer>> try_layers() const
    {
        std::uint32_t count = 0;
        camlux_status status = camlux_frame_layer_count(get(), &count);
        std::vector<camlux::layer> layers;
        for (std::uint32_t index = 0; status == CAMLUX_OK && index < count; ++index) {
            std::int32_t layer = 0;
            status = camlux_frame_get_layer(get(), index, &layer);
            layers.push_back(static_cast<camlux::layer>(layer));
        }
        return detail::ended(status, std::move(layers));
    }

    /** A layer in the frame's memory. The view keeps the frame. \tparam T float, or uint32_t for instance_id, material_id and tof_wraps. */
    template <class T>
    camlux::view<T> view(camlux::layer layer) const
    {
        return try_view<T>(layer).value();
    }
    template <class T>
    result<camlux::view<T>> try_view(camlux::layer layer) const;

    /** Copies a layer to the host's memory, with contiguous rows. \param destination also a vector or an array of float or uint32_t. */
    template <class T>
    void copy(camlux::layer layer, span<T> destination) const
    {
        try_copy(layer, destination).value();
    }
    template <class Container, class T = detail::value_in<Container>>
    void copy(camlux::layer layer, Container &destination) const
    {
        try_copy(layer, span<T>(destination)).value();
    }
    template <class Container, class T = detail::value_in<Container>>
    result<void> try_copy(camlux::layer layer, Container &destination) const
    {
        return try_copy(layer, span<T>(destination));
    }
    template <class T>
    result<void> try_copy(camlux::layer layer, span<T> destination) const
    {
        static_assert(std::is_same_v<T, float> || std::is_same_v<T, std::uint32_t>, "float or uint32_t");
        const result<camlux::view<T>> found = try_view<T>(layer);
        if (!found)
            return {found.status(), found.message()};
        return detail::ended(
            camlux_frame_copy(get(), detail::number(layer), destination.data(), destination.size() * sizeof(T), 0));
    }

    /** \param path UTF-8, ending with .exr. */
    void write_exr(const std::string &path, const exr_options &options = {}) const
    {
        try_write_exr(path, options).value();
    }
    result<void> try_write_exr(const std::string &path, const exr_options &options = {}) const
    {
        if (const result<void> fine = detail::check_texts({{"path", path}}); !fine)
            return fine;
        std::vector<std::int32_t> numbers;
        const camlux_exr_options raw = detail::raw_of(options, numbers);
        return detail::ended(camlux_frame_write_exr(get(), path.c_str(), &raw));
    }

    /**
     * Writes a preview, whose full brightness is the 99th percentile of the frame's radiance: camlux_frame_write_png.
     *
     * \param path UTF-8, ending with .png.
     */
    void write_png(const std::string &path) const { try_write_png(path).value(); }
    result<void> try_write_png(const std::string &path) const
    {
        if (const result<void> fine = detail::check_texts({{"path", path}}); !fine)
            return fine;
        return detail::ended(camlux_frame_write_png(get(), path.c_str()));
    }

    frame_stats stats() const { return try_stats().value(); }
    result<frame_stats> try_stats() const
    {
        camlux_frame_stats stats = CAMLUX_FRAME_STATS_INIT;
        const camlux_status status = camlux_frame_get_stats(get(), &stats);
        return detail::ended(status, detail::frame_stats_of(stats));
    }

    /** The passes of the frame, in the order of execution. */
    std::vector<pass_time> passes() const { return try_passes().value(); }
    result<std::vector<pass_time>> try_passes() const
    {
        camlux_frame_stats stats = CAMLUX_FRAME_STATS_INIT;
        camlux_status status = camlux_frame_get_stats(get(), &stats);
        std::vector<pass_time> passes;
        for (std::uint32_t index = 0; status == CAMLUX_OK && index < stats.pass_count; ++index) {
            camlux_pass_time pass = CAMLUX_PASS_TIME_INIT;
            status = camlux_frame_get_pass(get(), index, &pass);
            if (status == CAMLUX_OK)
                passes.push_back({pass.name, pass.ms});
        }
        return detail::ended(status, std::move(passes));
    }

    /** A layer on the device. The frame must have been rendered with on_device. */
    camlux_vulkan_image vulkan_image(camlux::layer layer) const { return try_vulkan_image(layer).value(); }
    result<camlux_vulkan_image> try_vulkan_image(camlux::layer layer) const
    {
        camlux_vulkan_image image = CAMLUX_VULKAN_IMAGE_INIT;
        const camlux_status status = camlux_frame_get_vulkan_image(get(), detail::number(layer), &image);
        return detail::ended(status, image);
    }

    /** Copies such a layer to shared memory, four floats per pixel: camlux_frame_copy_to_shared. */
    void copy_to(camlux::layer layer, const shared_memory &memory, std::uint64_t offset_bytes = 0) const
    {
        try_copy_to(layer, memory, offset_bytes).value();
    }
    result<void> try_copy_to(camlux::layer layer, const shared_memory &memory, std::uint64_t offset_bytes = 0) const
    {
        return detail::ended(camlux_frame_copy_to_shared(get(), detail::number(layer), memory.get(), offset_bytes));
    }
};

/** camlux_view: a layer in the frame's memory. It holds a reference to the frame. */
template <class T>
class view {
    static_assert(std::is_same_v<T, float> || std::is_same_v<T, std::uint32_t>, "float or uint32_t");

public:
    /** \param raw a view of that frame, with the format of T. */
    view(frame owner, const camlux_view &raw) : frame_(std::move(owner)), raw_(raw) {}

    std::size_t width() const noexcept { return raw_.width_px; }
    std::size_t height() const noexcept { return raw_.height_px; }
    std::size_t channels() const noexcept { return raw_.channels; }
    std::size_t row_stride_bytes() const noexcept { return raw_.row_stride_bytes; }
    camlux::layer layer() const noexcept { return static_cast<camlux::layer>(raw_.layer); }
    /** Name of the layer, such as "radiance". */
    const char *name() const noexcept { return raw_.name; }
    /** Unit of the values, such as "W/sr/m^2". */
    const char *unit() const noexcept { return raw_.unit; }

    /** The upper left value. Rows are row_stride_bytes() apart, channels are interleaved. */
    const T *data() const noexcept { return static_cast<const T *>(raw_.data); }

    /** The values of a row, channels interleaved. \param y from 0 at the top to height() - 1. Indices are not checked, here and below. */
    span<const T> row(std::size_t y) const noexcept
    {
        const auto *bytes = static_cast<const unsigned char *>(raw_.data) + y * raw_.row_stride_bytes;
        return {static_cast<const T *>(static_cast<const void *>(bytes)), width() * channels()};
    }
    /** The channels of a pixel. */
    span<const T> pixel(std::size_t x, std::size_t y) const noexcept
    {
        return {row(y).data() + x * channels(), channels()};
    }
    const T &operator()(std::size_t x, std::size_t y, std::size_t channel = 0) const noexcept
    {
        return row(y)[x * channels() + channel];
    }

private:
    frame frame_;
    camlux_view raw_;
};

template <class T>
result<camlux::view<T>> frame::try_view(camlux::layer layer) const
{
    camlux_view raw = CAMLUX_VIEW_INIT;
    const camlux_status status = camlux_frame_view(get(), detail::number(layer), &raw);
    if (status != CAMLUX_OK)
        return detail::ended(status, camlux::view<T>(*this, raw));
    if ((raw.format == CAMLUX_FORMAT_F32) != std::is_same_v<T, float>)
        return {CAMLUX_ERROR_INVALID_ARGUMENT,
                std::string("camlux::frame: layer ") + raw.name +
                    (std::is_same_v<T, float> ? " holds uint32_t, not float" : " holds float, not uint32_t")};
    return camlux::view<T>(*this, raw);
}

}  // namespace camlux

#endif  /* CAMLUX_FRAME_HPP */
