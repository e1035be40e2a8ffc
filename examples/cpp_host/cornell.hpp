// The Cornell box of scenes/cornell.toml, from arrays.
#pragma once

#include <camlux.hpp>

// The parts of the box, by index.
struct Cornell {
    camlux::scene scene;
    std::uint32_t light;
    std::uint32_t instance;
};

// The same values as in the scene file and its OBJ and MTL files, to the last bit. `size_px` is the width and height.
Cornell cornell_box(std::uint32_t size_px);

// The position of its light, m.
extern const camlux::vec3 cornell_light_m;
