#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "image_files.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/image/primaries.hpp"

namespace mirrorbake::image_files {
namespace {

using Pixel = std::array<unsigned char, 4>;

// The order in which pixels are stored: scan lines along one axis, from its end if `turned`.
struct Axis {
  char letter = 'X';
  bool turned = false;
  int length = 0;
};

struct Description {
  bool is_xyz = false;
  glm::dvec3 exposure{1.0};
  Axis slow, fast;
  std::size_t pixels_at = 0;  // byte at which they start
};

std::string_view next_token(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
  const std::string_view token = text.substr(0, text.find_first_of(" \t"));
  text.remove_prefix(token.size());
  return token;
}

template <typename Number>
std::optional<Number> number(std::string_view token) {
  Number value{};
  const auto [stop, code] = std::from_chars(token.data(), token.data() + token.size(), value);
  if (code != std::errc() || stop != token.data() + token.size()) return std::nullopt;
  return value;
}

std::optional<Axis> axis(std::string_view& text) {
  const std::string_view name = next_token(text);
  const std::optional<int> length = number<int>(next_token(text));
  const bool is_good = name.size() == 2 && (name[0] == '+' || name[0] == '-') &&
                       (name[1] == 'X' || name[1] == 'Y') && length && *length > 0;
  if (!is_good) return std::nullopt;
  // Rows count downwards, so that −Y is their natural order.
  return Axis{name[1], (name[0] == '-') == (name[1] == 'X'), *length};
}

class HdrReader : public Reader {
 public:
  HdrReader(std::string name, const Bytes& bytes) : name_(std::move(name)) {
    bytes_ = all_of(name_, bytes);
    description_ = describe();
    const bool is_column_wise = description_.slow.letter == 'X';
    const Axis& x = is_column_wise ? description_.slow : description_.fast;
    const Axis& y = is_column_wise ? description_.fast : description_.slow;
    header_.data = header_.display = {0, 0, x.length, y.length};
    header_.channels = {"R", "G", "B"};
    header_.says_linear = true;
    header_.pixel_bits = 8 * sizeof(Pixel);
    // A scan line of the old encoding takes two pixels at least, one of them a repetition.
    header_.expansion = std::max<std::uint64_t>(
        130, static_cast<std::uint64_t>(description_.fast.length) * sizeof(Pixel) / 8 + 1);
  }

  const Header& header() const override { return header_; }

  void read(std::span<float> pixels) override {
    const Axis& slow = description_.slow;
    const Axis& fast = description_.fast;
    const std::size_t width = static_cast<std::size_t>(header_.data.width);
    const glm::dmat3 rec709_from_file = description_.is_xyz ? rec709_from_xyz() : glm::dmat3(1.0);
    place_ = description_.pixels_at;
    std::vector<Pixel> line(static_cast<std::size_t>(fast.length));
    for (int i = 0; i < slow.length; ++i) {
      read_line(line);
      const int slow_index = slow.turned ? slow.length - 1 - i : i;
      for (int j = 0; j < fast.length; ++j) {
        const int fast_index = fast.turned ? fast.length - 1 - j : j;
        const int x = slow.letter == 'X' ? slow_index : fast_index;
        const int y = slow.letter == 'X' ? fast_index : slow_index;
        const glm::dvec3 stored = decode(line[static_cast<std::size_t>(j)]) / description_.exposure;
        const glm::vec3 value(description_.is_xyz ? rec709_from_file * stored : stored);
        float* to = pixels.data() + 3 * (static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x));
        for (int c = 0; c < 3; ++c) to[c] = value[c];
      }
    }
  }

 private:
  [[noreturn]] void fail(const std::string& problem) const { throw FileError(name_, problem); }

  // Up to the next line feed, without it and a carriage return before it.
  std::string_view take_line(std::size_t& place) const {
    constexpr std::size_t kLongest = 1 << 16;
    const char* begin = reinterpret_cast<const char*>(bytes_.data()) + place;
    const std::string_view rest(begin, std::min(bytes_.size() - place, kLongest));
    const std::size_t end = rest.find('\n');
    if (end == std::string_view::npos) fail("is damaged: its header does not end");
    place += end + 1;
    std::string_view line = rest.substr(0, end);
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }

  void read_variable(std::string_view line, Description& result) const {
    const auto starts = [&](std::string_view key) {
      if (!line.starts_with(key)) return false;
      line.remove_prefix(key.size());
      return true;
    };
    if (starts("FORMAT=")) {
      const std::string_view format = next_token(line);
      if (format != "32-bit_rle_rgbe" && format != "32-bit_rle_xyze") {
        fail("has the format '" + std::string(format.substr(0, 40)) +
             "', expected 32-bit_rle_rgbe or 32-bit_rle_xyze");
      }
      result.is_xyz = format.ends_with("xyze");
    } else if (starts("EXPOSURE=")) {  // several multiply
      result.exposure *= factor(next_token(line), "EXPOSURE");
    } else if (starts("COLORCORR=")) {
      for (int c = 0; c < 3; ++c) result.exposure[c] *= factor(next_token(line), "COLORCORR");
    }
  }

  double factor(std::string_view token, const char* what) const {
    const std::optional<double> value = number<double>(token);
    if (!value || !(*value >= 1e-30 && *value <= 1e30)) {
      fail(std::string("has the ") + what + " '" + std::string(token.substr(0, 40)) +
           "', expected a number above 0");
    }
    return *value;
  }

  Description describe() const {
    Description result;
    std::size_t place = 0;
    take_line(place);  // "#?RADIANCE", "#?RGBE" or another program's name
    for (std::string_view line = take_line(place); !line.empty(); line = take_line(place)) {
      read_variable(line, result);
    }
    std::string_view line = take_line(place);
    const std::string shown(line.substr(0, 40));
    const std::optional<Axis> slow = axis(line);
    const std::optional<Axis> fast = slow ? axis(line) : std::nullopt;
    if (!slow || !fast || slow->letter == fast->letter) {
      fail("has the size '" + shown + "', expected one like '-Y 512 +X 1024'");
    }
    result.slow = *slow;
    result.fast = *fast;
    result.pixels_at = place;
    return result;
  }

  Pixel take_pixel() {
    if (bytes_.size() - place_ < sizeof(Pixel)) fail("is truncated");
    Pixel pixel{};
    std::memcpy(pixel.data(), bytes_.data() + place_, sizeof(Pixel));
    place_ += sizeof(Pixel);
    return pixel;
  }

  unsigned char take_byte() {
    if (place_ >= bytes_.size()) fail("is truncated");
    return bytes_[place_++];
  }

  void read_line(std::vector<Pixel>& line) {
    constexpr std::size_t kShortest = 8;
    constexpr std::size_t kLongest = 0x7fff;
    const Pixel first = take_pixel();
    const bool is_new = line.size() >= kShortest && line.size() <= kLongest && first[0] == 2 &&
                        first[1] == 2 && (first[2] & 0x80) == 0;
    if (!is_new) {
      read_old_line(first, line);
      return;
    }
    if ((std::size_t{first[2]} << 8 | first[3]) != line.size())
      fail("is damaged: a scan line has another length");
    for (std::size_t component = 0; component < 4; ++component) {
      for (std::size_t x = 0; x < line.size();) {
        const std::size_t code = take_byte();
        const bool is_run = code > 128;
        const std::size_t count = is_run ? code - 128 : code;
        if (count == 0 || count > line.size() - x) fail("is damaged: a run exceeds its scan line");
        const unsigned char value = is_run ? take_byte() : 0;
        for (std::size_t i = 0; i < count; ++i) line[x++][component] = is_run ? value : take_byte();
      }
    }
  }

  // Pixels as they are; one of (1, 1, 1, n) repeats the last n times, and one right after it 256 · n times.
  void read_old_line(Pixel pixel, std::vector<Pixel>& line) {
    int shift = 0;
    for (std::size_t x = 0;;) {
      if (pixel[0] == 1 && pixel[1] == 1 && pixel[2] == 1) {
        const std::size_t count = shift < 32 ? std::size_t{pixel[3]} << shift : line.size() + 1;
        if (x == 0 || count > line.size() - x) fail("is damaged: a run exceeds its scan line");
        std::fill_n(line.begin() + static_cast<std::ptrdiff_t>(x), count, line[x - 1]);
        x += count;
        shift += 8;
      } else {
        line[x++] = pixel;
        shift = 0;
      }
      if (x == line.size()) return;
      pixel = take_pixel();
    }
  }

  // A mantissa stands for the middle of its interval in Radiance's own programs; here, as in all other
  // readers, for its lower end, so that 1 is 1.
  static glm::dvec3 decode(const Pixel& pixel) {
    if (pixel[3] == 0) return glm::dvec3(0.0);
    const double scale = std::ldexp(1.0, static_cast<int>(pixel[3]) - 136);
    return glm::dvec3(pixel[0], pixel[1], pixel[2]) * scale;
  }

  std::string name_;
  std::vector<unsigned char> bytes_;
  Description description_;
  Header header_;
  std::size_t place_ = 0;
};

}  // namespace

std::unique_ptr<Reader> open_hdr(const std::string& name, const Bytes& bytes) {
  return std::make_unique<HdrReader>(name, bytes);
}

}  // namespace mirrorbake::image_files
