/* Part of camlux.hpp: devices. */

#ifndef CAMLUX_DEVICE_HPP
#define CAMLUX_DEVICE_HPP

#include <cstdint>
#include <optional>
#include <string>

#include "values.hpp"

namespace camlux {

enum class device_kind : std::int32_t {
    discrete = CAMLUX_DEVICE_KIND_DISCRETE,
    integrated = CAMLUX_DEVICE_KIND_INTEGRATED,
    virtual_machine = CAMLUX_DEVICE_KIND_VIRTUAL,
    cpu = CAMLUX_DEVICE_KIND_CPU,
    other = CAMLUX_DEVICE_KIND_OTHER,
};

/** camlux_device_options: the best device, or the one with an index, else with a name, a UUID or a PCI address. */
struct device_options {
    std::optional<std::uint32_t> index = std::nullopt;
    std::string name = {}, uuid = {}, pci = {};
    bool validation = false;
};

/** camlux_device_info. */
struct device_info {
    std::uint32_t index = 0;
    device_kind kind = device_kind::other;
    bool is_usable = false;
    std::uint32_t max_image_px = 0, subgroup_lanes = 0;
    std::uint64_t max_allocation_bytes = 0;
    std::string name = {}, driver = {}, lacks = {}, api_version = {}, uuid = {}, pci = {};
};

namespace detail {

inline device_info device_info_of(const camlux_device_info &from)
{
    device_info to;
    to.index = from.index;
    to.kind = static_cast<device_kind>(from.kind);
    to.is_usable = from.is_usable != 0;
    to.max_image_px = from.max_image_px;
    to.subgroup_lanes = from.subgroup_lanes;
    to.max_allocation_bytes = from.max_allocation_bytes;
    to.name = from.name;
    to.driver = from.driver;
    to.lacks = from.lacks;
    to.api_version = from.api_version;
    to.uuid = from.uuid;
    to.pci = from.pci;
    return to;
}

}  // namespace detail

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
        if (const result<void> fine = detail::check_texts({{"device_options.name", options.name},
                                                                     {"device_options.uuid", options.uuid},
                                                                     {"device_options.pci", options.pci}});
            !fine)
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

}  // namespace camlux

#endif  /* CAMLUX_DEVICE_HPP */
