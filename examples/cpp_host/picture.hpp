// Radiance as a picture for a look: 8-bit sRGB in a PNG file.
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

// The mean of the pixels that fall on each pixel of a square picture.
Picture smaller(const camlux::view<float> &radiance, std::size_t size_px);

// The radiance below which nine tenths of the pixels are, in all bands.
float bright_radiance(const Picture &picture);

void place(Picture &onto, std::size_t x, std::size_t y, const Picture &picture);

// `bright` is a radiance that is shown bright; what is above comes close to white. Throws std::runtime_error where the file cannot be written.
void write_png(const std::string &path, const Picture &picture, float bright);
