// Renders a moving box under limits of time, and prints what each of them buys.
//
//     limits SCENE INSTANCE FOLDER
//
// Moves an instance of a scene file from frame to frame. Every tenth frame is compared with one of 0.5 % target error and another seed. FOLDER
// receives the last frame of each limit as a PNG file, and the errors over time as limits.svg.

#include <camlux.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;

constexpr int frames = 30, compared = 10;
constexpr double limits_ms[] = {33, 100, 300, 1000};
constexpr double step_m = 0.01;
constexpr double truth_error = 0.005;
// No frame of these limits meets it.
constexpr double least_error = 0.002;

struct Row {
    double limit_ms = 0, frames_per_s = 0, slowest_ms = 0, estimated = 0, upper = 0, measured = 0;
};

double root_mean_square(const std::vector<double> &values)
{
    double sum = 0;
    for (const double value : values)
        sum += value * value;
    return std::sqrt(sum / static_cast<double>(values.size()));
}

// relRMSE of the indirect light.
double error_of(const camlux::frame &frame, const camlux::frame &truth)
{
    const auto found = frame.view<float>(camlux::layer::indirect), due = truth.view<float>(camlux::layer::indirect);
    double error = 0, signal = 0;
    for (std::size_t y = 0; y < due.height(); ++y)
        for (std::size_t x = 0; x < due.width(); ++x)
            for (std::size_t band = 0; band < due.channels(); ++band) {
                const double t = due(x, y, band), off = found(x, y, band) - t;
                error += off * off;
                signal += t * t;
            }
    return std::sqrt(error / signal);
}

Row loop(const camlux::device &device, camlux::scene &scene, std::uint32_t instance, double limit_ms, const std::filesystem::path &picture)
{
    camlux::indirect limited, exact;
    limited.target_error = least_error;
    limited.max_ms = limit_ms;
    exact.target_error = truth_error;
    camlux::renderer renderer = camlux::renderer::create(device), other = camlux::renderer::create(device);
    const camlux::pose first = scene.pose(camlux::part::instance, instance);
    scene.set_indirect(limited);
    renderer.prepare(scene);
    std::vector<double> times_ms, estimated, upper, measured;
    for (int index = 0; index < frames; ++index) {
        camlux::pose pose = first;
        pose.position_m.x += step_m * index;
        scene.set_pose(camlux::part::instance, instance, pose);
        scene.set_indirect(limited);
        const Clock::time_point start = Clock::now();
        const camlux::frame frame = renderer.render(scene);
        const double time_ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
        // The first frame learns how fast the device is.
        if (index > 0) {
            times_ms.push_back(time_ms);
            estimated.push_back(frame.stats().estimated_error);
            upper.push_back(frame.stats().estimated_error_upper);
        }
        if (index % compared == compared - 1) {
            scene.set_indirect(exact);
            camlux::render_options options;
            options.seed = 1;
            measured.push_back(error_of(frame, other.render(scene, options)));
        }
        if (index + 1 == frames)
            frame.write_png(picture.string());
    }
    scene.set_pose(camlux::part::instance, instance, first);
    double sum_ms = 0;
    for (const double time_ms : times_ms)
        sum_ms += time_ms;
    return {limit_ms,
            1e3 * static_cast<double>(times_ms.size()) / sum_ms,
            *std::max_element(times_ms.begin(), times_ms.end()),
            root_mean_square(estimated),
            root_mean_square(upper),
            root_mean_square(measured)};
}

// Errors over the time of a frame, both logarithmic.
void write_plot(const std::filesystem::path &path, const std::vector<Row> &rows)
{
    const double width = 480, height = 300, left = 60, bottom = 40;
    const auto place_x = [&](double ms) { return left + (width - left - 20) * std::log(ms / 20) / std::log(100); };
    const auto place_y = [&](double error) { return 20 + (height - bottom - 20) * std::log(0.5 / error) / std::log(100); };
    std::ofstream file(path);
    file << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" << width << "\" height=\"" << height
         << "\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
    const auto text = [&](double x, double y, const char *anchor, const std::string &words) {
        file << "<text x=\"" << x << "\" y=\"" << y << "\" text-anchor=\"" << anchor << "\">" << words << "</text>\n";
    };
    struct Tick {
        double error;
        const char *label;
    };
    for (const Tick &tick : {Tick{0.5, "50 %"}, Tick{0.2, "20 %"}, Tick{0.1, "10 %"}, Tick{0.05, "5 %"}, Tick{0.02, "2 %"}, Tick{0.01, "1 %"},
                             Tick{0.005, "0.5 %"}}) {
        file << "<path stroke=\"#ccc\" d=\"M" << left << ' ' << place_y(tick.error) << "H" << width - 20 << "\"/>\n";
        text(left - 6, place_y(tick.error) + 4, "end", tick.label);
    }
    for (const double ms : {20, 50, 100, 200, 500, 1000, 2000})
        text(place_x(ms), height - bottom + 18, "middle", std::to_string(static_cast<int>(ms)));
    text(0.5 * (left + width), height - 6, "middle", "milliseconds a frame");
    struct Line {
        const char *name, *colour;
        double Row::*error;
    };
    double legend_y = 34;
    for (const Line &line : {Line{"upper bound", "#999", &Row::upper}, Line{"estimated", "#06c", &Row::estimated},
                             Line{"measured", "#c30", &Row::measured}}) {
        file << "<path fill=\"none\" stroke-width=\"2\" stroke=\"" << line.colour << "\" d=\"";
        for (const Row &row : rows)
            file << (&row == rows.data() ? 'M' : 'L') << place_x(1e3 / row.frames_per_s) << ' ' << place_y(row.*line.error);
        file << "\"/>\n<path stroke-width=\"2\" stroke=\"" << line.colour << "\" d=\"M" << width - 140 << ' ' << legend_y - 4
             << "h24\"/>\n";
        text(width - 110, legend_y, "start", line.name);
        legend_y += 18;
    }
    file << "</svg>\n";
}

}  // namespace

int main(int argument_count, char **arguments)
{
    if (argument_count != 4) {
        std::fprintf(stderr, "usage: limits SCENE INSTANCE FOLDER\n");
        return 2;
    }
    try {
        const std::filesystem::path folder = arguments[3];
        std::filesystem::create_directories(folder);
        camlux::scene scene = camlux::scene::load(arguments[1]);
        const auto instance = static_cast<std::uint32_t>(std::strtoul(arguments[2], nullptr, 10));
        scene.set_tof(std::nullopt);
        const camlux::device device = camlux::device::open();
        std::printf("  max_ms  frames/s  slowest ms  estimated  bound   measured\n");
        std::vector<Row> rows;
        for (const double limit_ms : limits_ms) {
            const std::string name = "limit_" + std::to_string(static_cast<int>(limit_ms)) + "_ms.png";
            rows.push_back(loop(device, scene, instance, limit_ms, folder / name));
            const Row &row = rows.back();
            std::printf("  %6.0f  %8.1f  %10.1f  %7.2f %%  %5.2f %%  %6.2f %%\n", row.limit_ms, row.frames_per_s, row.slowest_ms,
                        100 * row.estimated, 100 * row.upper, 100 * row.measured);
        }
        write_plot(folder / "limits.svg", rows);
    } catch (const std::exception &problem) {
        std::fprintf(stderr, "limits: %s\n", problem.what());
        return 1;
    }
}
