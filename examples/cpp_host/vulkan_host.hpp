// The Vulkan of a host: an instance, a device and a queue of its own, and commands that read an image.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <string>
#include <vector>

class VulkanHost {
public:
    // Opens the first device that has what camlux needs. With `validation`, under the Khronos layer, whose messages are counted.
    // Throws std::runtime_error for what is missing.
    explicit VulkanHost(bool validation);
    ~VulkanHost();
    VulkanHost(const VulkanHost &) = delete;
    VulkanHost &operator=(const VulkanHost &) = delete;

    // Copies an image of 4 floats a pixel, in the layout GENERAL, to the host's memory by commands of this queue, which wait on the
    // device until the timeline semaphore has come to the value.
    std::vector<float> read(VkImage image, std::uint32_t width, std::uint32_t height, VkSemaphore semaphore,
                            std::uint64_t value);

    VkInstance instance = VK_NULL_HANDLE;
    VkPhysicalDevice physical_device = VK_NULL_HANDLE;
    VkDevice device = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;
    std::uint32_t queue_family = 0;
    std::string device_name;
    // What the layer has said.
    std::uint32_t messages = 0;

    // What the device was made with, which camlux looks at.
    const VkDeviceCreateInfo &device_create_info() const { return device_info_; }

private:
    void make_instance(bool validation);
    bool choose_device();
    void make_device();
    std::uint32_t memory_type(std::uint32_t allowed, VkMemoryPropertyFlags wanted) const;

    VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
    float priority_ = 1;
    VkDeviceQueueCreateInfo queue_info_ = {};
    VkPhysicalDeviceVulkan12Features features12_ = {};
    VkPhysicalDeviceVulkan13Features features13_ = {};
    VkDeviceCreateInfo device_info_ = {};
};
