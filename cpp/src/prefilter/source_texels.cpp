#include "source_texels.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mirrorbake/projection/traits.hpp"

namespace mirrorbake {
namespace {

// Pieces of all faces together, and along a side of one.
constexpr double kMostPieces = 3.4e7;
constexpr int kMostAcross = 65536;

}  // namespace

SourceTexels::SourceTexels(const EnvMapLayout& layout, int parts)
    : projection_(layout.projection),
      parts_(parts),
      width_(layout.width * parts),
      height_(layout.height * parts),
      is_panorama_(is_panorama(layout.projection.kind)) {
  if (!is_panorama_) {
    angles_ = texel_solid_angles(projection_, width_, height_);
    return;
  }
  angles_.resize(static_cast<std::size_t>(height_));
  for (int row = 0; row < height_; ++row) {
    angles_[static_cast<std::size_t>(row)] = texel_solid_angle(projection_, width_, height_, 0, row);
  }
  for (int column = 0; column < width_; ++column) {
    const double longitude = std::numbers::pi * column_center(column, width_);
    sines_.push_back(std::sin(longitude));
    cosines_.push_back(std::cos(longitude));
  }
  for (int row = 0; row < height_; ++row) {
    const glm::dvec3 middle = direction_from_point(projection_, 0, 0.0, row_center(row, height_));
    sines_.push_back(middle.y);
    cosines_.push_back(-middle.z);
  }
}

glm::dvec3 SourceTexels::direction(int face, int row, int column) const {
  if (!is_panorama_) {
    return direction_from_point(projection_, face, column_center(column, width_), row_center(row, height_));
  }
  const std::size_t longitude = static_cast<std::size_t>(column);
  const std::size_t latitude = static_cast<std::size_t>(width_) + static_cast<std::size_t>(row);
  return {cosines_[latitude] * sines_[longitude], sines_[latitude],
          -cosines_[latitude] * cosines_[longitude]};
}

double texel_width(const EnvMapLayout& layout) {
  const glm::dvec2 largest = traits(layout.projection.kind).largest_texel(layout.projection);
  return std::max(2.0 * largest.x / layout.width, 2.0 * largest.y / layout.height);
}

int parts_for_width(const EnvMapLayout& layout, double sigma) {
  const double wanted = 0.8 * texel_width(layout) / sigma;
  if (wanted <= 1.0) return 1;
  const double across = std::max(layout.width, layout.height);
  const double texels = static_cast<double>(layout.level_texels(0));
  const double most = std::max(1.0, std::min(std::sqrt(kMostPieces / texels), kMostAcross / across));
  return static_cast<int>(std::min(std::ceil(wanted), std::floor(most)));
}

}  // namespace mirrorbake
