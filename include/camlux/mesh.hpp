/* Part of camlux.hpp: arrays and meshes. */

#ifndef CAMLUX_MESH_HPP
#define CAMLUX_MESH_HPP

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>

#include "values.hpp"

namespace camlux {

namespace detail {

/** The number type in an element of N numbers; no type if it is not such an element. */
template <class Element, std::size_t N, class = void>
struct number_in {};

template <class Number, std::size_t N>
struct number_in<std::array<Number, N>, N> {
    using type = Number;
};

template <class Number>
struct number_in<Number, 1, std::enable_if_t<std::is_arithmetic_v<Number>>> {
    using type = Number;
};

/** Whether the elements of a container end with it. */
template <class Container, class = void>
struct owns_elements : std::false_type {};

template <class Container>
struct owns_elements<Container, std::void_t<typename Container::allocator_type>> : std::true_type {};

template <class Element, std::size_t N>
struct owns_elements<std::array<Element, N>, void> : std::true_type {};

}  // namespace detail

/**
 * Elements of N numbers each in the host's memory: camlux_array with its count. They are read only during
 * scene::add_mesh or scene::set_mesh.
 *
 * The numbers are float or double for vertices, uint16_t or uint32_t for indices.
 */
template <std::size_t N>
class elements {
public:
    /** No elements. */
    constexpr elements() noexcept = default;

    /**
     * `count` elements from `first`. \param stride_bytes from one element to the next, such as sizeof(Vertex), or
     * 3 * sizeof(float) in a list of numbers with three for each element.
     */
    template <class Number>
    constexpr elements(const Number *first, std::size_t count, std::size_t stride_bytes) noexcept
        : first_(first), count_(count), stride_bytes_(stride_bytes), format_(format_of<Number>())
    {
    }

    /** A vector, array or span of std::array<Number, N>; if N is 1, of numbers. */
    template <class Container, class Element = std::remove_cv_t<typename std::decay_t<Container>::value_type>,
              class Number = typename detail::number_in<Element, N>::type>
    constexpr elements(const Container &container) noexcept
        : elements(static_cast<const Number *>(static_cast<const void *>(container.data())), container.size(), sizeof(Element))
    {
        static_assert(sizeof(Element) == N * sizeof(Number), "elements have no gaps inside");
    }

    /** Elements refer to the container's, which must live as long: no temporary vector or array. */
    template <class Container, class = std::enable_if_t<!std::is_reference_v<Container> && detail::owns_elements<Container>::value>>
    elements(Container &&container) = delete;

    constexpr std::size_t count() const noexcept { return count_; }
    camlux_array raw() const noexcept { return {count_ == 0 ? nullptr : first_, stride_bytes_, format_, 0}; }

private:
    template <class Number>
    static constexpr std::int32_t format_of() noexcept
    {
        constexpr bool is_f32 = std::is_same_v<Number, float>, is_f64 = std::is_same_v<Number, double>;
        constexpr bool is_u16 = std::is_same_v<Number, std::uint16_t>, is_u32 = std::is_same_v<Number, std::uint32_t>;
        static_assert(is_f32 || is_f64 || is_u16 || is_u32, "float, double, uint16_t or uint32_t");
        return is_f32 ? CAMLUX_FORMAT_F32 : is_f64 ? CAMLUX_FORMAT_F64 : is_u16 ? CAMLUX_FORMAT_U16 : CAMLUX_FORMAT_U32;
    }

    const void *first_ = nullptr;
    std::size_t count_ = 0;
    std::size_t stride_bytes_ = 0;
    std::int32_t format_ = CAMLUX_FORMAT_F32;
};

/** camlux_mesh. Arrays that are not empty have one element for each vertex, or for each triangle. */
struct mesh {
    elements<3> positions_m = {};
    elements<3> normals = {};
    elements<2> texcoords = {};
    /** Three indices of vertices for each triangle. */
    elements<3> triangles = {};
    /** One material for all triangles, used if triangle_materials is empty. */
    std::uint32_t material = 0;
    elements<1> triangle_materials = {};
    std::string name = {};
};

namespace detail {

inline camlux_mesh raw_of(const mesh &from) noexcept
{
    camlux_mesh to = CAMLUX_MESH_INIT;
    to.material = from.material;
    to.vertex_count = from.positions_m.count();
    to.triangle_count = from.triangles.count();
    to.positions_m = from.positions_m.raw();
    to.normals = from.normals.raw();
    to.texcoords = from.texcoords.raw();
    to.indices = from.triangles.raw();
    to.triangle_materials = from.triangle_materials.raw();
    to.name = name_of(from.name);
    return to;
}

/** Checks what camlux.h cannot check: texts, and that arrays have the same count. */
inline result<void> check_mesh(const mesh &mesh)
{
    const auto fits = [](const auto &list, const auto &whole) {
        return list.count() == 0 || list.count() == whole.count();
    };
    if (!fits(mesh.normals, mesh.positions_m) || !fits(mesh.texcoords, mesh.positions_m) ||
        !fits(mesh.triangle_materials, mesh.triangles))
        return {CAMLUX_ERROR_INVALID_ARGUMENT, "camlux::mesh: normals, texcoords and triangle_materials are empty, or as many as "
                                               "positions_m and triangles"};
    return check_texts({{"mesh.name", mesh.name}});
}

}  // namespace detail

}  // namespace camlux

#endif  /* CAMLUX_MESH_HPP */
