#include "bright_surfaces.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <glm/geometric.hpp>

#include "cdf.hpp"
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
      glm::vec2 w = stream.get(diffuse_dimension);
      if (w.x + w.y > 1.0F) w = 1.0F - w;
      const Surface surface = surface_of_triangle(world, object, triangle, w, side * normal);
      if (surface.albedo == glm::vec3(0.0F)) continue;
      const glm::vec3 irradiance = direct_irradiance(world, surface, stream.get(light_dimension), false);
      sum += static_cast<double>(luminance(surface.albedo * irradiance)) * std::numbers::inv_pi_v<double>;
    }
    brightest = std::max(brightest, sum / looks);
  }
  return brightest;
}

double area_of(const World& world, std::uint32_t object, std::uint32_t triangle) {
  const std::span<const glm::vec3> p = world.rays.positions(static_cast<int>(object));
  const glm::uvec3 t = world.scene.objects[object].mesh.triangles[triangle];
  const glm::dvec3 a(p[t.x]), b(p[t.y]), c(p[t.z]);
  return 0.5 * glm::length(glm::cross(b - a, c - a));
}

}  // namespace

BrightSurfaces::BrightSurfaces(const World& world, std::uint64_t seed) {
  const std::vector<Object>& objects = world.scene.objects;
  std::vector<Triangle> all;
  for (std::uint32_t o = 0; o < objects.size(); ++o) {
    const auto count = static_cast<std::uint32_t>(objects[o].mesh.triangles.size());
    for (std::uint32_t t = 0; t < count; ++t) all.push_back({o, t});
  }
  std::vector<double> areas(all.size()), powers(all.size());
  parallel_for(all.size(), 256, [&](std::size_t begin, std::size_t end) {
    poll_interrupt();
    for (std::size_t i = begin; i < end; ++i) {
      const auto [object, triangle] = all[i];
      areas[i] = area_of(world, object, triangle);
      if (areas[i] > 0.0) powers[i] = areas[i] * reflected(world, seed, object, triangle);
    }
  });
  double area = 0.0, power = 0.0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    area += areas[i];
    power += powers[i];
  }
  std::vector<double> bright, bright_areas;
  double bright_power = 0.0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!(powers[i] * area > kBright * power * areas[i])) continue;
    triangles_.push_back(all[i]);
    bright.push_back(powers[i]);
    bright_areas.push_back(areas[i]);
    bright_power += powers[i];
  }
  if (!(bright_power > kLeastShare * power)) triangles_.clear();
  if (triangles_.empty()) return;
  cdf_.resize(bright.size() + 1);
  normalise_cdf(cdf_.data(), bright.data(), static_cast<int>(bright.size()));
  density_.resize(objects.size());
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const auto [object, triangle] = triangles_[i];
    std::vector<float>& density = density_[object];
    density.resize(objects[object].mesh.triangles.size());
    // Of the intervals as they were rounded.
    const double share = static_cast<double>(cdf_[i + 1]) - static_cast<double>(cdf_[i]);
    density[triangle] = static_cast<float>(share / bright_areas[i]);
  }
}

BrightSurfaces::Point BrightSurfaces::sample(glm::vec2 u) const {
  const CdfSample chosen = sample_cdf(cdf_.data(), static_cast<int>(triangles_.size()), u.x);
  const auto [object, triangle] = triangles_[static_cast<std::size_t>(chosen.index)];
  const float root = std::sqrt(chosen.place);
  return {object, triangle, {root * (1.0F - u.y), root * u.y}};
}

}  // namespace mirrorbake::tracing
