#include "symmetry.hpp"

#include <cmath>

#include <glm/common.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>

namespace mirrorbake {
namespace {

// The 48 symmetries of the cube, the identity first.
std::vector<glm::dmat3> signed_permutations() {
  constexpr std::array<std::array<int, 3>, 6> kOrders = {
      {{0, 1, 2}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}, {1, 2, 0}, {2, 0, 1}}};
  std::vector<glm::dmat3> all;
  for (const std::array<int, 3>& order : kOrders) {
    for (unsigned signs = 0; signs < 8; ++signs) {
      glm::dmat3 axes(0.0);
      for (int i = 0; i < 3; ++i) axes[i][order[static_cast<std::size_t>(i)]] = signs >> i & 1U ? -1.0 : 1.0;
      all.push_back(axes);
    }
  }
  return all;
}

struct Image {
  int face;
  glm::dvec2 point;
};

std::optional<Image> image_of(const Projection& projection, const glm::dmat3& axes, int face, double x,
                              double y) {
  const MapPoint p = point_from_direction(projection, axes * direction_from_point(projection, face, x, y));
  if (!p.covered) return std::nullopt;
  return Image{p.face, {p.x, p.y}};
}

constexpr double kTolerance = 1e-6;

std::optional<int> whole(double value) {
  const double rounded = std::round(value);
  if (!(std::abs(value - rounded) < kTolerance)) return std::nullopt;
  return static_cast<int>(rounded);
}

// Found by looking at points: the map is affine if three of them say so of two others, far from them.
std::optional<FaceMap> face_map(const EnvMapLayout& layout, const glm::dmat3& axes, int face) {
  constexpr double kStep = 0.25;
  constexpr std::array<glm::dvec2, 5> kPoints = {glm::dvec2{0.3125, 0.15625},
                                                 {0.3125 + kStep, 0.15625},
                                                 {0.3125, 0.15625 + kStep},
                                                 {-0.4375, -0.34375},
                                                 {-0.15625, 0.71875}};
  std::array<glm::dvec2, 5> images;
  FaceMap map;
  for (std::size_t i = 0; i < kPoints.size(); ++i) {
    const auto image = image_of(layout.projection, axes, face, kPoints[i].x, kPoints[i].y);
    if (!image || (i > 0 && image->face != map.face)) return std::nullopt;
    map.face = image->face;
    images[i] = image->point;
    if (is_panorama(layout.projection.kind) && i > 0) {
      images[i].x -= 2.0 * std::round(0.5 * (images[i].x - images[0].x));
    }
  }
  const glm::dvec2 by_x = (images[1] - images[0]) / kStep;
  const glm::dvec2 by_y = (images[2] - images[0]) / kStep;
  const auto xx = whole(by_x.x);
  const auto yx = whole(by_x.y);
  const auto xy = whole(by_y.x);
  const auto yy = whole(by_y.y);
  if (!xx || !yx || !xy || !yy || std::abs(*xx) + std::abs(*xy) != 1 || std::abs(*yx) + std::abs(*yy) != 1) {
    return std::nullopt;
  }
  if (*xy != 0 && layout.width != layout.height) return std::nullopt;
  const glm::dvec2 shift = images[0] - kPoints[0].x * by_x - kPoints[0].y * by_y;
  for (std::size_t i = 3; i < kPoints.size(); ++i) {
    glm::dvec2 error = kPoints[i].x * by_x + kPoints[i].y * by_y + shift - images[i];
    if (is_panorama(layout.projection.kind)) error.x -= 2.0 * std::round(0.5 * error.x);
    if (!(std::abs(error.x) + std::abs(error.y) < kTolerance)) return std::nullopt;
  }
  // Columns go with x, rows against y; the first texel's centre is at (1/width − 1, 1 − 1/height).
  map.row_per_row = *yy;
  map.row_per_column = -*yx;
  map.column_per_row = -*xy;
  map.column_per_column = *xx;
  const double x = column_center(0, layout.width);
  const double y = row_center(0, layout.height);
  const auto column = whole(0.5 * ((*xx * x + *xy * y + shift.x + 1.0) * layout.width - 1.0));
  const auto row = whole(0.5 * ((1.0 - *yx * x - *yy * y - shift.y) * layout.height - 1.0));
  if (!column || !row) return std::nullopt;
  map.row_offset = *row;
  map.column_offset = *column;
  if (is_panorama(layout.projection.kind)) {
    map.column_offset = ((*column % layout.width) + layout.width) % layout.width;
  }
  return map;
}

}  // namespace

std::optional<TexelMap> texel_map(const EnvMapLayout& layout, const glm::dmat3& axes) {
  TexelMap map;
  map.width = layout.width;
  for (int face = 0; face < face_count(layout.projection); ++face) {
    const auto one = face_map(layout, axes, face);
    if (!one) return std::nullopt;
    map.faces[static_cast<std::size_t>(face)] = *one;
  }
  return map;
}

std::vector<SharedSymmetry> shared_symmetries(const EnvMapLayout& source, const EnvMapLayout& target,
                                              const glm::mat3& source_from_target) {
  const glm::dmat3 matrix(source_from_target);
  const glm::dmat3 inverse = glm::transpose(matrix);
  std::vector<SharedSymmetry> shared;
  for (const glm::dmat3& of_target : signed_permutations()) {
    // The only one that may do the same in the source, and whether it does. Products with signed permutations
    // are exact: a matrix that is symmetric but for rounding is not taken for symmetric.
    glm::dmat3 of_source = matrix * of_target * inverse;
    for (int i = 0; i < 3; ++i) of_source[i] = glm::round(of_source[i]);
    if (of_source * matrix != matrix * of_target) continue;
    // The map of fewer faces takes less time to turn down.
    std::optional<TexelMap> in_target, in_source;
    if (face_count(target.projection) < face_count(source.projection)) {
      in_target = texel_map(target, of_target);
      if (in_target) in_source = texel_map(source, of_source);
    } else {
      in_source = texel_map(source, of_source);
      if (in_source) in_target = texel_map(target, of_target);
    }
    if (in_target && in_source) shared.push_back({*in_target, *in_source});
  }
  return shared;
}

}  // namespace mirrorbake
