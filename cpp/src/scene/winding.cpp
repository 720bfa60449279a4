#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include "mirrorbake/scene/scene.hpp"

namespace mirrorbake {

double winding_number(const TriangleMesh& mesh, glm::dvec3 point) {
  const Bounds box = bounds(mesh);
  if (glm::any(glm::lessThan(point, glm::dvec3(box.min))) ||
      glm::any(glm::greaterThan(point, glm::dvec3(box.max)))) {
    return 0.0;
  }
  double sum = 0.0;
  for (const glm::uvec3 t : mesh.triangles) {
    const glm::dvec3 a = glm::dvec3(mesh.positions[t.x]) - point;
    const glm::dvec3 b = glm::dvec3(mesh.positions[t.y]) - point;
    const glm::dvec3 c = glm::dvec3(mesh.positions[t.z]) - point;
    const double la = glm::length(a);
    const double lb = glm::length(b);
    const double lc = glm::length(c);
    sum += std::atan2(glm::dot(a, glm::cross(b, c)),
                      la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb);
  }
  return sum / (2.0 * std::numbers::pi);
}

bool encloses(const TriangleMesh& mesh, glm::dvec3 point) { return winding_number(mesh, point) > 0.5; }

}  // namespace mirrorbake
