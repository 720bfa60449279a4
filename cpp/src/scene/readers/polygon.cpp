#include "polygon.hpp"

#include <cmath>
#include <numeric>

#include <glm/geometric.hpp>

namespace mirrorbake {
namespace {

// Ear clipping may take time in the cube of the number of corners: beyond this, files of garbage would take minutes, and
// real polygons are convex caps, for which a fan is right.
constexpr std::size_t kMaxEarCorners = 512;

class Polygon {
 public:
  Polygon(std::span<const std::uint32_t> corners, const std::vector<glm::vec3>& positions)
      : corners_(corners), positions_(positions) {
    const glm::dvec3 origin = at(0);
    for (std::uint32_t i = 1; i + 1 < corners.size(); ++i)
      area_ += glm::cross(at(i) - origin, at(i + 1) - origin);
  }

  glm::dvec3 at(std::uint32_t corner) const { return glm::dvec3(positions_[corners_[corner]]); }

  /// Area of the triangle, positive if it faces as the polygon does.
  double area(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    return glm::dot(area_, glm::cross(at(b) - at(a), at(c) - at(a)));
  }

  bool is_ear(const std::vector<std::uint32_t>& rest, std::size_t i) const {
    const std::uint32_t a = rest[(i + rest.size() - 1) % rest.size()];
    const std::uint32_t b = rest[i];
    const std::uint32_t c = rest[(i + 1) % rest.size()];
    if (!(area(a, b, c) > 0.0)) return false;
    for (const std::uint32_t p : rest) {
      if (p == a || p == b || p == c) continue;
      if (area(a, b, p) > 0.0 && area(b, c, p) > 0.0 && area(c, a, p) > 0.0) return false;
    }
    return true;
  }

 private:
  std::span<const std::uint32_t> corners_;
  const std::vector<glm::vec3>& positions_;
  glm::dvec3 area_{0.0};
};

}  // namespace

void triangulate(std::span<const std::uint32_t> corners, const std::vector<glm::vec3>& positions,
                 std::vector<glm::uvec3>& triples) {
  const std::uint32_t count = static_cast<std::uint32_t>(corners.size());
  if (count == 3) {
    triples.push_back({0, 1, 2});
    return;
  }
  const Polygon polygon(corners, positions);
  if (count == 4) {
    const bool is_first_good = polygon.area(0, 1, 2) >= 0.0 && polygon.area(0, 2, 3) >= 0.0;
    triples.push_back(is_first_good ? glm::uvec3(0, 1, 2) : glm::uvec3(0, 1, 3));
    triples.push_back(is_first_good ? glm::uvec3(0, 2, 3) : glm::uvec3(1, 2, 3));
    return;
  }
  if (count > kMaxEarCorners) {
    for (std::uint32_t i = 1; i + 1 < count; ++i) triples.push_back({0, i, i + 1});
    return;
  }
  std::vector<std::uint32_t> rest(count);
  std::iota(rest.begin(), rest.end(), 0U);
  while (rest.size() > 3) {
    std::size_t ear = 0;
    while (ear < rest.size() && !polygon.is_ear(rest, ear)) ++ear;
    if (ear == rest.size()) ear = 1;  // a twisted polygon has none
    triples.push_back(
        {rest[(ear + rest.size() - 1) % rest.size()], rest[ear], rest[(ear + 1) % rest.size()]});
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  triples.push_back({rest[0], rest[1], rest[2]});
}

}  // namespace mirrorbake
