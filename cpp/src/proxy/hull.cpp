#include "mirrorbake/proxy/hull.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "is_finite.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake {
namespace {

void check_finite(const char* name, std::span<const glm::vec3> points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!detail::is_finite(points[i])) {
      throw InvalidArgument(std::string(name) + "[" + std::to_string(i) + "]", text_of(points[i]),
                            "finite coordinates");
    }
  }
}

/// The points with those that stick out in 26 directions first: most triangles inside a dent see one of them.
std::vector<glm::dvec3> outermost_first(std::span<const glm::vec3> points) {
  std::vector<glm::dvec3> sorted(points.begin(), points.end());
  std::size_t front = 0;
  for (int code = 0; code < 27; ++code) {
    const glm::dvec3 d(code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1);
    if (d == glm::dvec3(0.0) || front >= sorted.size()) continue;
    const auto farthest = std::max_element(sorted.begin(), sorted.end(), [&](const auto& a, const auto& b) {
      return glm::dot(a, d) < glm::dot(b, d);
    });
    if (farthest >= sorted.begin() + static_cast<std::ptrdiff_t>(front))
      std::swap(sorted[front++], *farthest);
  }
  return sorted;
}

}  // namespace

std::vector<std::uint8_t> hull_triangles(std::span<const glm::vec3> positions,
                                         std::span<const glm::uvec3> triangles,
                                         std::span<const glm::vec3> extremes, double tolerance) {
  check_finite("positions", positions);
  check_finite("extremes", extremes);
  if (!(tolerance >= 0)) throw InvalidArgument("tolerance", text_of(tolerance), "≥ 0");
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const unsigned largest = std::max({triangles[i].x, triangles[i].y, triangles[i].z});
    if (largest >= positions.size()) {
      throw InvalidArgument("triangles[" + std::to_string(i) + "]", std::to_string(largest),
                            "indices below " + std::to_string(positions.size()));
    }
  }
  std::vector<std::uint8_t> on_hull(triangles.size(), 0);
  if (triangles.empty()) return on_hull;

  const std::vector<glm::dvec3> points = outermost_first(extremes.empty() ? positions : extremes);
  glm::dvec3 low(positions[0]);
  glm::dvec3 high(positions[0]);
  for (const glm::vec3& p : positions) {
    low = glm::min(low, glm::dvec3(p));
    high = glm::max(high, glm::dvec3(p));
  }
  const double slack = tolerance * glm::length(high - low);
  constexpr std::size_t kGrain = 256;
  parallel_for(triangles.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const glm::dvec3 a(positions[triangles[i].x]);
      const glm::dvec3 normal =
          glm::cross(glm::dvec3(positions[triangles[i].y]) - a, glm::dvec3(positions[triangles[i].z]) - a);
      const double length = glm::length(normal);
      if (!(length > 0)) continue;
      const double limit = glm::dot(normal, a) + slack * length;
      on_hull[i] = std::none_of(points.begin(), points.end(),
                                [&](const glm::dvec3& p) { return glm::dot(normal, p) > limit; });
    }
  });
  return on_hull;
}

}  // namespace mirrorbake
