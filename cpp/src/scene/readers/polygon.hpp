#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

namespace mirrorbake {

/// Cuts a polygon of the file `path`, given by the indices of its corners into `positions`, into corner
/// triples (numbers of corners, not of vertices): quadrilaterals along the diagonal that keeps both halves
/// facing the same way, larger ones by ear clipping in the plane of the polygon's area vector (Newell).
/// Always corners.size() − 2 triangles, whatever the shape. Throws FileError for one of more than 512 corners
/// that would take minutes, because most of its corners are reflex and none is an ear.
void triangulate(const std::string& path, std::span<const std::uint32_t> corners,
                 const std::vector<glm::vec3>& positions, std::vector<glm::uvec3>& triples);

}  // namespace mirrorbake
