// Tests what camlux.hpp adds to camlux.h. scripts/test-package runs it as C++17 and as C++20.
#include <array>
#include <atomic>
#include <camlux.hpp>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <thread>
#include <type_traits>
#include <unistd.h>
#include <vector>

#define CHECK(is_so) check((is_so), #is_so, __LINE__)

namespace {

void check(bool is_so, const char *what, int line)
{
    if (is_so)
        return;
    std::fprintf(stderr, "test.cpp:%d: not so: %s (last error: %s)\n", line, what, camlux_last_error());
    std::exit(EXIT_FAILURE);
}

// The status that a call throws, or CAMLUX_OK.
template <class Function>
camlux_status thrown_by(Function &&function)
{
    try {
        function();
    } catch (const camlux::error &error) {
        CHECK(std::strlen(error.what()) > 0);
        return error.status();
    }
    return CAMLUX_OK;
}

struct HostProblem {
    int number;
};

template <class Function>
int host_problem_of(Function &&function)
{
    try {
        function();
    } catch (const HostProblem &problem) {
        return problem.number;
    }
    return 0;
}

std::uint32_t handles()
{
    std::uint32_t count = 0;
    CHECK(camlux_handle_count(&count) == CAMLUX_OK);
    return count;
}

template <class Raw>
bool same(const Raw &a, const Raw &b)
{
    return std::memcmp(&a, &b, sizeof(Raw)) == 0;  // The structs of the interface have no padding.
}

void values_begin_like_those_of_c()
{
    const camlux_camera camera = CAMLUX_CAMERA_INIT;
    const camlux_sensor sensor = CAMLUX_SENSOR_INIT;
    const camlux_indirect indirect = CAMLUX_INDIRECT_INIT;
    const camlux_pose pose = CAMLUX_POSE_INIT;
    const camlux_material material = CAMLUX_MATERIAL_INIT;
    const camlux_texture texture = CAMLUX_TEXTURE_INIT;
    const camlux_light light = CAMLUX_LIGHT_INIT;
    const camlux_pattern pattern = CAMLUX_PATTERN_INIT;
    const camlux_projected_image image = CAMLUX_PROJECTED_IMAGE_INIT;
    const camlux_exr_options exr = CAMLUX_EXR_OPTIONS_INIT;
    const camlux_tof tof = CAMLUX_TOF_INIT;
    const camlux_tof_noise noise = CAMLUX_TOF_NOISE_INIT;
    const camlux_render_options render = CAMLUX_RENDER_OPTIONS_INIT;
    CHECK(same(camlux::detail::raw_of(camlux::camera()), camera));
    CHECK(same(camlux::detail::raw_of(camlux::sensor()), sensor));
    CHECK(same<camlux_indirect>(camlux::indirect(), indirect));
    CHECK(same(camlux::detail::raw_of(camlux::pose()), pose));
    CHECK(same(camlux::detail::raw_of(camlux::material()), material));
    CHECK(same(camlux::detail::raw_of(camlux::texture()), texture));
    CHECK(same(camlux::detail::raw_of(camlux::light()), light));
    CHECK(same(camlux::detail::raw_of(camlux::pattern()), pattern));
    CHECK(same(camlux::detail::raw_of(camlux::projected_image()), image));
    std::vector<std::int32_t> numbers;
    CHECK(same(camlux::detail::raw_of(camlux::exr_options(), numbers), exr));
    CHECK(same(camlux::detail::raw_of(camlux::tof_noise()), noise));
    CHECK(same(camlux::detail::raw_of(camlux::tof(), nullptr), tof));
    CHECK(camlux::render_options().submission_target_ms == render.submission_target_ms);
    CHECK(camlux::vec3(camlux::camera().up).y == 1);
    camlux::exr_options depth;
    depth.layers = {camlux::layer::depth, camlux::layer::radiance};
    depth.multipart = true;
    CHECK(camlux::detail::raw_of(depth, numbers).layer_count == 2);
    CHECK(camlux::detail::raw_of(depth, numbers).multipart == 1);
    CHECK((numbers == std::vector<std::int32_t>{CAMLUX_LAYER_DEPTH, CAMLUX_LAYER_RADIANCE}));
}

// A camera with a pose that faces a point looks at that point, in all directions.
void poses_face_a_point()
{
    camlux::scene scene = camlux::scene::create();
    for (int i = 0; i < 27; ++i) {
        const camlux::vec3 from = {0.3, -0.2, 0.7};
        const camlux::vec3 to = {from.x + i % 3 - 1, from.y + i / 3 % 3 - 1, from.z + i / 9 - 1};
        if (i == 13)  // No direction.
            continue;
        const camlux::pose pose = camlux::pose::facing(from, to);
        scene.set_pose(camlux::part::camera, 0, pose);
        const camlux::camera camera = scene.camera();
        const camlux::vec3 a = {to.x - from.x, to.y - from.y, to.z - from.z};
        const camlux::vec3 b = {camera.look_at_m.x - from.x, camera.look_at_m.y - from.y, camera.look_at_m.z - from.z};
        const double along = a.x * b.x + a.y * b.y + a.z * b.z;
        const double lengths = std::sqrt((a.x * a.x + a.y * a.y + a.z * a.z) * (b.x * b.x + b.y * b.y + b.z * b.z));
        CHECK(std::abs(along / lengths - 1) < 1e-12);
        CHECK(camera.up.y > -1e-12);
    }
}

// Matrices of 3 x 4 and 4 x 4 numbers, in the axes of OpenCV and of OpenGL.
void matrices_are_poses()
{
    // A quarter turn about z, twice as large.
    const std::array<double, 12> turned = {0, -2, 0, 1, 2, 0, 0, 2, 0, 0, 2, 3};
    const camlux::pose pose = camlux::pose::from_matrix(turned);
    CHECK(std::abs(pose.scale - 2) < 1e-12 && pose.position_m.y == 2);
    CHECK(std::abs(pose.orientation.z - std::sqrt(0.5)) < 1e-12 && std::abs(pose.orientation.w - std::sqrt(0.5)) < 1e-12);
    const double square[16] = {1, 0, 0, 4, 0, 1, 0, 5, 0, 0, 1, 6, 0, 0, 0, 1};
    camlux::scene scene = camlux::scene::create();
    scene.set_pose(camlux::part::camera, 0, camlux::pose::from_matrix(square, camlux::axes::opengl));
    const camlux::camera camera = scene.camera();
    CHECK(std::abs(camera.look_at_m.z - 5) < 1e-12 && std::abs(camera.up.y - 1) < 1e-12);
    scene.set_pose(camlux::part::camera, 0, camlux::pose::from_matrix(square));
    CHECK(std::abs(scene.camera().look_at_m.z - 7) < 1e-12 && std::abs(scene.camera().up.y + 1) < 1e-12);
    const std::vector<double> flat = {1, 0, 0, 4, 0, 0, 0, 5, 0, 0, 1, 6};
    CHECK(thrown_by([&] { (void)camlux::pose::from_matrix(flat); }) == CAMLUX_ERROR_SCENE);
    CHECK(camlux::pose::try_from_matrix({}).status() == CAMLUX_ERROR_INVALID_ARGUMENT);
}

// C would read these texts up to the NUL.
void texts_with_a_nul_are_refused(const camlux::frame &frame)
{
    const std::string text = std::string("a") + '\0' + "b.exr";
    camlux::scene scene = camlux::scene::create();
    camlux::texture texture;
    camlux::material material;
    camlux::mesh mesh;
    camlux::pattern pattern;
    camlux::projected_image image;
    camlux::device_options device;
    texture.name = material.name = mesh.name = pattern.path = image.path = device.name = text;
    const auto refused = [](const auto &result, const char *name = "name has a") {
        return result.status() == CAMLUX_ERROR_INVALID_ARGUMENT && result.message().find("NUL after \"a\"") != std::string::npos &&
               result.message().find(name) != std::string::npos;
    };
    CHECK(refused(camlux::scene::try_load(text), "path has a") && refused(camlux::device::try_open(device)));
    CHECK(refused(scene.try_add_texture(texture)) && refused(scene.try_set_texture(0, texture)));
    CHECK(refused(scene.try_add_material(material)) && refused(scene.try_set_material(0, material)));
    CHECK(refused(scene.try_add_mesh(mesh)) && refused(scene.try_set_mesh(0, mesh)));
    const camlux::light lamp = camlux::light::lamp({}, {0, -1, 0}, {1, 0, 0}, pattern, {});
    CHECK(refused(scene.try_add_light(lamp), "pattern.path has a") && refused(scene.try_set_light(0, lamp), "path"));
    CHECK(refused(scene.try_add_light(camlux::light::projector({}, {0, -1, 0}, {1, 0, 0}, image, {})), "projected_image.path has a"));
    CHECK(refused(frame.try_write_exr(text), "path") && refused(frame.try_write_png(text), "path"));
    CHECK(thrown_by([&] { frame.write_exr("x.jpg"); }) == CAMLUX_ERROR_INVALID_ARGUMENT);
    CHECK(thrown_by([&] { frame.write_png("x.exr"); }) == CAMLUX_ERROR_INVALID_ARGUMENT);
}

void values_come_back()
{
    camlux::scene scene = camlux::scene::create();
    camlux::camera camera;
    camera.width_px = 7;
    camera.position_m = {1, 2, 3};
    camera.look_at_m = {1, 2, 5};
    camera.lens = camlux::intrinsics{10, 11, 3.5, 4.5};
    scene.set_camera(camera);
    const camlux::camera back = scene.camera();
    CHECK(back.width_px == 7 && back.position_m.y == 2 && back.look_at_m.z == 5);
    CHECK(back.lens && back.lens->fy_px == 11 && back.lens->cy_px == 4.5);
    camera.lens = camlux::intrinsics{300, 310, 3.5, 240, camlux::lens_model::fisheye, {0.01, 0.002}};
    camera.samples = 16;
    camera.filter = camlux::pixel_filter::gaussian;
    scene.set_camera(camera);
    const camlux::camera distorted = scene.camera();
    CHECK(distorted.samples == 16 && distorted.filter == camlux::pixel_filter::gaussian);
    CHECK(distorted.lens->model == camlux::lens_model::fisheye && distorted.lens->distortion[1] == 0.002);
    camera.lens->model = camlux::lens_model::rational;
    camera.lens->distortion[13] = 0.05;
    camera.lens->skew_px = 1.5;
    scene.set_camera(camera);
    const camlux::camera tilted = scene.camera();
    CHECK(tilted.lens->distortion == camera.lens->distortion && tilted.lens->skew_px == 1.5);
    camera.lens.reset();
    camera.fov_x_deg = 60;
    scene.set_camera(camera);
    CHECK(scene.camera().fov_x_deg == 60.0 && !scene.camera().lens);
    camera.fov_x_deg.reset();
    camera.equirectangular = true;
    scene.set_camera(camera);
    CHECK(scene.camera().equirectangular && !scene.camera().fov_x_deg && !scene.camera().lens);
    camera.equirectangular = false;
    camera.orthographic_height_m = 2.5;
    scene.set_camera(camera);
    CHECK(scene.camera().orthographic_height_m == 2.5 && !scene.camera().equirectangular && !scene.camera().lens);
    CHECK(scene.camera().fov_y_deg == 45);
    camera.orthographic_height_m = std::nullopt;
    scene.set_camera(camera);

    const std::uint32_t lamp = scene.add_light(camlux::light::disc({0, 1, 0}, {0, -1, 0}, 0.1, {1, 2, 3}));
    CHECK(scene.light(lamp).radius_m == 0.1);
    const auto flat = scene.try_add_light(camlux::light::disc({0, 1, 0}, {0, -1, 0}, 0, {1, 2, 3}));
    CHECK(flat.status() == CAMLUX_ERROR_SCENE && flat.message().find("radius_m of a disc") != std::string::npos);
    camlux::light both = scene.light(lamp);
    both.width_m = both.height_m = 0.1;
    CHECK(thrown_by([&] { scene.set_light(lamp, both); }) == CAMLUX_ERROR_SCENE);
    scene.set_light(lamp, camlux::light::rectangle({0, 1, 0}, {0, -1, 0}, {1, 0, 0}, 0.2, 0.3, {1, 2, 3}));
    CHECK(scene.light(lamp).up.x == 1 && scene.light(lamp).height_m == 0.3);
    const std::uint32_t light = scene.add_light(camlux::light::spot({0, 1, 0}, {0, -1, 0}, {1, 2, 3}, 10, 20));
    CHECK(scene.light(light).kind == camlux::light_kind::spot && scene.light(light).power_w.b == 3);
    CHECK(scene.light(light).direction.y == -1 && scene.light(light).outer_half_angle_deg == 20);
    scene.set_light(light, camlux::light::directional({0, -2, 0}, {4, 5, 6}));
    CHECK(scene.light(light).irradiance_w_m2.g == 5);
    scene.set_pose(camlux::part::light, light, {{}, {1, 0, 0, 0}});
    CHECK(std::abs(scene.light(light).direction.z + 1) < 1e-12);
    CHECK(scene.pose(camlux::part::light, lamp).position_m.y == 1);

    camlux::material red;
    red.kd = {0.5, 0.1, 0.1};
    red.name = "red";
    const std::uint32_t material = scene.add_material(red);
    CHECK(scene.material(material).kd.r == 0.5 && scene.material(material).kd_texture == 0);
    const std::uint8_t up[3] = {128, 128, 255};
    camlux::texture map;
    map.width_px = map.height_px = 1;
    map.pixels = up;
    red.normal_texture = scene.add_texture(map);
    scene.set_material(material, red);
    CHECK(red.normal_texture == 1 && scene.material(material).normal_texture == 1);
    map.encoding = camlux::encoding::srgb;
    CHECK(thrown_by([&] { scene.set_texture(1, map); }) == CAMLUX_ERROR_SCENE);
    camlux::mesh triangle;
    const std::vector<std::array<float, 3>> corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::vector<std::array<std::uint32_t, 3>> triangles = {{0, 1, 2}};
    triangle.positions_m = corners;
    triangle.triangles = triangles;
    const std::uint32_t mesh = scene.add_mesh(triangle);
    scene.set_mesh(mesh, triangle);
    const std::uint32_t first = scene.add_instance(mesh), second = scene.add_instance(mesh);
    scene.set_poses(camlux::part::instance, {{{1, 0, 0}, {}, 2}, {{0, 0, 3}, {}}});
    CHECK(scene.pose(camlux::part::instance, first).scale == 2 && scene.pose(camlux::part::instance, second).position_m.z == 3);
    scene.set_visible(camlux::part::instance, first, false);
    CHECK(!scene.is_visible(camlux::part::instance, first) && scene.is_visible(camlux::part::instance, second));
    scene.remove(camlux::part::instance, second);
    CHECK(!scene.try_is_visible(camlux::part::instance, second).ok());
    CHECK(!scene.try_pose(camlux::part::instance, second).ok());
    CHECK(scene.add_instance(mesh) == second);
}

void settings_come_back()
{
    camlux::scene scene = camlux::scene::create();
    CHECK(!scene.sensor() && !scene.tof() && !scene.indirect() && scene.direct() == camlux::shadow::standard);
    scene.set_direct(camlux::shadow::rays);
    CHECK(scene.direct() == camlux::shadow::rays);
    camlux::indirect sum;
    sum.estimator = CAMLUX_ESTIMATOR_RSM_AVERAGE;
    sum.rsm_size = 32;
    scene.set_indirect(sum);
    CHECK(scene.indirect()->estimator == CAMLUX_ESTIMATOR_RSM_AVERAGE && scene.indirect()->rsm_size == 32);
    scene.set_indirect(camlux::indirect());
    CHECK(scene.indirect()->target_error == 0.02 && scene.indirect()->rsm_size == 0);
    camlux::sensor sensor;
    sensor.pixel_pitch_um = {10, 11};
    sensor.exposure_time_s = 1e-3;
    sensor.duty_cycle = 0.5;
    sensor.wavelength_nm = 850;
    sensor.quantum_efficiency = 0.25;
    sensor.f_number = 2;
    scene.set_sensor(sensor);
    CHECK(!scene.sensor()->vignetting);
    sensor.vignetting = {-0.3, 0.1, -0.05};
    scene.set_sensor(sensor);
    CHECK(same(camlux::detail::raw_of(*scene.sensor()), camlux::detail::raw_of(sensor)) && !scene.sensor()->noise);
    camlux::vignetting_map map;
    map.width_px = 2;
    map.height_px = 1;
    map.values = {1, 0.5f};
    scene.set_vignetting_map(map);
    map.height_px = 2;
    CHECK(scene.try_set_vignetting_map(map).status() == CAMLUX_ERROR_INVALID_ARGUMENT);
    scene.set_vignetting_map(std::nullopt);
    sensor.bayer = camlux::bayer_pattern::bggr;
    sensor.noise = camlux::tof_noise();
    sensor.noise->full_well_e = 5e3;
    sensor.noise->dsnu_e = 0.5;
    scene.set_sensor(sensor);
    CHECK(scene.sensor()->bayer == camlux::bayer_pattern::bggr && scene.sensor()->noise->dsnu_e == 0.5);
    sensor.noise = std::nullopt;
    sensor.bayer = camlux::bayer_pattern::none;
    scene.set_sensor(sensor);
    CHECK(!scene.sensor()->noise);
    camlux::tof tof;
    tof.frequencies = {{20e6, 1}, {100e6, 0.75}};
    tof.ambient_lights = {0, 2};
    scene.set_tof(tof);
    CHECK(scene.tof()->frequencies[1].contrast == 0.75 && scene.tof()->ambient_lights == tof.ambient_lights && !scene.tof()->noise);
    tof.noise = camlux::tof_noise();
    tof.noise->full_well_e = 1e4;
    tof.output = camlux::charge::dn;
    tof.ambient_lights.clear();
    scene.set_tof(tof);
    scene.set_tof(scene.tof());
    CHECK(scene.tof()->noise->full_well_e == 1e4 && scene.tof()->output == camlux::charge::dn && scene.tof()->ambient_lights.empty());
    scene.set_sensor(std::nullopt);
    CHECK(!scene.sensor() && camlux::scene().try_tof().status() == CAMLUX_ERROR_INVALID_HANDLE);

    camlux::texture grey;
    const std::uint8_t half[1] = {128};
    grey.width_px = grey.height_px = grey.channels = 1;
    grey.pixels = half;
    camlux::material shiny;
    shiny.ks = {0.5, 0.5, 0.5};
    shiny.shininess = 20;
    shiny.ks_texture = shiny.shininess_texture = shiny.alpha_texture = scene.add_texture(grey);
    shiny.alpha_cutoff = 0.25;
    const camlux::material found = scene.material(scene.add_material(shiny));
    CHECK(found.ks_texture == 1 && found.shininess_texture == 1 && found.alpha_cutoff == 0.25 && !found.microfacets);

    camlux::material gold;
    gold.kd = {1, 0.77, 0.34};
    gold.microfacets = camlux::metallic_roughness{0.3, 1};
    gold.metallic_roughness_texture = 1;
    gold.emission_w_sr_m2 = {3, 2, 1};
    gold.emission_texture = 1;
    gold.one_sided = true;
    const camlux::material as_set = scene.material(scene.add_material(gold));
    CHECK(as_set.microfacets && as_set.microfacets->roughness == 0.3 && as_set.microfacets->metallic == 1);
    CHECK(as_set.microfacets->ior == 1.5 && as_set.microfacets->specular == 1 && as_set.metallic_roughness_texture == 1);
    CHECK(as_set.emission_w_sr_m2.r == 3 && as_set.emission_w_sr_m2.b == 1 && as_set.emission_texture == 1 && as_set.one_sided && !found.one_sided);
}

void handles_share_and_give_back()
{
    const std::uint32_t before = handles();
    {
        camlux::scene first = camlux::scene::create();
        CHECK(handles() == before + 1);
        camlux::scene copy = first;
        CHECK(copy == first && handles() == before + 1);
        camlux::scene moved = std::move(first);
        CHECK(!first && moved == copy);
        CHECK(thrown_by([&] { first.validate(); }) == CAMLUX_ERROR_INVALID_HANDLE);
        copy = camlux::scene();
        moved.set_direct(camlux::shadow::rays);
        camlux::scene &itself = moved;
        moved = itself;
        CHECK(moved && handles() == before + 1);
    }
    CHECK(handles() == before);
}

void both_forms_tell_the_same()
{
    camlux::scene scene = camlux::scene::create();
    camlux::camera camera;
    camera.fov_y_deg = -1;
    CHECK(thrown_by([&] { scene.set_camera(camera); }) == CAMLUX_ERROR_SCENE);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK(std::isnan(camlux::pose::facing({0, 1, 0}, {0, nan, 0}).orientation.w));
    static_assert(!std::is_constructible_v<camlux::elements<3>, std::vector<std::array<float, 3>>>, "it would dangle");
    static_assert(!std::is_constructible_v<camlux::elements<3>, std::array<std::array<float, 3>, 4>>, "it would dangle");
    static_assert(std::is_constructible_v<camlux::elements<3>, std::array<std::array<float, 3>, 4> &>, "it lives on");
    static_assert(std::is_constructible_v<camlux::elements<3>, std::vector<std::array<float, 3>> &>, "it is kept by the caller");
    const camlux::result<void> result = scene.try_set_camera(camera);
    CHECK(!result && result.status() == CAMLUX_ERROR_SCENE && result.message() == camlux_last_error());
    CHECK(thrown_by([] { camlux::scene::load("no such file.toml"); }) == CAMLUX_ERROR_SCENE);
    camlux::result<camlux::scene> none = camlux::scene::try_load("no such file.toml");
    CHECK(!none.ok() && none.message().find("no such file.toml") != std::string::npos);
    CHECK(thrown_by([&] { none.value(); }) == CAMLUX_ERROR_SCENE);
    CHECK(scene.try_counts()->lights == 0);
    CHECK(scene.bounds().is_empty == 1);
    CHECK(camlux::version() / 1000000 == CAMLUX_VERSION_MAJOR);
}

// Arrays that would be read incorrectly do not compile.
template <std::size_t N, class... Arguments>
constexpr bool takes = std::is_constructible_v<camlux::elements<N>, Arguments...>;

static_assert(takes<3, const std::vector<std::array<float, 3>> &> && takes<3, const std::array<std::array<double, 3>, 8> &>);
static_assert(takes<2, const std::vector<std::array<float, 2>> &> && takes<1, const std::vector<std::uint16_t> &>);
static_assert(!takes<3, const std::vector<std::array<std::uint32_t, 4>> &>, "quads are no triangles");
static_assert(!takes<3, const std::vector<std::array<float, 2>> &> && !takes<2, const std::vector<std::array<float, 3>> &>);
static_assert(!takes<3, const std::vector<float> &>, "which of them make an element?");
static_assert(!takes<3, const float *, std::size_t>, "a count of numbers is no count of elements");
static_assert(takes<3, const float *, std::size_t, std::size_t>);

struct Vertex {
    float position_m[3];
    std::uint32_t something_else;
};

// A floor under a lamp. The floor is an interleaved array with 16-bit indices.
camlux::scene small_scene()
{
    const std::vector<Vertex> vertices = {{{-1, 0, -1}, 0}, {{-1, 0, 1}, 0}, {{1, 0, 1}, 0}, {{1, 0, -1}, 0}};
    const std::array<std::array<std::uint16_t, 3>, 2> triangles = {{{0, 1, 2}, {0, 2, 3}}};
    camlux::scene scene = camlux::scene::create();
    camlux::material grey;
    grey.kd = {0.5, 0.5, 0.5};
    camlux::mesh floor;
    floor.material = scene.add_material(grey);
    floor.positions_m = {&vertices[0].position_m[0], vertices.size(), sizeof(Vertex)};
    floor.triangles = triangles;
    scene.add_instance(scene.add_mesh(floor));
    scene.add_light(camlux::light::point({0, 2, 0}, {10, 10, 10}));
    camlux::camera camera;
    camera.width_px = camera.height_px = 33;
    camera.position_m = {0, 3, 0};
    camera.look_at_m = {0, 0, 0};
    camera.up = {0, 0, -1};
    scene.set_camera(camera);

    // The same positions, not interleaved.
    const std::vector<float> flat = {-1, 0, -1, -1, 0, 1, 1, 0, 1, 1, 0, -1};
    camlux::mesh again = floor;
    again.positions_m = {flat.data(), flat.size() / 3, 3 * sizeof(float)};
    CHECK(camlux::detail::raw_of(again).vertex_count == 4);
    again.positions_m = {flat.data(), flat.size(), sizeof(float)};
    CHECK(thrown_by([&] { scene.add_mesh(again); }) == CAMLUX_ERROR_INVALID_ARGUMENT);

    floor.normals = {&vertices[0].position_m[0], 3, sizeof(Vertex)};
    CHECK(thrown_by([&] { scene.add_mesh(floor); }) == CAMLUX_ERROR_INVALID_ARGUMENT);
    CHECK(scene.counts().meshes == 1);
    return scene;
}

// A lamp that shines down only, and a projector of two pixels, over the floor.
void lamps_and_projectors_shine(camlux::renderer &renderer)
{
    camlux::scene scene = small_scene();
    scene.set_visible(camlux::part::light, 0, false);
    camlux::pattern pattern;
    pattern.gammas_deg = {0, 90};
    pattern.planes_deg = {0};
    pattern.intensities = {1, 1};
    // All of the power in half the sphere: twice the radiance under a point light.
    const std::uint32_t lamp = scene.add_light(camlux::light::lamp({0, 2, 0}, {0, -1, 0}, {1, 0, 0}, pattern, {10, 10, 10}));
    const double under_point = 10 * 0.5 / (16 * 9.8696044);
    const auto middle = [&](std::size_t x) {
        return static_cast<double>(renderer.render(scene).view<float>(camlux::layer::radiance)(x, 16, 1));
    };
    CHECK(std::abs(middle(16) / under_point - 2) < 1e-4);
    camlux::light half = scene.light(lamp);
    half.power_w = {5, 5, 5};
    scene.set_light(lamp, half);
    CHECK(std::abs(middle(16) / under_point - 1) < 1e-4);
    pattern.intensities.pop_back();
    CHECK(thrown_by([&] { scene.add_light(camlux::light::lamp({}, {0, -1, 0}, {1, 0, 0}, pattern, {})); }) ==
          CAMLUX_ERROR_INVALID_ARGUMENT);

    camlux::projected_image image;
    image.width_px = 2;
    image.height_px = 1;
    image.values = {0, 1};
    image.fov_y_deg = 40;
    // The camera's right is the world's +x, and so is the projector's, with the same up.
    scene.set_light(lamp, camlux::light::projector({0, 2, 0}, {0, -1, 0}, {0, 0, -1}, image, {10, 10, 10}));
    CHECK(middle(14) == 0 && middle(18) > 0);
    image.lens = camlux::intrinsics{1, 1, 1, 0.5};
    scene.set_light(lamp, camlux::light::projector({0, 2, 0}, {0, -1, 0}, {0, 0, -1}, image, {10, 10, 10}));
    CHECK(middle(14) == 0 && middle(18) > 0);
    image.values.clear();
    CHECK(thrown_by([&] { scene.add_light(camlux::light::projector({}, {0, -1, 0}, {0, 0, -1}, image, {})); }) ==
          CAMLUX_ERROR_INVALID_ARGUMENT);
}

// Whether a layer can be copied to such an argument.
template <class Destination, class = void>
constexpr bool is_copied_to = false;

template <class Destination>
constexpr bool is_copied_to<Destination, std::void_t<decltype(std::declval<const camlux::frame &>().copy(camlux::layer::depth,
                                                                                                          std::declval<Destination>()))>> = true;

void views_are_typed_and_keep_their_frame(const camlux::device &device, camlux::renderer &renderer)
{
    const camlux::scene scene = small_scene();
    const std::uint32_t before = handles();
    {
        const camlux::view<float> radiance = renderer.render(scene).view<float>(camlux::layer::radiance);
        CHECK(handles() == before + 1);
        CHECK(radiance.width() == 33 && radiance.height() == 33 && radiance.channels() == 3);
        CHECK(std::strcmp(radiance.unit(), "W/sr/m^2") == 0 && std::strcmp(radiance.name(), "radiance") == 0);
        // P kd / (4 pi^2 d^2), as in the example of camlux.h.
        CHECK(std::abs(radiance(16, 16, 1) - 10 * 0.5 / (16 * 9.8696044)) < 1e-5);
        CHECK(radiance.pixel(16, 16)[1] == radiance(16, 16, 1) && radiance.row(16)[49] == radiance(16, 16, 1));
        CHECK(radiance.data() == &radiance(0, 0) && radiance.data() + 3 * 33 == &radiance(0, 1));
        float sum = 0;
        for (const float value : radiance.row(16))
            sum += value;
        CHECK(sum > 0);
    }
    CHECK(handles() == before);

    // Nothing has changed, until the seed does.
    CHECK(renderer.render(scene).passes().empty());
    camlux::render_options other_seed;
    other_seed.seed = 1;
    const camlux::frame frame = renderer.render(scene, other_seed);
    CHECK(renderer.foretell_ms(scene) > 0.0);
    CHECK(frame.view<std::uint32_t>(camlux::layer::instance_id)(16, 16) == 1);
    CHECK(frame.try_view<float>(camlux::layer::instance_id).status() == CAMLUX_ERROR_INVALID_ARGUMENT);
    CHECK(frame.try_view<std::uint32_t>(camlux::layer::radiance).status() == CAMLUX_ERROR_INVALID_ARGUMENT);
    CHECK(frame.try_view<float>(camlux::layer::energy).status() == CAMLUX_ERROR_INVALID_ARGUMENT);
    CHECK(frame.try_vulkan_image(camlux::layer::radiance).status() == CAMLUX_ERROR_INVALID_ARGUMENT);
    std::vector<float> depth(33 * 33);
    frame.copy<float>(camlux::layer::depth, depth);
    std::vector<float> again(33 * 33);
    frame.copy(camlux::layer::depth, again);
    CHECK(again == depth && frame.try_copy(camlux::layer::depth, camlux::span<float>(again)).ok());
    std::array<std::uint32_t, 33 * 33> ids = {};
    frame.copy(camlux::layer::instance_id, ids);
    CHECK(ids[33 * 16 + 16] == 1 && !frame.try_copy(camlux::layer::depth, ids).ok());
    static_assert(!is_copied_to<const std::vector<float> &> && !is_copied_to<std::vector<float>> && !is_copied_to<std::vector<double> &>);
    static_assert(is_copied_to<std::vector<float> &> && is_copied_to<camlux::span<float> &> && is_copied_to<camlux::span<float>>);
    CHECK(depth[33 * 16 + 16] == frame.view<float>(camlux::layer::depth)(16, 16));
    CHECK(frame.try_copy<float>(camlux::layer::radiance, depth).status() == CAMLUX_ERROR_INVALID_ARGUMENT);
    CHECK(frame.layers().size() > 5 && !frame.passes().empty() && frame.stats().wall_ms > 0);
    CHECK(frame.stats().stop == camlux::stop_reason::none && !frame.stats().device.empty());
    texts_with_a_nul_are_refused(frame);

    camlux::renderer prepared = camlux::renderer::create(device);
    CHECK(prepared.prepare(scene) > 0 && prepared.render(scene).stats().preparation_ms == 0);
    camlux::scene without_sensor = camlux::scene::create();
    camlux::tof tof;
    tof.frequencies = {{20e6, 1}};
    without_sensor.set_tof(tof);
    CHECK(prepared.try_prepare(without_sensor).status() == CAMLUX_ERROR_SCENE);
}

// The lamp is 2 m above the floor and the camera 3 m, so half the path is 2.5 m.
void time_of_flight_has_its_layers(camlux::renderer &renderer)
{
    camlux::scene scene = small_scene();
    camlux::tof tof;
    tof.frequencies = {{20e6, 1}, {100e6, 0.75}};
    tof.phase_count = 3;
    scene.set_tof(tof);
    CHECK(thrown_by([&] { scene.validate(); }) == CAMLUX_ERROR_SCENE);
    camlux::sensor sensor;
    sensor.pixel_pitch_um = {10, 10};
    sensor.exposure_time_s = 1e-3;
    sensor.wavelength_nm = 850;
    sensor.quantum_efficiency = 0.5;
    scene.set_sensor(sensor);
    const camlux::frame frame = renderer.render(scene);
    const camlux::layer far_range = camlux::of_frequency(1, camlux::layer::tof_range);
    CHECK(std::abs(frame.view<float>(camlux::layer::half_path)(16, 16) - 2.5) < 1e-5);
    CHECK(std::abs(frame.view<float>(camlux::layer::tof_range)(16, 16) - 2.5) < 1e-4);
    CHECK(std::abs(frame.view<float>(far_range)(16, 16) - (2.5 - 299792458.0 / 200e6)) < 1e-4);
    CHECK(frame.view<std::uint32_t>(camlux::of_frequency(1, camlux::layer::tof_wraps))(16, 16) == 1);
    const auto taps = frame.view<float>(camlux::of_frequency(1, camlux::layer::tof_taps, 2));
    CHECK(std::strcmp(taps.name(), "tof1.phase2") == 0 && std::strcmp(taps.unit(), "e-") == 0);
    CHECK(taps.channels() == 2 && taps(16, 16, 0) > 0);

    for (const camlux::layer none : {camlux::of_frequency(0, camlux::layer::tof_taps, 8), camlux::of_frequency(4, far_range),
                                     camlux::of_frequency(9, camlux::layer::tof_range), camlux::of_frequency(-1, camlux::layer::tof_range),
                                     camlux::of_frequency(1, camlux::layer::radiance)}) {
        CHECK(frame.try_view<float>(none).status() == CAMLUX_ERROR_INVALID_ARGUMENT && static_cast<std::int32_t>(none) == -1);
        camlux::exr_options wrong;
        wrong.layers = {camlux::layer::radiance, none};
        CHECK(thrown_by([&] { frame.write_exr("never.exr", wrong); }) == CAMLUX_ERROR_INVALID_ARGUMENT);
    }
    for (const std::int32_t number : {32, 63, 128, 1 << 30}) {
        camlux::exr_options wrong;
        wrong.layers = {static_cast<camlux::layer>(number)};
        CHECK(frame.try_write_exr("never.exr", wrong).status() == CAMLUX_ERROR_INVALID_ARGUMENT);
    }

    camlux::exr_options options;
    // Of the second frequency only; a third does not exist.
    options.layers = {camlux::layer::half_path, far_range};
    frame.write_exr("far.exr", options);
    CHECK(std::remove("far.exr") == 0);
    options.layers = {camlux::of_frequency(2, camlux::layer::tof_range)};
    const auto missing = frame.try_write_exr("never.exr", options);
    CHECK(missing.status() == CAMLUX_ERROR_INVALID_ARGUMENT);
    CHECK(missing.message().find("tof2.range; choose one of its 2 frequencies") != std::string::npos);

    tof.noise = camlux::tof_noise();
    tof.noise->full_well_e = 1e6;
    tof.noise->bits = 24;
    tof.output = camlux::charge::dn;
    scene.set_tof(tof);
    camlux::render_options first, second;
    first.frame_index = 0;
    second.frame_index = 1;
    const camlux::frame noisy = renderer.render(scene, first);
    CHECK(std::strcmp(noisy.view<float>(camlux::layer::tof_taps).unit(), "DN") == 0);
    const camlux::frame other = renderer.render(scene, second);
    const auto range_m = [](const camlux::frame &of) { return of.view<float>(camlux::layer::tof_range)(16, 16); };
    CHECK(range_m(noisy) != range_m(other));
    first.seed = 7;
    CHECK(range_m(renderer.render(scene, first)) != range_m(noisy));
    // Without an index the renderer counts.
    const camlux::frame counted = renderer.render(scene);
    const std::uint32_t index = counted.stats().frame_index;
    CHECK(index > 1 && range_m(counted) != range_m(noisy) && range_m(counted) != range_m(other));
    CHECK(renderer.render(scene).stats().frame_index == index + 1);
    second.frame_index = index;
    CHECK(range_m(renderer.render(scene, second)) == range_m(counted));

    // A light of the camera moves with it, until it has a pose in the world.
    camlux::light carried = camlux::light::point({0.1, 0, 0}, {1, 1, 1});
    carried.relative_to = camlux::relative_to::camera;
    scene.set_light(0, carried);
    CHECK(scene.light(0).relative_to == camlux::relative_to::camera);
    camlux::pose camera_pose = scene.pose(camlux::part::camera, 0);
    const double before_m = scene.pose(camlux::part::light, 0).position_m.x;
    camera_pose.position_m.x += 1;
    scene.set_pose(camlux::part::camera, 0, camera_pose);
    CHECK(std::abs(scene.pose(camlux::part::light, 0).position_m.x - before_m - 1) < 1e-12);
    scene.set_pose(camlux::part::light, 0, {{9, 9, 9}, {}});
    CHECK(scene.light(0).relative_to == camlux::relative_to::world && scene.light(0).position_m.x == 9);
    camera_pose.position_m.x -= 1;
    scene.set_pose(camlux::part::camera, 0, camera_pose);
    CHECK(scene.light(0).position_m.x == 9);
    tof.frequencies.resize(5);
    CHECK(thrown_by([&] { scene.set_tof(tof); }) == CAMLUX_ERROR_INVALID_ARGUMENT);
    scene.set_tof(std::nullopt);
    CHECK(renderer.render(scene).try_view<float>(far_range).status() == CAMLUX_ERROR_INVALID_ARGUMENT);
}

void layers_go_to_memory(const camlux::device &device, camlux::renderer &renderer)
{
    const camlux::scene scene = small_scene();
    const auto seen = renderer.render(scene).view<float>(camlux::layer::radiance);
    std::vector<float> radiance(3 * seen.width() * seen.height());
    camlux::render_options to_memory;
    to_memory.targets.emplace_back(camlux::layer::radiance, radiance.data(), radiance.size() * sizeof(float));
    CHECK(renderer.render(scene, to_memory).layers().empty());
    CHECK(radiance[3 * (9 * seen.width() + 9)] == seen(9, 9));
    to_memory.targets[0].size_bytes = 4;
    CHECK(renderer.try_render(scene, to_memory).status() == CAMLUX_ERROR_INVALID_ARGUMENT);

    static_assert(camlux::of_bounces(3) == static_cast<camlux::layer>(CAMLUX_LAYER_INDIRECT_BOUNCE + 2));
    static_assert(camlux::of_bounces(17) == static_cast<camlux::layer>(-1));
    constexpr camlux::layer second = camlux::of_bounces(2, camlux::layer::tof_phasor_bounce);
    static_assert(camlux::of_frequency(1, second) == static_cast<camlux::layer>(CAMLUX_LAYER_TOF_PHASOR_BOUNCE + 1 + CAMLUX_TOF_NEXT_FREQUENCY));
    static_assert(camlux::of_frequency(1, camlux::layer::tof_point) == static_cast<camlux::layer>(CAMLUX_LAYER_TOF_POINT + CAMLUX_TOF_NEXT_FREQUENCY));

    camlux::render_options named;
    named.layers = {camlux::layer::albedo, camlux::layer::camera_normal};
    const camlux::frame guides = renderer.render(scene, named);
    CHECK(guides.layers().size() == 2);
    CHECK(guides.view<float>(camlux::layer::albedo)(9, 9) > 0.0f);
    CHECK(guides.view<float>(camlux::layer::camera_normal)(9, 9, 2) < 0.0f);
    named.on_device = true;
    CHECK(renderer.try_render(scene, named).status() == CAMLUX_ERROR_INVALID_ARGUMENT);

    camlux::render_options on_device;
    on_device.on_device = true;
    const camlux::frame staying = renderer.render(scene, on_device);
    const camlux::shared_memory shared = camlux::shared_memory::create(device, 16 * seen.width() * seen.height());
    staying.copy_to(camlux::layer::radiance, shared);
    CHECK(staying.try_copy_to(camlux::layer::radiance, shared, 16).status() == CAMLUX_ERROR_INVALID_ARGUMENT);
    const camlux_shared_memory_info shared_info = shared.info();
    if (shared_info.host_data)
        CHECK(static_cast<const float *>(shared_info.host_data)[4 * (9 * seen.width() + 9)] == seen(9, 9));
    const int fd = shared.export_fd();
    CHECK(fd >= 0 && close(fd) == 0);
}

void callbacks_may_throw(const camlux::device &device, camlux::renderer &renderer)
{
    const camlux::scene scene = small_scene();
    camlux::render_options options;
    int calls = 0;
    options.progress = [&](double fraction, std::string_view pass) {
        CHECK(fraction >= 0 && fraction <= 1 && !pass.empty());
        return ++calls > 0;
    };
    renderer.render(scene, options);
    CHECK(calls > 0);
    options.progress = [](double, std::string_view) { return false; };
    CHECK(thrown_by([&] { renderer.render(scene, options); }) == CAMLUX_CANCELLED);
    options.progress = [](double, std::string_view) -> bool { throw HostProblem{7}; };
    CHECK(host_problem_of([&] { renderer.render(scene, options); }) == 7);
    CHECK(host_problem_of([&] { (void)renderer.try_render(scene, options); }) == 7);
    CHECK(renderer.try_render(scene).ok());

    options = {};
    options.cancel_token = camlux::cancel_token::create();
    CHECK(renderer.try_render(scene, options).ok());
    options.cancel_token.cancel();
    CHECK(thrown_by([&] { renderer.render(scene, options); }) == CAMLUX_CANCELLED);

    options = {};
    std::atomic<int> reports(0);
    options.progress = [&](double, std::string_view) { return ++reports > 0; };
    camlux::job job = renderer.submit(scene, options);
    const camlux::frame submitted = job.wait();
    CHECK(job.is_done() && reports > 0);
    CHECK(submitted.view<float>(camlux::layer::radiance)(9, 9) == renderer.render(scene).view<float>(camlux::layer::radiance)(9, 9));
    CHECK(job.try_wait().status() == CAMLUX_ERROR_INVALID_ARGUMENT);
    CHECK(job.wait_for(std::chrono::seconds(0)) && job.wait_for(std::chrono::hours(1)));
    // The exception of a job's callback reaches whoever waits, at every call.
    options.progress = [](double, std::string_view) -> bool { throw HostProblem{9}; };
    camlux::job failing = renderer.submit(scene, options);
    CHECK(host_problem_of([&] { (void)failing.wait(); }) == 9);
    CHECK(host_problem_of([&] { (void)failing.try_wait(); }) == 9);
    CHECK(failing.is_done() && renderer.try_render(scene).ok());
    options.progress = [](double, std::string_view) { return false; };
    CHECK(renderer.submit(scene, options).try_wait().status() == CAMLUX_CANCELLED);
    // A render in a job's callback throws there, and not from the job.
    camlux::renderer inner = camlux::renderer::create(device);
    camlux::render_options inner_options;
    inner_options.progress = [](double, std::string_view) -> bool { throw HostProblem{12}; };
    std::atomic<int> inner_problem(0);
    options.progress = [&](double, std::string_view) {
        inner_problem = host_problem_of([&] { inner.render(scene, inner_options); });
        return true;
    };
    CHECK(renderer.submit(scene, options).try_wait().ok() && inner_problem == 12);
    // A job that nobody waits for takes its exception with it.
    options.progress = [](double, std::string_view) -> bool { throw HostProblem{10}; };
    renderer.submit(scene, options);
    renderer.submit(scene);
    // A callback may release its own job.
    camlux::job own;
    std::atomic<bool> is_set(false);
    options.progress = [&](double, std::string_view) -> bool {
        while (!is_set)
            std::this_thread::yield();
        own = {};
        throw HostProblem{11};
    };
    own = renderer.submit(scene, options);
    is_set = true;
    while (!renderer.try_foretell_ms(scene).ok())
        std::this_thread::yield();
    CHECK(renderer.try_render(scene).ok());

    std::vector<camlux::camera> cameras(2);
    for (camlux::camera &camera : cameras) {
        camera.width_px = camera.height_px = 9;
        camera.position_m.y = 3;
        camera.look_at_m = {0, 0, 0};
        camera.up = {0, 0, -1};
    }
    cameras[1].width_px = 5;
    const std::vector<camlux::frame> views = renderer.render(scene, cameras);
    CHECK(views.size() == 2 && views[1].view<float>(camlux::layer::radiance).width() == 5);
    cameras[1].width_px = 0;
    CHECK(renderer.try_render(scene, cameras).status() == CAMLUX_ERROR_SCENE);

    const std::uint32_t before = handles();
    camlux_status inside = CAMLUX_OK;
    camlux::set_log(camlux::log_level::debug, [&](camlux::log_level, std::string_view message) {
        CHECK(!message.empty());
        inside = camlux::try_set_log(camlux::log_level::off, nullptr).status();
        throw HostProblem{8};
    });
    // A finished frame is not lost to an exception of the log: the next call without a value throws it.
    {
        const camlux::frame finished = renderer.render(scene);
        CHECK(finished.view<float>(camlux::layer::radiance)(9, 9) > 0);
        CHECK(host_problem_of([&] { scene.validate(); }) == 8);
        camlux::job logged = renderer.submit(scene);
        CHECK(logged.wait().view<float>(camlux::layer::radiance)(9, 9) > 0);
        CHECK(host_problem_of([&] { scene.validate(); }) == 8);
        // A call that fails has no value to lose.
        CHECK(host_problem_of([&] { (void)finished.try_view<float>(camlux::layer::energy); }) == 8);
        CHECK(host_problem_of([&] { camlux::set_log(camlux::log_level::off, nullptr); }) == 0);
    }
    CHECK(inside == CAMLUX_ERROR_BUSY);
    CHECK(handles() == before);
    // A replaced callback is destroyed when the call returns.
    const auto token = std::make_shared<int>(0);
    camlux::set_log(camlux::log_level::info, [token](camlux::log_level, std::string_view) { ++*token; });
    CHECK(token.use_count() == 2);
    renderer.render(scene);
    CHECK(*token > 0);
    camlux::set_log(camlux::log_level::off, nullptr);
    CHECK(token.use_count() == 1);
}

// A thread that sets another callback waits for the running one, which must not wait for that thread.
void a_callback_does_not_wait_for_who_waits_for_it(camlux::renderer &renderer)
{
    std::thread setter;
    camlux_status inside = CAMLUX_OK;
    camlux::set_log(camlux::log_level::debug, [&](camlux::log_level, std::string_view) {
        if (setter.joinable())
            return;
        setter = std::thread([] { camlux::set_log(camlux::log_level::off, nullptr); });
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        inside = camlux::try_set_log(camlux::log_level::off, nullptr).status();
    });
    renderer.render(small_scene());
    setter.join();
    CHECK(inside == CAMLUX_ERROR_BUSY);
}

}  // namespace

int main()
{
    values_begin_like_those_of_c();
    values_come_back();
    settings_come_back();
    poses_face_a_point();
    matrices_are_poses();
    handles_share_and_give_back();
    both_forms_tell_the_same();
    {
        camlux::device_options options;
        options.validation = true;
        const camlux::device device = camlux::device::open(options);
        CHECK(camlux::device::count() > camlux::device::info_of(0).index && device.info().is_usable);
        camlux::device_options same;
        same.uuid = device.info().uuid;
        CHECK(camlux::device::open(same).info().name == device.info().name);
        same.uuid = "0123";
        CHECK(camlux::device::try_open(same).status() == CAMLUX_ERROR_NO_DEVICE);
        same = {};
        same.pci = "ff:1f.7";
        CHECK(camlux::device::try_open(same).status() == CAMLUX_ERROR_NO_DEVICE);
        camlux::renderer renderer = camlux::renderer::create(device);
        views_are_typed_and_keep_their_frame(device, renderer);
        lamps_and_projectors_shine(renderer);
        time_of_flight_has_its_layers(renderer);
        callbacks_may_throw(device, renderer);
        layers_go_to_memory(device, renderer);
        a_callback_does_not_wait_for_who_waits_for_it(renderer);
        CHECK(device.validation_count() == 0);
    }
    CHECK(handles() == 0);
    std::printf("camlux.hpp as C++ %ld: all passed\n", __cplusplus);
}
