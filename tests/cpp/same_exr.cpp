// Compares two OpenEXR files, except for the order of the attributes in their headers: same_exr A.exr B.exr
// camlux writes the attributes in no fixed order. Everything else must be equal bit for bit.

#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

namespace {

struct File {
    std::map<std::string, std::string> attributes = {};
    // The offset table and the rows of pixels.
    std::string rest = {};
};

std::string text(const std::string &bytes, std::size_t &at)
{
    const std::size_t end = bytes.find('\0', at);
    if (end == std::string::npos)
        throw std::runtime_error("the header does not end");
    const std::string found = bytes.substr(at, end - at);
    at = end + 1;
    return found;
}

std::uint32_t u32(const std::string &bytes, std::size_t at)
{
    std::uint32_t value = 0;
    for (std::size_t byte = 4; byte-- > 0;)
        value = value << 8 | static_cast<unsigned char>(bytes.at(at + byte));
    return value;
}

File read(const char *path)
{
    std::ifstream stream(path, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
    if (!stream || bytes.size() < 8 || u32(bytes, 0) != 20000630)
        throw std::runtime_error(std::string(path) + " is no OpenEXR file");
    File file;
    std::size_t at = 8;
    for (std::string name = text(bytes, at); !name.empty(); name = text(bytes, at)) {
        const std::string type = text(bytes, at);
        const std::size_t size = u32(bytes, at);
        if (!file.attributes.emplace(name, type + ": " + bytes.substr(at + 4, size)).second)
            throw std::runtime_error(std::string(path) + " says " + name + " twice");
        at += 4 + size;
    }
    file.rest = bytes.substr(at);
    return file;
}

}  // namespace

int main(int argument_count, char **arguments)
{
    if (argument_count != 3)
        return 2;
    try {
        const File a = read(arguments[1]), b = read(arguments[2]);
        bool is_same = a.rest == b.rest && !a.rest.empty();
        if (!is_same)
            std::fprintf(stderr, "the pixels differ\n");
        std::map<std::string, std::string> all = a.attributes;
        all.insert(b.attributes.begin(), b.attributes.end());
        for (const auto &[name, value] : all) {
            const auto in_a = a.attributes.find(name), in_b = b.attributes.find(name);
            const bool agrees = in_a != a.attributes.end() && in_b != b.attributes.end() && in_a->second == in_b->second;
            if (!agrees)
                std::fprintf(stderr, "the headers differ: %s\n", name.c_str());
            is_same = is_same && agrees;
        }
        if (is_same)
            std::printf("%zu bytes of pixels and %zu attributes are the same\n", a.rest.size(), all.size());
        return is_same ? 0 : 1;
    } catch (const std::exception &problem) {
        std::fprintf(stderr, "same_exr: %s\n", problem.what());
        return 2;
    }
}
