#include <atomic>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <glm/geometric.hpp>

#include "lookup_constants.hpp"
#include "lookup_formulas.hpp"
#include "lookup_kernels.hpp"
#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/isa.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/text.hpp"
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

template <typename Vector>
Vector lookup_one(const Proxy& proxy, const Vector& position, const Vector& direction) {
  using baseline::Vec;
  const LookupConstants k = lookup_constants(proxy);
  const Vec p = {static_cast<double>(position.x), static_cast<double>(position.y),
                 static_cast<double>(position.z)};
  const Vec d = {static_cast<double>(direction.x), static_cast<double>(direction.y),
                 static_cast<double>(direction.z)};
  Vec h = d;
  baseline::with_shape(k.shape, [&]<LookupShape shape>() { h = baseline::lookup<shape, true>(k, p, d); });
  return Vector(glm::dvec3(h.x, h.y, h.z));
}

/// Throws for the first NaN or infinite value in the row, if there is one.
template <typename Vector>
void check_row(std::string_view name, std::span<const Vector> vectors, std::size_t row) {
  if (is_finite(vectors[row])) return;
  throw InvalidArgument(name, text_of(vectors[row]) + " in row " + std::to_string(row), "finite");
}

/// Rays per task: some 50 µs.
constexpr std::size_t kGrain = 16384;

/// Runs `kernel(positions, seconds, lookups, count)`, which says how many it is done with, on all rays; there
/// are `proxy_count` lookups for each.
template <typename Vector, typename Kernel>
void map_rays(std::span<const Vector> positions, std::string_view second_name,
              std::span<const Vector> seconds, std::span<Vector> lookups, std::size_t proxy_count,
              Kernel kernel) {
  const std::size_t count = positions.size();
  if (seconds.size() != count) {
    throw InvalidArgument(second_name, std::to_string(seconds.size()) + " elements",
                          "as many as positions: " + std::to_string(count));
  }
  if (lookups.size() != proxy_count * count) {
    throw InvalidArgument("lookups", std::to_string(lookups.size()) + " elements",
                          "one for each position and proxy: " + std::to_string(proxy_count * count));
  }
  std::atomic<std::size_t> first_left = count;
  parallel_for(count, kGrain, [&](std::size_t begin, std::size_t end) {
    const std::size_t done =
        begin + kernel(&positions[begin].x, &seconds[begin].x, &lookups[begin].x, end - begin);
    if (done == end) return;
    std::size_t known = first_left;
    while (done < known && !first_left.compare_exchange_weak(known, done)) {
    }
  });
  // The rows of the block that was left hold what they held, even where the results replace them.
  for (std::size_t row = first_left; row < count; ++row) {
    check_row("positions", positions, row);
    check_row(second_name, seconds, row);
  }
}

}  // namespace

glm::vec3 lookup_direction(const Proxy& proxy, glm::vec3 position, glm::vec3 direction) {
  return lookup_one(proxy, position, direction);
}

glm::dvec3 lookup_direction(const Proxy& proxy, glm::dvec3 position, glm::dvec3 direction) {
  return lookup_one(proxy, position, direction);
}

void lookup_directions(const Proxy& proxy, std::span<const glm::vec3> positions,
                       std::span<const glm::vec3> directions, std::span<glm::vec3> lookups) {
  const LookupConstants k = lookup_constants(proxy);
  map_rays(positions, "directions", directions, lookups, 1,
           [&](const float* p, const float* d, float* l, std::size_t count) {
             return lookup_kernels().rays_f32(k, p, d, l, count);
           });
}

void lookup_directions(const Proxy& proxy, std::span<const glm::dvec3> positions,
                       std::span<const glm::dvec3> directions, std::span<glm::dvec3> lookups) {
  const LookupConstants k = lookup_constants(proxy);
  map_rays(positions, "directions", directions, lookups, 1,
           [&](const double* p, const double* d, double* l, std::size_t count) {
             return lookup_kernels().rays_f64(k, p, d, l, count);
           });
}

void mirror_lookups(std::span<const Proxy> proxies, glm::vec3 eye, std::span<const glm::vec3> positions,
                    std::span<const glm::vec3> normals, std::span<glm::vec3> lookups) {
  if (proxies.empty()) throw InvalidArgument("proxies", "empty", "at least one");
  check_finite("eye", eye);
  std::vector<LookupConstants> k;
  for (const Proxy& proxy : proxies) k.push_back(lookup_constants(proxy));
  const double e[3] = {static_cast<double>(eye.x), static_cast<double>(eye.y), static_cast<double>(eye.z)};
  map_rays(positions, "normals", normals, lookups, k.size(),
           [&](const float* p, const float* n, float* l, std::size_t count) {
             return lookup_kernels().mirrors_f32(k.data(), k.size(), e, p, n, l, positions.size(), count);
           });
}

}  // namespace mirrorbake
