#include "shape_families.hpp"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "mirrorbake/proxy/fit.hpp"

namespace mirrorbake::shape_families {
namespace {

constexpr double kMaxLog = 12;  // of extents in units of the scale: e¹² = 160,000

/// Rodrigues' formula.
glm::dmat3 rotation_from_vector(const glm::dvec3& v) {
  const double angle = glm::length(v);
  if (!(angle > 0)) return glm::dmat3(1.0);
  const glm::dvec3 k = v / angle;
  const glm::dmat3 cross(0, k.z, -k.y, -k.z, 0, k.x, k.y, -k.x, 0);
  return glm::dmat3(1.0) + std::sin(angle) * cross + (1.0 - std::cos(angle)) * cross * cross;
}

Parameters box_parameters(const Box& box, glm::vec3 origin, double scale) {
  Parameters q(6);
  for (int axis = 0; axis < 3; ++axis) {
    const double offset = static_cast<double>(box.centre[axis]) - static_cast<double>(origin[axis]);
    const double half = static_cast<double>(box.half_extent[axis]);
    q[axis] = std::log(std::max(half - offset, 1e-4 * half) / scale);
    q[axis + 3] = std::log(std::max(half + offset, 1e-4 * half) / scale);
  }
  return q;
}

Parameters ellipsoid_parameters(const Parameters& box, double inflation) {
  Parameters q(6);
  for (int axis = 0; axis < 3; ++axis) {
    q[axis] = 0.5 * (std::exp(box[axis + 3]) - std::exp(box[axis]));
    q[axis + 3] = std::log(0.5 * inflation * (std::exp(box[axis + 3]) + std::exp(box[axis])));
  }
  return q;
}

Parameters with_rotation(const Parameters& q, const glm::dvec3& rotation) {
  Parameters rotated(9);
  rotated << q.head(6), rotation.x, rotation.y, rotation.z;
  return rotated;
}

/// Hits in a frame rotated about the origin.
std::vector<glm::vec3> rotated_hits(std::span<const glm::vec3> hits, glm::vec3 origin,
                                    const glm::dvec3& rotation) {
  const glm::dmat3 axes = rotation_from_vector(rotation);
  std::vector<glm::vec3> rotated;
  rotated.reserve(hits.size());
  for (const glm::vec3& hit : hits) {
    rotated.emplace_back(glm::dvec3(origin) + axes * (glm::dvec3(hit) - glm::dvec3(origin)));
  }
  return rotated;
}

}  // namespace

bool feasible(const Family& family, const Parameters& q) {
  if (!q.allFinite()) return false;
  const auto extent_ok = [&](Eigen::Index first, Eigen::Index count) {
    return q.segment(first, count).cwiseAbs().maxCoeff() <= kMaxLog;
  };
  // The origin has to lie clearly inside.
  constexpr double kMaxGauge = 0.99;
  switch (family.shape) {
    case Shape::infinite: return true;
    case Shape::sphere: return extent_ok(3, 1) && q.head(3).norm() < kMaxGauge * std::exp(q[3]);
    case Shape::hemisphere:
      return extent_ok(2, 2) && std::hypot(q[0], q[1], std::exp(q[2])) < kMaxGauge * std::exp(q[3]);
    case Shape::box: return extent_ok(0, 6);
    case Shape::ellipsoid:
      return extent_ok(3, 3) &&
             (q.head(3).array() / q.segment(3, 3).array().exp()).matrix().norm() < kMaxGauge;
  }
  return false;
}

Proxy make_proxy(const Family& family, const Parameters& q, const glm::vec3& origin, double scale) {
  const glm::dvec3 o(origin);
  glm::dmat3 axes(1.0);
  if (family.rotated) axes = rotation_from_vector({q[6], q[7], q[8]});
  const glm::mat3 proxy_from_world(axes);
  const auto world = [&](const glm::dvec3& local) {
    return glm::vec3(o + glm::transpose(axes) * (scale * local));
  };
  switch (family.shape) {
    case Shape::infinite: break;
    case Shape::sphere:
      return {Ellipsoid{world({q[0], q[1], q[2]}), glm::vec3(static_cast<float>(scale * std::exp(q[3])))},
              origin};
    case Shape::hemisphere:
      return {Hemisphere{world({q[0], -std::exp(q[2]), q[1]}), static_cast<float>(scale * std::exp(q[3]))},
              origin};
    case Shape::box: {
      const glm::dvec3 low(std::exp(q[0]), std::exp(q[1]), std::exp(q[2]));
      const glm::dvec3 high(std::exp(q[3]), std::exp(q[4]), std::exp(q[5]));
      return {Box{world(0.5 * (high - low)), glm::vec3(0.5 * scale * (high + low)), proxy_from_world},
              origin};
    }
    case Shape::ellipsoid: {
      const glm::dvec3 radii(std::exp(q[3]), std::exp(q[4]), std::exp(q[5]));
      return {Ellipsoid{world({q[0], q[1], q[2]}), glm::vec3(scale * radii), proxy_from_world}, origin};
    }
  }
  return {InfiniteSphere{}, origin};
}

std::vector<Parameters> starts(const Family& family, std::span<const glm::vec3> hits, glm::vec3 origin,
                               double scale) {
  if (family.shape == Shape::infinite) return {Parameters(0)};
  const Parameters box = box_parameters(fit_box_robust(hits, origin), origin, scale);
  switch (family.shape) {
    case Shape::infinite: return {Parameters(0)};
    case Shape::sphere: {
      Parameters centred(4);
      centred << 0, 0, 0, 0;
      Parameters in_box(4);
      const Parameters e = ellipsoid_parameters(box, 1.1);
      in_box << e.head(3), e.tail(3).maxCoeff();
      return {centred, in_box};
    }
    case Shape::hemisphere: {
      Parameters q(4);
      q << 0, 0, box[1], std::max(0.0, box[1] + 0.1);
      Parameters wide = q;
      wide[3] += 1;
      return {q, wide};
    }
    default: break;
  }
  std::vector<Parameters> result;
  const auto add = [&](const Parameters& sides, const glm::dvec3& rotation) {
    const std::vector<Parameters> shapes =
        family.shape == Shape::box
            ? std::vector<Parameters>{sides}
            : std::vector<Parameters>{ellipsoid_parameters(sides, 1.0), ellipsoid_parameters(sides, 1.2)};
    for (const Parameters& q : shapes) result.push_back(family.rotated ? with_rotation(q, rotation) : q);
  };
  if (!family.rotated) {
    add(box, {});
    if (family.shape == Shape::ellipsoid) {
      Parameters sphere(6);
      sphere.setZero();
      result.push_back(sphere);
    }
    return result;
  }
  // Rooms stand on their floor: turns about the vertical first, then two tilts.
  constexpr double kDegree = 0.017453292519943295;
  for (double turn : {0.0, 22.5, 45.0, 67.5}) {
    const glm::dvec3 rotation(0, turn * kDegree, 0);
    const Box turned = fit_box_robust(rotated_hits(hits, origin, rotation), origin);
    add(box_parameters(turned, origin, scale), rotation);
  }
  for (const glm::dvec3 rotation : {glm::dvec3(30 * kDegree, 0, 0), glm::dvec3(0, 0, 30 * kDegree)}) {
    const Box tilted = fit_box_robust(rotated_hits(hits, origin, rotation), origin);
    add(box_parameters(tilted, origin, scale), rotation);
  }
  return result;
}

}  // namespace mirrorbake::shape_families
