// Builds the Cornell box from arrays.
#include "cornell.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace {

// The OBJ file uses the colours in this order. The same order here gives the same layer id.material.
enum Colour : std::uint32_t { red, green, white };

struct Quad {
    Colour colour;
    std::array<std::array<double, 3>, 4> corners_m;
};

constexpr Quad quads[] = {
    // Walls: left, right, floor, back. The ceiling is open.
    {red, {{{-1.01, 0, 0.99}, {-0.99, 0, -1.04}, {-1.02, 1.99, -1.04}, {-1.02, 1.99, 0.99}}}},
    {green, {{{1, 0, -1.04}, {1, 0, 0.99}, {1, 1.99, 0.99}, {1, 1.99, -1.04}}}},
    {white, {{{-1.01, 0, 0.99}, {1, 0, 0.99}, {1, 0, -1.04}, {-0.99, 0, -1.04}}}},
    {white, {{{-0.99, 0, -1.04}, {1, 0, -1.04}, {1, 1.99, -1.04}, {-1.02, 1.99, -1.04}}}},
    // The low block.
    {white, {{{-0.05, 0, 0.57}, {-0.05, 0.6, 0.57}, {0.13, 0.6, 0}, {0.13, 0, 0}}}},
    {white, {{{0.7, 0, 0.17}, {0.7, 0.6, 0.17}, {0.53, 0.6, 0.75}, {0.53, 0, 0.75}}}},
    {white, {{{0.53, 0, 0.75}, {0.7, 0, 0.17}, {0.13, 0, 0}, {-0.05, 0, 0.57}}}},
    {white, {{{0.53, 0.6, 0.75}, {0.7, 0.6, 0.17}, {0.13, 0.6, 0}, {-0.05, 0.6, 0.57}}}},
    {white, {{{0.13, 0, 0}, {0.13, 0.6, 0}, {0.7, 0.6, 0.17}, {0.7, 0, 0.17}}}},
    {white, {{{0.53, 0, 0.75}, {0.53, 0.6, 0.75}, {-0.05, 0.6, 0.57}, {-0.05, 0, 0.57}}}},
    // The tall block.
    {white, {{{-0.53, 0, 0.09}, {-0.53, 1.2, 0.09}, {-0.71, 1.2, -0.49}, {-0.71, 0, -0.49}}}},
    {white, {{{-0.14, 0, -0.67}, {-0.14, 1.2, -0.67}, {0.04, 1.2, -0.09}, {0.04, 0, -0.09}}}},
    {white, {{{-0.53, 0, 0.09}, {0.04, 0, -0.09}, {-0.14, 0, -0.67}, {-0.71, 0, -0.49}}}},
    {white, {{{-0.53, 1.2, 0.09}, {0.04, 1.2, -0.09}, {-0.14, 1.2, -0.67}, {-0.71, 1.2, -0.49}}}},
    {white, {{{-0.71, 0, -0.49}, {-0.71, 1.2, -0.49}, {-0.14, 1.2, -0.67}, {-0.14, 0, -0.67}}}},
    {white, {{{0.04, 0, -0.09}, {0.04, 1.2, -0.09}, {-0.53, 1.2, 0.09}, {-0.53, 0, 0.09}}}},
};

// The values of scenes/cornell.mtl.
camlux::material diffuse(camlux::rgb kd, const char *name)
{
    camlux::material made;
    made.kd = kd;
    made.shininess = 1;
    made.name = name;
    return made;
}

std::uint32_t add_box(camlux::scene &scene)
{
    std::vector<std::array<double, 3>> positions_m;
    std::vector<std::array<std::uint16_t, 3>> triangles;
    std::vector<std::uint32_t> colours;
    for (const Quad &quad : quads) {
        const auto corner = [first = positions_m.size()](std::size_t index) {
            return static_cast<std::uint16_t>(first + index);
        };
        triangles.push_back({corner(0), corner(1), corner(2)});
        triangles.push_back({corner(0), corner(2), corner(3)});
        colours.insert(colours.end(), 2, quad.colour);
        positions_m.insert(positions_m.end(), quad.corners_m.begin(), quad.corners_m.end());
    }
    // add_mesh copies these arrays and accepts their element types as they are.
    camlux::mesh mesh;
    mesh.positions_m = positions_m;
    mesh.triangles = triangles;
    mesh.triangle_materials = colours;
    mesh.name = "box";
    return scene.add_mesh(mesh);
}

}  // namespace

const camlux::vec3 cornell_light_m = {-0.005, 1.98, -0.03};

Cornell cornell_box(std::uint32_t size_px)
{
    camlux::scene scene = camlux::scene::create();

    camlux::camera camera;
    camera.width_px = camera.height_px = size_px;
    camera.position_m = {0.0, 1.0, 3.2};
    camera.look_at_m = {0.0, 1.0, 0.0};
    camera.up = {0.0, 1.0, 0.0};
    camera.fov_y_deg = 50.0;
    scene.set_camera(camera);

    camlux::sensor sensor;
    sensor.pixel_pitch_um = {12.0, 12.0};
    sensor.exposure_time_s = 1.0e-3;
    sensor.duty_cycle = 0.5;
    scene.set_sensor(sensor);

    camlux::indirect indirect;
    indirect.estimator = CAMLUX_ESTIMATOR_RSM_AVERAGE;
    indirect.rsm_size = 64;
    scene.set_indirect(indirect);

    const double power_w = 50.26548245743669;  // 4 W/sr
    const std::uint32_t light = scene.add_light(camlux::light::point(cornell_light_m, {power_w, power_w, power_w}));

    scene.add_material(diffuse({0.63, 0.065, 0.05}, "red"));
    scene.add_material(diffuse({0.14, 0.45, 0.091}, "green"));
    scene.add_material(diffuse({0.725, 0.71, 0.68}, "white"));
    const std::uint32_t instance = scene.add_instance(add_box(scene));
    return {scene, light, instance};
}
