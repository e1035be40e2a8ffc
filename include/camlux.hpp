/*
 * camlux for C++17 and later. It wraps camlux.h with owning handles, exceptions or results, and typed views. Header only; link
 * libcamlux.
 *
 * camlux.h is the manual. It describes what each function does, its units and its threads, under the same name. This file describes
 * only the differences.
 *
 *
 * A COMPLETE EXAMPLE
 *
 *     camlux::scene scene = camlux::scene::load("scenes/cornell_spot.toml");
 *     camlux::renderer renderer = camlux::renderer::create(camlux::device::open());
 *     camlux::frame frame = renderer.render(scene);
 *     camlux::view<float> radiance = frame.view<float>(camlux::layer::radiance);
 *     std::printf("%g %s\n", radiance(400, 400, 0), radiance.unit());
 *
 *
 * HANDLES
 *
 * device, scene, renderer, frame, job, shared_memory and cancel_token hold one reference each. Copies share the object, moves transfer the
 * reference, destructors release it. A handle that was created without arguments or moved from is empty: it converts to false, and calls
 * with it fail with CAMLUX_ERROR_INVALID_HANDLE. get() returns the handle for camlux.h.
 *
 *
 * ERRORS
 *
 * Every function has two forms. The plain form throws camlux::error, with the status and the message of camlux_last_error, also
 * if a render was cancelled (CAMLUX_CANCELLED). The form that begins with try_ returns a result<T>, which has a value or a
 * status and a message. It throws no camlux::error. With -fno-exceptions, use only the try_ forms: a plain form that fails
 * aborts the program.
 *
 * These headers find a few errors themselves: texts with a NUL inside, arrays of unequal length, a view of the wrong type. Such an error
 * has a status and a message like all others, but camlux_last_error and the log do not have it, since no call of camlux.h has failed.
 *
 *
 * CALLBACKS
 *
 * Callbacks are std::function, and may throw. No exception crosses the library. Both forms throw the exception again, because it is the
 * host's own:
 *
 * - An exception in a progress function cancels the render. The call that renders throws it; for a job, job::wait.
 * - An exception in a log function cancels nothing, and costs no result: a call that returns a value returns it. The next call of that
 *   thread that returns none, or fails, throws the exception.
 */

#ifndef CAMLUX_HPP
#define CAMLUX_HPP

#if __cplusplus < 201703L && !(defined(_MSVC_LANG) && _MSVC_LANG >= 201703L)
#error "camlux.hpp needs C++17 or later: compile with -std=c++17 (C++11 can use camlux.h)"
#else

#include <cstdint>

#include "camlux.h"
#include "camlux/camera.hpp"
#include "camlux/device.hpp"
#include "camlux/frame.hpp"
#include "camlux/light.hpp"
#include "camlux/log.hpp"
#include "camlux/material.hpp"
#include "camlux/mesh.hpp"
#include "camlux/pose.hpp"
#include "camlux/renderer.hpp"
#include "camlux/result.hpp"
#include "camlux/scene.hpp"
#include "camlux/values.hpp"

namespace camlux {

/** The version of the library at run time; CAMLUX_VERSION_MAJOR and so on are those of this header. See camlux_version. */
inline std::uint32_t version() noexcept { return camlux_version(); }

}  // namespace camlux

#endif  /* C++17 */

#endif  /* CAMLUX_HPP */
