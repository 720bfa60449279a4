#include <numbers>
#include <vector>
#include <glm/geometric.hpp>

#include "gather.hpp"
#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/interrupt.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "options.hpp"
#include "state.hpp"

namespace mirrorbake {
namespace {

// Rays after which the back of a surface is taken for the inside of a closed body.
constexpr int kProbeRays = 64;

}  // namespace

std::vector<glm::vec3> Tracer::vertex_irradiance(int object, int rays, std::uint64_t seed,
                                                 SurfaceSide side) const {
  using namespace tracing;  // NOLINT: this function is all about it
  state_->check_object("object", object);
  check_range("rays", rays, 1, 65536);
  const World& world = state_->lit.world;
  const Indirect& indirect = state_->lit.indirect;
  const TriangleMesh& mesh = world.scene.objects[static_cast<std::size_t>(object)].mesh;

  // The triangle corners at each vertex.
  std::vector<std::uint32_t> first(mesh.positions.size() + 1, 0);
  for (const glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) ++first[t[k] + 1];
  }
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) first[v + 1] += first[v];
  std::vector<TriangleCorner> corners(first.back());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      corners[next[mesh.triangles[t][static_cast<int>(k)]]++] = {static_cast<std::uint32_t>(object), t, k};
    }
  }

  const bool path = indirect.mode == IndirectLight::path;
  const bool cached = indirect.mode == IndirectLight::cached;
  const PathLimits limits{TraceOptions{}.max_specular_depth, TraceOptions{}.max_diffuse_depth};
  const auto irradiance_at = [&](const Surface& surface, glm::vec2 u) {
    return direct_irradiance(world, surface, u, false) + indirect.cache.irradiance(surface);
  };
  std::vector<glm::vec3> irradiance(mesh.positions.size(), glm::vec3(0.0F));
  parallel_for(irradiance.size(), 32, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      const std::uint32_t count = first[v + 1] - first[v];
      if (count == 0) continue;
      poll_interrupt();
      glm::dvec3 sum(0.0);
      for (int r = 0; r < rays; ++r) {
        if (r == kProbeRays && side == SurfaceSide::back && sum == glm::dvec3(0.0)) break;
        const auto index = static_cast<std::uint32_t>(r);
        const SampleStream stream = sample_stream(seed, v, index);
        const TriangleCorner& corner = corners[first[v] + index % count];
        glm::vec3 n = face_normal(world, corner.object, corner.triangle);
        if (side == SurfaceSide::back) n = -n;
        if (n == glm::vec3(0.0F)) continue;
        const glm::vec3 weights = weights_near_corner(corner.corner, stream.get(dimension_base(0, 1)));
        const Surface start =
            surface_of_triangle(world, corner.object, corner.triangle, {weights.y, weights.z}, n);
        glm::vec3 found = direct_irradiance(world, start, stream.get(light_dimension), path);
        if (path) {
          found += std::numbers::pi_v<float> *
                   diffuse_path_radiance(state_->lit, start, limits, stream, 1, Effort::one);
        } else if (cached) {
          found += caustic_irradiance(world, indirect.guide, start, stream);
          const glm::vec3 direction =
              sample_cosine_hemisphere(Frame(start.normal), stream.get(diffuse_dimension));
          if (glm::dot(direction, start.geometric_normal) > 0.0F) {
            // Bounce 1 on, so that the next surface draws other numbers than this one.
            const SampleStream onward{hash64(stream.key, 1), index};
            found += std::numbers::pi_v<float> *
                     gather_along(world, {offset_origin(start, direction), direction}, onward, irradiance_at)
                         .radiance;
          }
        }
        sum += glm::dvec3(found);
      }
      irradiance[v] = glm::vec3(sum / static_cast<double>(rays));
    }
  });
  return irradiance;
}

}  // namespace mirrorbake
