/*
 * camlux for C++17 and later. It wraps camlux.h with owning handles, exceptions or results, and typed views. Header only; link
 * libcamlux.
 *
 * camlux.h is the manual. It describes what each function does, its units and its threads, under the same name. This file describes
 * only the differences.
 *
 *
 * A COMPLETE EXAMPLE
 *
 *     camlux::scene scene = camlux::scene::load("scenes/cornell_spot.toml");
 *     camlux::renderer renderer = camlux::renderer::create(camlux::device::open());
 *     camlux::frame frame = renderer.render(scene);
 *     camlux::view<float> radiance = frame.view<float>(camlux::layer::radiance);
 *     std::printf("%g %s\n", radiance(400, 400, 0), radiance.unit());
 *
 *
 * HANDLES
 *
 * device, scene, renderer, frame, job, shared_memory and cancel_token hold one reference each. Copies share the object, moves transfer the
 * reference, destructors release it. A handle that was created without arguments or moved from is empty: it converts to false, and calls
 * with it fail with CAMLUX_ERROR_INVALID_HANDLE. get() returns the handle for camlux.h.
 *
 *
 * ERRORS
 *
 * Every function has two forms. The plain form throws camlux::error, with the status and the message of camlux_last_error, also
 * if a render was cancelled (CAMLUX_CANCELLED). The form that begins with try_ returns a result<T>, which has a value or a
 * status and a message. It throws no camlux::error. With -fno-exceptions, use only the try_ forms: a plain form that fails
 * aborts the program.
 *
 *
 * CALLBACKS
 *
 * Callbacks are std::function, and may throw. No exception crosses the library. Both forms throw the exception again, because it is the
 * host's own:
 *
 * - An exception in a progress function cancels the render. The call that renders throws it; for a job, job::wait.
 * - An exception in a log function cancels nothing, and costs no result: a call that returns a value returns it. The next call of that
 *   thread that returns none, or fails, throws the exception.
 */

#ifndef CAMLUX_HPP
#define CAMLUX_HPP

#if __cplusplus < 201703L && !(defined(_MSVC_LANG) && _MSVC_LANG >= 201703L)
#error "camlux.hpp needs C++17 or later: compile with -std=c++17 (C++11 can use camlux.h)"
#else

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "camlux.h"
#include "camlux/log.hpp"
#include "camlux/result.hpp"
#include "camlux/values.hpp"

namespace camlux {

/** The version of the library at run time; CAMLUX_VERSION_MAJOR and so on are those of this header. See camlux_version. */
inline std::uint32_t version() noexcept { return camlux_version(); }

using scene_counts = camlux_scene_counts;
using bounds = camlux_bounds;

/** camlux_device: an open device. Any thread may use it. */
class device : public detail::handle<camlux_device, camlux_device_retain, camlux_device_release> {
public:
    using handle::handle;

    static std::uint32_t count() { return try_count().value(); }
    static result<std::uint32_t> try_count()
    {
        std::uint32_t count = 0;
        const camlux_status status = camlux_device_count(&count);
        return detail::ended(status, count);
    }

    /** Describes a device, which need not be open. \param index from 0 to count() - 1. */
    static device_info info_of(std::uint32_t index) { return try_info_of(index).value(); }
    static result<device_info> try_info_of(std::uint32_t index)
    {
        camlux_device_info info = CAMLUX_DEVICE_INFO_INIT;
        const camlux_status status = camlux_device_get_info(index, &info);
        return detail::ended(status, detail::device_info_of(info));
    }

    static device open(const device_options &options = {}) { return try_open(options).value(); }
    static result<device> try_open(const device_options &options = {})
    {
        if (const result<void> fine = detail::check_texts({options.name, options.uuid, options.pci}); !fine)
            return {fine.status(), fine.message()};
        camlux_device_options raw = CAMLUX_DEVICE_OPTIONS_INIT;
        raw.validation = options.validation ? 1 : 0;
        if (options.index) {
            raw.choice = CAMLUX_DEVICE_INDEX;
            raw.index = *options.index;
        } else if (!options.name.empty()) {
            raw.choice = CAMLUX_DEVICE_NAME;
            raw.name = options.name.c_str();
        } else if (!options.uuid.empty()) {
            raw.choice = CAMLUX_DEVICE_UUID;
            raw.name = options.uuid.c_str();
        } else if (!options.pci.empty()) {
            raw.choice = CAMLUX_DEVICE_PCI;
            raw.name = options.pci.c_str();
        }
        camlux_device *opened = nullptr;
        const camlux_status status = camlux_device_create(&raw, &opened);
        return detail::ended(status, device(opened));
    }

    /** Opens a device on the host's own VkDevice. */
    static device from_vulkan(const camlux_vulkan_device &vulkan) { return try_from_vulkan(vulkan).value(); }
    static result<device> try_from_vulkan(const camlux_vulkan_device &vulkan)
    {
        camlux_device *opened = nullptr;
        const camlux_status status = camlux_device_create_from_vulkan(&vulkan, &opened);
        return detail::ended(status, device(opened));
    }

    device_info info() const { return try_info().value(); }
    result<device_info> try_info() const
    {
        camlux_device_info info = CAMLUX_DEVICE_INFO_INIT;
        const camlux_status status = camlux_device_info_of(get(), &info);
        return detail::ended(status, detail::device_info_of(info));
    }

    std::uint32_t validation_count() const { return try_validation_count().value(); }
    result<std::uint32_t> try_validation_count() const
    {
        std::uint32_t count = 0;
        const camlux_status status = camlux_device_validation_count(get(), &count);
        return detail::ended(status, count);
    }
};

/** camlux_scene. Any thread may change it. Copies refer to the same scene. */
class scene : public detail::handle<camlux_scene, camlux_scene_retain, camlux_scene_release> {
public:
    using handle::handle;

    /** Creates an empty scene. */
    static scene create() { return try_create().value(); }
    static result<scene> try_create()
    {
        camlux_scene *created = nullptr;
        const camlux_status status = camlux_scene_create(&created);
        return detail::ended(status, scene(created));
    }

    /** \param path of a scene file, UTF-8. */
    static scene load(const std::string &path) { return try_load(path).value(); }
    static result<scene> try_load(const std::string &path)
    {
        if (const result<void> fine = detail::check_texts({path}); !fine)
            return {fine.status(), fine.message()};
        camlux_scene *loaded = nullptr;
        const camlux_status status = camlux_scene_load_file(path.c_str(), &loaded);
        return detail::ended(status, scene(loaded));
    }

    void set_camera(const camlux::camera &camera) { try_set_camera(camera).value(); }
    result<void> try_set_camera(const camlux::camera &camera)
    {
        const camlux_camera raw = detail::raw_of(camera);
        return detail::ended(camlux_scene_set_camera(get(), &raw));
    }

    camlux::camera camera() const { return try_camera().value(); }
    result<camlux::camera> try_camera() const
    {
        camlux_camera raw = CAMLUX_CAMERA_INIT;
        const camlux_status status = camlux_scene_get_camera(get(), &raw);
        return detail::ended(status, detail::camera_of(raw));
    }

    /** \param sensor std::nullopt: none. */
    void set_sensor(const std::optional<camlux::sensor> &sensor) { try_set_sensor(sensor).value(); }
    result<void> try_set_sensor(const std::optional<camlux::sensor> &sensor)
    {
        const camlux_sensor raw = detail::raw_of(sensor.value_or(camlux::sensor()));
        return detail::ended(camlux_scene_set_sensor(get(), sensor ? &raw : nullptr));
    }

    /** \param tof std::nullopt: no time of flight. It needs a sensor with wavelength_nm and quantum_efficiency. */
    void set_tof(const std::optional<camlux::tof> &tof) { try_set_tof(tof).value(); }
    result<void> try_set_tof(const std::optional<camlux::tof> &tof)
    {
        if (!tof)
            return detail::ended(camlux_scene_set_tof(get(), nullptr));
        const camlux_tof_noise noise = detail::raw_of(tof->noise.value_or(tof_noise()));
        const camlux_tof raw = detail::raw_of(*tof, tof->noise ? &noise : nullptr);
        return detail::ended(camlux_scene_set_tof(get(), &raw));
    }

    /** \param indirect std::nullopt: direct light only. */
    void set_indirect(const std::optional<camlux::indirect> &indirect) { try_set_indirect(indirect).value(); }
    result<void> try_set_indirect(const std::optional<camlux::indirect> &indirect)
    {
        return detail::ended(camlux_scene_set_indirect(get(), indirect ? &*indirect : nullptr));
    }

    /** Sets how direct light is computed. */
    void set_direct(camlux::shadow shadow) { try_set_direct(shadow).value(); }
    result<void> try_set_direct(camlux::shadow shadow)
    {
        camlux_direct raw = CAMLUX_DIRECT_INIT;
        raw.shadow = detail::number(shadow);
        return detail::ended(camlux_scene_set_direct(get(), &raw));
    }

    /** \return the number of the texture for members of camlux::material: the first one has 1, and 0 stands for none. */
    std::uint32_t add_texture(const camlux::texture &texture) { return try_add_texture(texture).value(); }
    result<std::uint32_t> try_add_texture(const camlux::texture &texture)
    {
        if (const result<void> fine = detail::check_texts({texture.name}); !fine)
            return {fine.status(), fine.message()};
        const camlux_texture raw = detail::raw_of(texture);
        return added(camlux_scene_add_texture, raw);
    }

    void set_texture(std::uint32_t number, const camlux::texture &texture) { try_set_texture(number, texture).value(); }
    result<void> try_set_texture(std::uint32_t number, const camlux::texture &texture)
    {
        if (const result<void> fine = detail::check_texts({texture.name}); !fine)
            return {fine.status(), fine.message()};
        const camlux_texture raw = detail::raw_of(texture);
        return detail::ended(camlux_scene_set_texture(get(), number, &raw));
    }

    /** \return the index of the new part, as in the other add_ functions below. */
    std::uint32_t add_material(const camlux::material &material) { return try_add_material(material).value(); }
    result<std::uint32_t> try_add_material(const camlux::material &material)
    {
        if (const result<void> fine = detail::check_texts({material.name}); !fine)
            return {fine.status(), fine.message()};
        const camlux_material raw = detail::raw_of(material);
        return added(camlux_scene_add_material, raw);
    }

    void set_material(std::uint32_t index, const camlux::material &material)
    {
        try_set_material(index, material).value();
    }
    result<void> try_set_material(std::uint32_t index, const camlux::material &material)
    {
        if (const result<void> fine = detail::check_texts({material.name}); !fine)
            return {fine.status(), fine.message()};
        const camlux_material raw = detail::raw_of(material);
        return detail::ended(camlux_scene_set_material(get(), index, &raw));
    }

    /** Reads a material, without its name. */
    camlux::material material(std::uint32_t index) const { return try_material(index).value(); }
    result<camlux::material> try_material(std::uint32_t index) const
    {
        camlux_material raw = CAMLUX_MATERIAL_INIT;
        const camlux_status status = camlux_scene_get_material(get(), index, &raw);
        return detail::ended(status, detail::material_of(raw));
    }

    std::uint32_t add_mesh(const camlux::mesh &mesh) { return try_add_mesh(mesh).value(); }
    result<std::uint32_t> try_add_mesh(const camlux::mesh &mesh)
    {
        if (const result<void> fine = detail::check_mesh(mesh); !fine)
            return {fine.status(), fine.message()};
        const camlux_mesh raw = detail::raw_of(mesh);
        return added(camlux_scene_add_mesh, raw);
    }

    /** Replaces a mesh in all of its instances. */
    void set_mesh(std::uint32_t index, const camlux::mesh &mesh) { try_set_mesh(index, mesh).value(); }
    result<void> try_set_mesh(std::uint32_t index, const camlux::mesh &mesh)
    {
        if (const result<void> fine = detail::check_mesh(mesh); !fine)
            return {fine.status(), fine.message()};
        const camlux_mesh raw = detail::raw_of(mesh);
        return detail::ended(camlux_scene_set_mesh(get(), index, &raw));
    }

    /** \param mesh the index of a mesh. */
    std::uint32_t add_instance(std::uint32_t mesh, const camlux::pose &pose = {})
    {
        return try_add_instance(mesh, pose).value();
    }
    result<std::uint32_t> try_add_instance(std::uint32_t mesh, const camlux::pose &pose = {})
    {
        const camlux_pose raw = detail::raw_of(pose);
        std::uint32_t index = 0;
        const camlux_status status = camlux_scene_add_instance(get(), mesh, &raw, &index);
        return detail::ended(status, index);
    }

    std::uint32_t add_light(const camlux::light &light) { return try_add_light(light).value(); }
    result<std::uint32_t> try_add_light(const camlux::light &light)
    {
        if (const result<void> fine = detail::check_light(light); !fine)
            return {fine.status(), fine.message()};
        return added(camlux_scene_add_light, detail::whole_light(light).raw());
    }

    void set_light(std::uint32_t index, const camlux::light &light) { try_set_light(index, light).value(); }
    result<void> try_set_light(std::uint32_t index, const camlux::light &light)
    {
        if (const result<void> fine = detail::check_light(light); !fine)
            return fine;
        const detail::whole_light whole(light);
        return detail::ended(camlux_scene_set_light(get(), index, &whole.raw()));
    }

    camlux::light light(std::uint32_t index) const { return try_light(index).value(); }
    result<camlux::light> try_light(std::uint32_t index) const
    {
        camlux_light raw = CAMLUX_LIGHT_INIT;
        const camlux_status status = camlux_scene_get_light(get(), index, &raw);
        return detail::ended(status, detail::light_of(raw));
    }

    /** Moves the camera, a light or an instance. \param index 0 for the camera. */
    void set_pose(camlux::part part, std::uint32_t index, const camlux::pose &pose)
    {
        try_set_pose(part, index, pose).value();
    }
    result<void> try_set_pose(camlux::part part, std::uint32_t index, const camlux::pose &pose)
    {
        const camlux_pose raw = detail::raw_of(pose);
        return detail::ended(camlux_scene_set_pose(get(), detail::number(part), index, &raw));
    }

    camlux::pose pose(camlux::part part, std::uint32_t index = 0) const { return try_pose(part, index).value(); }
    result<camlux::pose> try_pose(camlux::part part, std::uint32_t index = 0) const
    {
        camlux_pose raw = CAMLUX_POSE_INIT;
        const camlux_status status = camlux_scene_get_pose(get(), detail::number(part), index, &raw);
        return detail::ended(status, detail::pose_of(raw));
    }

    /** Moves the lights or instances 0 to poses.size() - 1, all or none. */
    void set_poses(camlux::part part, const std::vector<camlux::pose> &poses) { try_set_poses(part, poses).value(); }
    result<void> try_set_poses(camlux::part part, const std::vector<camlux::pose> &poses)
    {
        std::vector<camlux_pose> raw;
        raw.reserve(poses.size());
        for (const camlux::pose &pose : poses)
            raw.push_back(detail::raw_of(pose));
        return detail::ended(
            camlux_scene_set_poses(get(), detail::number(part), nullptr, raw.size(), raw.data(), sizeof(camlux_pose)));
    }

    /** Shows or hides a light or an instance. */
    void set_visible(camlux::part part, std::uint32_t index, bool is_visible)
    {
        try_set_visible(part, index, is_visible).value();
    }
    result<void> try_set_visible(camlux::part part, std::uint32_t index, bool is_visible)
    {
        return detail::ended(camlux_scene_set_visible(get(), detail::number(part), index, is_visible ? 1 : 0));
    }

    /** Removes a light or an instance. The indices of others do not change. */
    void remove(camlux::part part, std::uint32_t index) { try_remove(part, index).value(); }
    result<void> try_remove(camlux::part part, std::uint32_t index)
    {
        return detail::ended(camlux_scene_remove(get(), detail::number(part), index));
    }

    void validate() const { try_validate().value(); }
    result<void> try_validate() const { return detail::ended(camlux_scene_validate(get())); }

    scene_counts counts() const { return try_counts().value(); }
    result<scene_counts> try_counts() const
    {
        scene_counts counts = CAMLUX_SCENE_COUNTS_INIT;
        const camlux_status status = camlux_scene_get_counts(get(), &counts);
        return detail::ended(status, counts);
    }

    camlux::bounds bounds() const { return try_bounds().value(); }
    result<camlux::bounds> try_bounds() const
    {
        camlux::bounds bounds = CAMLUX_BOUNDS_INIT;
        const camlux_status status = camlux_scene_get_bounds(get(), &bounds);
        return detail::ended(status, bounds);
    }

private:
    template <class Raw>
    result<std::uint32_t> added(camlux_status (*add)(camlux_scene *, const Raw *, std::uint32_t *), const Raw &raw)
    {
        std::uint32_t index = 0;
        const camlux_status status = add(get(), &raw, &index);
        return detail::ended(status, index);
    }
};

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

    /** The layers that it has. */
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

    /** Copies a layer to the host's memory, with contiguous rows. */
    template <class T>
    void copy(camlux::layer layer, span<T> destination) const
    {
        try_copy(layer, destination).value();
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
        if (const result<void> fine = detail::check_texts({path}); !fine)
            return fine;
        if (const result<void> fine = detail::check_layers(options.layers); !fine)
            return fine;
        const camlux_exr_options raw = detail::raw_of(options);
        return detail::ended(camlux_frame_write_exr(get(), path.c_str(), &raw));
    }

    /** \param path UTF-8, ending with .png. */
    void write_png(const std::string &path) const { try_write_png(path).value(); }
    result<void> try_write_png(const std::string &path) const
    {
        if (const result<void> fine = detail::check_texts({path}); !fine)
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

namespace detail {

using progress_function = std::function<bool(double, std::string_view)>;

/** Reports progress to the host. Returns what a progress callback returns. */
inline std::int32_t report_to(const progress_function &progress, kept_exception &thrown, double fraction, const char *pass) noexcept
{
    bool goes_on = false;
    const bool returned = guarded(thrown, [&] { goes_on = progress(fraction, pass); });
    return returned && goes_on ? 0 : 1;
}

/** The progress callback for camlux_renderer_render. */
inline std::int32_t report(double fraction, const char *pass, void *user)
{
    return report_to(*static_cast<const progress_function *>(user), thrown(), fraction, pass);
}

/** The result is valid as long as `options` exists. */
inline camlux_render_options raw_of(const render_options &options) noexcept
{
    camlux_render_options raw = CAMLUX_RENDER_OPTIONS_INIT;
    raw.submission_target_ms = options.submission_target_ms;
    raw.on_device = options.on_device ? 1 : 0;
    raw.frame_index = options.frame_index.value_or(CAMLUX_NEXT_FRAME);
    raw.seed = options.seed;
    raw.cancel_token = options.cancel_token.get();
    raw.targets = options.targets.data();
    raw.target_count = options.targets.size();
    if (options.progress) {
        raw.progress = report;
        raw.progress_user = const_cast<progress_function *>(&options.progress);
    }
    return raw;
}

/** What a job's callbacks need. Also its thread holds it, because a callback may release the last copy of its own job. */
struct job_state : std::enable_shared_from_this<job_state> {
    explicit job_state(render_options from) : options(std::move(from)) {}

    render_options options;
    kept_exception thrown = {};
};

/** The progress callback for camlux_renderer_submit. A job always has it: it tells the job's thread where exceptions go. */
inline std::int32_t report_of_job(double fraction, const char *pass, void *user)
{
    auto &state = *static_cast<job_state *>(user);
    thrown_by_job() = std::shared_ptr<kept_exception>(state.shared_from_this(), &state.thrown);
    return state.options.progress ? report_to(state.options.progress, state.thrown, fraction, pass) : 0;
}

}  // namespace detail

/** camlux_job: a render that runs while the host does something else. The destructor of the last copy cancels it, and waits until it has ended. */
class job {
public:
    job() noexcept = default;

    explicit operator bool() const noexcept { return static_cast<bool>(handle_); }
    camlux_job *get() const noexcept { return handle_.get(); }

    bool is_done() const { return try_is_done().value(); }
    result<bool> try_is_done() const
    {
        std::int32_t done = 0;
        const camlux_status status = camlux_job_poll(get(), &done);
        return detail::ended(status, done != 0);
    }

    /** Waits until the job is done, at most for a time. Returns whether it is done: wait() then does not wait. */
    template <class Number, class Period>
    bool wait_for(std::chrono::duration<Number, Period> longest) const
    {
        return try_wait_for(longest).value();
    }
    template <class Number, class Period>
    result<bool> try_wait_for(std::chrono::duration<Number, Period> longest) const
    {
        const std::chrono::duration<double, std::milli> milliseconds = longest;
        std::int32_t done = 0;
        const camlux_status status = camlux_job_wait_for(get(), milliseconds.count(), &done);
        return detail::ended(status, done != 0);
    }

    /** Waits for the job and returns its frame, once. Throws the exception of its progress function, at every call. */
    frame wait() { return try_wait().value(); }
    result<frame> try_wait()
    {
        camlux_frame *rendered = nullptr;
        const camlux_status status = camlux_job_wait(get(), &rendered);
        frame made(rendered);
#if CAMLUX_HPP_EXCEPTIONS
        // On the job's own thread nothing has ended.
        if (state_ && status == CAMLUX_OK)
            detail::thrown().keep(state_->thrown.take());
        else if (const std::exception_ptr exception = state_ && status != CAMLUX_ERROR_BUSY ? state_->thrown.get() : nullptr)
            std::rethrow_exception(exception);
#endif
        return detail::ended(status, std::move(made));
    }

private:
    friend class renderer;
    using handle = detail::handle<camlux_job, camlux_job_retain, camlux_job_release>;

    // Declared before the handle, so that it outlives the render.
    std::shared_ptr<detail::job_state> state_ = nullptr;
    handle handle_ = {};
};

/** camlux_renderer: renders frames on a device, one at a time. Make one for each thread. */
class renderer : public detail::handle<camlux_renderer, camlux_renderer_retain, camlux_renderer_release> {
public:
    using handle::handle;

    static renderer create(const device &device) { return try_create(device).value(); }
    static result<renderer> try_create(const device &device)
    {
        camlux_renderer *created = nullptr;
        const camlux_status status = camlux_renderer_create(device.get(), &created);
        return detail::ended(status, renderer(created));
    }

    frame render(const scene &scene, const render_options &options = {}) { return try_render(scene, options).value(); }
    result<frame> try_render(const scene &scene, const render_options &options = {})
    {
        const camlux_render_options raw = detail::raw_of(options);
        camlux_frame *rendered = nullptr;
        const camlux_status status = camlux_renderer_render(get(), scene.get(), &raw, &rendered);
        return detail::ended(status, frame(rendered));
    }

    /** Renders the scene from several cameras. What the lights see and what rays hit is computed once. */
    std::vector<frame> render(const scene &scene, const std::vector<camera> &cameras, const render_options &options = {})
    {
        return try_render(scene, cameras, options).value();
    }
    result<std::vector<frame>> try_render(const scene &scene, const std::vector<camera> &cameras, const render_options &options = {})
    {
        std::vector<camlux_camera> raw_cameras;
        raw_cameras.reserve(cameras.size());
        for (const camera &one : cameras)
            raw_cameras.push_back(detail::raw_of(one));
        const camlux_render_options raw = detail::raw_of(options);
        std::vector<camlux_frame *> rendered(cameras.size());
        const camlux_status status = camlux_renderer_render_cameras(
            get(), scene.get(), raw_cameras.data(), raw_cameras.size(), sizeof(camlux_camera), &raw, rendered.data());
        std::vector<frame> frames;
        frames.reserve(rendered.size());
        for (camlux_frame *one : rendered)
            frames.push_back(frame(one));
        return detail::ended(status, std::move(frames));
    }

    /** Starts to render on its own thread. The progress function is called there, too. */
    job submit(const scene &scene, render_options options = {}) { return try_submit(scene, std::move(options)).value(); }
    result<job> try_submit(const scene &scene, render_options options = {})
    {
        job submitted;
        submitted.state_ = std::make_shared<detail::job_state>(std::move(options));
        camlux_render_options raw = detail::raw_of(submitted.state_->options);
        raw.progress = detail::report_of_job;
        raw.progress_user = submitted.state_.get();
        camlux_job *begun = nullptr;
        const camlux_status status = camlux_renderer_submit(get(), scene.get(), &raw, &begun);
        submitted.handle_ = job::handle(begun);
        return detail::ended(status, std::move(submitted));
    }

    /** Compiles and copies to the device what frames of the scene need: see camlux_renderer_prepare. Returns the milliseconds that it took. */
    double prepare(const scene &scene) { return try_prepare(scene).value(); }
    result<double> try_prepare(const scene &scene)
    {
        double milliseconds = 0.0;
        const camlux_status status = camlux_renderer_prepare(get(), scene.get(), &milliseconds);
        return detail::ended(status, milliseconds);
    }

    /** Predicts the GPU time of a frame: see camlux_renderer_foretell_ms. */
    double foretell_ms(const scene &scene) const { return try_foretell_ms(scene).value(); }
    result<double> try_foretell_ms(const scene &scene) const
    {
        double milliseconds = 0.0;
        const camlux_status status = camlux_renderer_foretell_ms(get(), scene.get(), &milliseconds);
        return detail::ended(status, milliseconds);
    }
};

}  // namespace camlux

#endif  /* C++17 */

#endif  /* CAMLUX_HPP */
