// Renders the Cornell box from arrays while its light moves in a circle. Writes EXR files and a picture of all frames, and prints their
// times.
//
//     moving_light FOLDER [SIZE]
//
// The first frame is bit-identical to that of `camlux render scenes/cornell.toml --size SIZE SIZE`.

#include "cornell.hpp"
#include "picture.hpp"
#include "reuse.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

namespace {

constexpr int positions = 16;
constexpr unsigned long default_size_px = 200;

// A full turn that begins at the light's position in the scene file and descends towards the front.
camlux::vec3 light_position_m(int index)
{
    const double angle = 2 * 3.14159265358979323846 * index / positions;
    const double forward = 1 - std::cos(angle);
    const camlux::vec3 &start = cornell_light_m;
    return {start.x + 0.8 * std::sin(angle), start.y - 0.3 * forward, start.z + 0.45 * forward};
}

std::string numbered(int index) { return {"0123456789"[index / 10], "0123456789"[index % 10]}; }

// Eight pictures per row, the rows below one another.
void render_turn(const camlux::device &device, const std::filesystem::path &folder, std::uint32_t size_px)
{
    constexpr std::size_t small_px = 200, in_a_row = 8;
    Cornell box = cornell_box(size_px);
    camlux::renderer renderer = camlux::renderer::create(device);
    Picture strip = black(in_a_row * small_px, positions / in_a_row * small_px);

    std::printf("%u x %u, a light in %d positions\n   frame   wall ms  %-20s  passes that ran\n", size_px, size_px,
                positions, "light at, m");
    for (int index = 0; index < positions; ++index) {
        const camlux::vec3 at_m = light_position_m(index);
        box.scene.set_pose(camlux::part::light, box.light, {at_m, {}});
        const camlux::frame frame = renderer.render(box.scene);

        camlux::exr_options options;
        if (index > 0) {  // The first file has all layers at full precision.
            options.layers = {camlux::layer::radiance};
            options.half = true;
        }
        frame.write_exr((folder / ("frame_" + numbered(index) + ".exr")).string(), options);
        const auto place_x = static_cast<std::size_t>(index) % in_a_row, place_y = static_cast<std::size_t>(index) / in_a_row;
        place(strip, place_x * small_px, place_y * small_px,
              smaller(frame.view<float>(camlux::layer::radiance), small_px));

        std::printf("   %5d %9.2f  %6.3f %6.3f %6.3f ", index, frame.stats().wall_ms, at_m.x, at_m.y, at_m.z);
        for (const camlux::pass_time &pass : frame.passes())
            std::printf(" %s", pass.name.c_str());
        std::printf("\n");
    }
    write_png((folder / "strip.png").string(), strip, bright_radiance(strip));
}

int run(const std::filesystem::path &folder, std::uint32_t size_px)
{
    std::filesystem::create_directories(folder);
    // The library prints nothing: its warnings arrive here.
    camlux::set_log(camlux::log_level::warning, [](camlux::log_level, std::string_view message) {
        std::fprintf(stderr, "camlux: %.*s\n", static_cast<int>(message.size()), message.data());
    });
    const camlux::device device = camlux::device::open();
    std::printf("camlux %u.%u.%u on %s\n\n", camlux::version() / 1000000, camlux::version() / 1000 % 1000,
                camlux::version() % 1000, device.info().name.c_str());
    render_turn(device, folder, size_px);
    print_reuse(device, 64);
    if (size_px != 64)
        print_reuse(device, size_px);
    print_setters();
    std::printf("\n%s: frame_00.exr to frame_%d.exr, strip.png\n", folder.string().c_str(), positions - 1);
    return EXIT_SUCCESS;
}

}  // namespace

int main(int argument_count, char **arguments)
{
    const unsigned long size_px = argument_count > 2 ? std::strtoul(arguments[2], nullptr, 10) : default_size_px;
    if (argument_count < 2 || argument_count > 3 || size_px < 1 || size_px > 16384) {
        std::fprintf(stderr, "usage: moving_light FOLDER [SIZE]\n");
        return 2;
    }
    try {
        return run(arguments[1], static_cast<std::uint32_t>(size_px));
    } catch (const std::exception &problem) {
        std::fprintf(stderr, "moving_light: %s\n", problem.what());
        return EXIT_FAILURE;
    }
}
