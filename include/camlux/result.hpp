/* Part of camlux.hpp: errors, results and the handle class. */

#ifndef CAMLUX_RESULT_HPP
#define CAMLUX_RESULT_HPP

#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#if __cplusplus >= 202002L && __has_include(<span>)
#include <span>
#endif

#include "../camlux.h"

#if defined(__cpp_exceptions) || defined(_CPPUNWIND)
#define CAMLUX_HPP_EXCEPTIONS 1
#else
#define CAMLUX_HPP_EXCEPTIONS 0
#endif

namespace camlux {

#ifdef __cpp_lib_span
template <class T>
using span = std::span<T>;
#else
/** Contiguous values: the part of std::span that is needed here. */
template <class T>
class span {
public:
    using value_type = std::remove_cv_t<T>;

    constexpr span() noexcept = default;
    constexpr span(T *data, std::size_t size) noexcept : data_(data), size_(size) {}
    template <class Container, class = decltype(static_cast<T *>(std::declval<Container &>().data()))>
    constexpr span(Container &&container) noexcept : data_(container.data()), size_(container.size())
    {
    }
    template <std::size_t Size>
    constexpr span(T (&array)[Size]) noexcept : data_(array), size_(Size)
    {
    }

    constexpr T *data() const noexcept { return data_; }
    constexpr std::size_t size() const noexcept { return size_; }
    constexpr std::size_t size_bytes() const noexcept { return size_ * sizeof(T); }
    constexpr bool empty() const noexcept { return size_ == 0; }
    constexpr T *begin() const noexcept { return data_; }
    constexpr T *end() const noexcept { return data_ + size_; }
    constexpr T &operator[](std::size_t index) const noexcept { return data_[index]; }

private:
    T *data_ = nullptr;
    std::size_t size_ = 0;
};
#endif

/** The exception for a call that did not end with CAMLUX_OK. */
class error : public std::runtime_error {
public:
    error(camlux_status status, const std::string &message) : std::runtime_error(message), status_(status) {}

    /** CAMLUX_CANCELLED, CAMLUX_ERROR_SCENE and so on. */
    camlux_status status() const noexcept { return status_; }

private:
    camlux_status status_;
};

namespace detail {

[[noreturn]] inline void fail(camlux_status status, const std::string &message)
{
#if CAMLUX_HPP_EXCEPTIONS
    throw error(status, message);
#else
    std::fprintf(stderr, "camlux: %s: %s\n", camlux_status_text(status), message.c_str());
    std::abort();
#endif
}

/** Where the exceptions of callbacks wait until a call can throw them: the first of them, with a lock. */
class kept_exception {
public:
    void keep(std::exception_ptr exception)
    {
        const std::lock_guard<std::mutex> lock(changing_);
        if (!first_)
            first_ = std::move(exception);
    }
    std::exception_ptr get() const
    {
        const std::lock_guard<std::mutex> lock(changing_);
        return first_;
    }
    std::exception_ptr take()
    {
        const std::lock_guard<std::mutex> lock(changing_);
        return std::exchange(first_, nullptr);
    }

private:
    mutable std::mutex changing_{};
    std::exception_ptr first_ = nullptr;
};

/** The exceptions of the callbacks on this thread. */
inline kept_exception &thrown()
{
    thread_local kept_exception thrown;
    return thrown;
}

/** On the thread of a job: where its exceptions go, to be thrown by job::wait. */
inline std::shared_ptr<kept_exception> &thrown_by_job()
{
    thread_local std::shared_ptr<kept_exception> thrown = nullptr;
    return thrown;
}

/** Calls a function of the host from inside the library, which no exception may cross. Keeps its exception. */
template <class Function>
bool guarded([[maybe_unused]] kept_exception &thrown, Function &&function) noexcept
{
#if CAMLUX_HPP_EXCEPTIONS
    try {
        function();
        return true;
    } catch (...) {
        thrown.keep(std::current_exception());
        return false;
    }
#else
    function();
    return true;
#endif
}

}  // namespace detail

/** What a try_ function returns: a T, or a status and its message. */
template <class T>
class [[nodiscard]] result {
public:
    result(T value) : value_(std::move(value)) {}
    result(camlux_status status, std::string message) : status_(status), message_(std::move(message)) {}

    bool ok() const noexcept { return value_.has_value(); }
    explicit operator bool() const noexcept { return ok(); }
    camlux_status status() const noexcept { return status_; }
    const std::string &message() const noexcept { return message_; }

    /** Returns the value, or throws the error. */
    T &value() &
    {
        if (!ok())
            detail::fail(status_, message_);
        return *value_;
    }
    T &&value() && { return std::move(value()); }
    /** The value. The result must be ok. */
    T &operator*() noexcept { return *value_; }
    const T &operator*() const noexcept { return *value_; }
    T *operator->() noexcept { return &*value_; }
    const T *operator->() const noexcept { return &*value_; }

private:
    std::optional<T> value_ = std::nullopt;
    camlux_status status_ = CAMLUX_OK;
    std::string message_ = {};
};

/** The result of a function without a value. */
template <>
class [[nodiscard]] result<void> {
public:
    result() = default;
    result(camlux_status status, std::string message) : status_(status), message_(std::move(message)) {}

    bool ok() const noexcept { return status_ == CAMLUX_OK; }
    explicit operator bool() const noexcept { return ok(); }
    camlux_status status() const noexcept { return status_; }
    const std::string &message() const noexcept { return message_; }

    /** Throws the error, if it is one. */
    void value() const
    {
        if (!ok())
            detail::fail(status_, message_);
    }

private:
    camlux_status status_ = CAMLUX_OK;
    std::string message_ = {};
};

namespace detail {

inline result<void> ended(camlux_status status)
{
#if CAMLUX_HPP_EXCEPTIONS
    if (const std::exception_ptr exception = thrown().take())
        std::rethrow_exception(exception);
#endif
    if (status == CAMLUX_OK)
        return {};
    return {status, camlux_last_error()};
}

template <class T>
result<std::decay_t<T>> ended(camlux_status status, T &&value)
{
    // The value of a call that has succeeded is worth more than an exception of the log function: the next call without a value throws it.
    if (status == CAMLUX_OK)
        return std::forward<T>(value);
    const result<void> end = ended(status);
    return {end.status(), end.message()};
}

/** Owns one reference to an object of the library. */
template <class Raw, camlux_status (*retain)(Raw *), camlux_status (*release)(Raw *)>
class handle {
public:
    handle() noexcept = default;
    /** Takes ownership of a reference from camlux.h. */
    explicit handle(Raw *raw) noexcept : raw_(raw) {}
    handle(const handle &other) : raw_(other.raw_)
    {
        if (raw_ != nullptr && retain(raw_) != CAMLUX_OK) {
            raw_ = nullptr;
            fail(CAMLUX_ERROR_INVALID_HANDLE, camlux_last_error());
        }
    }
    handle(handle &&other) noexcept : raw_(std::exchange(other.raw_, nullptr)) {}
    handle &operator=(handle other) noexcept
    {
        std::swap(raw_, other.raw_);
        return *this;
    }
    ~handle() { release(raw_); }

    /** Returns the handle for functions of camlux.h. This object keeps the reference. */
    Raw *get() const noexcept { return raw_; }
    explicit operator bool() const noexcept { return raw_ != nullptr; }
    friend bool operator==(const handle &a, const handle &b) noexcept { return a.raw_ == b.raw_; }
    friend bool operator!=(const handle &a, const handle &b) noexcept { return a.raw_ != b.raw_; }

private:
    Raw *raw_ = nullptr;
};

}  // namespace detail

}  // namespace camlux

#endif  /* CAMLUX_RESULT_HPP */
