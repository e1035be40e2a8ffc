// Renders the Cornell box on this program's own VkDevice and reads the frame's images there with its own commands.
//
//     own_vulkan [SIZE] [--validation]
//
// Exits with 1 if a value differs from the one that camlux returns in host memory, or if the validation layer complains.

#include "cornell.hpp"
#include "vulkan_host.hpp"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string_view>

namespace {

camlux::device lend(const VulkanHost &host)
{
    camlux_vulkan_device lent = CAMLUX_VULKAN_DEVICE_INIT;
    lent.get_instance_proc_addr = reinterpret_cast<camlux_vulkan_function>(vkGetInstanceProcAddr);
    lent.instance = host.instance;
    lent.physical_device = host.physical_device;
    lent.device = host.device;
    lent.device_create_info = &host.device_create_info();
    lent.queue = host.queue;
    lent.queue_family = host.queue_family;
    return camlux::device::from_vulkan(lent);
}

// The number of values of the layer that are not bit-identical in the image on the device and in host memory.
std::size_t differences(VulkanHost &host, const camlux::frame &frame, camlux::layer layer)
{
    const camlux_vulkan_image image = frame.vulkan_image(layer);
    const std::vector<float> on_device = host.read(reinterpret_cast<VkImage>(image.image), image.width_px, image.height_px,
                                                   reinterpret_cast<VkSemaphore>(image.semaphore), image.semaphore_value);
    // Called after host.read, because camlux itself reads the images here.
    const camlux::view<float> here = frame.view<float>(layer);
    std::size_t different = 0;
    for (std::size_t y = 0; y < here.height(); ++y)
        for (std::size_t x = 0; x < here.width(); ++x)
            for (std::size_t band = 0; band < 3; ++band)
                different += std::memcmp(&here(x, y, band), &on_device[4 * (y * here.width() + x) + band], sizeof(float)) != 0;
    std::printf("  %-10s semaphore at %llu, %zu of %zu values differ\n", here.name(),
                static_cast<unsigned long long>(image.semaphore_value), different, 3 * here.width() * here.height());
    return different;
}

int run(std::uint32_t size_px, bool validation)
{
    VulkanHost host(validation);
    std::printf("own device: %s\n", host.device_name.c_str());
    std::size_t different = 0;
    {
        // All camlux objects must be destroyed before the device: this scope ends first.
        const camlux::device device = lend(host);
        Cornell box = cornell_box(size_px);
        camlux::renderer renderer = camlux::renderer::create(device);
        camlux::render_options options;
        options.on_device = true;
        for (const double x_m : {0.0, 0.5}) {
            camlux::vec3 at_m = cornell_light_m;
            at_m.x += x_m;
            box.scene.set_pose(camlux::part::light, box.light, {at_m, {}});
            const camlux::frame frame = renderer.render(box.scene, options);
            std::printf("light at x = %.3f m, %.2f ms\n", at_m.x, frame.stats().wall_ms);
            for (const camlux::layer layer : {camlux::layer::radiance, camlux::layer::indirect, camlux::layer::normal})
                different += differences(host, frame, layer);
        }
    }
    if (validation)
        std::printf("messages of the validation layer: %u\n", host.messages);
    return different == 0 && host.messages == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace

int main(int argument_count, char **arguments)
{
    std::uint32_t size_px = 400;
    bool validation = false;
    for (int index = 1; index < argument_count; ++index) {
        if (std::string_view(arguments[index]) == "--validation")
            validation = true;
        else
            size_px = static_cast<std::uint32_t>(std::strtoul(arguments[index], nullptr, 10));
    }
    if (size_px < 1 || size_px > 16384) {
        std::fprintf(stderr, "usage: own_vulkan [SIZE] [--validation]\n");
        return 2;
    }
    try {
        return run(size_px, validation);
    } catch (const std::exception &problem) {
        std::fprintf(stderr, "own_vulkan: %s\n", problem.what());
        return EXIT_FAILURE;
    }
}
