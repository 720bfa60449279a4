#include <string>
#include <variant>

#include <glm/geometric.hpp>

#include "lookup_formulas.hpp"
#include "lookup_kernels.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/isa.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/proxy/proxy.hpp"

namespace mirrorbake {

const LookupKernels& lookup_kernels() {
#ifdef MIRRORBAKE_HAS_X86_LEVELS
  switch (active_isa()) {
    case Isa::avx512: return avx512::kLookupKernels;
    case Isa::avx2: return avx2::kLookupKernels;
    case Isa::sse42: return sse42::kLookupKernels;
    case Isa::baseline: break;
  }
#endif
  return baseline::kLookupKernels;
}

namespace {

void set(double (&to)[3], glm::vec3 from) {
  for (int i = 0; i < 3; ++i) to[i] = static_cast<double>(from[i]);
}

void set_frame(LookupConstants& k, glm::vec3 centre, const glm::mat3& proxy_from_world, glm::dvec3 scale) {
  set(k.centre, centre);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      k.rows[3 * row + column] = scale[row] * static_cast<double>(proxy_from_world[column][row]);
    }
  }
  k.rotated = proxy_from_world != glm::mat3(1.0F);
}

void set_shape(LookupConstants&, const InfiniteSphere&) {}

void set_shape(LookupConstants& k, const Box& box) {
  k.shape = LookupShape::box;
  set_frame(k, box.centre, box.proxy_from_world, glm::dvec3(1.0));
  set(k.extent, box.half_extent);
}

void set_shape(LookupConstants& k, const Ellipsoid& ellipsoid) {
  k.shape = LookupShape::ellipsoid;
  set_frame(k, ellipsoid.centre, ellipsoid.proxy_from_world, 1.0 / glm::dvec3(ellipsoid.radii));
}

void set_shape(LookupConstants& k, const Hemisphere& dome) {
  k.shape = LookupShape::hemisphere;
  set_frame(k, dome.centre, dome.proxy_from_world, glm::dvec3(1.0 / static_cast<double>(dome.radius)));
}

LookupConstants constants(const Proxy& proxy) {
  LookupConstants k;
  std::visit([&](const auto& shape) { set_shape(k, shape); }, proxy.shape);
  set(k.origin, proxy.origin);
  return k;
}

template <typename Vector>
Vector lookup_one(const Proxy& proxy, const Vector& position, const Vector& direction) {
  using baseline::Vec;
  const LookupConstants k = constants(proxy);
  const Vec p = {static_cast<double>(position.x), static_cast<double>(position.y),
                 static_cast<double>(position.z)};
  const Vec d = {static_cast<double>(direction.x), static_cast<double>(direction.y),
                 static_cast<double>(direction.z)};
  Vec h = d;
  switch (k.shape) {
    case LookupShape::infinite: break;
    case LookupShape::box: h = baseline::lookup<LookupShape::box, true>(k, p, d); break;
    case LookupShape::ellipsoid: h = baseline::lookup<LookupShape::ellipsoid, true>(k, p, d); break;
    case LookupShape::hemisphere: h = baseline::lookup<LookupShape::hemisphere, true>(k, p, d); break;
  }
  return Vector(glm::dvec3(h.x, h.y, h.z));
}

void check_lengths(const char* names, std::size_t a, std::size_t b, std::size_t c) {
  if (a == b && b == c) return;
  throw InvalidArgument(names,
                        std::to_string(a) + ", " + std::to_string(b) + ", " + std::to_string(c) + " elements",
                        "spans of one length");
}

/// Rays per task: some 50 µs.
constexpr std::size_t kGrain = 16384;

}  // namespace

glm::vec3 lookup_direction(const Proxy& proxy, glm::vec3 position, glm::vec3 direction) {
  return lookup_one(proxy, position, direction);
}

glm::dvec3 lookup_direction(const Proxy& proxy, glm::dvec3 position, glm::dvec3 direction) {
  return lookup_one(proxy, position, direction);
}

void lookup_directions(const Proxy& proxy, std::span<const glm::vec3> positions,
                       std::span<const glm::vec3> directions, std::span<glm::vec3> lookups) {
  check_lengths("positions, directions, lookups", positions.size(), directions.size(), lookups.size());
  const LookupConstants k = constants(proxy);
  parallel_for(positions.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    lookup_kernels().rays_f32(k, &positions[begin].x, &directions[begin].x, &lookups[begin].x, end - begin);
  });
}

void lookup_directions(const Proxy& proxy, std::span<const glm::dvec3> positions,
                       std::span<const glm::dvec3> directions, std::span<glm::dvec3> lookups) {
  check_lengths("positions, directions, lookups", positions.size(), directions.size(), lookups.size());
  const LookupConstants k = constants(proxy);
  parallel_for(positions.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    lookup_kernels().rays_f64(k, &positions[begin].x, &directions[begin].x, &lookups[begin].x, end - begin);
  });
}

void mirror_lookups(const Proxy& proxy, glm::vec3 eye, std::span<const glm::vec3> positions,
                    std::span<const glm::vec3> normals, std::span<glm::vec3> lookups) {
  check_lengths("positions, normals, lookups", positions.size(), normals.size(), lookups.size());
  const LookupConstants k = constants(proxy);
  double e[3];
  set(e, eye);
  parallel_for(positions.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    lookup_kernels().mirrors_f32(k, e, &positions[begin].x, &normals[begin].x, &lookups[begin].x,
                                 end - begin);
  });
}

bool all_finite(std::span<const glm::vec3> vectors) {
  return vectors.empty() || lookup_kernels().all_finite_f32(&vectors[0].x, 3 * vectors.size());
}

bool all_finite(std::span<const glm::dvec3> vectors) {
  return vectors.empty() || lookup_kernels().all_finite_f64(&vectors[0].x, 3 * vectors.size());
}

}  // namespace mirrorbake
