#pragma once

#include <span>
#include <glm/vec3.hpp>

#include "mirrorbake/proxy/proxy.hpp"

/// Fitting proxies to geometry (spec G3). All functions throw InvalidArgument for empty input and for NaN or
/// infinite coordinates, naming the first offending element.
namespace mirrorbake {

/// Flat input has no volume: no extent of a fitted shape is less than this fraction of its largest extent.
inline constexpr float kMinExtentRatio = 1e-4F;

/// Area-weighted mean of the triangles' centroids: the origin of an object's maps ([PEM] §4). Throws
/// InvalidArgument if an index is out of range or all triangles together have no area.
glm::vec3 area_weighted_centroid(std::span<const glm::vec3> positions, std::span<const glm::uvec3> triangles);

/// Minimum-volume axis-aligned ellipsoid around `centre` that encloses every point, to a relative volume of
/// 1e-6: the optimum to 1e-8, its radii then rounded up to float. No radius is below kMinExtentRatio times
/// the largest distance along an axis. Throws InvalidArgument if all points lie at the centre.
Ellipsoid fit_ellipsoid(std::span<const glm::vec3> points, glm::vec3 centre);

/// Box by [PEM] §4: its bottom on the plane y = `floor`, the other five sides at the mean distance, along
/// each axis direction, of the hit points that lie on that side (those for which the axis is the largest
/// component of hit − origin). A side without hits takes the distance of the opposite side or, if that has
/// none either, the mean of all. `origin` must lie above the floor. Hits at the origin are ignored;
/// InvalidArgument if nothing else is left.
Box fit_box_mean_distance(std::span<const glm::vec3> hits, glm::vec3 origin, float floor);

/// Axis-aligned box around `origin` that fits the surroundings' hit points best, by robust least squares of
/// each point's distance to the box's surface: Huber's loss, which turns linear at 1 % of the mean distance
/// of the hits from the origin, so that furniture and what is seen through windows counts little. Sides
/// without hits are placed as by fit_box_mean_distance. Hits at the origin are ignored; InvalidArgument if
/// nothing else is left.
Box fit_box_robust(std::span<const glm::vec3> hits, glm::vec3 origin);

}  // namespace mirrorbake
