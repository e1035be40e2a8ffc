#include "picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

Picture black(std::size_t width, std::size_t height) { return {width, height, std::vector<float>(3 * width * height)}; }

Picture smaller(const camlux::view<float> &radiance, std::size_t size_px)
{
    Picture picture = black(size_px, size_px);
    const auto edge = [size_px](std::size_t index, std::size_t whole) { return index * whole / size_px; };
    for (std::size_t y = 0; y < size_px; ++y) {
        const std::size_t top = edge(y, radiance.height());
        const std::size_t bottom = std::max(edge(y + 1, radiance.height()), top + 1);
        for (std::size_t x = 0; x < size_px; ++x) {
            const std::size_t left = edge(x, radiance.width());
            const std::size_t right = std::max(edge(x + 1, radiance.width()), left + 1);
            float *mean = picture.pixel(x, y);
            for (std::size_t from_y = top; from_y < bottom; ++from_y)
                for (std::size_t from_x = left; from_x < right; ++from_x)
                    for (std::size_t band = 0; band < 3; ++band)
                        mean[band] += radiance(from_x, from_y, band);
            for (std::size_t band = 0; band < 3; ++band)
                mean[band] /= static_cast<float>((bottom - top) * (right - left));
        }
    }
    return picture;
}

float bright_radiance(const Picture &picture)
{
    std::vector<float> values = picture.rgb;
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 9 / 10);
    std::nth_element(values.begin(), place, values.end());
    return *place;
}

void place(Picture &onto, std::size_t x, std::size_t y, const Picture &picture)
{
    for (std::size_t row = 0; row < picture.height; ++row)
        std::copy_n(picture.pixel(0, row), 3 * picture.width, onto.pixel(x, y + row));
}

namespace {

std::uint8_t srgb(float linear)
{
    const float value = std::clamp(linear, 0.0f, 1.0f);
    const float encoded = value <= 0.0031308f ? 12.92f * value : 1.055f * std::pow(value, 1 / 2.4f) - 0.055f;
    return static_cast<std::uint8_t>(std::lround(255 * encoded));
}

using Bytes = std::vector<std::uint8_t>;

void add_u32(Bytes &bytes, std::uint32_t value)
{
    for (const int shift : {24, 16, 8, 0})
        bytes.push_back(static_cast<std::uint8_t>(value >> shift));
}

std::uint32_t crc32(const std::uint8_t *begin, const std::uint8_t *end)
{
    std::uint32_t crc = ~UINT32_C(0);
    for (; begin != end; ++begin) {
        crc ^= *begin;
        for (int bit = 0; bit < 8; ++bit)
            crc = crc >> 1 ^ (crc & 1 ? UINT32_C(0xedb88320) : 0);
    }
    return ~crc;
}

void add_chunk(Bytes &file, const char *type, const Bytes &data)
{
    add_u32(file, static_cast<std::uint32_t>(data.size()));
    const std::size_t begin = file.size();
    file.insert(file.end(), type, type + 4);
    file.insert(file.end(), data.begin(), data.end());
    add_u32(file, crc32(file.data() + begin, file.data() + file.size()));
}

// A zlib stream without compression: simple, and good enough for small pictures.
Bytes stored(const Bytes &data)
{
    Bytes stream = {0x78, 0x01};
    constexpr std::size_t most = 65535;
    for (std::size_t begin = 0; begin < data.size(); begin += most) {
        const std::size_t size = std::min(most, data.size() - begin);
        const auto low = static_cast<std::uint8_t>(size), high = static_cast<std::uint8_t>(size >> 8);
        const bool is_last = begin + size == data.size();
        stream.insert(stream.end(), {static_cast<std::uint8_t>(is_last), low, high, static_cast<std::uint8_t>(~low),
                                     static_cast<std::uint8_t>(~high)});
        const auto first = data.begin() + static_cast<std::ptrdiff_t>(begin);
        stream.insert(stream.end(), first, first + static_cast<std::ptrdiff_t>(size));
    }
    std::uint32_t a = 1, b = 0;
    for (const std::uint8_t byte : data) {
        a = (a + byte) % 65521;
        b = (b + a) % 65521;
    }
    add_u32(stream, b << 16 | a);
    return stream;
}

}  // namespace

void write_png(const std::string &path, const Picture &picture, float bright)
{
    Bytes rows;
    for (std::size_t y = 0; y < picture.height; ++y) {
        rows.push_back(0);  // No filter.
        for (std::size_t value = 0; value < 3 * picture.width; ++value)
            rows.push_back(srgb(1 - std::exp(-1.5f * picture.pixel(0, y)[value] / bright)));
    }
    Bytes header;
    add_u32(header, static_cast<std::uint32_t>(picture.width));
    add_u32(header, static_cast<std::uint32_t>(picture.height));
    header.insert(header.end(), {8, 2, 0, 0, 0});  // Eight bits, R G B.
    Bytes file = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    add_chunk(file, "IHDR", header);
    add_chunk(file, "IDAT", stored(rows));
    add_chunk(file, "IEND", {});

    std::FILE *out = std::fopen(path.c_str(), "wb");
    const bool is_written = out != nullptr && std::fwrite(file.data(), 1, file.size(), out) == file.size();
    const bool is_closed = out != nullptr && std::fclose(out) == 0;
    if (!is_written || !is_closed)
        throw std::runtime_error("cannot write " + path);
}
