// Measures what a renderer repeats after a change, and what it reuses.
#pragma once

#include <camlux.hpp>

#include <cstdint>

// Prints a table for the Cornell box at this size: times and passes of a frame after each kind of change.
void print_reuse(const camlux::device &device, std::uint32_t size_px);

// Prints nanoseconds per call of the functions that change a scene.
void print_setters();
