#include "mirrorbake/surface/texture_samples.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <glm/common.hpp>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/interrupt.hpp"

namespace mirrorbake {
namespace {

constexpr std::uint32_t kNone = ~0U;

/// A triangle of the texture, in places from the top left one.
class Outline {
 public:
  Outline(glm::dvec2 a, glm::dvec2 b, glm::dvec2 c) : a_(a), ab_(b - a), ac_(c - a) {
    low_ = glm::min(a, glm::min(b, c));
    high_ = glm::max(a, glm::max(b, c));
    area_ = ab_.x * ac_.y - ab_.y * ac_.x;
  }

  bool has_area() const { return area_ != 0.0; }

  /// Weights of the second and third corner at a point.
  glm::dvec2 weights(glm::dvec2 p) const {
    const glm::dvec2 d = p - a_;
    return glm::dvec2(d.x * ac_.y - d.y * ac_.x, ab_.x * d.y - ab_.y * d.x) / area_;
  }

  /// Calls `visit(row, column)` for all places, of `side`² of them, whose middle lies in it.
  template <typename Visit>
  void visit_places(int side, const Visit& visit) const {
    const auto first = [side](double low) {
      return static_cast<int>(std::ceil(std::clamp(low - 0.5, 0.0, side * 1.0)));
    };
    const auto last = [side](double high) {
      return static_cast<int>(std::floor(std::clamp(high - 0.5, -1.0, side - 1.0)));
    };
    for (int row = first(low_.y); row <= last(high_.y); ++row) {
      for (int column = first(low_.x); column <= last(high_.x); ++column) {
        const glm::dvec2 w = weights({column + 0.5, row + 0.5});
        if (w.x >= 0.0 && w.y >= 0.0 && w.x + w.y <= 1.0) visit(row, column);
      }
    }
  }

 private:
  glm::dvec2 a_, ab_, ac_;
  glm::dvec2 low_, high_;
  double area_;
};

Outline outline_of(glm::uvec3 triangle, std::span<const glm::vec2> uvs, int side) {
  const auto corner = [&](std::uint32_t vertex) {
    return static_cast<double>(side) * glm::dvec2(uvs[vertex].x, 1.0 - uvs[vertex].y);
  };
  return {corner(triangle.x), corner(triangle.y), corner(triangle.z)};
}

}  // namespace

SurfaceSamples texture_samples(std::span<const glm::vec3> positions, std::span<const glm::uvec3> triangles,
                               std::span<const glm::vec2> uvs, int size, int per_side) {
  check_range("size", size, 1, 4096);
  check_range("per_side", per_side, 1, 8);
  check_length("uvs", uvs.size(), positions.size(), "one per vertex, as positions");
  check_triangles(triangles, positions.size());
  for (const glm::vec2& uv : uvs) {
    if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) {
      throw InvalidArgument("uvs", "a coordinate that is not finite", "finite numbers");
    }
  }
  const int side = size * per_side;
  const auto wide = static_cast<std::size_t>(side);
  std::vector<std::uint32_t> triangle_at(wide * wide, kNone);
  for (std::size_t t = triangles.size(); t-- > 0;) {
    if (t % 1024 == 0) poll_interrupt();
    const Outline outline = outline_of(triangles[t], uvs, side);
    if (!outline.has_area()) continue;
    outline.visit_places(side, [&](int row, int column) {
      triangle_at[wide * static_cast<std::size_t>(row) + static_cast<std::size_t>(column)] =
          static_cast<std::uint32_t>(t);
    });
  }

  SurfaceSamples samples;
  samples.width = samples.height = size;
  samples.samples_per_pixel = per_side * per_side;
  for (int texel = 0; texel < size * size; ++texel) {
    for (int place = 0; place < samples.samples_per_pixel; ++place) {
      const int row = texel / size * per_side + place / per_side;
      const int column = texel % size * per_side + place % per_side;
      const std::uint32_t t =
          triangle_at[wide * static_cast<std::size_t>(row) + static_cast<std::size_t>(column)];
      if (t == kNone) continue;
      const glm::uvec3 v = triangles[t];
      const glm::dvec2 middle(column + 0.5, row + 0.5);
      const glm::dvec2 w = outline_of(v, uvs, side).weights(middle);
      samples.pixel.push_back(static_cast<std::uint32_t>(texel));
      samples.triangle.push_back(t);
      samples.barycentric.emplace_back(w);
      samples.position.emplace_back((1.0 - w.x - w.y) * glm::dvec3(positions[v.x]) +
                                    w.x * glm::dvec3(positions[v.y]) + w.y * glm::dvec3(positions[v.z]));
      samples.reflection.emplace_back(glm::dvec3(middle / static_cast<double>(side), 0.0));
    }
  }
  samples.part.assign(samples.size(), 0);
  for (auto* unchanged :
       {&samples.dposition_dx, &samples.dposition_dy, &samples.dreflection_dx, &samples.dreflection_dy}) {
    unchanged->assign(samples.size(), glm::vec3(0.0F));
  }
  return samples;
}

}  // namespace mirrorbake
