#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

namespace mirrorbake {

/// The light that the reflected rays of SurfaceSamples bring from one shell of the environment ([PEM] §4 has
/// two, "this method easily generalizes"): what a ray meets first of the shell's own kind, with the shells in
/// front of it left out. One entry per sample.
struct ShellLight {
  std::string name;
  std::vector<glm::vec4> radiance;  ///< incident, premultiplied, and α; in the last shell α is 1
  std::vector<float> hit_distance;  ///< along the ray to what it meets, metres; +inf: nothing
};

/// Where the samples of an image's pixels first meet the reflector: what a renderer with environment maps
/// needs to know, and so the common ground of the rendering matrix and of the run time. One entry per sample
/// that sees the reflector; all arrays have the same length or, where marked, may be empty. Entries are
/// ordered by pixel, then by sample.
struct SurfaceSamples {
  int width = 0;   ///< of the image, pixels
  int height = 0;  ///< of the image, pixels
  int samples_per_pixel = 0;
  /// Where in the scene the positions' zero is: 0, but for scenes far from their own zero, where float
  /// positions would be coarser than lookups may be.
  glm::dvec3 origin{0.0};
  /// Samples traced per pixel, whatever they saw: one entry per pixel, or none if all are
  /// `samples_per_pixel`.
  std::vector<std::uint32_t> pixel_samples;

  std::vector<std::uint32_t> pixel;     ///< y · width + x
  std::vector<std::uint16_t> part;      ///< part of the reflector
  std::vector<std::uint32_t> triangle;  ///< of the reflector's mesh
  std::vector<glm::vec2> barycentric;   ///< weights of the triangle's second and third vertex
  std::vector<glm::vec3> position;      ///< relative to `origin`
  /// Unit shading normal, towards the eye. Where the mesh's interpolated normal would reflect the view into
  /// the surface it is bent until the reflection just leaves it.
  std::vector<glm::vec3> normal;
  std::vector<glm::vec3> reflection;  ///< unit direction r = 2(n·v)n − v

  /// Change of `position` and `reflection` per pixel to the right (dx) and down (dy): ray differentials
  /// (Igehy, SIGGRAPH 1999), the point sliding in its triangle's plane, the normal interpolated. Bounded:
  /// near the silhouette the cosine to the plane is taken as 0.1 at least, and a change of direction as 2 at
  /// most.
  std::vector<glm::vec3> dposition_dx, dposition_dy;
  std::vector<glm::vec3> dreflection_dx, dreflection_dy;

  std::vector<glm::vec3> fresnel;   ///< F of the first bounce, per channel
  std::vector<glm::vec3> albedo;    ///< diffuse albedo with texture, times (1 − F) under a coat
  std::vector<glm::vec3> emission;  ///< radiance of the surface's own; empty: none
  std::vector<std::uint8_t> back;   ///< 1 where the eye sees the back of the triangle; empty: nowhere

  // The light that was traced; empty when only visibility was asked for.
  std::vector<glm::vec3> diffuse;  ///< D: radiance that the body reflects and emits, one entry per sample
  /// Front to back, so that the incident radiance is L₀ + (1 − α₀)(L₁ + (1 − α₁)(…)).
  std::vector<ShellLight> shells;

  std::size_t size() const { return pixel.size(); }
  /// Samples traced in pixel number `p`.
  std::uint32_t samples_in(std::size_t p) const {
    return pixel_samples.empty() ? static_cast<std::uint32_t>(samples_per_pixel) : pixel_samples[p];
  }
};

}  // namespace mirrorbake
