#include <algorithm>
#include <cmath>

#include "mirrorbake/core/bilinear.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/scene/scene.hpp"

namespace mirrorbake {
namespace {

// The coordinate in [0,1] that finds the same texels.
float wrapped(float x, TextureWrap wrap) {
  if (!std::isfinite(x)) return 0.0F;  // a transform of large coordinates may overflow
  if (wrap == TextureWrap::repeat) return x - std::floor(x);
  if (wrap == TextureWrap::clamp) return std::clamp(x, 0.0F, 1.0F);
  return 1.0F - std::abs(x - 2.0F * std::floor(0.5F * x) - 1.0F);
}

// `i` is at most one texel outside.
int wrapped(int i, int size, TextureWrap wrap) {
  if (wrap == TextureWrap::repeat) return i < 0 ? i + size : (i >= size ? i - size : i);
  return std::clamp(i, 0, size - 1);  // the mirror image of the border is the border
}

}  // namespace

glm::vec2 texture_coordinates(const TextureReference& reference, glm::vec2 uv) {
  if (reference.scale == glm::vec2(1.0F) && reference.rotation == 0.0F) {
    return {uv.x + reference.offset.x, uv.y - reference.offset.y};
  }
  const float c = std::cos(reference.rotation);
  const float s = std::sin(reference.rotation);
  const glm::vec2 scaled = reference.scale * glm::vec2(uv.x, 1.0F - uv.y);
  const glm::vec2 moved =
      glm::vec2(c * scaled.x + s * scaled.y, c * scaled.y - s * scaled.x) + reference.offset;
  return {moved.x, 1.0F - moved.y};
}

glm::vec3 texture_lookup(const Texture& texture, glm::vec2 uv) {
  if (texture.file) return texture.file->lookup(uv, 0.0F, texture.wrap_u, texture.wrap_v);
  const Image& image = texture.image;
  const BilinearCell<float> cell =
      bilinear_cell(wrapped(uv.x, texture.wrap_u) * static_cast<float>(image.width),
                    (1.0F - wrapped(uv.y, texture.wrap_v)) * static_cast<float>(image.height));
  const int x = cell.column;
  const int y = cell.row;
  const bool is_grey = image.channels.size() == 1;
  const auto texel = [&](int i, int j) {
    const float* p =
        image.at(wrapped(i, image.width, texture.wrap_u), wrapped(j, image.height, texture.wrap_v));
    return is_grey ? glm::vec3(*p) : glm::vec3(p[0], p[1], p[2]);
  };
  return cell.mix(texel(x, y), texel(x + 1, y), texel(x, y + 1), texel(x + 1, y + 1));
}

glm::vec3 texture_mean(const Texture& texture) {
  if (texture.file) return texture.file->mean();
  const Image& image = texture.image;
  const std::size_t channels = image.channels.size();
  glm::dvec3 sum(0.0);
  for (std::size_t i = 0; i < image.pixels.size(); i += channels) {
    for (std::size_t c = 0; c < 3; ++c) sum[static_cast<int>(c)] += image.pixels[i + (channels == 1 ? 0 : c)];
  }
  const std::size_t texels = image.pixels.size() / channels;
  return glm::vec3(sum / static_cast<double>(texels));
}

Image texture_image(const Texture& texture) {
  if (!texture.file) return texture.image;
  const TextureFile& file = *texture.file;
  Image image(file.width(), file.height(), {"R", "G", "B"});
  parallel_for(static_cast<std::size_t>(image.height), 16, [&](std::size_t first, std::size_t last) {
    for (int y = static_cast<int>(first); y < static_cast<int>(last); ++y) {
      for (int x = 0; x < image.width; ++x) {
        const glm::vec2 centre{(static_cast<float>(x) + 0.5F) / static_cast<float>(image.width),
                               1.0F - (static_cast<float>(y) + 0.5F) / static_cast<float>(image.height)};
        const glm::vec3 value = file.lookup(centre, 0.0F, TextureWrap::clamp, TextureWrap::clamp);
        float* pixel = image.at(x, y);
        for (int c = 0; c < 3; ++c) pixel[c] = value[c];
      }
    }
  });
  return image;
}

bool has_gaps(const Material& material) {
  return material.opacity_texture.texture >= 0 || material.opacity < material.opacity_cutoff.value_or(1.0F);
}

std::vector<int> materials_of(const Object& object) {
  std::vector<int> materials = object.part_materials;
  if (materials.empty()) return {object.material};
  std::sort(materials.begin(), materials.end());
  materials.erase(std::unique(materials.begin(), materials.end()), materials.end());
  return materials;
}

namespace {

template <typename Test>
bool any_material(const Scene& scene, const Object& object, const Test& test) {
  const std::vector<int> materials = materials_of(object);
  return std::any_of(materials.begin(), materials.end(),
                     [&](int index) { return test(scene.materials[static_cast<std::size_t>(index)]); });
}

}  // namespace

bool is_specular(const Scene& scene, const Object& object) {
  return any_material(scene, object, [](const Material& material) { return material.specular; });
}

bool has_gaps(const Scene& scene, const Object& object) {
  return any_material(scene, object, [](const Material& material) { return has_gaps(material); });
}

float opacity_at(const Scene& scene, const Material& material, glm::vec2 uv) {
  float opacity = material.opacity;
  if (material.opacity_texture.texture >= 0) opacity *= texture_lookup(scene, material.opacity_texture, uv).x;
  if (!material.opacity_cutoff) return opacity;
  return opacity >= *material.opacity_cutoff ? 1.0F : 0.0F;
}

glm::vec3 texture_lookup(const Scene& scene, const TextureReference& reference, glm::vec2 uv) {
  return texture_lookup(scene.textures[static_cast<std::size_t>(reference.texture)],
                        texture_coordinates(reference, uv));
}

}  // namespace mirrorbake
