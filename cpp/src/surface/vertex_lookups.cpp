#include "mirrorbake/surface/vertex_lookups.hpp"

#include <cstddef>
#include <cstdint>

#include <glm/geometric.hpp>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/surface/lookup.hpp"

namespace mirrorbake {
namespace {

constexpr std::size_t kSamplesPerChunk = 4096;

// Change of the weights of a triangle's second and third vertex as a point in its plane moves by `d`: the
// least squares solution of d = x·e1 + y·e2.
glm::dvec2 weights_along(glm::dvec3 e1, glm::dvec3 e2, glm::dvec3 d) {
  const double a = glm::dot(e1, e1), b = glm::dot(e1, e2), c = glm::dot(e2, e2);
  const double determinant = a * c - b * b;
  // Squared sine of the angle between the edges, times a·c: below this they point the same way in float.
  if (!(determinant > 1e-14 * a * c)) return glm::dvec2(0.0);
  const double p = glm::dot(e1, d), q = glm::dot(e2, d);
  return glm::dvec2(c * p - b * q, a * q - b * p) / determinant;
}

}  // namespace

SurfaceSamples with_vertex_lookups(const SurfaceSamples& samples, std::span<const glm::vec3> positions,
                                   std::span<const glm::uvec3> triangles,
                                   std::span<const glm::vec3> lookups) {
  check_lookup_arrays(samples);
  check_length("samples.triangle", samples.triangle.size(), samples.size(), "as many as samples.pixel");
  check_length("samples.barycentric", samples.barycentric.size(), samples.size(), "as many as samples.pixel");
  check_length("lookups", lookups.size(), positions.size(), "one per vertex, as positions");
  const auto count = static_cast<std::int64_t>(triangles.size());
  for (const std::uint32_t triangle : samples.triangle) {
    check_range("samples.triangle", std::int64_t{triangle}, std::int64_t{0}, count - 1);
  }
  check_triangles(triangles, positions.size());
  SurfaceSamples result = samples;
  parallel_for(samples.size(), kSamplesPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const glm::uvec3 t = triangles[samples.triangle[i]];
      const glm::dvec3 a = positions[t.x], e1 = glm::dvec3(positions[t.y]) - a,
                       e2 = glm::dvec3(positions[t.z]) - a;
      const glm::dvec3 first = lookups[t.x], second = glm::dvec3(lookups[t.y]) - first,
                       third = glm::dvec3(lookups[t.z]) - first;
      const glm::dvec2 weights = samples.barycentric[i];
      const glm::dvec2 dx = weights_along(e1, e2, samples.dposition_dx[i]);
      const glm::dvec2 dy = weights_along(e1, e2, samples.dposition_dy[i]);
      result.reflection[i] = first + weights.x * second + weights.y * third;
      result.dreflection_dx[i] = dx.x * second + dx.y * third;
      result.dreflection_dy[i] = dy.x * second + dy.y * third;
    }
  });
  return result;
}

}  // namespace mirrorbake
