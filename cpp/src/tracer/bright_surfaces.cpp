#include "bright_surfaces.hpp"

#include <algorithm>
#include <numbers>
#include <numeric>
#include <utility>
#include <glm/vec3.hpp>

#include "gather.hpp"
#include "mirrorbake/core/interrupt.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "world.hpp"

namespace mirrorbake::tracing {
namespace {

// Points of a triangle's side that are looked at. What they miss is left to rays of a random direction.
constexpr std::uint32_t kLooks = 4;
// On an object of more triangles than this one point has to do: its triangles are small.
constexpr std::uint32_t kManyTriangles = 16384;
// A surface is bright that reflects as many times the radiance of the mean surface,
constexpr double kBright = 4.0;
// and bright surfaces are worth rays of their own from this share of all reflected light on.
constexpr double kLeastShare = 1e-3;

// Luminance of the light that a triangle's brighter side reflects on average.
double reflected(const World& world, std::uint64_t seed, std::uint32_t object, std::uint32_t triangle) {
  const std::uint32_t looks = world.scene.objects[object].mesh.triangles.size() > kManyTriangles ? 1 : kLooks;
  const glm::vec3 normal = face_normal(world, object, triangle);
  double brightest = 0.0;
  for (const float side : {1.0F, -1.0F}) {
    double sum = 0.0;
    for (std::uint32_t i = 0; i < looks; ++i) {
      const SampleStream stream = sample_stream(hash64(seed, object), triangle, i);
      const glm::vec2 weights = uniform_on_triangle(stream.get(diffuse_dimension));
      const Surface surface = surface_of_triangle(world, object, triangle, weights, side * normal);
      if (surface.albedo == glm::vec3(0.0F)) continue;
      const glm::vec3 irradiance = direct_irradiance(world, surface, stream.get(light_dimension), false);
      sum += static_cast<double>(luminance(surface.albedo * irradiance)) * std::numbers::inv_pi_v<double>;
    }
    brightest = std::max(brightest, sum / looks);
  }
  return brightest;
}

}  // namespace

BrightSurfaces::BrightSurfaces(const World& world, std::uint64_t seed) {
  const std::vector<Object>& objects = world.scene.objects;
  std::vector<TriangleSampler::Triangle> all;
  for (std::uint32_t o = 0; o < objects.size(); ++o) {
    if ((objects[o].visibility & Visibility::reflection) == Visibility::none) continue;
    const auto count = static_cast<std::uint32_t>(objects[o].mesh.triangles.size());
    for (std::uint32_t t = 0; t < count; ++t) all.push_back({o, t});
  }
  std::vector<double> areas(all.size()), powers(all.size());
  parallel_for(all.size(), 256, [&](std::size_t begin, std::size_t end) {
    poll_interrupt();
    for (std::size_t i = begin; i < end; ++i) {
      const auto [object, triangle] = all[i];
      areas[i] = triangle_area(world.rays.positions(static_cast<int>(object)),
                               objects[object].mesh.triangles[triangle]);
      if (areas[i] > 0.0) powers[i] = areas[i] * reflected(world, seed, object, triangle);
    }
  });
  const double area = std::accumulate(areas.begin(), areas.end(), 0.0);
  const double power = std::accumulate(powers.begin(), powers.end(), 0.0);
  std::vector<TriangleSampler::Triangle> bright;
  std::vector<double> bright_areas, bright_powers;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!(powers[i] * area > kBright * power * areas[i])) continue;
    bright.push_back(all[i]);
    bright_areas.push_back(areas[i]);
    bright_powers.push_back(powers[i]);
  }
  if (!(std::accumulate(bright_powers.begin(), bright_powers.end(), 0.0) > kLeastShare * power)) return;
  points_ = TriangleSampler(std::move(bright), bright_powers);
  density_.resize(objects.size());
  for (std::size_t i = 0; i < bright_areas.size(); ++i) {
    const auto [object, triangle] = points_.triangles()[i];
    std::vector<float>& density = density_[object];
    density.resize(objects[object].mesh.triangles.size());
    density[triangle] = static_cast<float>(points_.probability(i) / bright_areas[i]);
  }
}

}  // namespace mirrorbake::tracing
