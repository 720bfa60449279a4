#include "caustic_guide.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>
#include <utility>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "barycentric.hpp"
#include "cdf.hpp"
#include "integrator.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "triangle_sampler.hpp"
#include "world.hpp"

namespace mirrorbake::tracing {
namespace {

constexpr std::size_t kPhotons = 1U << 18;

// Cells along the grid's longest side.
constexpr int kCells = 32;
// Guided rays per path, at most.
constexpr float kMostRays = 0.7F;
// Where caustics are this part of the light that falls on the reflectors, there are half as many.
constexpr float kNoticeable = 0.01F;
// Fewer than this are nothing that the cache should know of.
constexpr float kFewestRays = 0.002F;

// The octahedral map (Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors",
// JCGT 3(2), 2014) to [−1,1]², and its solid angle per area, |d|₁³ for a unit direction d.
struct Octahedral {
  glm::vec2 point;
  float solid_angle;
};

Octahedral octahedral(glm::vec3 d) {
  const float sum = std::abs(d.x) + std::abs(d.y) + std::abs(d.z);
  glm::vec2 p = glm::vec2(d.x, d.y) / sum;
  if (d.z < 0.0F) {
    p = glm::vec2(std::copysign(1.0F - std::abs(p.y), p.x), std::copysign(1.0F - std::abs(p.x), p.y));
  }
  return {p, sum * sum * sum};
}

glm::vec3 from_octahedral(glm::vec2 p) {
  const float z = 1.0F - std::abs(p.x) - std::abs(p.y);
  if (z < 0.0F)
    p = glm::vec2(std::copysign(1.0F - std::abs(p.y), p.x), std::copysign(1.0F - std::abs(p.x), p.y));
  return glm::normalize(glm::vec3(p, z));
}

constexpr int kSide = CausticGuide::kSide;
constexpr int kBins = CausticGuide::kBins;
constexpr float kBinArea = 4.0F / static_cast<float>(kBins);

int bin_of(glm::vec2 point) {
  const int x = std::min(static_cast<int>((point.x + 1.0F) * (0.5F * kSide)), kSide - 1);
  const int y = std::min(static_cast<int>((point.y + 1.0F) * (0.5F * kSide)), kSide - 1);
  return y * kSide + x;
}

// A bit for each of 8 × 8 squares of bins. Few are lit: a look at them mostly spares the look at the bins,
// which are in no cache.
std::uint64_t square_bit(int bin) {
  constexpr int kSquare = kSide / 8;
  static_assert(kSide % 8 == 0);
  return std::uint64_t{1} << (bin / kSide / kSquare * 8 + bin % kSide / kSquare);
}

// All specular surfaces that reflections show, by area.
TriangleSampler specular_surfaces(const World& world) {
  std::vector<TriangleSampler::Triangle> triangles;
  std::vector<double> areas;
  for (std::uint32_t o = 0; o < world.scene.objects.size(); ++o) {
    const Object& object = world.scene.objects[o];
    const bool is_seen = (object.visibility & Visibility::reflection) != Visibility::none;
    if (!is_seen || !is_specular(world.scene, object)) continue;
    const std::span<const glm::vec3> p = world.rays.positions(static_cast<int>(o));
    for (std::uint32_t t = 0; t < object.mesh.triangles.size(); ++t) {
      if (!world.scene.materials[static_cast<std::size_t>(material_of(object, t))].specular) continue;
      areas.push_back(triangle_area(p, object.mesh.triangles[t]));
      triangles.push_back({o, t});
    }
  }
  return {std::move(triangles), areas};
}

}  // namespace

void CausticGuide::shoot_one(const World& world, const Hit& start, float area, const SampleStream& stream,
                             Photons& photons) {
  const std::optional<LightSample> light = world.lights.sample(world.position(start), stream.get(1), false);
  if (!light) return;
  Surface surface = surface_at(world.scene, world.rays, start, -light->direction);
  // A mirror's image of a point light is found by no ray.
  if (light->pdf == 0.0F && !surface.rough()) return;
  constexpr float kShadowEpsilon = 1e-3F;
  if (world.rays.all().occluded({offset_origin(surface, light->direction), light->direction,
                                 light->distance * (1.0F - kShadowEpsilon)})) {
    return;
  }
  glm::vec3 power = area * glm::dot(surface.geometric_normal, light->direction) * light->radiance;
  photons.received += static_cast<double>(luminance(power));
  for (int bounce = 0; bounce < kSpecularBounces; ++bounce) {
    const SpecularBounce next = specular_bounce(surface, stream.get(2 + static_cast<std::uint32_t>(bounce)));
    power *= surface.fresnel * next.weight;
    if (!(luminance(power) > 0.0F)) return;
    const Ray ray{offset_origin(surface, next.direction), next.direction};
    const Hit hit = world.rays.all().intersect(ray, RayKind::reflection);
    if (hit.missed() || world.is_light(hit)) return;
    surface = surface_at(world.scene, world.rays, hit, ray.direction);
    if (surface.albedo != glm::vec3(0.0F)) {
      photons.landed.push_back({surface.position, surface.view, luminance(power)});
    }
    if (!surface.specular()) return;
  }
}

CausticGuide::Photons CausticGuide::shoot(const World& world, const TriangleSampler& specular,
                                          std::uint64_t seed) {
  constexpr std::size_t kChunk = 4096;
  const auto area = static_cast<float>(specular.weight() / kPhotons);
  std::vector<Photons> chunks((kPhotons + kChunk - 1) / kChunk);
  parallel_for(kPhotons, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const SampleStream stream = sample_stream(seed, 0, static_cast<std::uint32_t>(i));
      shoot_one(world, specular.sample(stream.get(0)), area, stream, chunks[begin / kChunk]);
    }
  });
  Photons photons;
  for (const Photons& chunk : chunks) {
    photons.landed.insert(photons.landed.end(), chunk.landed.begin(), chunk.landed.end());
    photons.received += chunk.received;
  }
  return photons;
}

void CausticGuide::lay_grid(const std::vector<Photon>& photons) {
  // Around all but the stray ones, which a large scene has far away.
  constexpr double kStray = 0.01;
  std::vector<float> coordinates(photons.size());
  glm::vec3 extent(0.0F);
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(photons.begin(), photons.end(), coordinates.begin(),
                   [&](const Photon& p) { return p.position[axis]; });
    std::sort(coordinates.begin(), coordinates.end());
    const auto stray = static_cast<std::size_t>(kStray * static_cast<double>(coordinates.size()));
    corner_[axis] = coordinates[stray];
    extent[axis] = coordinates[coordinates.size() - 1 - stray] - corner_[axis];
  }
  const float longest = std::max(extent.x, std::max(extent.y, extent.z));
  if (!(longest > 0.0F)) return;
  cells_per_metre_ = kCells / longest;
  // A cell more on each side, for what lies on the border.
  size_ = glm::ivec3(glm::floor(extent * cells_per_metre_)) + 3;
  corner_ -= 1.0F / cells_per_metre_;
}

void CausticGuide::fill(const std::vector<Photon>& photons, double irradiance_of_reflectors) {
  constexpr std::int32_t kDark = -1;
  std::vector<std::int32_t> slot(grid_index({0, 0, size_.z}), kDark);
  std::vector<std::array<float, kBins>> histograms;
  for (const Photon& photon : photons) {
    // Into the eight cells around it.
    const glm::vec3 place = (photon.position - corner_) * cells_per_metre_ - 0.5F;
    const glm::vec3 base = glm::floor(place);
    const glm::vec3 fraction = place - base;
    const auto bin = static_cast<std::size_t>(bin_of(octahedral(photon.direction).point));
    for (int k = 0; k < 8; ++k) {
      const glm::ivec3 step(k & 1, (k >> 1) & 1, k >> 2);
      const glm::vec3 c = base + glm::vec3(step);
      if (!(c.x >= 0.0F && c.y >= 0.0F && c.z >= 0.0F && c.x < static_cast<float>(size_.x) &&
            c.y < static_cast<float>(size_.y) && c.z < static_cast<float>(size_.z))) {
        continue;
      }
      float weight = photon.power;
      for (int axis = 0; axis < 3; ++axis) weight *= step[axis] == 1 ? fraction[axis] : 1.0F - fraction[axis];
      std::int32_t& h = slot[grid_index(glm::ivec3(c))];
      if (h == kDark) {
        h = static_cast<std::int32_t>(histograms.size());
        histograms.emplace_back();
      }
      histograms[static_cast<std::size_t>(h)][bin] += weight;
    }
  }

  const double cell_area =
      1.0 / (static_cast<double>(cells_per_metre_) * static_cast<double>(cells_per_metre_));
  const double noticeable = kNoticeable * irradiance_of_reflectors;
  grid_.resize(slot.size());
  first_.push_back(0);
  for (std::size_t c = 0; c < slot.size(); ++c) {
    if (slot[c] == kDark) continue;
    const std::array<float, kBins>& histogram = histograms[static_cast<std::size_t>(slot[c])];
    double power = 0.0;
    for (float value : histogram) power += static_cast<double>(value);
    const double irradiance = power / cell_area;
    const auto rays = static_cast<float>(kMostRays * irradiance / (irradiance + noticeable));
    if (rays < kFewestRays) continue;

    grid_[c] = {rays, static_cast<std::uint32_t>(first_.size() - 1), 0};
    std::vector<double> powers;
    for (std::size_t word = 0; word < kWords; ++word) {
      LitBins lit;
      lit.before = static_cast<std::uint32_t>(cdf_.size() + powers.size());
      for (std::size_t bin = 64 * word; bin < 64 * word + 64; ++bin) {
        if (!(histogram[bin] > 0.0F)) continue;
        lit.bits |= std::uint64_t{1} << (bin % 64);
        grid_[c].lit_squares |= square_bit(static_cast<int>(bin));
        powers.push_back(static_cast<double>(histogram[bin]));
        bins_.push_back(static_cast<std::uint16_t>(bin));
      }
      lit_.push_back(lit);
    }
    bins_.push_back(0);  // beside the last entry of the distribution
    cdf_.resize(bins_.size());
    normalise_cdf(&cdf_[first_.back()], powers.data(), static_cast<int>(powers.size()));
    first_.push_back(static_cast<std::uint32_t>(cdf_.size()));
  }
}

CausticGuide::CausticGuide(const World& world, std::uint64_t seed) {
  const TriangleSampler specular = specular_surfaces(world);
  if (!(specular.weight() > 0.0) || world.lights.empty()) return;
  const Photons photons = shoot(world, specular, seed);
  if (photons.landed.empty()) return;
  lay_grid(photons.landed);
  if (size_.x > 0) fill(photons.landed, photons.received / specular.weight());
}

float CausticGuide::strength(Cell cell) {
  return kNoticeable * cell.rays / std::max(kMostRays - cell.rays, 1e-6F);
}

glm::vec3 CausticGuide::sample(Cell cell, glm::vec2 u) const {
  const std::uint32_t first = first_[cell.number];
  const CdfSample lit = sample_cdf(&cdf_[first], static_cast<int>(first_[cell.number + 1] - first) - 1, u.x);
  const int bin = bins_[first + static_cast<std::size_t>(lit.index)];
  const int row = bin / kSide;
  const glm::vec2 place(static_cast<float>(bin % kSide) + lit.place, static_cast<float>(row) + u.y);
  return from_octahedral(place * (2.0F / kSide) - 1.0F);
}

float CausticGuide::pdf(Cell cell, glm::vec3 direction) const {
  const Octahedral o = octahedral(direction);
  const int number = bin_of(o.point);
  if ((cell.lit_squares & square_bit(number)) == 0) return 0.0F;
  const auto bin = static_cast<std::size_t>(number);
  const LitBins& lit = lit_[cell.number * kWords + bin / 64];
  const std::uint64_t bit = std::uint64_t{1} << (bin % 64);
  if ((lit.bits & bit) == 0) return 0.0F;
  const float* cdf = &cdf_[lit.before + static_cast<std::size_t>(std::popcount(lit.bits & (bit - 1)))];
  return (cdf[1] - cdf[0]) / (kBinArea * o.solid_angle);
}

}  // namespace mirrorbake::tracing
