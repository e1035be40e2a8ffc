/* Part of camlux.hpp: vectors, and what all structs of camlux.h as C++ values need. Units and ranges are those of the C struct that a comment names. */

#ifndef CAMLUX_VALUES_HPP
#define CAMLUX_VALUES_HPP

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <type_traits>

#include "result.hpp"

namespace camlux {

/** x, y, z. */
struct vec3 {
    double x = 0, y = 0, z = 0;
};

/** A value for each band. */
struct rgb {
    double r = 0, g = 0, b = 0;
};

/** A rotation: a quaternion of length 1. */
struct quaternion {
    double x = 0, y = 0, z = 0, w = 1;
};

namespace detail {

/** The number of an enumeration's value, for camlux.h. */
template <class Enum>
constexpr std::int32_t number(Enum value) noexcept
{
    static_assert(std::is_same_v<std::underlying_type_t<Enum>, std::int32_t>);
    return static_cast<std::int32_t>(value);
}

inline void set(double (&to)[3], const vec3 &from) noexcept
{
    to[0] = from.x;
    to[1] = from.y;
    to[2] = from.z;
}

inline void set(double (&to)[3], const rgb &from) noexcept { set(to, vec3{from.r, from.g, from.b}); }

inline vec3 vec3_of(const double (&from)[3]) noexcept { return {from[0], from[1], from[2]}; }

inline rgb rgb_of(const double (&from)[3]) noexcept { return {from[0], from[1], from[2]}; }

inline const char *name_of(const std::string &name) noexcept { return name.empty() ? nullptr : name.c_str(); }

/** A text of the host, and what it is called. */
struct named_text {
    const char *name;
    std::string_view text;
};

/** The error for a text with a NUL inside: C would read no further. */
inline result<void> check_texts(std::initializer_list<named_text> texts)
{
    for (const auto &[name, text] : texts)
        if (const std::size_t end = text.find('\0'); end != std::string_view::npos)
            return {CAMLUX_ERROR_INVALID_ARGUMENT,
                    std::string("camlux: ") + name + " has a NUL after \"" + std::string(text.substr(0, end)) + "\"; remove it"};
    return {};
}

}  // namespace detail

}  // namespace camlux

#endif  /* CAMLUX_VALUES_HPP */
