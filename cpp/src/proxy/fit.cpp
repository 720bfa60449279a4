#include "mirrorbake/proxy/fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake {
namespace {

void check_points(const char* name, std::span<const glm::vec3> points) {
  if (points.empty()) throw InvalidArgument(name, "empty", "at least one point");
  check_finite(name, points);
}

float round_up(double value) {
  const auto rounded = static_cast<float>(value);
  return static_cast<double>(rounded) < value
             ? std::nextafter(rounded, std::numeric_limits<float>::infinity())
             : rounded;
}

// -----------------------------------------------------------------------------------------------------------
// Minimum-volume ellipsoid. With w_i = 1/r_i² and X_j = (d_jx², d_jy², d_jz²), d_j the j-th point seen from
// the centre,
//
//   minimise −Σ log w_i  subject to  X_j · w ≤ 1 for all j,
//
// which is convex with three unknowns; at most three constraints are active at the optimum. So constraints
// are added one at a time, the one that is violated most, and the small problem is solved anew by a barrier
// method.

/// argmin −Σ log w_i − μ Σ_j log(1 − X_j·w) by damped Newton steps, from a strictly feasible w.
glm::dvec3 barrier_centre(std::span<const glm::dvec3> constraints, double mu, glm::dvec3 w) {
  const auto objective = [&](const glm::dvec3& v) {
    if (!(v.x > 0 && v.y > 0 && v.z > 0)) return std::numeric_limits<double>::infinity();
    double sum = -std::log(v.x) - std::log(v.y) - std::log(v.z);
    for (const glm::dvec3& x : constraints) {
      const double slack = 1.0 - glm::dot(x, v);
      if (!(slack > 0)) return std::numeric_limits<double>::infinity();
      sum -= mu * std::log(slack);
    }
    return sum;
  };
  constexpr int kMaxSteps = 60;
  double value = objective(w);
  for (int step = 0; step < kMaxSteps; ++step) {
    glm::dvec3 gradient = -1.0 / w;
    glm::dmat3 hessian(0.0);
    for (int i = 0; i < 3; ++i) hessian[i][i] = 1.0 / (w[i] * w[i]);
    for (const glm::dvec3& x : constraints) {
      const double inverse_slack = 1.0 / (1.0 - glm::dot(x, w));
      gradient += mu * inverse_slack * x;
      for (int i = 0; i < 3; ++i) hessian[i] += mu * inverse_slack * inverse_slack * x[i] * x;
    }
    // Cholesky factors of the 3×3 Hessian, which is positive definite by its first term.
    const double l00 = std::sqrt(hessian[0][0]);
    const double l10 = hessian[0][1] / l00;
    const double l20 = hessian[0][2] / l00;
    const double l11 = std::sqrt(std::max(hessian[1][1] - l10 * l10, std::numeric_limits<double>::min()));
    const double l21 = (hessian[1][2] - l20 * l10) / l11;
    const double l22 =
        std::sqrt(std::max(hessian[2][2] - l20 * l20 - l21 * l21, std::numeric_limits<double>::min()));
    const double y0 = -gradient.x / l00;
    const double y1 = (-gradient.y - l10 * y0) / l11;
    const double y2 = (-gradient.z - l20 * y0 - l21 * y1) / l22;
    glm::dvec3 move;
    move.z = y2 / l22;
    move.y = (y1 - l21 * move.z) / l11;
    move.x = (y0 - l10 * move.y - l20 * move.z) / l00;

    const double decrement = -glm::dot(gradient, move);  // Newton decrement, squared
    if (!(decrement > 1e-18)) break;
    double length = 1.0;
    double next = objective(w + move);
    while (!(next <= value - 1e-4 * length * decrement) && length > 1e-12) {
      length *= 0.5;
      next = objective(w + length * move);
    }
    if (!(next < value)) break;  // at the limit of double precision
    w += length * move;
    value = next;
  }
  return w;
}

/// Optimum of the small problem, from any w > 0; the result is feasible.
glm::dvec3 solve_constraints(std::span<const glm::dvec3> constraints, glm::dvec3 w) {
  double largest = 0;
  for (const glm::dvec3& x : constraints) largest = std::max(largest, glm::dot(x, w));
  w *= 0.5 / largest;
  // The centre for μ is at most μ·m above the optimum (Boyd & Vandenberghe, Convex Optimization, §11.2.2).
  for (double mu = 1.0; mu * static_cast<double>(constraints.size()) > 1e-11; mu *= 0.05) {
    w = barrier_centre(constraints, mu, w);
  }
  return barrier_centre(constraints, 1e-11 / static_cast<double>(constraints.size()), w);
}

// -----------------------------------------------------------------------------------------------------------
// Boxes. Sides are numbered −x, +x, −y, +y, −z, +z.

using Sides = std::array<double, 6>;  ///< distance of each side from the origin, > 0

int side_of(const glm::dvec3& d) {
  const glm::dvec3 a = glm::abs(d);
  const int axis = a.x >= a.y && a.x >= a.z ? 0 : (a.y >= a.z ? 1 : 2);
  return 2 * axis + (d[axis] > 0 ? 1 : 0);
}

double side_distance(const glm::dvec3& d, int side) { return (side % 2 == 1 ? 1.0 : -1.0) * d[side / 2]; }

/// Hits relative to the origin, without those at the origin itself.
std::vector<glm::dvec3> hits_from(std::span<const glm::vec3> hits, glm::vec3 origin) {
  check_points("hits", hits);
  check_finite("origin", origin);
  std::vector<glm::dvec3> relative;
  relative.reserve(hits.size());
  for (const glm::vec3& hit : hits) {
    const glm::dvec3 d = glm::dvec3(hit) - glm::dvec3(origin);
    if (d != glm::dvec3(0.0)) relative.push_back(d);
  }
  if (relative.empty()) {
    throw InvalidArgument("hits", "all at the origin " + text_of(origin), "points around the origin");
  }
  return relative;
}

/// Distances along each side's direction of the hits whose largest component it is.
std::array<std::vector<double>, 6> distances_by_side(std::span<const glm::dvec3> hits) {
  std::array<std::vector<double>, 6> distances;
  for (const glm::dvec3& d : hits) {
    const int side = side_of(d);
    distances[side].push_back(side_distance(d, side));
  }
  return distances;
}

/// Gives sides that no hit determines (marked by 0) the opposite one's distance, or the mean of all.
void fill_empty_sides(Sides& sides) {
  double sum = 0;
  int count = 0;
  for (double side : sides) {
    if (side > 0) {
      sum += side;
      ++count;
    }
  }
  const Sides known = sides;
  for (std::size_t side = 0; side < 6; ++side) {
    if (known[side] > 0) continue;
    sides[side] = known[side ^ 1] > 0 ? known[side ^ 1] : sum / count;
  }
}

Box box_from_sides(Sides sides, glm::vec3 origin) {
  const double largest = *std::max_element(sides.begin(), sides.end());
  for (double& side : sides) side = std::max(side, static_cast<double>(kMinExtentRatio) * largest);
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = static_cast<double>(origin[axis]) - sides[2 * axis];
    const double high = static_cast<double>(origin[axis]) + sides[2 * axis + 1];
    box.centre[axis] = static_cast<float>(0.5 * (low + high));
    box.half_extent[axis] = static_cast<float>(0.5 * (high - low));
  }
  return box;
}

struct Nearest {
  int side = 0;
  double distance = 0;
};

/// The side that a point belongs to (inside the nearest one, outside the one it is farthest beyond) and its
/// distance to the surface.
Nearest nearest_side(const glm::dvec3& d, const Sides& sides) {
  Nearest nearest;
  double least_depth = std::numeric_limits<double>::infinity();
  double outside = 0;  // squared distance
  for (int side = 0; side < 6; ++side) {
    const double depth = sides[side] - side_distance(d, side);
    if (depth < least_depth) {
      least_depth = depth;
      nearest.side = side;
    }
    if (depth < 0) outside += depth * depth;
  }
  nearest.distance = outside > 0 ? std::sqrt(outside) : least_depth;
  return nearest;
}

double huber(double residual, double threshold) {
  const double r = std::abs(residual);
  return r <= threshold ? 0.5 * r * r : threshold * (r - 0.5 * threshold);
}

/// Minimiser of Σ huber(x − value), by iteratively reweighted means, which decrease the sum monotonically.
double huber_location(std::span<const double> values, double threshold, double start) {
  double location = start;
  for (int step = 0; step < 100; ++step) {
    double weights = 0;
    double sum = 0;
    for (double value : values) {
      const double r = std::abs(value - location);
      const double weight = r <= threshold ? 1.0 : threshold / r;
      weights += weight;
      sum += weight * value;
    }
    const double next = sum / weights;
    const bool converged = std::abs(next - location) <= 1e-9 * threshold;
    location = next;
    if (converged) break;
  }
  return location;
}

double box_cost(std::span<const glm::dvec3> hits, const Sides& sides, double threshold) {
  double cost = 0;
  for (const glm::dvec3& d : hits) cost += huber(nearest_side(d, sides).distance, threshold);
  return cost;
}

double quantile(std::vector<double>& values, double q) {
  const auto middle =
      values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Where most points lie within `width` of each other: the middle one of those. Sorts the values.
double densest(std::vector<double>& values, double width) {
  std::sort(values.begin(), values.end());
  std::size_t first = 0;
  std::size_t best = 0;
  std::size_t most = 0;
  for (std::size_t last = 0; last < values.size(); ++last) {
    while (values[last] - values[first] > width) ++first;
    if (last - first + 1 > most) {
      most = last - first + 1;
      best = first;
    }
  }
  return values[best + most / 2];
}

/// Sides at the densest places of the hits before them. Unlike quantiles of the hits that a side takes by
/// direction these find the far walls of a flat room, before which most hits are on floor and ceiling.
Sides densest_sides(std::span<const glm::dvec3> hits, double width) {
  Sides sides{};
  for (int side = 0; side < 6; ++side) {
    std::vector<double> distances;
    for (const glm::dvec3& d : hits) {
      const double distance = side_distance(d, side);
      if (distance > 0) distances.push_back(distance);
    }
    if (!distances.empty()) sides[static_cast<std::size_t>(side)] = densest(distances, width);
  }
  fill_empty_sides(sides);
  return sides;
}

}  // namespace

glm::vec3 area_weighted_centroid(std::span<const glm::vec3> positions,
                                 std::span<const glm::uvec3> triangles) {
  check_points("positions", positions);
  check_triangles(triangles, positions.size());
  // Relative to a vertex: far from the world's origin the products would lose digits.
  const glm::dvec3 reference(positions[0]);
  glm::dvec3 sum(0.0);
  double area = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const glm::uvec3 t = triangles[i];
    const glm::dvec3 a = glm::dvec3(positions[t.x]) - reference;
    const glm::dvec3 b = glm::dvec3(positions[t.y]) - reference;
    const glm::dvec3 c = glm::dvec3(positions[t.z]) - reference;
    const double weight = glm::length(glm::cross(b - a, c - a));
    sum += weight * (a + b + c);
    area += weight;
  }
  if (!(area > 0)) throw InvalidArgument("triangles", "without area", "at least one triangle with an area");
  return glm::vec3(reference + sum / (3.0 * area));
}

Ellipsoid fit_ellipsoid(std::span<const glm::vec3> points, glm::vec3 centre) {
  check_points("points", points);
  check_finite("centre", centre);
  const glm::dvec3 c(centre);
  glm::dvec3 extent(0.0);
  for (const glm::vec3& point : points) extent = glm::max(extent, glm::abs(glm::dvec3(point) - c));
  const double largest = std::max({extent.x, extent.y, extent.z});
  if (!(largest > 0)) {
    throw InvalidArgument("points", "all at the centre " + text_of(centre), "points around the centre");
  }
  // In units of the extents, which makes the problem well conditioned: w lies in [1/3, 1] where it matters.
  // The least thickness is a constraint like the points': an imaginary point on each axis.
  const double thinnest = static_cast<double>(kMinExtentRatio) * largest;
  const glm::dvec3 unit = glm::max(extent, glm::dvec3(thinnest));
  std::vector<glm::dvec3> squares(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const glm::dvec3 d = (glm::dvec3(points[i]) - c) / unit;
    squares[i] = d * d;
  }
  std::vector<glm::dvec3> active;
  for (int axis = 0; axis < 3; ++axis) {
    glm::dvec3 thickness(0.0);
    thickness[axis] = (thinnest / unit[axis]) * (thinnest / unit[axis]);
    active.push_back(thickness);
  }
  const auto most_violated = [&](const glm::dvec3& w) {
    std::size_t worst = 0;
    double value = -1;
    for (std::size_t i = 0; i < squares.size(); ++i) {
      const double x = squares[i].x * w.x + squares[i].y * w.y + squares[i].z * w.z;
      if (x > value) {
        value = x;
        worst = i;
      }
    }
    return std::pair{worst, value};
  };
  // A violation of ε costs 1.5 ε of volume when the radii are scaled up to enclose the point.
  constexpr double kTolerance = 1e-9;
  constexpr int kMaxConstraints = 500;
  glm::dvec3 w(1.0);
  double worst_value = 0;
  for (int step = 0; step < kMaxConstraints; ++step) {
    const auto [worst, value] = most_violated(w);
    worst_value = value;
    if (step > 0 && value <= 1.0 + kTolerance) break;
    active.push_back(squares[worst]);
    w = solve_constraints(active, w);
  }
  worst_value = std::max(worst_value, most_violated(w).second);
  if (worst_value > 1.0 + 1e-7) {
    throw NumericalError("fit_ellipsoid: no convergence, a point is outside by " +
                         text_of(worst_value - 1.0));
  }
  const double scale = std::sqrt(std::max(worst_value, 1.0)) * (1.0 + 1e-14);
  Ellipsoid ellipsoid;
  ellipsoid.centre = centre;
  for (int axis = 0; axis < 3; ++axis)
    ellipsoid.radii[axis] = round_up(scale * unit[axis] / std::sqrt(w[axis]));
  return ellipsoid;
}

Box fit_box_mean_distance(std::span<const glm::vec3> hits, glm::vec3 origin, float floor) {
  const std::vector<glm::dvec3> relative = hits_from(hits, origin);
  if (!std::isfinite(floor) || !(floor < origin.y)) {
    throw InvalidArgument("floor", text_of(floor), "a height below the origin's, " + text_of(origin.y));
  }
  Sides sides{};
  const auto distances = distances_by_side(relative);
  for (std::size_t side = 0; side < 6; ++side) {
    if (distances[side].empty()) continue;
    double sum = 0;
    for (double distance : distances[side]) sum += distance;
    sides[side] = sum / static_cast<double>(distances[side].size());
  }
  fill_empty_sides(sides);
  constexpr std::size_t kBottom = 2;
  sides[kBottom] = static_cast<double>(origin.y) - static_cast<double>(floor);
  return box_from_sides(sides, origin);
}

Box fit_box_robust(std::span<const glm::vec3> hits, glm::vec3 origin) {
  const std::vector<glm::dvec3> relative = hits_from(hits, origin);
  double mean_distance = 0;
  for (const glm::dvec3& d : relative) mean_distance += glm::length(d);
  mean_distance /= static_cast<double>(relative.size());
  const double threshold = 0.01 * mean_distance;

  // Which side a point belongs to makes the problem non-convex: alternate between assigning points to sides
  // and placing each side, from several starts, and keep the best. Walls are the outermost things in a room,
  // so the upper quantiles are usually close already.
  auto distances = distances_by_side(relative);
  Sides best{};
  double best_cost = std::numeric_limits<double>::infinity();
  std::vector<Sides> starts{densest_sides(relative, threshold)};
  for (double q : {0.5, 0.75, 0.9, 0.98}) {
    Sides sides{};
    for (std::size_t side = 0; side < 6; ++side) {
      if (!distances[side].empty()) sides[side] = quantile(distances[side], q);
    }
    fill_empty_sides(sides);
    starts.push_back(sides);
  }
  for (Sides sides : starts) {
    double last_cost = std::numeric_limits<double>::infinity();
    for (int round = 0; round < 50; ++round) {
      const double cost = box_cost(relative, sides, threshold);
      if (cost < best_cost) {
        best_cost = cost;
        best = sides;
      }
      if (!(cost < last_cost * (1.0 - 1e-9))) break;
      last_cost = cost;
      std::array<std::vector<double>, 6> members;
      for (const glm::dvec3& d : relative) {
        const int side = nearest_side(d, sides).side;
        members[side].push_back(side_distance(d, side));
      }
      const double least = static_cast<double>(kMinExtentRatio) * mean_distance;
      for (std::size_t side = 0; side < 6; ++side) {
        if (members[side].empty()) continue;
        sides[side] = std::max(huber_location(members[side], threshold, sides[side]), least);
      }
    }
  }
  return box_from_sides(best, origin);
}

}  // namespace mirrorbake
