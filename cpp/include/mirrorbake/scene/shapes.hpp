#pragma once

#include <glm/vec3.hpp>

#include "mirrorbake/scene/scene.hpp"

/// Meshes that the library makes itself.
namespace mirrorbake {

/// The Utah teapot: 32 bicubic Bézier patches (Newell 1975; control points as published by Crow, "The origins
/// of the teapot", IEEE CG&A 7(1), 1987), each cut into `subdivisions`² × 2 triangles, with the true normals
/// of the surface. 25 gives the 40,000 triangles of [PEM] §6. It stands on y = 0, its axis on the y axis, the
/// spout along +X, scaled so that its body is `height` metres high. Parts: 0 "body" (body, handle, spout,
/// bottom), 1 "lid".
TriangleMesh make_teapot(int subdivisions = 25, float height = 0.15F);

/// Names of the teapot's parts, in order.
std::vector<std::string> teapot_part_names();

TriangleMesh make_box(glm::vec3 min, glm::vec3 max);
TriangleMesh make_sphere(glm::vec3 centre, float radius, int segments = 48);
TriangleMesh make_cylinder(glm::vec3 base, float radius, float height, int segments = 48);
TriangleMesh make_cone(glm::vec3 base, float radius, float height, int segments = 48);
TriangleMesh make_torus(glm::vec3 centre, float ring_radius, float tube_radius, int segments = 48);
/// The rectangle corner, corner + u, corner + u + v, corner + v, facing u × v, with uv (0,0), (1,0), (1,1),
/// (0,1).
TriangleMesh make_rectangle(glm::vec3 corner, glm::vec3 u, glm::vec3 v);

}  // namespace mirrorbake
