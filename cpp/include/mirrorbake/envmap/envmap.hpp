#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "mirrorbake/projection/projection.hpp"

/// The environment map container (spec E1): one block of float32 values, a projection, and nothing else.
namespace mirrorbake {

/// Order of the values: levels, the finest first; in a level the faces; in a face the rows from the top; in a
/// row the texels; in a texel the channels. Level l has faces of max(1, width >> l) × max(1, height >> l)
/// texels. For a cube map it is the order of CubePyramidLayout.
struct EnvMapLayout {
  Projection projection;
  int width = 1;  ///< texels of a face of the finest level
  int height = 1;
  int levels = 1;  ///< how many levels there are, counted from the finest
  int channels = 3;

  int level_width(int level) const { return width >> level > 0 ? width >> level : 1; }
  int level_height(int level) const { return height >> level > 0 ? height >> level : 1; }
  std::size_t level_texels(int level) const {
    return static_cast<std::size_t>(face_count(projection)) * static_cast<std::size_t>(level_width(level)) *
           static_cast<std::size_t>(level_height(level));
  }
  /// Index of the first value of a level; of `levels`, the number of values.
  std::size_t level_offset(int level) const;
  std::size_t size() const { return level_offset(levels); }
  /// Index of the first value of a texel.
  std::size_t index(int level, int face, int row, int column) const {
    const std::size_t line = static_cast<std::size_t>(face) * static_cast<std::size_t>(level_height(level)) +
                             static_cast<std::size_t>(row);
    return level_offset(level) +
           (line * static_cast<std::size_t>(level_width(level)) + static_cast<std::size_t>(column)) *
               static_cast<std::size_t>(channels);
  }

  bool operator==(const EnvMapLayout&) const = default;
};

/// Number of levels down to 1×1: floor(log2(max(width, height))) + 1.
int full_level_count(int width, int height);

/// Throws InvalidArgument unless sides are 1…65536 (a cube's equal), channels 1…1024, levels 1…the full
/// count.
void validate(const EnvMapLayout& layout);

/// Somebody else's memory seen as an environment map.
struct EnvMapView {
  EnvMapLayout layout;
  std::span<const float> values;
  std::span<const std::string> channels = {};  ///< names, layout.channels of them, or none

  std::span<const float> level(int l) const {
    return values.subspan(layout.level_offset(l), layout.level_offset(l + 1) - layout.level_offset(l));
  }
};

/// Throws InvalidArgument if the layout is not valid or the values or names have another number.
void validate(const EnvMapView& map);

struct EnvMap {
  EnvMapLayout layout;
  std::vector<float> values;
  std::vector<std::string> channels;  ///< names, layout.channels of them, or none

  operator EnvMapView() const {
    return {layout, values, channels};
  }  // NOLINT(google-explicit-constructor): an owner is a view
};

/// A map of zeros. Throws InvalidArgument for a layout that is not valid or names of another number.
EnvMap make_envmap(const EnvMapLayout& layout, std::span<const std::string> channels = {});

/// Σ L Ω over the sphere for every channel of a level, in double: the flux of the map (radiance times
/// steradian).
std::vector<double> integrate(const EnvMapView& map, int level = 0);

/// Number of NaN and infinite values.
std::size_t count_not_finite(const EnvMapView& map);

}  // namespace mirrorbake
