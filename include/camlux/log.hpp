/* Part of camlux.hpp: the log. */

#ifndef CAMLUX_LOG_HPP
#define CAMLUX_LOG_HPP

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string_view>
#include <utility>

#include "result.hpp"
#include "values.hpp"

namespace camlux {

enum class log_level : std::int32_t {
    off = CAMLUX_LOG_OFF,
    error = CAMLUX_LOG_ERROR,
    warning = CAMLUX_LOG_WARNING,
    info = CAMLUX_LOG_INFO,
    debug = CAMLUX_LOG_DEBUG,
};

namespace detail {

using log_function = std::function<void(log_level, std::string_view)>;

/** The log function of the process. It must live as long as it may be called. */
struct log_slot {
    std::mutex changing{};
    std::unique_ptr<log_function> function = nullptr;

    log_slot() = default;
    log_slot(const log_slot &) = delete;
    log_slot &operator=(const log_slot &) = delete;

    ~log_slot() { camlux_set_log(CAMLUX_LOG_OFF, nullptr, nullptr); }
};

inline log_slot &log()
{
    static log_slot slot;
    return slot;
}

inline bool &is_logging()
{
    thread_local bool is_logging = false;
    return is_logging;
}

/** The log callback that the library calls with a message. */
inline void receive(std::int32_t level, const char *message, void *user)
{
    is_logging() = true;
    kept_exception &thrown_here = thrown_by_job() ? *thrown_by_job() : thrown();
    guarded(thrown_here, [&] { (*static_cast<const log_function *>(user))(static_cast<log_level>(level), message); });
    is_logging() = false;
}

}  // namespace detail

/** Sends the process's messages, up to a level, to a function. Several threads may call it at once. \param function empty: none. */
inline result<void> try_set_log(log_level level, std::function<void(log_level, std::string_view)> function)
{
    // The library also refuses this. But a callback that waited for the lock here would deadlock with its holder, which waits for the callback.
    if (detail::is_logging())
        return {CAMLUX_ERROR_BUSY, "camlux::set_log: a log callback cannot set another"};
    std::unique_ptr<detail::log_function> next;
    if (function)
        next = std::make_unique<detail::log_function>(std::move(function));
    detail::log_slot &slot = detail::log();
    camlux_status status = CAMLUX_OK;
    {
        const std::lock_guard<std::mutex> lock(slot.changing);
        status = camlux_set_log(detail::number(level), next ? detail::receive : nullptr, next.get());
        if (status == CAMLUX_OK)
            std::swap(slot.function, next);
    }
    return detail::ended(status);
}
inline void set_log(log_level level, std::function<void(log_level, std::string_view)> function)
{
    try_set_log(level, std::move(function)).value();
}

}  // namespace camlux

#endif  /* CAMLUX_LOG_HPP */
