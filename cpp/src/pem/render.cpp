#include "mirrorbake/pem/render.hpp"

#include <algorithm>
#include <numbers>
#include <string>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/envmap/reads.hpp"
#include "mirrorbake/surface/lookup.hpp"
#include "mirrorbake/surface/shells.hpp"

namespace mirrorbake {
namespace {

constexpr std::size_t kPixelsPerChunk = 1024;

std::size_t channels_of(const ShellMap& map) { return map.texels.size() / map.topology.texels(); }

glm::vec4 read(const ShellMap& map, const TexelReads& reads) {
  const std::size_t channels = channels_of(map);
  glm::vec4 value(0.0F, 0.0F, 0.0F, channels == 4 ? 0.0F : 1.0F);
  for (const TexelWeight& entry : reads) {
    const float* texel = map.texels.data() + channels * entry.texel;
    for (std::size_t k = 0; k < channels; ++k) {
      value[static_cast<int>(k)] += entry.weight * texel[k];
    }
  }
  return value;
}

void check_part(const std::string& name, const PartShells& shells, const SurfaceSamples& samples) {
  if (shells.empty()) throw InvalidArgument(name, "no shells", "at least one");
  for (std::size_t k = 0; k < shells.size(); ++k) {
    const std::string shell = name + "[" + std::to_string(k) + "]";
    const std::size_t texels = shells[k].topology.texels();
    if (shells[k].texels.size() != 3 * texels && shells[k].texels.size() != 4 * texels) {
      throw InvalidArgument(shell + ".texels", std::to_string(shells[k].texels.size()) + " numbers",
                            "3 or 4 for each of " + std::to_string(texels) + " texels");
    }
    validate(shells[k].proxy);
    const std::size_t known = shells[k].triangles.size();
    if (known == 0) continue;
    check_length("samples.triangle", samples.triangle.size(), samples.size());
    const auto unknown = std::find_if(samples.triangle.begin(), samples.triangle.end(),
                                      [known](std::uint32_t triangle) { return triangle >= known; });
    if (unknown != samples.triangle.end()) {
      throw InvalidArgument(
          shell + ".triangles", std::to_string(known) + " entries",
          "one per triangle of the reflector, of which number " + std::to_string(*unknown) + " is seen");
    }
  }
}

glm::vec3 incident_light(const SurfaceSamples& samples, std::size_t i, const PartShells& shells,
                         const RunTimeModel& model) {
  ShellComposite composite;
  for (const ShellMap& map : shells) {
    if (!map.triangles.empty() && map.triangles[samples.triangle[i]] == 0) continue;
    composite.add(read(map, lookup(samples, i, map.proxy, map.topology, model)));
    if (composite.transmittance() == 0.0F) break;
  }
  return composite.light();
}

void check_triangles_of(const SurfaceSamples& samples, std::span<const glm::uvec3> triangles,
                        const char* of_vertices, std::size_t vertices) {
  check_length("samples.triangle", samples.triangle.size(), samples.size());
  check_length("samples.barycentric", samples.barycentric.size(), samples.size());
  for (const glm::uvec3& triangle : triangles) {
    if (std::max({triangle.x, triangle.y, triangle.z}) >= vertices) {
      throw InvalidArgument(of_vertices, std::to_string(vertices) + " entries",
                            "one per vertex of the triangles");
    }
  }
  for (const std::uint32_t triangle : samples.triangle) {
    if (triangle >= triangles.size()) {
      throw InvalidArgument("samples.triangle", std::to_string(triangle),
                            "below " + std::to_string(triangles.size()));
    }
  }
}

template <typename Value>
Value interpolated(std::span<const Value> of_vertices, glm::uvec3 triangle, glm::vec2 weights) {
  return (1.0F - weights.x - weights.y) * of_vertices[triangle.x] + weights.x * of_vertices[triangle.y] +
         weights.y * of_vertices[triangle.z];
}

/// D of every sample from `irradiance_at(i, is_back)`.
template <typename IrradianceAt>
std::vector<glm::vec3> diffuse_of(const SurfaceSamples& samples, bool has_backs,
                                  const IrradianceAt& irradiance_at) {
  const bool is_sided = has_backs && !samples.back.empty();
  if (is_sided) check_length("samples.back", samples.back.size(), samples.size());
  std::vector<glm::vec3> diffuse(samples.size());
  parallel_for(samples.size(), 16384, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const glm::vec3 irradiance = irradiance_at(i, is_sided && samples.back[i] != 0);
      diffuse[i] = samples.albedo[i] * irradiance * std::numbers::inv_pi_v<float>;
      if (!samples.emission.empty()) diffuse[i] += samples.emission[i];
    }
  });
  return diffuse;
}

}  // namespace

Image render_reflector(const SurfaceSamples& samples, std::span<const PartShells> parts,
                       std::span<const glm::vec3> diffuse, const RunTimeModel& model) {
  check_lookup_arrays(samples);
  validate(model);
  for (std::size_t p = 0; p < parts.size(); ++p) {
    check_part("parts[" + std::to_string(p) + "]", parts[p], samples);
  }
  if (!samples.part.empty()) {
    const int last = *std::max_element(samples.part.begin(), samples.part.end());
    if (static_cast<std::size_t>(last) >= parts.size()) {
      throw InvalidArgument("parts", std::to_string(parts.size()) + " entries",
                            "at least " + std::to_string(last + 1) + ", one per part that is seen");
    }
  }
  if (!diffuse.empty()) check_length("diffuse", diffuse.size(), samples.size());

  Image image(samples.width, samples.height, {"R", "G", "B", "A"});
  const std::size_t pixels =
      static_cast<std::size_t>(samples.width) * static_cast<std::size_t>(samples.height);
  parallel_for(pixels, kPixelsPerChunk, [&](std::size_t begin, std::size_t end) {
    // Where each pixel's samples start: pixels are independent of each other, samples are in their order.
    const auto first = std::lower_bound(samples.pixel.begin(), samples.pixel.end(), begin);
    for (std::size_t i = static_cast<std::size_t>(first - samples.pixel.begin());
         i < samples.size() && samples.pixel[i] < end; ++i) {
      glm::vec3 light = samples.fresnel[i] * incident_light(samples, i, parts[samples.part[i]], model);
      if (!diffuse.empty()) light += diffuse[i];
      const float mean = 1.0F / static_cast<float>(samples.samples_in(samples.pixel[i]));
      float* pixel = image.pixels.data() + std::size_t{4} * samples.pixel[i];
      for (int k = 0; k < 3; ++k) pixel[k] += mean * light[k];
      pixel[3] += mean;
    }
  });
  return image;
}

std::vector<glm::vec4> shell_light(const SurfaceSamples& samples, const ShellMap& map,
                                   const RunTimeModel& model) {
  check_lookup_arrays(samples);
  validate(model);
  check_part("part", {map}, samples);
  std::vector<glm::vec4> light(samples.size(), glm::vec4(0.0F));
  parallel_for(samples.size(), kPixelsPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!map.triangles.empty() && map.triangles[samples.triangle[i]] == 0) continue;
      light[i] = read(map, lookup(samples, i, map.proxy, map.topology, model));
    }
  });
  return light;
}

std::vector<glm::vec3> diffuse_from_irradiance(const SurfaceSamples& samples,
                                               std::span<const glm::uvec3> triangles,
                                               std::span<const glm::vec3> vertex_irradiance,
                                               std::span<const glm::vec3> back_irradiance) {
  if (!back_irradiance.empty()) {
    check_length("back_irradiance", back_irradiance.size(), vertex_irradiance.size());
  }
  check_triangles_of(samples, triangles, "vertex_irradiance", vertex_irradiance.size());
  return diffuse_of(samples, !back_irradiance.empty(), [&](std::size_t i, bool is_back) {
    const glm::uvec3 triangle = triangles[samples.triangle[i]];
    const std::span<const glm::vec3> side = is_back ? back_irradiance : vertex_irradiance;
    return interpolated(side, triangle, samples.barycentric[i]);
  });
}

std::vector<glm::vec3> diffuse_from_lightmap(const SurfaceSamples& samples,
                                             std::span<const glm::uvec3> triangles,
                                             std::span<const glm::vec2> uvs, int size,
                                             std::span<const glm::vec3> lightmap,
                                             std::span<const glm::vec3> back_lightmap) {
  check_range("size", size, 1, 4096);
  const TexelTopology texels = TexelTopology::atlas(size, size);
  const auto count = static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
  check_length("lightmap", lightmap.size(), count, "size * size");
  if (!back_lightmap.empty()) check_length("back_lightmap", back_lightmap.size(), count, "size * size");
  check_triangles_of(samples, triangles, "uvs", uvs.size());
  return diffuse_of(samples, !back_lightmap.empty(), [&](std::size_t i, bool is_back) {
    const glm::vec2 uv = interpolated(uvs, triangles[samples.triangle[i]], samples.barycentric[i]);
    TexelReads reads;
    add_bilinear(texels, 0, {uv.x, 1.0F - uv.y, 0.0F}, 1.0F, reads);
    const std::span<const glm::vec3> side = is_back ? back_lightmap : lightmap;
    glm::vec3 irradiance(0.0F);
    for (const TexelWeight& read : reads) irradiance += read.weight * side[read.texel];
    return irradiance;
  });
}

}  // namespace mirrorbake
