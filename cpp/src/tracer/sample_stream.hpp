#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mirrorbake/core/sampling.hpp"

namespace mirrorbake::tracing {

/// The random numbers of one sample of one pixel (or texel, or vertex): value number `dimension` depends on
/// the stream's coordinates alone, so that every integrator sees the same numbers at the same place.
struct SampleStream {
  std::uint64_t key = 0;    ///< hash of seed and pixel
  std::uint32_t index = 0;  ///< number of the sample in its pixel

  glm::vec2 get(std::uint32_t dimension) const { return sobol_2d(index, hash64(key ^ dimension)); }
  /// The same without stratification, four times as fast.
  glm::vec2 get_independent(std::uint32_t dimension) const {
    const std::uint64_t bits = hash64(key ^ dimension, index);
    return {unit_float(static_cast<std::uint32_t>(bits >> 32)), unit_float(static_cast<std::uint32_t>(bits))};
  }
};

inline SampleStream sample_stream(std::uint64_t seed, std::uint64_t pixel, std::uint32_t index) {
  return {hash64(seed, pixel), index};
}

/// Where each use finds its numbers: for every bounce of the specular path that starts at the eye, the
/// vertices of the diffuse path that leaves it there, and the uses at each of them.
enum Dimension : std::uint32_t {
  camera_dimension = 0,   ///< of the first vertex
  rough_dimension = 0,    ///< direction in a rough lobe; the first vertex's is found one bounce on
  light_dimension = 1,    ///< next-event estimation
  diffuse_dimension = 2,  ///< direction of a diffuse bounce
  lobe_dimension = 3,     ///< choice of a lobe and Russian roulette
  guide_dimension = 4,    ///< guided ray; then light and direction at each rough surface on its way
  dimensions_per_vertex = 16,
  vertices_per_bounce = 256,
};

/// First dimension of vertex `vertex` of the diffuse path that leaves mirror bounce `bounce`.
inline std::uint32_t dimension_base(int bounce, int vertex) {
  return (static_cast<std::uint32_t>(bounce) * vertices_per_bounce + static_cast<std::uint32_t>(vertex)) *
         dimensions_per_vertex;
}

/// Orthonormal tangents of a unit vector (Duff et al., Building an Orthonormal Basis, Revisited, JCGT 6(1),
/// 2017).
struct Frame {
  glm::vec3 tangent;
  glm::vec3 bitangent;
  glm::vec3 normal;

  explicit Frame(glm::vec3 n) : normal(n) {
    const float sign = std::copysign(1.0F, n.z);
    const float a = -1.0F / (sign + n.z);
    const float b = n.x * n.y * a;
    tangent = {1.0F + sign * n.x * n.x * a, sign * b, -sign * n.x};
    bitangent = {b, sign + n.y * n.y * a, -n.y};
  }
  glm::vec3 to_local(glm::vec3 v) const {
    return {glm::dot(v, tangent), glm::dot(v, bitangent), glm::dot(v, normal)};
  }
  glm::vec3 to_world(glm::vec3 v) const { return v.x * tangent + v.y * bitangent + v.z * normal; }
};

/// Direction about `normal` with density cos/π.
inline glm::vec3 sample_cosine_hemisphere(const Frame& frame, glm::vec2 u) {
  const float radius = std::sqrt(u.x);
  const float phi = 2.0F * std::numbers::pi_v<float> * u.y;
  const float z = std::sqrt(std::max(0.0F, 1.0F - u.x));
  return glm::normalize(frame.to_world({radius * std::cos(phi), radius * std::sin(phi), z}));
}

}  // namespace mirrorbake::tracing
