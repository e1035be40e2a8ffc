/* Part of camlux.hpp: poses. */

#ifndef CAMLUX_POSE_HPP
#define CAMLUX_POSE_HPP

#include <cmath>
#include <cstdint>

#include "values.hpp"

namespace camlux {

/** The axes of a camera: x right, y down, z forward (OpenCV, camlux), or x right, y up, z backward (OpenGL, Blender). */
enum class axes : std::int32_t { opencv = CAMLUX_AXES_OPENCV, opengl = CAMLUX_AXES_OPENGL };

/** camlux_pose: maps a part's own space to world space. */
struct pose {
    vec3 position_m = {};
    quaternion orientation = {};
    /** Scale of an instance; 1 for other parts. */
    double scale = 1;

    /**
     * The pose of a matrix from own space to world space, such as camera-to-world: camlux_pose_from_matrix.
     *
     * \param rows 12 numbers (3 x 4) or 16 (4 x 4), row by row.
     */
    static pose from_matrix(span<const double> rows, axes own = axes::opencv) { return try_from_matrix(rows, own).value(); }
    static result<pose> try_from_matrix(span<const double> rows, axes own = axes::opencv);

    /** At `from_m`, facing `to_m`: cameras and spot lights face along +z of their pose; a camera's +y points down, against `up`. */
    static pose facing(const vec3 &from_m, const vec3 &to_m, const vec3 &up = {0, 1, 0})
    {
        const auto cross = [](const vec3 &a, const vec3 &b) {
            return vec3{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
        };
        const auto unit = [](const vec3 &a, const vec3 &otherwise) {
            const double length = std::sqrt(a.x * a.x + a.y * a.y + a.z * a.z);
            // What is not a number stays so, and is refused.
            return length == 0 ? otherwise : vec3{a.x / length, a.y / length, a.z / length};
        };
        const vec3 z = unit({to_m.x - from_m.x, to_m.y - from_m.y, to_m.z - from_m.z}, {0, 0, 1});
        // Straight up or down, any horizontal direction will do.
        const vec3 any = std::abs(z.x) < 0.9 ? vec3{1, 0, 0} : vec3{0, 0, 1};
        const vec3 x = unit(cross(z, up), unit(cross(z, any), {1, 0, 0}));
        const vec3 y = cross(z, x);
        // The quaternion of the matrix with these columns, by its largest component (Shepperd 1978).
        const double trace = x.x + y.y + z.z;
        const double squares[4] = {1 + 2 * x.x - trace, 1 + 2 * y.y - trace, 1 + 2 * z.z - trace, 1 + trace};
        int largest = 0;
        for (int i = 1; i < 4; ++i)
            largest = squares[i] > squares[largest] ? i : largest;
        const double twice = std::sqrt(squares[largest]), f = 0.5 / twice;
        const quaternion candidates[4] = {
            {0.5 * twice, (y.x + x.y) * f, (z.x + x.z) * f, (y.z - z.y) * f},
            {(y.x + x.y) * f, 0.5 * twice, (z.y + y.z) * f, (z.x - x.z) * f},
            {(z.x + x.z) * f, (z.y + y.z) * f, 0.5 * twice, (x.y - y.x) * f},
            {(y.z - z.y) * f, (z.x - x.z) * f, (x.y - y.x) * f, 0.5 * twice},
        };
        return {from_m, candidates[largest], 1};
    }
};

enum class part : std::int32_t {
    camera = CAMLUX_PART_CAMERA,
    light = CAMLUX_PART_LIGHT,
    instance = CAMLUX_PART_INSTANCE,
};

namespace detail {

inline camlux_pose raw_of(const pose &from) noexcept
{
    camlux_pose to = CAMLUX_POSE_INIT;
    set(to.position_m, from.position_m);
    to.orientation_xyzw[0] = from.orientation.x;
    to.orientation_xyzw[1] = from.orientation.y;
    to.orientation_xyzw[2] = from.orientation.z;
    to.orientation_xyzw[3] = from.orientation.w;
    to.scale = from.scale;
    return to;
}

inline pose pose_of(const camlux_pose &from) noexcept
{
    const double(&q)[4] = from.orientation_xyzw;
    return {vec3_of(from.position_m), {q[0], q[1], q[2], q[3]}, from.scale};
}

}  // namespace detail

inline result<pose> pose::try_from_matrix(span<const double> rows, axes own)
{
    camlux_pose raw = CAMLUX_POSE_INIT;
    const camlux_status status = camlux_pose_from_matrix(rows.data(), rows.size(), detail::number(own), &raw);
    return detail::ended(status, detail::pose_of(raw));
}

}  // namespace camlux

#endif  /* CAMLUX_POSE_HPP */
