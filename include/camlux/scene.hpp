/* Part of camlux.hpp: scenes. */

#ifndef CAMLUX_SCENE_HPP
#define CAMLUX_SCENE_HPP

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "camera.hpp"
#include "light.hpp"
#include "material.hpp"
#include "mesh.hpp"
#include "pose.hpp"
#include "values.hpp"

namespace camlux {

using scene_counts = camlux_scene_counts;
using bounds = camlux_bounds;

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
        if (const result<void> fine = detail::check_texts({{"path", path}}); !fine)
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
        // The noise that is set may not go together with another sensor.
        camlux_status status = camlux_scene_set_sensor_noise(get(), nullptr);
        const camlux_sensor raw = detail::raw_of(sensor.value_or(camlux::sensor()));
        if (status == CAMLUX_OK)
            status = camlux_scene_set_sensor(get(), sensor ? &raw : nullptr);
        if (status == CAMLUX_OK && sensor && sensor->noise) {
            const camlux_tof_noise noise = detail::raw_of(*sensor->noise);
            status = camlux_scene_set_sensor_noise(get(), &noise);
        }
        return detail::ended(status);
    }

    std::optional<camlux::sensor> sensor() const { return try_sensor().value(); }
    result<std::optional<camlux::sensor>> try_sensor() const
    {
        camlux_sensor raw = CAMLUX_SENSOR_INIT;
        std::int32_t is_set = 0;
        camlux_status status = camlux_scene_get_sensor(get(), &raw, &is_set);
        std::optional<camlux::sensor> found;
        if (is_set)
            found = detail::sensor_of(raw);
        camlux_tof_noise noise = CAMLUX_TOF_NOISE_INIT;
        if (status == CAMLUX_OK)
            status = camlux_scene_get_sensor_noise(get(), &noise, &is_set);
        if (found && is_set)
            found->noise = detail::noise_of(noise);
        return detail::ended(status, found);
    }

    /** \param map std::nullopt: none. */
    void set_vignetting_map(const std::optional<camlux::vignetting_map> &map) { try_set_vignetting_map(map).value(); }
    result<void> try_set_vignetting_map(const std::optional<camlux::vignetting_map> &map)
    {
        if (!map)
            return detail::ended(camlux_scene_set_vignetting_map(get(), nullptr));
        if (const result<void> fine = detail::check_map(*map); !fine)
            return fine;
        const camlux_vignetting_map raw = detail::raw_of(*map);
        return detail::ended(camlux_scene_set_vignetting_map(get(), &raw));
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

    std::optional<camlux::tof> tof() const { return try_tof().value(); }
    result<std::optional<camlux::tof>> try_tof() const
    {
        camlux_tof raw = CAMLUX_TOF_INIT;
        camlux_tof_noise noise = CAMLUX_TOF_NOISE_INIT;
        std::int32_t is_set = 0;
        std::vector<std::uint32_t> ambient;
        // First the number of ambient lights, then their indices.
        camlux_status status = camlux_scene_get_tof(get(), &raw, &noise, nullptr, 0, &is_set);
        if (status == CAMLUX_OK && raw.ambient_light_count > 0) {
            ambient.resize(raw.ambient_light_count);
            status = camlux_scene_get_tof(get(), &raw, &noise, ambient.data(), ambient.size(), &is_set);
        }
        return detail::ended(status, is_set ? std::optional(detail::tof_of(raw)) : std::nullopt);
    }

    /** \param indirect std::nullopt: direct light only. */
    void set_indirect(const std::optional<camlux::indirect> &indirect) { try_set_indirect(indirect).value(); }
    result<void> try_set_indirect(const std::optional<camlux::indirect> &indirect)
    {
        return detail::ended(camlux_scene_set_indirect(get(), indirect ? &*indirect : nullptr));
    }

    std::optional<camlux::indirect> indirect() const { return try_indirect().value(); }
    result<std::optional<camlux::indirect>> try_indirect() const
    {
        camlux::indirect found;
        std::int32_t is_set = 0;
        const camlux_status status = camlux_scene_get_indirect(get(), &found, &is_set);
        return detail::ended(status, is_set ? std::optional(found) : std::nullopt);
    }

    /** Sets how direct light is computed. */
    void set_direct(camlux::shadow shadow) { try_set_direct(shadow).value(); }
    result<void> try_set_direct(camlux::shadow shadow)
    {
        camlux_direct raw = CAMLUX_DIRECT_INIT;
        raw.shadow = detail::number(shadow);
        return detail::ended(camlux_scene_set_direct(get(), &raw));
    }

    shadow direct() const { return try_direct().value(); }
    result<shadow> try_direct() const
    {
        camlux_direct raw = CAMLUX_DIRECT_INIT;
        const camlux_status status = camlux_scene_get_direct(get(), &raw);
        return detail::ended(status, static_cast<shadow>(raw.shadow));
    }

    /** \return the number of the texture for members of camlux::material: the first one has 1, and 0 stands for none. */
    std::uint32_t add_texture(const camlux::texture &texture) { return try_add_texture(texture).value(); }
    result<std::uint32_t> try_add_texture(const camlux::texture &texture)
    {
        if (const result<void> fine = detail::check_texts({{"texture.name", texture.name}}); !fine)
            return {fine.status(), fine.message()};
        const camlux_texture raw = detail::raw_of(texture);
        return added(camlux_scene_add_texture, raw);
    }

    void set_texture(std::uint32_t number, const camlux::texture &texture) { try_set_texture(number, texture).value(); }
    result<void> try_set_texture(std::uint32_t number, const camlux::texture &texture)
    {
        if (const result<void> fine = detail::check_texts({{"texture.name", texture.name}}); !fine)
            return {fine.status(), fine.message()};
        const camlux_texture raw = detail::raw_of(texture);
        return detail::ended(camlux_scene_set_texture(get(), number, &raw));
    }

    /** \return the index of the new part, as in the other add_ functions below. */
    std::uint32_t add_material(const camlux::material &material) { return try_add_material(material).value(); }
    result<std::uint32_t> try_add_material(const camlux::material &material)
    {
        if (const result<void> fine = detail::check_texts({{"material.name", material.name}}); !fine)
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
        if (const result<void> fine = detail::check_texts({{"material.name", material.name}}); !fine)
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

    bool is_visible(camlux::part part, std::uint32_t index) const { return try_is_visible(part, index).value(); }
    result<bool> try_is_visible(camlux::part part, std::uint32_t index) const
    {
        std::int32_t is_visible = 0;
        const camlux_status status = camlux_scene_get_visible(get(), detail::number(part), index, &is_visible);
        return detail::ended(status, is_visible != 0);
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

}  // namespace camlux

#endif  /* CAMLUX_SCENE_HPP */
