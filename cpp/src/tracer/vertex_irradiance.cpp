#include <numbers>
#include <optional>
#include <span>
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

using namespace tracing;  // NOLINT: this file is all about it

// Rays after which the back of a surface is taken for the inside of a closed body.
constexpr int kProbeRays = 64;

/// Irradiance of single surface points, all light included.
class Gatherer {
 public:
  Gatherer(const LitWorld& lit, std::uint64_t seed) : lit_(lit), seed_(seed) {}

  /// Mean over `rays` samples, of which number r starts at `start_at(r, stream)` if there is one; `number`:
  /// of the mean, which draws other random numbers than the others.
  template <typename StartAt>
  glm::vec3 mean(std::size_t number, int rays, SurfaceSide side, const StartAt& start_at) const {
    glm::dvec3 sum(0.0);
    for (int r = 0; r < rays; ++r) {
      if (r == kProbeRays && side == SurfaceSide::back && sum == glm::dvec3(0.0)) break;
      const SampleStream stream = sample_stream(seed_, number, static_cast<std::uint32_t>(r));
      const std::optional<Surface> start = start_at(static_cast<std::uint32_t>(r), stream);
      if (start) sum += glm::dvec3(irradiance(*start, stream, static_cast<std::uint32_t>(r)));
    }
    return glm::vec3(sum / static_cast<double>(rays));
  }

  /// A point of a triangle seen from its front or its back; none if the triangle has no area.
  std::optional<Surface> start(int object, std::uint32_t triangle, glm::vec2 weights,
                               SurfaceSide side) const {
    const auto number = static_cast<std::uint32_t>(object);
    glm::vec3 n = face_normal(lit_.world, number, triangle);
    if (n == glm::vec3(0.0F)) return std::nullopt;
    if (side == SurfaceSide::back) n = -n;
    return surface_of_triangle(lit_.world, number, triangle, weights, n);
  }

 private:
  glm::vec3 irradiance(const Surface& start, const SampleStream& stream, std::uint32_t index) const {
    const World& world = lit_.world;
    const Indirect& indirect = lit_.indirect;
    const bool path = indirect.mode == IndirectLight::path;
    glm::vec3 found = direct_irradiance(world, start, stream.get(light_dimension), path);
    if (path) {
      const PathLimits limits{TraceOptions{}.max_specular_depth, TraceOptions{}.max_diffuse_depth};
      return found +
             std::numbers::pi_v<float> * diffuse_path_radiance(lit_, start, limits, stream, 1, Effort::one);
    }
    if (indirect.mode != IndirectLight::cached) return found;
    found += caustic_irradiance(world, indirect.guide, start, stream);
    const glm::vec3 direction = sample_cosine_hemisphere(Frame(start.normal), stream.get(diffuse_dimension));
    if (glm::dot(direction, start.geometric_normal) <= 0.0F) return found;
    const auto irradiance_at = [&](const Surface& surface, glm::vec2 u) {
      return direct_irradiance(world, surface, u, false) + indirect.cache.irradiance(surface);
    };
    // Bounce 1 on, so that the next surface draws other numbers than this one.
    const SampleStream onward{hash64(stream.key, 1), index};
    return found + std::numbers::pi_v<float> * gather_along(world,
                                                            {offset_origin(start, direction), direction},
                                                            onward, irradiance_at)
                                                   .radiance;
  }

  const LitWorld& lit_;
  std::uint64_t seed_;
};

constexpr std::size_t kPointsPerChunk = 32;

}  // namespace

std::vector<glm::vec3> Tracer::vertex_irradiance(int object, int rays, std::uint64_t seed,
                                                 SurfaceSide side) const {
  state_->check_object("object", object);
  check_range("rays", rays, 1, 65536);
  const TriangleMesh& mesh = state_->lit.world.scene.objects[static_cast<std::size_t>(object)].mesh;

  // The triangle corners at each vertex.
  std::vector<std::uint32_t> first(mesh.positions.size() + 1, 0);
  for (const glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) ++first[t[k] + 1];
  }
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) first[v + 1] += first[v];
  struct Corner {
    std::uint32_t triangle, corner;
  };
  std::vector<Corner> corners(first.back());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::uint32_t k = 0; k < 3; ++k) corners[next[mesh.triangles[t][static_cast<int>(k)]]++] = {t, k};
  }

  const Gatherer gatherer(state_->lit, seed);
  std::vector<glm::vec3> irradiance(mesh.positions.size(), glm::vec3(0.0F));
  parallel_for(irradiance.size(), kPointsPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      const std::uint32_t count = first[v + 1] - first[v];
      if (count == 0) continue;
      poll_interrupt();
      irradiance[v] = gatherer.mean(v, rays, side, [&](std::uint32_t r, const SampleStream& stream) {
        const Corner& corner = corners[first[v] + r % count];
        const glm::vec3 weights = weights_near_corner(corner.corner, stream.get(dimension_base(0, 1)));
        return gatherer.start(object, corner.triangle, {weights.y, weights.z}, side);
      });
    }
  });
  return irradiance;
}

std::vector<glm::vec3> Tracer::surface_irradiance(int object, std::span<const std::uint32_t> triangles,
                                                  std::span<const glm::vec2> barycentric, int rays,
                                                  std::uint64_t seed, SurfaceSide side) const {
  state_->check_object("object", object);
  check_range("rays", rays, 1, 65536);
  check_length("barycentric", barycentric.size(), triangles.size(), "one per entry of triangles");
  const TriangleMesh& mesh = state_->lit.world.scene.objects[static_cast<std::size_t>(object)].mesh;
  const std::int64_t last = static_cast<std::int64_t>(mesh.triangles.size()) - 1;
  for (const std::uint32_t triangle : triangles) {
    check_range("triangles", std::int64_t{triangle}, std::int64_t{0}, last);
  }
  const Gatherer gatherer(state_->lit, seed);
  std::vector<glm::vec3> irradiance(triangles.size(), glm::vec3(0.0F));
  parallel_for(irradiance.size(), kPointsPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      poll_interrupt();
      irradiance[i] = gatherer.mean(i, rays, side, [&](std::uint32_t, const SampleStream&) {
        return gatherer.start(object, triangles[i], barycentric[i], side);
      });
    }
  });
  return irradiance;
}

}  // namespace mirrorbake
