#include "mirrorbake/envmap/repair.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/envmap/texel_lookup.hpp"

namespace mirrorbake {
namespace {

// A channel of a level, seen as a sheet of numbers.
class Sheet {
 public:
  Sheet(EnvMap& map, int level, std::size_t channel) : map_(map), level_(level), channel_(channel) {}

  float& at(const FaceTexel& texel) {
    return map_.values[map_.layout.index(level_, texel.face, texel.row, texel.column) + channel_];
  }
  bool is_hole(const FaceTexel& texel) { return !std::isfinite(at(texel)); }

  std::vector<FaceTexel> holes() {
    std::vector<FaceTexel> result;
    for (int face = 0; face < face_count(map_.layout.projection); ++face) {
      for (int row = 0; row < map_.layout.level_height(level_); ++row) {
        for (int column = 0; column < map_.layout.level_width(level_); ++column) {
          if (is_hole({face, row, column})) result.push_back({face, row, column});
        }
      }
    }
    return result;
  }

  std::array<FaceTexel, 8> neighbours(const FaceTexel& texel) const {
    std::array<FaceTexel, 8> result;
    for (int i = 0; i < 8; ++i) {
      const int place = i < 4 ? i : i + 1;
      result[static_cast<std::size_t>(i)] =
          continued(map_.layout.projection, map_.layout.level_width(level_), map_.layout.level_height(level_),
                    {texel.face, texel.row + place / 3 - 1, texel.column + place % 3 - 1});
    }
    return result;
  }

  std::optional<float> mean_around(const FaceTexel& texel) {
    double sum = 0.0;
    int count = 0;
    for (const FaceTexel& neighbour : neighbours(texel)) {
      if (is_hole(neighbour)) continue;
      sum += static_cast<double>(at(neighbour));
      ++count;
    }
    if (count == 0) return std::nullopt;
    return static_cast<float>(sum / count);
  }

 private:
  EnvMap& map_;
  int level_;
  std::size_t channel_;
};

// Fills those of the ring that have neighbours, all of them from values that were known before, so that the
// order of the texels does not matter; the holes around them are the next ring.
std::vector<FaceTexel> fill_ring(Sheet& sheet, const std::vector<FaceTexel>& ring) {
  std::vector<std::pair<FaceTexel, float>> found;
  for (const FaceTexel& hole : ring) {
    if (!sheet.is_hole(hole)) continue;
    if (const std::optional<float> value = sheet.mean_around(hole)) found.emplace_back(hole, *value);
  }
  for (const auto& [hole, value] : found) sheet.at(hole) = value;
  std::vector<FaceTexel> next;
  for (const auto& [hole, value] : found) {
    for (const FaceTexel& neighbour : sheet.neighbours(hole)) {
      if (sheet.is_hole(neighbour)) next.push_back(neighbour);
    }
  }
  // A hole beside several of the ring is one.
  const auto place = [](const FaceTexel& t) { return std::tuple(t.face, t.row, t.column); };
  std::sort(next.begin(), next.end(),
            [&](const FaceTexel& x, const FaceTexel& y) { return place(x) < place(y); });
  next.erase(std::unique(next.begin(), next.end()), next.end());
  return next;
}

// Whether all could be filled. Texels that are neighbours of a hole across an edge need not have it as one:
// what a walk from ring to ring leaves is looked through again.
bool fill(Sheet& sheet) {
  std::vector<FaceTexel> left = sheet.holes();
  while (!left.empty()) {
    for (std::vector<FaceTexel> ring = left; !ring.empty();) ring = fill_ring(sheet, ring);
    const std::size_t before = left.size();
    left = sheet.holes();
    if (left.size() == before) return false;
  }
  return true;
}

}  // namespace

std::size_t repair_not_finite(const std::string& name, EnvMap& map) {
  const std::size_t bad = count_not_finite(map);
  if (bad == 0) return 0;
  const auto channels = static_cast<std::size_t>(map.layout.channels);
  for (int level = 0; level < map.layout.levels; ++level) {
    for (std::size_t channel = 0; channel < channels; ++channel) {
      Sheet sheet(map, level, channel);
      if (!fill(sheet)) {
        throw FileError(name, "has no finite value of channel " + std::to_string(channel) + " on level " +
                                  std::to_string(level) + " from which the others could be filled");
      }
    }
  }
  return bad;
}

}  // namespace mirrorbake
