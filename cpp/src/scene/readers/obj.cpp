#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "file_bytes.hpp"
#include "loaded_mesh.hpp"
#include "mirrorbake/core/error.hpp"
#include "mtl.hpp"
#include "obj_builder.hpp"
#include "obj_libraries.hpp"
#include "readers.hpp"
#include "text_lines.hpp"

namespace mirrorbake {
namespace {

// A number that float can hold, with the digits that only double can.
std::optional<double> finite_number(std::string_view token) {
  if (token.starts_with('+')) token.remove_prefix(1);
  double value = 0.0;
  const auto [stop, code] = std::from_chars(token.data(), token.data() + token.size(), value);
  // from_chars does not say which end of the range was left.
  if (code == std::errc::result_out_of_range) value = std::strtod(std::string(token).c_str(), nullptr);
  if (code == std::errc::invalid_argument || stop != token.data() + token.size() ||
      !(std::abs(value) <= std::numeric_limits<float>::max())) {
    return std::nullopt;
  }
  return value;
}

// position, position/uv, position//normal or position/uv/normal, each an integer. What follows a slash may be
// missing.
std::optional<ObjCorner> corner_from(std::string_view token) {
  std::array<int, 3> indices{};
  for (int part = 0; part < 3; ++part) {
    const std::size_t end = std::min(token.find('/'), token.size());
    const bool is_empty = end == 0 && part > 0;
    int& index = indices[static_cast<std::size_t>(part)];
    const auto [stop, code] = std::from_chars(token.data(), token.data() + end, index);
    // 0 is no index, and would otherwise count as a missing one.
    if (!is_empty && (code != std::errc() || stop != token.data() + end || (index == 0 && part > 0)))
      return std::nullopt;
    if (end == token.size()) return ObjCorner{indices[0], indices[1], indices[2]};
    token.remove_prefix(end + 1);
  }
  return std::nullopt;
}

// The reader of one file. Where an object (`o`) is named, groups (`g`) are stretches of it; in files without,
// they are the objects.
class ObjReader {
 public:
  ObjReader(const std::string& path, const MeshLimits& limits, ObjContent& content, glm::dvec3 origin)
      : path_(path), builder_(path, limits), content_(content), origin_(origin) {}

  LoadedMesh read(std::string_view text) {
    TextLines objects(text);
    while (!names_objects_ && objects.next()) {
      names_objects_ = mtl::split_keyword(objects.line()).first == "o";
    }
    TextLines lines(text);
    while (lines.next()) read_line(lines.line(), lines.number());
    content_.materials = std::move(builder_.material_names());
    return builder_.finish();
  }

 private:
  void read_line(std::string_view line, std::size_t number) {
    line_number_ = number;
    const auto [keyword, rest] = mtl::split_keyword(line);
    if (keyword == "v") {
      read_position(rest);
    } else if (keyword == "vn") {
      read_numbers(rest, 3);
      builder_.add_normal(glm::vec3(first_three()));
    } else if (keyword == "vt") {
      read_numbers(rest, 1);
      builder_.add_uv(glm::vec2(numbers_[0], numbers_.size() > 1 ? numbers_[1] : 0.0));
    } else if (keyword == "f" || keyword == "fo") {
      read_face(rest);
    } else if (keyword == "usemtl") {
      builder_.set_material(std::string(rest));
    } else if (keyword == "o" || (keyword == "g" && !names_objects_)) {
      builder_.set_name(std::string(rest));
    } else if (keyword == "s") {
      read_smoothing(rest);
    } else if (keyword == "mtllib" && !rest.empty()) {
      content_.libraries.emplace_back(rest);
    } else if (keyword == "l") {
      ++content_.lines;
    } else if (keyword == "p") {
      ++content_.points;
    } else if (keyword == "curv" || keyword == "curv2" || keyword == "surf") {
      ++content_.curves;
    }
  }

  static std::string_view take_token(std::string_view& line) {
    const auto [token, rest] = mtl::split_keyword(line);
    line = rest;
    return token.starts_with('#') ? std::string_view() : token;
  }

  [[noreturn]] void fail(const std::string& problem) const {
    throw FileError(path_, "line " + std::to_string(line_number_) + " has " + problem);
  }

  void read_numbers(std::string_view rest, std::size_t needed) {
    numbers_.clear();
    for (std::string_view token = take_token(rest); !token.empty(); token = take_token(rest)) {
      const std::optional<double> value = finite_number(token);
      if (!value) fail("'" + std::string(token.substr(0, 40)) + "', expected a finite float32");
      numbers_.push_back(*value);
    }
    if (numbers_.size() < needed) {
      fail(std::to_string(numbers_.size()) + " numbers, expected " + std::to_string(needed) + " or more");
    }
  }

  glm::dvec3 first_three() const { return {numbers_[0], numbers_[1], numbers_[2]}; }

  // x y z, with a weight w for curves or, in files of scanners and sculptors, a colour.
  void read_position(std::string_view rest) {
    read_numbers(rest, 3);
    builder_.add_position(glm::vec3(first_three() - origin_));
    if (numbers_.size() < 6) return;
    ++content_.colors;
    const auto unit = [](double v) { return std::clamp(static_cast<float>(v), 0.0F, 1.0F); };
    builder_.set_color({unit(numbers_[3]), unit(numbers_[4]), unit(numbers_[5])});
  }

  void read_face(std::string_view rest) {
    corners_.clear();
    for (std::string_view token = take_token(rest); !token.empty(); token = take_token(rest)) {
      const std::optional<ObjCorner> corner = corner_from(token);
      if (!corner) fail("'" + std::string(token.substr(0, 40)) + "', expected the indices of a corner");
      corners_.push_back(*corner);
    }
    // Exporters leave them behind where they have merged points.
    if (corners_.size() < 3) {
      ++content_.short_faces;
      return;
    }
    builder_.add_face(corners_);
  }

  // A number, or "off" for 0; programs write "on" and nothing too.
  void read_smoothing(std::string_view rest) {
    const std::string_view token = take_token(rest);
    std::uint32_t group = 1;
    const auto [stop, code] = std::from_chars(token.data(), token.data() + token.size(), group);
    if (token == "off") group = 0;
    builder_.set_smoothing(code == std::errc() || token == "off" ? group : 1);
  }

  const std::string& path_;
  ObjBuilder builder_;
  ObjContent& content_;
  glm::dvec3 origin_;
  std::size_t line_number_ = 0;
  bool names_objects_ = false;
  std::vector<double> numbers_;
  std::vector<ObjCorner> corners_;
};

}  // namespace

std::vector<std::string> material_libraries(std::string_view text) {
  std::vector<std::string> libraries;
  TextLines lines(text);
  while (lines.next()) {
    const auto [keyword, rest] = mtl::split_keyword(lines.line());
    if (keyword == "mtllib" && !rest.empty()) libraries.emplace_back(rest);
  }
  return libraries;
}

std::vector<std::string> library_files(const std::string& path, std::string names) {
  std::replace(names.begin(), names.end(), '\\', '/');
  std::error_code code;
  const auto whole = resolve_inside(std::filesystem::path(path).parent_path(), names);
  if (whole && std::filesystem::exists(*whole, code)) return {names};
  std::vector<std::string> files;
  std::string_view left = names;
  while (!left.empty()) {
    const auto [file, rest] = mtl::split_keyword(left);
    files.emplace_back(file);
    left = rest;
  }
  return files;
}

LoadedMesh read_obj_content(const std::string& path, const MeshLimits& limits, glm::dvec3 origin,
                            ObjContent& content) {
  LoadedMesh loaded = ObjReader(path, limits, content, origin).read(read_file(path));
  check_positions(path, loaded.mesh.positions);
  return loaded;
}

LoadedMesh read_obj(const std::string& path, const MeshLimits& limits, glm::dvec3 origin) {
  ObjContent ignored;
  return read_obj_content(path, limits, origin, ignored);
}

}  // namespace mirrorbake
