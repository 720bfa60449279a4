#include "mirrorbake/envmap/envmap.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"

namespace mirrorbake {
namespace {

void check_names(const EnvMapLayout& layout, std::span<const std::string> names) {
  if (!names.empty() && names.size() != static_cast<std::size_t>(layout.channels)) {
    throw InvalidArgument("channels", std::to_string(names.size()) + " names",
                          std::to_string(layout.channels));
  }
}

}  // namespace

std::size_t EnvMapLayout::level_offset(int level) const {
  std::size_t texels = 0;
  for (int l = 0; l < level; ++l) texels += level_texels(l);
  return texels * static_cast<std::size_t>(channels);
}

int full_level_count(int width, int height) {
  return static_cast<int>(std::bit_width(static_cast<unsigned>(std::max({width, height, 1}))));
}

void validate(const EnvMapLayout& layout) {
  validate(layout.projection);
  for (const auto& [name, side] : {std::pair{"width", layout.width}, {"height", layout.height}}) {
    check_range(name, side, 1, 65536, " texels");
  }
  if (layout.projection.kind == ProjectionKind::cube && layout.width != layout.height) {
    throw InvalidArgument(
        "height", std::to_string(layout.height),
        "the width, " + std::to_string(layout.width) + ": the faces of a cube map are square");
  }
  check_range("channels", layout.channels, 1, 1024);
  check_range("levels", layout.levels, 1, full_level_count(layout.width, layout.height));
}

void validate(const EnvMapView& map) {
  validate(map.layout);
  if (map.values.size() != map.layout.size()) {
    throw InvalidArgument("values", std::to_string(map.values.size()) + " numbers",
                          std::to_string(map.layout.size()) + " (levels, faces, rows, columns and channels)");
  }
  check_names(map.layout, map.channels);
}

EnvMap make_envmap(const EnvMapLayout& layout, std::span<const std::string> channels) {
  validate(layout);
  check_names(layout, channels);
  return {layout, std::vector<float>(layout.size()), {channels.begin(), channels.end()}};
}

std::vector<double> integrate(const EnvMapView& map, int level) {
  validate(map);
  check_range("level", level, 0, map.layout.levels - 1);
  const int width = map.layout.level_width(level);
  const int height = map.layout.level_height(level);
  // A table of a wide panorama would take more memory than its values.
  const bool rows_alike = is_panorama(map.layout.projection.kind);
  std::vector<double> angles;
  if (!rows_alike) angles = texel_solid_angles(map.layout.projection, width, height);
  const std::span<const float> values = map.level(level);
  const std::size_t channels = static_cast<std::size_t>(map.layout.channels);
  std::vector<double> sums(channels);
  const float* value = values.data();
  for (int face = 0; face < face_count(map.layout.projection); ++face) {
    for (int row = 0; row < height; ++row) {
      const double of_row =
          rows_alike ? texel_solid_angle(map.layout.projection, width, height, 0, row) : 0.0;
      const double* of_texels =
          rows_alike ? nullptr : angles.data() + static_cast<std::ptrdiff_t>(row) * width;
      for (int column = 0; column < width; ++column, value += channels) {
        const double angle = rows_alike ? of_row : of_texels[column];
        for (std::size_t c = 0; c < channels; ++c) sums[c] += angle * static_cast<double>(value[c]);
      }
    }
  }
  return sums;
}

std::size_t count_not_finite(const EnvMapView& map) {
  return static_cast<std::size_t>(
      std::count_if(map.values.begin(), map.values.end(), [](float v) { return !std::isfinite(v); }));
}

}  // namespace mirrorbake
