#include "irradiance_cache.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "barycentric.hpp"
#include "gather.hpp"
#include "mirrorbake/core/interrupt.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "world.hpp"

namespace mirrorbake::tracing {
namespace {

// Rays after which a hemisphere inside a closed body is given up.
constexpr int kProbeRays = 16;
// Later passes gather light that is dimmer and smoother than the first one's: a quarter of the rays will do.
constexpr int kLaterShare = 4;
// Caustics are as sharp as the mirrors: as many times the rays of the first pass, where there are any.
constexpr int kCausticShare = 4;
// Corners of a flat-shaded mesh share a slot if their faces differ by less than acos(0.999) = 2.6°.
constexpr float kSameFace = 0.999F;
// Slots of an object up to which each takes all of its rays; beyond it the object's rays are as many as these
// have, down to a share that the mean with a vertex and its ring of six makes up for.
constexpr float kSlotsWithAllRays = 16384.0F;
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
    : seed_(options.seed) {
  assign_slots(world);
  gather(world, guide, options);
}

void IrradianceCache::assign_slots(const World& world) {
  slot_of_corner_.resize(world.scene.objects.size());
  ray_share_.assign(world.scene.objects.size(), 1.0F);
  std::uint32_t slots = 0;
  for (std::size_t o = 0; o < world.scene.objects.size(); ++o) {
    const Object& object = world.scene.objects[o];
    const std::vector<int> materials = materials_of(object);
    if (std::all_of(materials.begin(), materials.end(), [&](int material) {
          return world.scene.materials[static_cast<std::size_t>(material)].albedo == glm::vec3(0.0F);
        })) {
      continue;
    }
    const TriangleMesh& mesh = object.mesh;
    std::vector<std::uint32_t>& slot = slot_of_corner_[o];
    const std::uint32_t before = slots;
    slot.resize(3 * mesh.triangles.size(), kNoSlot);
    if (!mesh.normals.empty()) {
      std::vector<std::uint32_t> slot_of_vertex(mesh.positions.size(), kNoSlot);
      for (std::size_t i = 0; i < slot.size(); ++i) {
        std::uint32_t& s = slot_of_vertex[mesh.triangles[i / 3][static_cast<int>(i % 3)]];
        if (s == kNoSlot) s = slots++;
        slot[i] = s;
      }
    } else {
      // A chain per vertex of the slots made there so far, each with the face normal that it stands for.
      struct Entry {
        glm::vec3 normal;
        std::uint32_t slot;
        std::uint32_t next;
      };
      std::vector<Entry> entries;
      std::vector<std::uint32_t> first(mesh.positions.size(), kNoSlot);
      for (std::size_t i = 0; i < slot.size(); ++i) {
        const auto triangle = static_cast<std::uint32_t>(i / 3);
        const glm::vec3 n = face_normal(world, static_cast<std::uint32_t>(o), triangle);
        std::uint32_t& head = first[mesh.triangles[triangle][static_cast<int>(i % 3)]];
        std::uint32_t e = head;
        while (e != kNoSlot && glm::dot(entries[e].normal, n) < kSameFace) e = entries[e].next;
        if (e == kNoSlot) {
          entries.push_back({n, slots++, head});
          e = head = static_cast<std::uint32_t>(entries.size() - 1);
        }
        slot[i] = entries[e].slot;
      }
    }
    ray_share_[o] = std::clamp(kSlotsWithAllRays / static_cast<float>(slots - before), kLeastShare, 1.0F);
  }

  first_corner_.assign(slots + 1, 0);
  for (const auto& object : slot_of_corner_) {
    for (std::uint32_t s : object) ++first_corner_[s + 1];
  }
  for (std::size_t s = 0; s < slots; ++s) first_corner_[s + 1] += first_corner_[s];
  corners_.resize(first_corner_.back());
  std::vector<std::uint32_t> next(first_corner_.begin(), first_corner_.end() - 1);
  for (std::size_t o = 0; o < slot_of_corner_.size(); ++o) {
    for (std::size_t i = 0; i < slot_of_corner_[o].size(); ++i) {
      corners_[next[slot_of_corner_[o][i]]++] = {static_cast<std::uint32_t>(o),
                                                 static_cast<std::uint32_t>(i / 3),
                                                 static_cast<std::uint32_t>(i % 3)};
    }
  }
}

glm::vec3 IrradianceCache::interpolate(const Sides& values, const Surface& surface) const {
  const std::vector<std::uint32_t>& slots = slot_of_corner_[static_cast<std::size_t>(surface.object)];
  if (slots.empty()) return glm::vec3(0.0F);
  const std::uint32_t* slot = &slots[3 * std::size_t{surface.triangle}];
  const std::vector<glm::vec3>& value = values.side[surface.front ? 0 : 1];
  return tracing::interpolate(value, {slot[0], slot[1], slot[2]}, surface.barycentric);
}

std::array<Surface, IrradianceCache::kStartPoints> IrradianceCache::start_points(const World& world,
                                                                                 std::size_t slot, int side,
                                                                                 std::uint32_t count) const {
  const std::uint32_t first = first_corner_[slot];
  const std::uint32_t corners = first_corner_[slot + 1] - first;
  std::array<Surface, kStartPoints> starts;
  for (std::uint32_t i = 0; i < count; ++i) {
    const SampleStream stream = sample_stream(seed_, side_number(slot, side), i);
    const TriangleCorner& corner = corners_[first + i % corners];
    const glm::vec3 n = face_normal(world, corner.object, corner.triangle);
    starts[i] = surface_near_corner(world, corner, stream.get(dimension_base(0, 1)), side == 0 ? n : -n);
  }
  return starts;
}

glm::vec3 IrradianceCache::slot_caustics(const World& world, const CausticGuide& guide, std::size_t slot,
                                         int side, int rays) const {
  if (guide.knows_nothing()) return glm::vec3(0.0F);
  const auto start_count = std::min(kStartPoints, static_cast<std::uint32_t>(rays));
  const std::array<Surface, kStartPoints> starts = start_points(world, slot, side, start_count);
  glm::vec3 sum(0.0F);
  for (int r = 0; r < rays; ++r) {
    const auto index = static_cast<std::uint32_t>(r);
    sum += caustic_irradiance(world, guide, starts[index % start_count],
                              sample_stream(seed_, side_number(slot, side), index));
  }
  return sum / static_cast<float>(rays);
}

template <typename IrradianceAt>
IrradianceCache::SlotGather IrradianceCache::gather_slot(const World& world, std::size_t slot, int side,
                                                         int rays, const IrradianceAt& irradiance_at) const {
  const std::uint64_t number = side_number(slot, side);
  const auto start_count = std::min(kStartPoints, static_cast<std::uint32_t>(rays));
  const std::array<Surface, kStartPoints> starts = start_points(world, slot, side, start_count);

  SlotGather result;
  int traced = 0;
  int dark = 0;
  int nothing = 0;
  // A slot with a share of the rays is given up as early in them as others are.
  const int probe_rays = rays_of(slot, kProbeRays, kLeastRays);
  for (int r = 0; r < rays; ++r) {
    const bool hopeless = dark == traced || (side == 1 && dark + nothing == traced);
    if (r == probe_rays && hopeless) {
      result.given_up = true;
      break;
    }
    const auto index = static_cast<std::uint32_t>(r);
    const SampleStream stream = sample_stream(seed_, number, index);
    const Surface& start = starts[index % start_count];
    const glm::vec3 direction =
        sample_cosine_hemisphere(Frame(start.normal), stream.get(dimension_base(0, 0) + diffuse_dimension));
    if (!(glm::dot(direction, start.geometric_normal) > 0.0F)) continue;
    const Gathered gathered =
        gather_along(world, {offset_origin(start, direction), direction}, stream, irradiance_at);
    result.irradiance += gathered.radiance;
    dark += gathered.dark_back_side ? 1 : 0;
    nothing += gathered.nothing ? 1 : 0;
    ++traced;
  }
  result.irradiance *= std::numbers::pi_v<float> / static_cast<float>(rays);
  result.buried = 2 * dark > traced;
  return result;
}

void IrradianceCache::gather(const World& world, const CausticGuide& guide, const TracerOptions& options) {
  const std::size_t slots = first_corner_.size() - 1;
  std::vector<std::uint8_t> buried[2];
  std::vector<std::uint8_t> given_up[2];
  for (int side = 0; side < 2; ++side) {
    total_.side[side].assign(slots, glm::vec3(0.0F));
    buried[side].assign(slots, 0);
    given_up[side].assign(slots, 0);
  }

  Sides previous;
  for (int pass = 0; pass < options.cache_bounces; ++pass) {
    const auto direct = [&](const Surface& s, glm::vec2 u) { return direct_irradiance(world, s, u, false); };
    const auto indirect = [&](const Surface& s, glm::vec2) { return interpolate(previous, s); };
    const int rays =
        pass == 0 ? options.cache_rays
                  : std::max(options.cache_rays / kLaterShare, std::min(options.cache_rays, kProbeRays));
    Sides found;
    for (int side = 0; side < 2; ++side) {
      found.side[side].assign(slots, glm::vec3(0.0F));
      parallel_for(slots, 32, [&](std::size_t begin, std::size_t end) {
        for (std::size_t slot = begin; slot < end; ++slot) {
          if (given_up[side][slot] != 0) continue;
          poll_interrupt();
          const int own = rays_of(slot, rays, pass == 0 ? kLeastRays : kLeastLaterRays);
          const SlotGather gathered = pass == 0 ? gather_slot(world, slot, side, own, direct)
                                                : gather_slot(world, slot, side, own, indirect);
          found.side[side][slot] = gathered.irradiance;
          if (pass > 0) continue;
          // Their bounce is gathered by the next pass.
          if (!gathered.given_up) {
            found.side[side][slot] += slot_caustics(world, guide, slot, side, kCausticShare * own);
          }
          buried[side][slot] = gathered.buried ? 1 : 0;
          given_up[side][slot] = gathered.given_up ? 1 : 0;
        }
      });
      share_rays(found.side[side], buried[side]);
      fill_buried(found.side[side], buried[side]);
      for (std::size_t i = 0; i < slots; ++i) total_.side[side][i] += found.side[side][i];
    }
    previous = std::move(found);
  }
}

int IrradianceCache::rays_of(std::size_t slot, int rays, int least) const {
  const float share = ray_share_[corners_[first_corner_[slot]].object];
  return std::max(static_cast<int>(share * static_cast<float>(rays)), std::min(rays, least));
}

void IrradianceCache::share_rays(std::vector<glm::vec3>& values,
                                 const std::vector<std::uint8_t>& buried) const {
  const std::vector<glm::vec3> gathered = values;
  parallel_for(values.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t slot = begin; slot < end; ++slot) {
      const std::uint32_t first = first_corner_[slot];
      if (buried[slot] != 0 || ray_share_[corners_[first].object] == 1.0F) continue;
      glm::vec3 sum(0.0F);
      int count = 0;
      for (std::uint32_t c = first; c < first_corner_[slot + 1]; ++c) {
        const std::uint32_t* triangle =
            &slot_of_corner_[corners_[c].object][3 * std::size_t{corners_[c].triangle}];
        for (int k = 0; k < 3; ++k) {
          if (buried[triangle[k]] != 0) continue;
          sum += gathered[triangle[k]];
          ++count;
        }
      }
      values[slot] = sum / static_cast<float>(count);
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
    for (std::uint32_t slot = 0; slot < unknown.size(); ++slot) {
      if (unknown[slot] == 0) continue;
      glm::vec3 sum(0.0F);
      int count = 0;
      for (std::uint32_t c = first_corner_[slot]; c < first_corner_[slot + 1]; ++c) {
        const std::uint32_t* triangle =
            &slot_of_corner_[corners_[c].object][3 * std::size_t{corners_[c].triangle}];
        for (int k = 0; k < 3; ++k) {
          if (unknown[triangle[k]] != 0) continue;
          sum += values[triangle[k]];
          ++count;
        }
      }
      if (count > 0) found.emplace_back(slot, sum / static_cast<float>(count));
    }
    if (found.empty()) return;
    for (const auto& [slot, value] : found) {
      values[slot] = value;
      unknown[slot] = 0;
    }
  }
}

}  // namespace mirrorbake::tracing
