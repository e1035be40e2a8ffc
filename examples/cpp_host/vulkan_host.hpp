// The host's own Vulkan: an instance, a device and a queue, and commands that read an image.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <string>
#include <vector>

class VulkanHost {
public:
    // Opens the first device that meets camlux's requirements. With `validation`, turns on the Khronos layer and counts its messages.
    // Throws std::runtime_error with the reason.
    explicit VulkanHost(bool validation);
    ~VulkanHost();
    VulkanHost(const VulkanHost &) = delete;
    VulkanHost &operator=(const VulkanHost &) = delete;

    // Copies an image of 4 floats per pixel, in the layout GENERAL, to host memory with commands of this queue. On the device, the commands
    // wait until the timeline semaphore reaches the value.
    std::vector<float> read(VkImage image, std::uint32_t width, std::uint32_t height, VkSemaphore semaphore,
                            std::uint64_t value);

    VkInstance instance = VK_NULL_HANDLE;
    VkPhysicalDevice physical_device = VK_NULL_HANDLE;
    VkDevice device = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;
    std::uint32_t queue_family = 0;
    std::string device_name;
    // Number of messages from the layer.
    std::uint32_t messages = 0;

    // The create info of the device, which camlux checks.
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
