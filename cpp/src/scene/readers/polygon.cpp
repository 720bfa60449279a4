#include "polygon.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include "mirrorbake/core/error.hpp"

namespace mirrorbake {
namespace {

// Ear clipping that looks at all corners for every ear may take time in the cube of their number. Beyond
// this, only reflex corners in reach are looked at.
constexpr std::size_t kMaxEarCorners = 512;
// How many corners may be looked at: a second of work. Polygons that somebody drew take a few for each ear.
constexpr std::uint64_t kMostLooks = 200'000'000;

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

// Ears of a polygon of many corners, clipped from a ring. The reflex corners, the only ones that can lie in
// an ear, are in the buckets of a grid over the polygon's plane.
class Ring {
 public:
  Ring(const std::string& path, std::span<const std::uint32_t> corners,
       const std::vector<glm::vec3>& positions)
      : path_(path),
        count_(static_cast<std::uint32_t>(corners.size())),
        points_(count_),
        previous_(count_),
        next_(count_) {
    project(corners, positions);
    for (std::uint32_t i = 0; i < count_; ++i) {
      previous_[i] = (i + count_ - 1) % count_;
      next_[i] = (i + 1) % count_;
    }
    side_ = static_cast<std::uint32_t>(std::max(1.0, std::sqrt(static_cast<double>(count_))));
    buckets_.resize(std::size_t{side_} * side_);
    is_reflex_.resize(count_);
    for (std::uint32_t i = 0; i < count_; ++i) {
      is_reflex_[i] = !(area(previous_[i], i, next_[i]) > 0.0);
      if (is_reflex_[i]) buckets_[bucket(points_[i])].push_back(i);
    }
  }

  void clip(std::vector<glm::uvec3>& triples) {
    std::uint32_t corner = 0;
    std::uint32_t since_last = 0;  // corners that were no ears
    for (std::uint32_t left = count_; left > 3;) {
      const bool is_twisted = since_last > left;  // has no ears
      if (!is_twisted && !is_ear(corner)) {
        corner = next_[corner];
        ++since_last;
        continue;
      }
      const std::uint32_t a = previous_[corner];
      const std::uint32_t c = next_[corner];
      triples.push_back({a, corner, c});
      next_[a] = c;
      previous_[c] = a;
      is_reflex_[corner] = false;
      for (const std::uint32_t i : {a, c}) {
        if (is_reflex_[i]) is_reflex_[i] = !(area(previous_[i], i, next_[i]) > 0.0);
      }
      --left;
      since_last = 0;
      corner = next_[c];  // every second one: rings of ears are cut to pieces of equal size, not to a fan
      last_ = a;
    }
    triples.push_back({previous_[last_], last_, next_[last_]});
  }

 private:
  void project(std::span<const std::uint32_t> corners, const std::vector<glm::vec3>& positions) {
    const auto at = [&](std::uint32_t i) { return glm::dvec3(positions[corners[i]]); };
    glm::dvec3 normal(0.0);
    for (std::uint32_t i = 1; i + 1 < count_; ++i) normal += glm::cross(at(i) - at(0), at(i + 1) - at(0));
    const glm::dvec3 size = glm::abs(normal);
    const int drop = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const bool is_turned = normal[drop] < 0.0;
    low_ = high_ = {at(0)[(drop + 1) % 3], at(0)[(drop + 2) % 3]};
    for (std::uint32_t i = 0; i < count_; ++i) {
      points_[i] = {at(i)[(drop + 1) % 3], at(i)[(drop + 2) % 3]};
      low_ = glm::min(low_, points_[i]);
      high_ = glm::max(high_, points_[i]);
    }
    sign_ = is_turned ? -1.0 : 1.0;
  }

  double area(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    const glm::dvec2 u = points_[b] - points_[a];
    const glm::dvec2 v = points_[c] - points_[a];
    return sign_ * (u.x * v.y - u.y * v.x);
  }

  glm::uvec2 cell(glm::dvec2 p) const {
    const glm::dvec2 size = glm::max(high_ - low_, glm::dvec2(1e-300));
    const glm::dvec2 place = (p - low_) / size * static_cast<double>(side_);
    return glm::uvec2(glm::clamp(place, 0.0, static_cast<double>(side_ - 1)));
  }
  std::size_t bucket(glm::dvec2 p) const {
    const glm::uvec2 c = cell(p);
    return std::size_t{c.y} * side_ + c.x;
  }

  bool is_ear(std::uint32_t b) {
    const std::uint32_t a = previous_[b];
    const std::uint32_t c = next_[b];
    if (!(area(a, b, c) > 0.0)) return false;
    const glm::uvec2 first = cell(glm::min(points_[a], glm::min(points_[b], points_[c])));
    const glm::uvec2 last = cell(glm::max(points_[a], glm::max(points_[b], points_[c])));
    for (std::uint32_t y = first.y; y <= last.y; ++y) {
      for (std::uint32_t x = first.x; x <= last.x; ++x) {
        const std::vector<std::uint32_t>& bucket = buckets_[std::size_t{y} * side_ + x];
        looks_ += 1 + bucket.size();
        for (const std::uint32_t p : bucket) {
          if (!is_reflex_[p] || p == a || p == b || p == c) continue;
          if (area(a, b, p) > 0.0 && area(b, c, p) > 0.0 && area(c, a, p) > 0.0) return false;
        }
      }
    }
    if (looks_ > kMostLooks) {
      throw FileError(path_,
                      "has a polygon of " + std::to_string(count_) +
                          " corners that is too entangled, expected one that can be cut into triangles");
    }
    return true;
  }

  const std::string& path_;
  std::uint32_t count_;
  std::vector<glm::dvec2> points_;
  std::vector<std::uint32_t> previous_, next_;
  std::vector<bool> is_reflex_;
  std::uint32_t side_ = 1;
  std::vector<std::vector<std::uint32_t>> buckets_;
  glm::dvec2 low_{0.0}, high_{0.0};
  double sign_ = 1.0;
  std::uint32_t last_ = 0;
  std::uint64_t looks_ = 0;
};

}  // namespace

void triangulate(const std::string& path, std::span<const std::uint32_t> corners,
                 const std::vector<glm::vec3>& positions, std::vector<glm::uvec3>& triples) {
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
    Ring(path, corners, positions).clip(triples);
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
