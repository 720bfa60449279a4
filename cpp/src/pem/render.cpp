#include "mirrorbake/pem/render.hpp"

#include <algorithm>
#include <numbers>
#include <string>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"

namespace mirrorbake {
namespace {

constexpr std::size_t kPixelsPerChunk = 1024;

glm::vec4 read_local(std::span<const float> map, const CubeFootprint& footprint) {
  glm::vec4 value(0.0F);
  for (int t = 0; t < footprint.count; ++t) {
    const TexelWeight& entry = footprint.texels[static_cast<std::size_t>(t)];
    const float* texel = map.data() + std::size_t{4} * entry.texel;
    value += entry.weight * glm::vec4(texel[0], texel[1], texel[2], texel[3]);
  }
  return value;
}

glm::vec3 read_distant(std::span<const float> map, const CubeFootprint& footprint) {
  glm::vec3 value(0.0F);
  for (int t = 0; t < footprint.count; ++t) {
    const TexelWeight& entry = footprint.texels[static_cast<std::size_t>(t)];
    const float* texel = map.data() + std::size_t{3} * entry.texel;
    value += entry.weight * glm::vec3(texel[0], texel[1], texel[2]);
  }
  return value;
}

void check_length(const std::string& name, std::size_t length, std::size_t expected) {
  if (length != expected)
    throw InvalidArgument(name, std::to_string(length) + " entries", std::to_string(expected));
}

}  // namespace

Image render_reflector(const SurfaceSamples& samples, std::span<const PartMaps> parts,
                       const CubePyramidLayout& layout, std::span<const glm::vec3> diffuse,
                       const LookupOptions& options) {
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const std::string name = "parts[" + std::to_string(p) + "]";
    if (!parts[p].local.empty()) {
      check_length(name + ".local", parts[p].local.size(), 4 * layout.texels());
      validate(parts[p].local_proxy);
    }
    check_length(name + ".distant", parts[p].distant.size(), 3 * layout.texels());
    validate(parts[p].distant_proxy);
  }
  if (!samples.part.empty()) {
    const int last = *std::max_element(samples.part.begin(), samples.part.end());
    if (static_cast<std::size_t>(last) >= parts.size()) {
      throw InvalidArgument("parts", std::to_string(parts.size()) + " entries",
                            "at least " + std::to_string(last + 1) + ", one per part that is seen");
    }
  }
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const std::size_t known = parts[p].local_triangles.size();
    if (known == 0) continue;
    check_length("samples.triangle", samples.triangle.size(), samples.size());
    const auto unknown = std::find_if(samples.triangle.begin(), samples.triangle.end(),
                                      [known](std::uint32_t triangle) { return triangle >= known; });
    if (unknown != samples.triangle.end()) {
      throw InvalidArgument(
          "parts[" + std::to_string(p) + "].local_triangles", std::to_string(known) + " entries",
          "one per triangle of the reflector, of which number " + std::to_string(*unknown) + " is seen");
    }
  }
  if (!diffuse.empty()) check_length("diffuse", diffuse.size(), samples.size());

  // Where each pixel's samples start: pixels are independent of each other, samples are in their order.
  Image image(samples.width, samples.height, {"R", "G", "B", "A"});
  const std::size_t pixels =
      static_cast<std::size_t>(samples.width) * static_cast<std::size_t>(samples.height);
  parallel_for(pixels, kPixelsPerChunk, [&](std::size_t begin, std::size_t end) {
    const auto first = std::lower_bound(samples.pixel.begin(), samples.pixel.end(), begin);
    const float mean = 1.0F / static_cast<float>(samples.samples_per_pixel);
    for (std::size_t i = static_cast<std::size_t>(first - samples.pixel.begin());
         i < samples.size() && samples.pixel[i] < end; ++i) {
      const PartMaps& maps = parts[samples.part[i]];
      glm::vec3 light =
          read_distant(maps.distant, lookup_footprint(samples, i, maps.distant_proxy, layout, options));
      if (!maps.local.empty() &&
          (maps.local_triangles.empty() || maps.local_triangles[samples.triangle[i]] != 0)) {
        const glm::vec4 local =
            read_local(maps.local, lookup_footprint(samples, i, maps.local_proxy, layout, options));
        light = glm::vec3(local) + (1.0F - local.a) * light;
      }
      light *= samples.fresnel[i];
      if (!diffuse.empty()) light += diffuse[i];
      float* pixel = image.pixels.data() + std::size_t{4} * samples.pixel[i];
      for (int k = 0; k < 3; ++k) pixel[k] += mean * light[k];
      pixel[3] += mean;
    }
  });
  return image;
}

std::vector<glm::vec3> diffuse_from_irradiance(const SurfaceSamples& samples,
                                               std::span<const glm::uvec3> triangles,
                                               std::span<const glm::vec3> vertex_irradiance) {
  for (const glm::uvec3& triangle : triangles) {
    if (std::max({triangle.x, triangle.y, triangle.z}) >= vertex_irradiance.size()) {
      throw InvalidArgument("vertex_irradiance", std::to_string(vertex_irradiance.size()) + " entries",
                            "one per vertex of the triangles");
    }
  }
  std::vector<glm::vec3> diffuse(samples.size());
  parallel_for(samples.size(), 16384, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (samples.triangle[i] >= triangles.size()) {
        throw InvalidArgument("samples.triangle", std::to_string(samples.triangle[i]),
                              "below " + std::to_string(triangles.size()));
      }
      const glm::uvec3 triangle = triangles[samples.triangle[i]];
      const glm::vec2 b = samples.barycentric[i];
      const glm::vec3 irradiance = (1.0F - b.x - b.y) * vertex_irradiance[triangle.x] +
                                   b.x * vertex_irradiance[triangle.y] + b.y * vertex_irradiance[triangle.z];
      diffuse[i] = samples.albedo[i] * irradiance * std::numbers::inv_pi_v<float>;
    }
  });
  return diffuse;
}

}  // namespace mirrorbake
