#pragma once

#include <span>

#include <glm/vec3.hpp>

#include "mirrorbake/proxy/proxy.hpp"

/// Fitting proxies to geometry (spec G3).
namespace mirrorbake {

/// Area-weighted mean of the triangles' centroids: the origin of an object's maps ([PEM] §4).
glm::vec3 area_weighted_centroid(std::span<const glm::vec3> positions, std::span<const glm::uvec3> triangles);

/// Minimum-volume axis-aligned ellipsoid around `centre` that encloses every point, to a relative volume of 1e-6.
Ellipsoid fit_ellipsoid(std::span<const glm::vec3> points, glm::vec3 centre);

/// Box by [PEM] §4: its bottom on the plane y = `floor`, the other five sides at the mean distance, along each axis
/// direction, of the hit points that lie on that side (those for which the axis is the largest component).
Box fit_box_mean_distance(std::span<const glm::vec3> hits, glm::vec3 origin, float floor);

/// Axis-aligned box that fits the surroundings' hit points best, by robust (Huber) least squares of each point's
/// distance to the box's surface; outliers such as furniture count little.
Box fit_box_robust(std::span<const glm::vec3> hits, glm::vec3 origin);

}  // namespace mirrorbake
