// Writes radiance as a viewable picture: 8-bit sRGB in a PNG file.
#pragma once

#include <camlux.hpp>

#include <cstdint>
#include <string>
#include <vector>

// Linear R, G, B.
struct Picture {
    std::size_t width = 0, height = 0;
    std::vector<float> rgb;

    float *pixel(std::size_t x, std::size_t y) { return &rgb[3 * (y * width + x)]; }
    const float *pixel(std::size_t x, std::size_t y) const { return &rgb[3 * (y * width + x)]; }
};

Picture black(std::size_t width, std::size_t height);

// Reduces an image to a square picture: each pixel is the mean of the pixels that fall on it.
Picture smaller(const camlux::view<float> &radiance, std::size_t size_px);

// The 90th percentile of the radiance, over all bands.
float bright_radiance(const Picture &picture);

void place(Picture &onto, std::size_t x, std::size_t y, const Picture &picture);

// `bright` is a radiance that is shown bright; higher values approach white. Throws std::runtime_error if the file cannot be written.
void write_png(const std::string &path, const Picture &picture, float bright);
