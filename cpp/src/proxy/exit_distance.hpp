#pragma once

#include <cmath>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <limits>

#include "mirrorbake/proxy/proxy.hpp"

/// Where rays leave the shapes: one formula each, without branches, that holds inside and outside (proxy.hpp
/// documents what it means outside). `Real` is the type of the arithmetic.
namespace mirrorbake::detail {

template <typename Real>
using Vec = glm::vec<3, Real>;

template <typename Real>
Real dot(const Vec<Real>& a, const Vec<Real>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// Ray parameter at which p + t·d crosses the wall at ±extent that d faces, ∞ if d is parallel to it.
template <typename Real>
Real wall_distance(Real p, Real d, Real extent) {
  const Real t = std::abs(std::copysign(extent, d) - p) / std::abs(d);
  // 0/0, a point on the wall and a direction within it, must not win: the comparison is false for NaN.
  return t >= Real(0) ? t : std::numeric_limits<Real>::infinity();
}

template <typename Real>
Real finite_or_zero(Real t) {
  return t <= std::numeric_limits<Real>::max() ? t : Real(0);
}

/// Box [−extent, extent].
template <typename Real>
Real box_exit(const Vec<Real>& p, const Vec<Real>& d, const Vec<Real>& extent) {
  const Real x = wall_distance(p.x, d.x, extent.x);
  const Real y = wall_distance(p.y, d.y, extent.y);
  const Real z = wall_distance(p.z, d.z, extent.z);
  const Real xy = x < y ? x : y;
  return finite_or_zero(xy < z ? xy : z);
}

/// Unit sphere. |p + t·d|² = 1 has the larger root t = (−b + s)/a = −c/(b + s), s = √(b² − ac), of which the
/// form is taken that does not cancel. A negative discriminant is a miss: with s = 0 the root is the nearest
/// point; a negative root is behind: 0.
template <typename Real>
Real sphere_exit(const Vec<Real>& p, const Vec<Real>& d) {
  const Real a = dot(d, d);
  const Real b = dot(p, d);
  const Real c = dot(p, p) - Real(1);
  const Real discriminant = b * b - a * c;
  const Real s = std::sqrt(discriminant > Real(0) ? discriminant : Real(0));
  const bool away = b > Real(0);
  const Real t = (away ? -c : s - b) / (away ? b + s : a);
  return t > Real(0) ? t : Real(0);  // also for 0/0, a zero direction
}

/// Half y ≥ 0 of the unit sphere.
template <typename Real>
Real hemisphere_exit(const Vec<Real>& p, const Vec<Real>& d) {
  const Real sphere = sphere_exit(p, d);
  const Real floor = d.y < Real(0) ? std::abs(p.y / d.y) : std::numeric_limits<Real>::infinity();
  return sphere < floor ? sphere : floor;
}

/// A shape with its numbers converted once: rays are taken to its axes and, for curved shapes, to units of
/// the radii.
template <typename Real>
struct Frame {
  Vec<Real> centre;
  Vec<Real> row_x, row_y, row_z;  ///< of local_from_world

  Frame(glm::vec3 world_centre, const glm::mat3& proxy_from_world, const Vec<Real>& scale)
      : centre(world_centre),
        row_x(scale.x * Vec<Real>(proxy_from_world[0][0], proxy_from_world[1][0], proxy_from_world[2][0])),
        row_y(scale.y * Vec<Real>(proxy_from_world[0][1], proxy_from_world[1][1], proxy_from_world[2][1])),
        row_z(scale.z * Vec<Real>(proxy_from_world[0][2], proxy_from_world[1][2], proxy_from_world[2][2])) {}

  Vec<Real> direction(const Vec<Real>& d) const { return {dot(row_x, d), dot(row_y, d), dot(row_z, d)}; }
  Vec<Real> position(const Vec<Real>& p) const { return direction(p - centre); }
  /// The same for a frame without rotation, bit for bit: the products with the zeros that this leaves out are
  /// zero.
  Vec<Real> direction_aligned(const Vec<Real>& d) const {
    return {row_x.x * d.x, row_y.y * d.y, row_z.z * d.z};
  }
  Vec<Real> position_aligned(const Vec<Real>& p) const { return direction_aligned(p - centre); }
};

template <typename Real>
struct BoxExit {
  Frame<Real> frame;
  Vec<Real> extent;
  explicit BoxExit(const Box& box)
      : frame(box.centre, box.proxy_from_world, Vec<Real>(1)), extent(box.half_extent) {}
  Real exit(const Vec<Real>& p, const Vec<Real>& d) const { return box_exit(p, d, extent); }
};

template <typename Real>
struct EllipsoidExit {
  Frame<Real> frame;
  explicit EllipsoidExit(const Ellipsoid& ellipsoid)
      : frame(ellipsoid.centre, ellipsoid.proxy_from_world, Vec<Real>(1) / Vec<Real>(ellipsoid.radii)) {}
  Real exit(const Vec<Real>& p, const Vec<Real>& d) const { return sphere_exit(p, d); }
};

template <typename Real>
struct HemisphereExit {
  Frame<Real> frame;
  explicit HemisphereExit(const Hemisphere& dome)
      : frame(dome.centre, dome.proxy_from_world, Vec<Real>(Real(1) / Real(dome.radius))) {}
  Real exit(const Vec<Real>& p, const Vec<Real>& d) const { return hemisphere_exit(p, d); }
};

template <typename Real>
BoxExit<Real> make_exit(const Box& box) {
  return BoxExit<Real>(box);
}
template <typename Real>
EllipsoidExit<Real> make_exit(const Ellipsoid& ellipsoid) {
  return EllipsoidExit<Real>(ellipsoid);
}
template <typename Real>
HemisphereExit<Real> make_exit(const Hemisphere& dome) {
  return HemisphereExit<Real>(dome);
}

}  // namespace mirrorbake::detail
