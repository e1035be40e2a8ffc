#include "reuse.hpp"

#include "cornell.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start)
{
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

std::vector<std::string> pass_names(const camlux::frame &frame)
{
    std::vector<std::string> names;
    for (const camlux::pass_time &pass : frame.passes())
        if (std::find(names.begin(), names.end(), pass.name) == names.end())
            names.push_back(pass.name);
    return names;
}

std::string joined(const std::vector<std::string> &names)
{
    std::string text;
    for (const std::string &name : names)
        text += (text.empty() ? "" : " ") + name;
    return text.empty() ? "-" : text;
}

// The frames of one row. Each time is the minimum of several frames, to exclude the load of other programs.
struct Row {
    double call_ms = std::numeric_limits<double>::infinity();
    double passes_ms = std::numeric_limits<double>::infinity();
    std::vector<std::string> passes = {};

    void add(camlux::renderer &renderer, const camlux::scene &scene)
    {
        const Clock::time_point start = Clock::now();
        const camlux::frame frame = renderer.render(scene);
        call_ms = std::min(call_ms, milliseconds_since(start));
        passes_ms = std::min(passes_ms, frame.stats().passes_ms);
        passes = pass_names(frame);
    }

    void print(const char *what, const std::vector<std::string> &all) const
    {
        std::vector<std::string> absent;
        for (const std::string &name : all)
            if (std::find(passes.begin(), passes.end(), name) == passes.end())
                absent.push_back(name);
        std::printf("  %-26s %9.2f %9.2f   %s\n", what, call_ms, passes_ms, joined(absent).c_str());
    }
};

// A pose that moves a little with each call, so that every call is a change.
camlux::pose nudged(camlux::vec3 position_m)
{
    static int calls = 0;
    position_m.x += 1e-4 * (++calls % 100);
    return {position_m, {}};
}

// The camera of the scene file looks along -z with y up: its optical frame is rotated about x by 180 degrees.
camlux::pose nudged_camera()
{
    camlux::pose pose = nudged({0.0, 1.0, 3.2});
    pose.orientation = {1, 0, 0, 0};
    return pose;
}

}  // namespace

void print_reuse(const camlux::device &device, std::uint32_t size_px)
{
    const int rounds = size_px > 256 ? 3 : 5;
    Cornell box = cornell_box(size_px);
    struct Change {
        const char *what;
        std::function<void()> change;
        Row row;
    };
    Change changes[] = {
        {"nothing", [] {}, {}},
        {"the camera", [&] { box.scene.set_pose(camlux::part::camera, 0, nudged_camera()); }, {}},
        {"the light", [&] { box.scene.set_pose(camlux::part::light, box.light, nudged(cornell_light_m)); }, {}},
        {"the mesh", [&] { box.scene.set_pose(camlux::part::instance, box.instance, nudged({0, 0, 0})); }, {}},
    };

    Row everything;
    camlux::renderer renderer = camlux::renderer::create(device);
    renderer.render(box.scene);
    // The rows alternate, so that other load on the machine affects all of them alike.
    for (int round = 0; round < rounds; ++round) {
        for (Change &change : changes) {
            change.change();
            change.row.add(renderer, box.scene);
        }
        camlux::renderer fresh = camlux::renderer::create(device);
        everything.add(fresh, box.scene);
    }

    std::printf("\n%u x %u, least of %d frames\n  %-26s %9s %9s   %s\n", size_px, size_px, rounds, "what changed",
                "call ms", "passes ms", "passes not run again");
    everything.print("everything (new renderer)", everything.passes);
    for (const Change &change : changes)
        change.row.print(change.what, everything.passes);
}

void print_setters()
{
    constexpr int calls = 2000, batches = 50;
    Cornell box = cornell_box(64);
    const camlux::camera camera = box.scene.camera();
    const camlux::light light = box.scene.light(box.light);
    const camlux::pose pose = nudged_camera();
    camlux::material grey;
    grey.kd = {0.5, 0.5, 0.5};

    struct Setter {
        const char *name;
        std::function<void()> call;
    };
    const Setter setters[] = {
        {"set_pose (camera)", [&] { box.scene.set_pose(camlux::part::camera, 0, pose); }},
        {"set_pose (light)", [&] { box.scene.set_pose(camlux::part::light, box.light, pose); }},
        {"set_pose (instance)", [&] { box.scene.set_pose(camlux::part::instance, box.instance, pose); }},
        {"set_camera", [&] { box.scene.set_camera(camera); }},
        {"set_light", [&] { box.scene.set_light(box.light, light); }},
        {"set_material", [&] { box.scene.set_material(0, grey); }},
        {"set_indirect", [&] { box.scene.set_indirect(camlux::indirect()); }},
        {"set_sensor", [&] { box.scene.set_sensor(std::nullopt); }},
    };
    std::printf("\nsetters, ns per call (least of %d batches of %d)\n", batches, calls);
    for (const Setter &setter : setters) {
        double least_ms = std::numeric_limits<double>::infinity();
        for (int batch = 0; batch < batches; ++batch) {
            const Clock::time_point start = Clock::now();
            for (int call = 0; call < calls; ++call)
                setter.call();
            least_ms = std::min(least_ms, milliseconds_since(start));
        }
        std::printf("  %-26s %9.0f\n", setter.name, least_ms * 1e6 / calls);
    }
}
