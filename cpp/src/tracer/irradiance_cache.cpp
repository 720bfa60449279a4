#include "irradiance_cache.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "barycentric.hpp"
#include "bright_surfaces.hpp"
#include "gather.hpp"
#include "mirrorbake/core/interrupt.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "world.hpp"

namespace mirrorbake::tracing {
namespace {

// Rays after which a hemisphere inside a closed body is given up.
constexpr int kProbeRays = 16;
// Later passes gather light that is dimmer and smoother than the first one's: a sixth of the rays will do.
constexpr int kLaterShare = 6;
// Caustics are as sharp as the mirrors: they take as many times the rays of the first pass, by the root of
// their strength, as their noise is in proportion to that.
constexpr float kRaysPerRootOfCaustics = 20.0F;
constexpr int kMostCausticShare = 16;
// Bright surfaces are few and small: as many times fewer rays than the first pass.
constexpr int kBrightShare = 6;
// Nodes of an object's vertices up to which each takes all of its rays; beyond it they have as many as these
// have, down to a share that the mean with a node and its ring of six makes up for.
constexpr float kNodesWithAllRays = 16384.0F;
constexpr float kLeastShare = 0.2F;
constexpr int kLeastRays = 8;
constexpr int kLeastLaterRays = 4;

}  // namespace

IrradianceCache::IrradianceCache() = default;
IrradianceCache::~IrradianceCache() = default;
IrradianceCache::IrradianceCache(const IrradianceCache&) = default;
IrradianceCache& IrradianceCache::operator=(const IrradianceCache&) = default;
IrradianceCache::IrradianceCache(IrradianceCache&&) noexcept = default;
IrradianceCache& IrradianceCache::operator=(IrradianceCache&&) noexcept = default;

IrradianceCache::IrradianceCache(const World& world, const CausticGuide& guide, const TracerOptions& options)
    : cells_(world, options.focus), seed_(options.seed) {
  for (std::uint32_t o = 0; o < world.scene.objects.size(); ++o) {
    const auto nodes = static_cast<float>(cells_.vertex_nodes(o));
    ray_share_.push_back(nodes > 0.0F ? std::clamp(kNodesWithAllRays / nodes, kLeastShare, 1.0F) : 1.0F);
  }
  gather(world, guide, options);
}

IrradianceCache::NodeRays IrradianceCache::node_rays(const World& world, std::size_t place, int side,
                                                     int pass, int most) const {
  const std::uint32_t node = cells_.along_curve()[place];
  NodeRays rays;
  rays.key = hash64(seed_, static_cast<std::uint64_t>(2 * pass + side));
  rays.place = static_cast<std::uint32_t>(place);
  rays.is_back = side == 1;
  // A node with a share of the rays is given up as early in them as others are.
  rays.probing = rays_of(node, kProbeRays, kLeastRays);
  const std::span<const CacheCells::Corner> corners = cells_.corners(node);
  const std::size_t count = std::min<std::size_t>(kStartPoints, static_cast<std::size_t>(most));
  for (std::size_t i = 0; i < count; ++i) {
    const CacheCells::Corner& corner = corners[i % corners.size()];
    const glm::vec3 n = face_normal(world, corner.object, corner.triangle);
    const glm::vec2 u = rays.stream(static_cast<int>(i), kStartPoints).get(dimension_base(0, 1));
    rays.starts[i] = cells_.surface_near(world, corner, u, rays.is_back ? -n : n);
  }
  return rays;
}

glm::vec3 IrradianceCache::node_caustics(const World& world, const CausticGuide& guide,
                                         const NodeRays& rays) {
  if (rays.to_caustics == 0) return glm::vec3(0.0F);
  glm::vec3 sum(0.0F);
  for (int r = 0; r < rays.to_caustics; ++r) {
    const SampleStream stream{rays.key, rays.first_to_caustics + static_cast<std::uint32_t>(r)};
    sum += caustic_irradiance(world, guide, rays.start(r, rays.to_caustics), stream);
  }
  return sum / static_cast<float>(rays.to_caustics);
}

// How many of a node's rays go towards a hit, per solid angle.
float IrradianceCache::mean_rays(const World& world, const BrightSurfaces& bright, const NodeRays& rays,
                                 const Ray& ray, const Hit& hit, float cosine) {
  const float along_cosine = static_cast<float>(rays.along_cosine) * cosine * std::numbers::inv_pi_v<float>;
  const float density = bright.density(hit.geometry, hit.triangle);
  if (density == 0.0F) return along_cosine;
  const float there = std::abs(glm::dot(world.geometric_normal(ray, hit), ray.direction));
  return along_cosine +
         static_cast<float>(rays.to_bright) * density * hit.distance * hit.distance / std::max(there, 1e-6F);
}

glm::vec3 IrradianceCache::from_bright(const World& world, const BrightSurfaces& bright,
                                       const NodeRays& rays) {
  glm::vec3 sum(0.0F);
  for (int r = 0; r < rays.to_bright; ++r) {
    const SampleStream stream = rays.stream(r, rays.to_bright);
    const Surface& start = rays.start(r, rays.to_bright);
    const Hit wanted = bright.sample(stream.get(dimension_base(0, 1) + guide_dimension));
    const glm::vec3 direction = glm::normalize(world.position(wanted) - start.position);
    const float cosine = glm::dot(start.normal, direction);
    if (!(cosine > 0.0F && glm::dot(start.geometric_normal, direction) > 0.0F)) continue;
    const Ray ray{offset_origin(start, direction), direction};
    const Hit hit = world.rays.all().intersect(ray, RayKind::reflection);
    if (hit.geometry != wanted.geometry || hit.triangle != wanted.triangle) continue;
    const Surface surface = surface_at(world.scene, world.rays, hit, direction);
    const glm::vec2 u = stream.get(dimension_base(0, 1) + light_dimension);
    const glm::vec3 radiance =
        surface.albedo * std::numbers::inv_pi_v<float> * direct_irradiance(world, surface, u, false);
    sum += radiance * cosine / mean_rays(world, bright, rays, ray, hit, cosine);
  }
  return sum;
}

template <typename IrradianceAt>
IrradianceCache::NodeGather IrradianceCache::gather_node(const World& world, const BrightSurfaces& bright,
                                                         const NodeRays& rays,
                                                         const IrradianceAt& irradiance_at) {
  NodeGather result;
  int traced = 0;
  int dark = 0;
  int nothing = 0;
  for (int r = 0; r < rays.along_cosine; ++r) {
    const bool hopeless = dark == traced || (rays.is_back && dark + nothing == traced);
    if (r == rays.probing && hopeless) {
      result.given_up = true;
      break;
    }
    const SampleStream stream = rays.stream(r, rays.along_cosine);
    const Surface& start = rays.start(r, rays.along_cosine);
    const glm::vec3 direction =
        sample_cosine_hemisphere(Frame(start.normal), stream.get(dimension_base(0, 0) + diffuse_dimension));
    if (!(glm::dot(direction, start.geometric_normal) > 0.0F)) continue;
    const Ray ray{offset_origin(start, direction), direction};
    const Gathered gathered = gather_along(world, ray, stream, irradiance_at);
    glm::vec3 first = gathered.radiance - gathered.by_mirrors;
    if (rays.to_bright > 0 && first != glm::vec3(0.0F)) {
      const float cosine = glm::dot(start.normal, direction);
      first *= static_cast<float>(rays.along_cosine) * cosine * std::numbers::inv_pi_v<float> /
               mean_rays(world, bright, rays, ray, gathered.first, cosine);
    }
    result.irradiance += first + gathered.by_mirrors;
    dark += gathered.dark_back_side ? 1 : 0;
    nothing += gathered.nothing ? 1 : 0;
    ++traced;
  }
  result.irradiance *= std::numbers::pi_v<float> / static_cast<float>(rays.along_cosine);
  result.buried = 2 * dark > traced;
  return result;
}

void IrradianceCache::gather(const World& world, const CausticGuide& guide, const TracerOptions& options) {
  const std::size_t nodes = cells_.node_count();
  std::vector<std::uint8_t> buried[2];
  std::vector<std::uint8_t> given_up[2];
  const BrightSurfaces bright(world, seed_);
  for (int side = 0; side < 2; ++side) {
    total_.side[side].assign(nodes, glm::vec3(0.0F));
    buried[side].assign(nodes, 0);
    given_up[side].assign(nodes, 0);
  }

  const std::vector<std::uint32_t> first_to_caustics = rays_to_caustics(world, guide, options.cache_rays);
  Sides previous;
  for (int pass = 0; pass < options.cache_bounces; ++pass) {
    const auto direct = [&](const Surface& s, glm::vec2 u) {
      // Two samples that lie apart: mostly of two lights, or of two ends of one.
      return 0.5F * (direct_irradiance(world, s, u, false) +
                     direct_irradiance(world, s, glm::fract(u + 0.5F), false));
    };
    const auto indirect = [&](const Surface& s, glm::vec2) { return interpolate(previous, s); };
    const int rays =
        pass == 0 ? options.cache_rays
                  : std::max(options.cache_rays / kLaterShare, std::min(options.cache_rays, kProbeRays));
    Sides found;
    for (int side = 0; side < 2; ++side) {
      found.side[side].assign(nodes, glm::vec3(0.0F));
      parallel_for(nodes, 32, [&](std::size_t begin, std::size_t end) {
        for (std::size_t place = begin; place < end; ++place) {
          const std::uint32_t node = cells_.along_curve()[place];
          if (given_up[side][node] != 0) continue;
          poll_interrupt();
          const int own = rays_of(node, rays, pass == 0 ? kLeastRays : kLeastLaterRays);
          NodeRays of_node = node_rays(world, place, side, pass, pass == 0 ? kMostCausticShare * own : own);
          of_node.along_cosine = own;
          if (pass > 0) {
            found.side[side][node] = gather_node(world, bright, of_node, indirect).irradiance;
            continue;
          }
          if (!bright.empty()) of_node.to_bright = std::max(own / kBrightShare, 1);
          of_node.first_to_caustics = first_to_caustics[place];
          of_node.to_caustics = static_cast<int>(first_to_caustics[place + 1] - first_to_caustics[place]);
          const NodeGather gathered = gather_node(world, bright, of_node, direct);
          found.side[side][node] = gathered.irradiance;
          // The bounce of what these find is gathered by the next pass.
          if (!gathered.given_up) {
            found.side[side][node] += from_bright(world, bright, of_node);
            found.side[side][node] += node_caustics(world, guide, of_node);
          }
          buried[side][node] = gathered.buried ? 1 : 0;
          given_up[side][node] = gathered.given_up ? 1 : 0;
        }
      });
      share_rays(found.side[side], buried[side]);
      fill_buried(found.side[side], buried[side]);
      sharpen(world, found.side[side], buried[side]);
      for (std::size_t i = 0; i < nodes; ++i) total_.side[side][i] += found.side[side][i];
    }
    if (pass > 0 && pass + 1 == options.cache_bounces) add_further_bounces(previous, found);
    previous = std::move(found);
  }
}

std::vector<std::uint32_t> IrradianceCache::rays_to_caustics(const World& world, const CausticGuide& guide,
                                                             int rays) const {
  std::vector<std::uint32_t> first(cells_.node_count() + 1, 0);
  if (guide.knows_nothing()) return first;
  for (std::size_t place = 0; place < cells_.node_count(); ++place) {
    const std::uint32_t node = cells_.along_curve()[place];
    const float strength = CausticGuide::strength(guide.cell(cells_.position(world, node)));
    const float share =
        std::clamp(kRaysPerRootOfCaustics * std::sqrt(strength), 1.0F, static_cast<float>(kMostCausticShare));
    const auto own = static_cast<float>(rays_of(node, rays, kLeastRays));
    first[place + 1] = first[place] + static_cast<std::uint32_t>(share * own);
  }
  return first;
}

void IrradianceCache::add_further_bounces(const Sides& before, const Sides& last) {
  // A surface cannot pass on more than it got; a sum of few and noisy values may say so.
  constexpr double kMostPassedOn = 0.95;
  glm::dvec3 sum_before(0.0);
  glm::dvec3 sum_last(0.0);
  for (int side = 0; side < 2; ++side) {
    for (const glm::vec3& value : before.side[side]) sum_before += glm::dvec3(value);
    for (const glm::vec3& value : last.side[side]) sum_last += glm::dvec3(value);
  }
  glm::vec3 further(0.0F);
  for (int c = 0; c < 3; ++c) {
    if (!(sum_before[c] > 0.0)) continue;
    const double passed_on = std::min(sum_last[c] / sum_before[c], kMostPassedOn);
    further[c] = static_cast<float>(passed_on / (1.0 - passed_on));
  }
  for (int side = 0; side < 2; ++side) {
    for (std::size_t i = 0; i < last.side[side].size(); ++i) {
      total_.side[side][i] += further * last.side[side][i];
    }
  }
}

float IrradianceCache::ray_share(std::size_t node) const {
  return cells_.is_vertex(node) ? ray_share_[cells_.corners(node).front().object] : 1.0F;
}

int IrradianceCache::rays_of(std::size_t node, int rays, int least) const {
  const float share = ray_share(node);
  return std::max(static_cast<int>(share * static_cast<float>(rays)), std::min(rays, least));
}

void IrradianceCache::share_rays(std::vector<glm::vec3>& values,
                                 const std::vector<std::uint8_t>& buried) const {
  const std::vector<glm::vec3> gathered = values;
  parallel_for(values.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t node = begin; node < end; ++node) {
      if (buried[node] != 0 || ray_share(node) == 1.0F) continue;
      glm::vec3 sum(0.0F);
      int count = 0;
      cells_.visit_around(node, [&](std::uint32_t other) {
        if (buried[other] != 0) return;
        sum += gathered[other];
        ++count;
      });
      values[node] = sum / static_cast<float>(count);
    }
  });
}

void IrradianceCache::sharpen(const World& world, std::vector<glm::vec3>& values,
                              const std::vector<std::uint8_t>& buried) const {
  // On congruent triangles whose edges have the mean square m, light of Laplacian c is c m / 16 less in the
  // mean over a cell than what is interpolated, and the mean of a node's neighbours is c m / 4 above it.
  constexpr float kPart = 0.25F;
  // Of neighbours that lie to one side, as on a border, the mean tells of the light's slope instead.
  constexpr float kLeastSymmetry = 0.9F;
  const std::vector<glm::vec3> gathered = values;
  parallel_for(values.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t node = begin; node < end; ++node) {
      if (buried[node] != 0 || ray_share(node) < 1.0F) continue;
      const glm::vec3 here = cells_.position(world, node);
      glm::vec3 sum(0.0F);
      glm::vec3 steps(0.0F);
      float length = 0.0F;
      int count = 0;
      cells_.visit_around(node, [&](std::uint32_t other) {
        if (other == node || buried[other] != 0) return;
        const glm::vec3 step = cells_.position(world, other) - here;
        steps += step;
        length += glm::length(step);
        sum += gathered[other];
        ++count;
      });
      if (count == 0 || glm::length(steps) > (1.0F - kLeastSymmetry) * length) continue;
      const glm::vec3 bend = sum / static_cast<float>(count) - gathered[node];
      values[node] = glm::max(gathered[node] - kPart * bend, glm::vec3(0.0F));
    }
  });
}

void IrradianceCache::fill_buried(std::vector<glm::vec3>& values,
                                  const std::vector<std::uint8_t>& buried) const {
  // From the rim inwards, one ring of triangles per round.
  constexpr int kRounds = 16;
  std::vector<std::uint8_t> unknown = buried;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<std::pair<std::uint32_t, glm::vec3>> found;
    for (std::uint32_t node = 0; node < unknown.size(); ++node) {
      if (unknown[node] == 0) continue;
      glm::vec3 sum(0.0F);
      int count = 0;
      cells_.visit_around(node, [&](std::uint32_t other) {
        if (unknown[other] != 0) return;
        sum += values[other];
        ++count;
      });
      if (count > 0) found.emplace_back(node, sum / static_cast<float>(count));
    }
    if (found.empty()) return;
    for (const auto& [node, value] : found) {
      values[node] = value;
      unknown[node] = 0;
    }
  }
}

}  // namespace mirrorbake::tracing
