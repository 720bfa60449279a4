#pragma once

/// Where rays leave the shapes: one formula each, without branches, that holds inside and outside (proxy.hpp
/// documents what it means outside). Written once, in double, and compiled once per instruction set:
/// everything lives in the namespace MIRRORBAKE_ISA and has internal linkage, and no other header is used.
#ifndef MIRRORBAKE_ISA
#define MIRRORBAKE_ISA baseline
#endif

#include "lookup_kernels.hpp"

namespace mirrorbake {

/// In the order of Proxy::shape.
enum class LookupShape : int { infinite, box, ellipsoid, hemisphere, count };

}  // namespace mirrorbake

namespace mirrorbake::MIRRORBAKE_ISA {
namespace {

constexpr double kInfinity = __builtin_inf();

struct Vec {
  double x, y, z;
};
inline Vec operator+(const Vec& a, const Vec& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator-(const Vec& a, const Vec& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec operator*(double s, const Vec& v) { return {s * v.x, s * v.y, s * v.z}; }
inline double dot(const Vec& a, const Vec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec vec(const double* v) { return {v[0], v[1], v[2]}; }

/// Ray parameter at which a wall is crossed, as a fraction, so that the nearest of three costs one division.
struct Crossing {
  double distance;  ///< along the wall's normal, at least 0
  double speed;     ///< of the ray along it, at least 0; 0 for a ray parallel to the wall
};

/// Of the walls at ±extent, the one that d faces.
inline Crossing crossing(double p, double d, double extent) {
  const double distance = __builtin_fabs(__builtin_copysign(extent, d) - p);
  const double speed = __builtin_fabs(d);
  // A point on the wall and a direction within it, 0/0, must not win over other walls.
  return {speed > 0 ? distance : 1, speed};
}

/// The earlier one. The products neither overflow nor vanish within the lengths that proxy.hpp allows.
inline Crossing first(const Crossing& a, const Crossing& b) {
  const bool a_first = a.distance * b.speed < b.distance * a.speed;
  return {a_first ? a.distance : b.distance, a_first ? a.speed : b.speed};
}

/// Box [−extent, extent].
inline double box_exit(const Vec& p, const Vec& d, const Vec& extent) {
  const Crossing x = crossing(p.x, d.x, extent.x);
  const Crossing y = crossing(p.y, d.y, extent.y);
  const Crossing z = crossing(p.z, d.z, extent.z);
  const Crossing nearest = first(first(x, y), z);
  const double t = nearest.distance / nearest.speed;
  return t < kInfinity ? t : 0;
}

/// Unit sphere. |p + t·d|² = 1 has the larger root t = (−b + s)/a = −c/(b + s), s = √(b² − ac), of which the
/// form is taken that does not cancel. A negative discriminant is a miss: with s = 0 the root is the nearest
/// point; a negative root is behind: 0.
inline double sphere_exit(const Vec& p, const Vec& d) {
  const double a = dot(d, d);
  const double b = dot(p, d);
  const double c = dot(p, p) - 1.0;
  const double discriminant = b * b - a * c;
  const double s = __builtin_sqrt(discriminant > 0 ? discriminant : 0);
  const bool away = b > 0;
  const double t = (away ? -c : s - b) / (away ? b + s : a);
  return t > 0 ? t : 0;  // also for 0/0, a zero direction
}

/// Half y ≥ 0 of the unit sphere.
inline double hemisphere_exit(const Vec& p, const Vec& d) {
  const double sphere = sphere_exit(p, d);
  const double floor = __builtin_fabs(p.y / d.y);
  return d.y < 0 && floor < sphere ? floor : sphere;
}

/// Whether the shape's own coordinates are in units of its size. Those of a box are not, which saves
/// roundings: its extent is subtracted.
constexpr bool is_scaled(LookupShape shape) { return shape != LookupShape::box; }

/// Rotates and scales into the shape's own coordinates. The aligned version leaves out
/// products with zeros and ones, which changes no bit of the result but the sign of a zero, to which the
/// formulas are indifferent.
template <LookupShape shape, bool rotated>
inline Vec local_direction(const LookupConstants& k, const Vec& d) {
  if constexpr (rotated) {
    return {dot(vec(k.rows), d), dot(vec(k.rows + 3), d), dot(vec(k.rows + 6), d)};
  } else if constexpr (!is_scaled(shape)) {
    return d;
  } else {
    return {k.rows[0] * d.x, k.rows[4] * d.y, k.rows[8] * d.z};
  }
}

template <LookupShape shape, bool rotated>
inline Vec lookup(const LookupConstants& k, const Vec& p, const Vec& d) {
  if constexpr (shape == LookupShape::infinite) {
    return d;
  } else {
    const Vec local_p = local_direction<shape, rotated>(k, p - vec(k.centre));
    const Vec local_d = local_direction<shape, rotated>(k, d);
    double t = 0;
    if constexpr (shape == LookupShape::box) t = box_exit(local_p, local_d, vec(k.extent));
    if constexpr (shape == LookupShape::ellipsoid) t = sphere_exit(local_p, local_d);
    if constexpr (shape == LookupShape::hemisphere) t = hemisphere_exit(local_p, local_d);
    return p + t * d - vec(k.origin);
  }
}

/// Calls function.operator()<shape>().
template <int number = 0, typename Function>
inline void with_shape(LookupShape shape, const Function& function) {
  if (static_cast<int>(shape) == number) {
    function.template operator()<static_cast<LookupShape>(number)>();
  } else if constexpr (number + 1 < static_cast<int>(LookupShape::count)) {
    with_shape<number + 1>(shape, function);
  }
}

/// Mirror direction, times |n|², of a ray from `eye` to p, normal n of any length.
inline Vec reflect(const Vec& p, const Vec& n, const Vec& eye) {
  const Vec v = eye - p;
  return 2.0 * dot(n, v) * n - dot(n, n) * v;
}

}  // namespace
}  // namespace mirrorbake::MIRRORBAKE_ISA
