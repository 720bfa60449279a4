#pragma once

#include <string>
#include <vector>
#include <glm/vec3.hpp>

#include "mirrorbake/scene/scene.hpp"

/// Meshes that the library makes itself, with normals and texture coordinates. All are closed but the
/// rectangle and the teapot. Lengths in metres; `segments` around a full turn, 3 to 4096. They throw
/// InvalidArgument for lengths that are not finite and above 0, and counts out of range.
namespace mirrorbake {

/// The Utah teapot: 32 bicubic Bézier patches (Newell 1975; control points as published by Crow, "The origins
/// of the teapot", IEEE CG&A 7(1), 1987), each cut into `subdivisions`² × 2 triangles (1 to 512), with the
/// true normals of the surface. 25 gives the 40,000 triangles of [PEM] §6. It stands on y = 0, its axis on
/// the y axis, the spout along +X, `height` metres high from the foot to the tip of the knob.
///
/// Parts: 0 "body" (rim, body, handle, spout, bottom), 1 "lid" (with its knob). The classic data are kept as
/// they are: handle and spout run into the body, and between rim and lid there is a gap through which the
/// inside of the body shows (its back side). Vertices are shared within a patch; those on a common edge of
/// two patches are bit-identical. At the tip of the knob and the middle of the bottom one edge of a patch is
/// a single point: the normal there is the limit of the surface's, and `subdivisions` triangles of each such
/// patch have no area. The texture coordinates are an atlas without overlaps, four patches per row.
TriangleMesh make_teapot(int subdivisions = 25, float height = 0.15F);

/// Names of the teapot's parts, in order.
std::vector<std::string> teapot_part_names();

/// Each side has texture coordinates from (0,0) to (1,1), v up; on the top u is +X and v −Z.
TriangleMesh make_box(glm::vec3 min, glm::vec3 max);

/// Latitude-longitude grid of `segments` × `segments`/2 cells, poles on the y axis; u runs counter-clockwise
/// seen from above, from +X; v from the south to the north pole.
TriangleMesh make_sphere(glm::vec3 centre, float radius, int segments = 48);

/// Upright, with both caps; `base` is the centre of the lower one.
TriangleMesh make_cylinder(glm::vec3 base, float radius, float height, int segments = 48);

/// Upright, with its base; `base` is the centre of that.
TriangleMesh make_cone(glm::vec3 base, float radius, float height, int segments = 48);

/// Around the vertical axis through `centre`; `tube_radius` < `ring_radius`. The tube has `segments`/2
/// segments.
TriangleMesh make_torus(glm::vec3 centre, float ring_radius, float tube_radius, int segments = 48);

/// The rectangle corner, corner + u, corner + u + v, corner + v, facing u × v, with uv (0,0), (1,0), (1,1),
/// (0,1).
TriangleMesh make_rectangle(glm::vec3 corner, glm::vec3 u, glm::vec3 v);

}  // namespace mirrorbake
