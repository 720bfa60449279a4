#include "gltf_materials.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <span>
#include <utility>

#include <glm/common.hpp>

#include "file_bytes.hpp"
#include "gltf_document.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake::gltf {
namespace {

// A lobe as narrow as this α is a mirror: most of it lies within 0.1°.
constexpr float kMirrorAlpha = 1e-3F;

TextureWrap wrap_of(const std::string& path, int mode) {
  switch (mode) {
    case TINYGLTF_TEXTURE_WRAP_REPEAT: return TextureWrap::repeat;
    case TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE: return TextureWrap::clamp;
    case TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT: return TextureWrap::mirror;
    default: fail(path, "sampler wrap mode is " + std::to_string(mode) + ", expected 10497, 33071 or 33648");
  }
}

glm::vec2 pair_property(const std::string& path, const tinygltf::Value& object, const char* key,
                        glm::vec2 default_value) {
  if (!object.Has(key)) return default_value;
  const tinygltf::Value& value = object.Get(key);
  glm::vec2 pair(0.0F);
  for (int i = 0; i < 2; ++i) {
    const bool is_good = value.ArrayLen() == 2 && value.Get(i).IsNumber();
    if (is_good) pair[i] = static_cast<float>(value.Get(i).GetNumberAsDouble());
    if (!is_good || !std::isfinite(pair[i])) {
      fail(path, std::string("KHR_texture_transform ") + key + " is not two finite numbers");
    }
  }
  return pair;
}

const tinygltf::Value* extension(const tinygltf::ExtensionMap& extensions, const char* name) {
  const auto it = extensions.find(name);
  return it == extensions.end() || !it->second.IsObject() ? nullptr : &it->second;
}

// Exporters round factors to a little more than 1.
float unit_factor(const std::string& path, const std::string& what, double value, Warnings& warnings) {
  if (!std::isfinite(value)) fail(path, what + " is " + text_of(value) + ", expected 0 to 1");
  if (value < 0.0 || value > 1.0) warnings.add(what + " is cut to 0 to 1");
  return static_cast<float>(std::clamp(value, 0.0, 1.0));
}

// The value in the middle of a texel of an image of some other size.
glm::vec3 resampled(const Image& image, int x, int y, int width, int height) {
  if (image.width == width && image.height == height) {
    const float* p = image.at(x, y);
    return image.channels.size() == 1 ? glm::vec3(*p) : glm::vec3(p[0], p[1], p[2]);
  }
  const float fx = std::clamp(
      (static_cast<float>(x) + 0.5F) * static_cast<float>(image.width) / static_cast<float>(width) - 0.5F,
      0.0F, static_cast<float>(image.width - 1));
  const float fy = std::clamp(
      (static_cast<float>(y) + 0.5F) * static_cast<float>(image.height) / static_cast<float>(height) - 0.5F,
      0.0F, static_cast<float>(image.height - 1));
  const int x0 = static_cast<int>(fx);
  const int y0 = static_cast<int>(fy);
  const int x1 = std::min(x0 + 1, image.width - 1);
  const int y1 = std::min(y0 + 1, image.height - 1);
  const auto texel = [&](int i, int j) { return resampled(image, i, j, image.width, image.height); };
  return glm::mix(glm::mix(texel(x0, y0), texel(x1, y0), fx - static_cast<float>(x0)),
                  glm::mix(texel(x0, y1), texel(x1, y1), fx - static_cast<float>(x0)),
                  fy - static_cast<float>(y0));
}

// An image of which each texel is `value`(base colour, metallic-roughness) of the images given, at the larger
// size.
template <typename Value>
Image combined(const Image* base, const Image* metallic_roughness, int channels, const Value& value) {
  int width = 1;
  int height = 1;
  for (const Image* image : {base, metallic_roughness}) {
    if (image == nullptr) continue;
    width = std::max(width, image->width);
    height = std::max(height, image->height);
  }
  Image result(width, height, default_channels(channels));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const glm::vec3 b = base != nullptr ? resampled(*base, x, y, width, height) : glm::vec3(1.0F);
      const glm::vec3 mr = metallic_roughness != nullptr ? resampled(*metallic_roughness, x, y, width, height)
                                                         : glm::vec3(1.0F);
      const glm::vec3 v = glm::clamp(value(b, mr), 0.0F, 1.0F);
      for (int c = 0; c < channels; ++c) result.at(x, y)[c] = v[c];
    }
  }
  return result;
}

}  // namespace

double number_property(const std::string& path, const tinygltf::Value& object, const char* key,
                       double default_value, const std::string& what) {
  if (!object.Has(key)) return default_value;
  const tinygltf::Value& value = object.Get(key);
  if (!value.IsNumber() || !std::isfinite(value.GetNumberAsDouble())) {
    fail(path, what + " " + key + " is not a finite number");
  }
  return value.GetNumberAsDouble();
}

// The metallic-roughness model of glTF 2.0 §3.9 and appendix B, before its textures are combined.
struct MaterialReader::Parameters {
  glm::vec3 base{1.0F};
  float metallic = 1.0F;
  float roughness = 1.0F;
  float dielectric_r0 = 0.04F;
  float alpha = 1.0F;
  std::optional<Use> base_use;
  std::optional<Use> metallic_roughness_use;
};

bool MaterialReader::Use::same_coordinates(const Use& other) const {
  return wrap_u == other.wrap_u && wrap_v == other.wrap_v && transform == other.transform &&
         uv_set == other.uv_set;
}

MaterialReader::MaterialReader(const std::string& path, const tinygltf::Model& model,
                               const SceneOptions& options, Warnings& warnings, Scene& scene)
    : path_(path),
      model_(model),
      warnings_(warnings),
      scene_(scene),
      nits_per_radiance_(options.luminous_efficacy),
      reader_(options, warnings) {}

std::optional<MaterialReader::Use> MaterialReader::use_of(int texture, int uv_set,
                                                          const tinygltf::ExtensionMap& extensions,
                                                          const std::string& what) const {
  if (texture == -1) return std::nullopt;
  const tinygltf::Texture& t = element(path_, model_.textures, texture, what + " texture");
  Use use;
  use.image = t.source;
  const tinygltf::Value* webp = extension(t.extensions, "EXT_texture_webp");
  if (webp != nullptr && webp->Get("source").IsNumber()) {
    const double source = webp->Get("source").GetNumberAsDouble();
    use.image =
        source >= 0.0 && source < static_cast<double>(model_.images.size()) ? static_cast<int>(source) : -2;
  }
  if (use.image == -1) {
    warnings_.add("textures without an image that is known are left out");
    return std::nullopt;
  }
  element(path_, model_.images, use.image, what + " image");
  if (t.sampler >= 0) {
    const tinygltf::Sampler& sampler = element(path_, model_.samplers, t.sampler, what + " sampler");
    use.wrap_u = wrap_of(path_, sampler.wrapS);
    use.wrap_v = wrap_of(path_, sampler.wrapT);
  }
  use.uv_set = uv_set;
  if (const tinygltf::Value* transform = extension(extensions, "KHR_texture_transform")) {
    const std::string name = what + " KHR_texture_transform";
    use.transform.offset = pair_property(path_, *transform, "offset", glm::vec2(0.0F));
    use.transform.scale = pair_property(path_, *transform, "scale", glm::vec2(1.0F));
    use.transform.rotation = static_cast<float>(number_property(path_, *transform, "rotation", 0.0, name));
    use.uv_set =
        static_cast<int>(std::clamp(number_property(path_, *transform, "texCoord", uv_set, name), -1.0, 1e6));
  }
  if (use.uv_set < 0) fail(path_, what + " texCoord is negative");
  return use;
}

int MaterialReader::uv_set(int material) {
  if (material < 0) return 0;
  const tinygltf::Material& m = element(path_, model_.materials, material, "material");
  const auto& pbr = m.pbrMetallicRoughness;
  const std::string where = "material " + std::to_string(material) + " ";
  std::optional<int> first;
  const auto note = [&](const std::optional<Use>& use) {
    if (!use) return;
    if (!first) first = use->uv_set;
    if (use->uv_set != *first) {
      warnings_.add("a material uses several sets of texture coordinates; all its textures use the first");
    }
  };
  for (const auto& [info, name] : {std::pair(&pbr.baseColorTexture, "base colour"),
                                   std::pair(&pbr.metallicRoughnessTexture, "metallic-roughness"),
                                   std::pair(&m.emissiveTexture, "emissive")}) {
    note(use_of(info->index, info->texCoord, info->extensions, where + name));
  }
  const auto& normal = m.normalTexture;
  note(use_of(normal.index, normal.texCoord, normal.extensions, where + "normal"));
  return first.value_or(0);
}

std::string MaterialReader::image_file(const tinygltf::Image& image) const {
  const std::string reference = percent_decoded(image.uri);
  const auto file = resolve_inside(std::filesystem::path(path_).parent_path(), reference);
  if (!file) fail(path_, "refers to '" + reference + "', which is not inside the file's own directory");
  return file->string();
}

template <typename Read>
auto MaterialReader::read_image(int index, const Read& read) const {
  const tinygltf::Image& image = element(path_, model_.images, index, "image");
  const std::string name = path_ + ": image " + std::to_string(index);
  if (image.bufferView >= 0) return read(name, view_bytes(path_, model_, image.bufferView, "image"));
  if (image.uri.empty()) return read(name, std::span(image.image));
  constexpr std::string_view kBase64 = ";base64,";
  const std::size_t data = image.uri.starts_with("data:") ? image.uri.find(kBase64) : std::string::npos;
  if (data != std::string::npos) {
    const auto decoded = base64_decoded(std::string_view(image.uri).substr(data + kBase64.size()));
    return read(name, std::span(decoded.data(), decoded.size()));
  }
  const std::string file = image_file(image);
  const std::string bytes = read_file(file);
  return read(file, std::span(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

Image MaterialReader::decode(int index, Transfer transfer) {
  return read_image(index, [&](const std::string& name, std::span<const unsigned char> bytes) {
    return reader_.read(name, bytes, transfer);
  });
}

template <typename Make>
TextureReference MaterialReader::made_texture(const Use& use, const std::string& name, const Make& make) {
  TextureReference reference = use.transform;
  const std::string key = name + " " + std::to_string(static_cast<int>(use.wrap_u)) + " " +
                          std::to_string(static_cast<int>(use.wrap_v));
  auto it = texture_of_.find(key);
  if (it == texture_of_.end()) {
    std::optional<Texture> texture = make();
    it = texture_of_.emplace(key, texture ? static_cast<int>(scene_.textures.size()) : -1).first;
    if (texture) {
      texture->wrap_u = use.wrap_u;
      texture->wrap_v = use.wrap_v;
      scene_.textures.push_back(std::move(*texture));
    }
  }
  reference.texture = it->second;
  return reference;
}

TextureReference MaterialReader::plain_texture(const Use& use) {
  return made_texture(use, "image " + std::to_string(use.image), [&] {
    const tinygltf::Image& image = element(path_, model_.images, use.image, "image");
    if (image.bufferView < 0 && !image.uri.empty() && !image.uri.starts_with("data:")) {
      return reader_.read_file_texture(image_file(image), Transfer::srgb);
    }
    Texture texture;
    texture.image = decode(use.image, Transfer::srgb);
    return texture;
  });
}

MaterialReader::Parameters MaterialReader::parameters(const tinygltf::Material& material,
                                                      const std::string& where) {
  const auto& pbr = material.pbrMetallicRoughness;
  Parameters p;
  if (pbr.baseColorFactor.size() != 4) fail(path_, where + "baseColorFactor is not four numbers");
  p.base = reflectance(path_, where + "baseColorFactor",
                       glm::vec3(pbr.baseColorFactor[0], pbr.baseColorFactor[1], pbr.baseColorFactor[2]),
                       warnings_);
  p.alpha = unit_factor(path_, where + "baseColorFactor's alpha", pbr.baseColorFactor[3], warnings_);
  p.metallic = unit_factor(path_, where + "metallicFactor", pbr.metallicFactor, warnings_);
  p.roughness = unit_factor(path_, where + "roughnessFactor", pbr.roughnessFactor, warnings_);
  if (const tinygltf::Value* ior = extension(material.extensions, "KHR_materials_ior")) {
    const double n = number_property(path_, *ior, "ior", 1.5, where + "KHR_materials_ior");
    // 0 stands for an infinite index.
    if (n != 0.0 && !(n >= 1.0)) fail(path_, where + "ior is " + text_of(n) + ", expected 0 or at least 1");
    p.dielectric_r0 = n == 0.0 ? 1.0F : static_cast<float>(std::pow((n - 1.0) / (n + 1.0), 2));
  }
  const auto& base = pbr.baseColorTexture;
  const auto& mr = pbr.metallicRoughnessTexture;
  p.base_use = use_of(base.index, base.texCoord, base.extensions, where + "base colour");
  p.metallic_roughness_use = use_of(mr.index, mr.texCoord, mr.extensions, where + "metallic-roughness");
  return p;
}

// Lambert's albedo is base · (1 − metallic), Schlick's r0 is mix(dielectric r0, base, metallic).
void MaterialReader::set_colours(const Parameters& p, Material& result) {
  const std::optional<Use>& base = p.base_use;
  std::optional<Use> varying;  // the texture of the metallic parameter, if it has an influence
  float metallic = p.metallic;
  if (p.metallic_roughness_use && p.metallic > 0.0F) {
    if (!base || base->same_coordinates(*p.metallic_roughness_use)) {
      varying = p.metallic_roughness_use;
    } else {
      const Image image = decode(p.metallic_roughness_use->image, Transfer::linear);
      const std::size_t channels = image.channels.size();
      double sum = 0.0;
      for (std::size_t i = channels == 1 ? 0 : 2; i < image.pixels.size(); i += channels)
        sum += image.pixels[i];
      metallic *=
          static_cast<float>(sum * static_cast<double>(channels) / static_cast<double>(image.pixels.size()));
      reader_.release(image);
      warnings_.add(
          "textures of base colour and metallicity that are placed differently: the mean metallicity is "
          "used");
    }
  }
  result.fresnel.model = FresnelModel::schlick;
  if (!varying && (!base || metallic == 0.0F || metallic == 1.0F)) {
    result.albedo = p.base * (1.0F - metallic);
    result.fresnel.r0 = glm::mix(glm::vec3(p.dielectric_r0), p.base, metallic);
    result.colors_tint_reflectance = metallic == 1.0F;
    if (!base) return;
    const TextureReference texture = plain_texture(*base);
    if (metallic == 0.0F) result.albedo_texture = texture;
    if (metallic == 1.0F) result.specular_texture = texture;
    return;
  }
  // Both vary over the surface and have to be made.
  const Use& placed = base ? *base : *varying;
  const std::string sources =
      (base ? std::to_string(base->image) : "-") + " " + (varying ? std::to_string(varying->image) : "-");
  std::optional<Image> base_image;
  std::optional<Image> mr_image;
  const auto make = [&](int channels, const auto& value) {
    if (base && !base_image) base_image = decode(base->image, Transfer::srgb);
    if (varying && !mr_image) mr_image = decode(varying->image, Transfer::linear);
    Image image = combined(base ? &*base_image : nullptr, varying ? &*mr_image : nullptr, channels, value);
    reader_.reserve(path_, image.width, image.height, channels);
    Texture texture;
    texture.image = std::move(image);
    return texture;
  };
  const auto metallic_at = [&](glm::vec3 mr) { return varying ? metallic * mr.z : metallic; };
  result.albedo = p.base;
  result.albedo_texture = made_texture(placed, "albedo " + sources + " " + text_of(metallic), [&] {
    return make(base ? 3 : 1, [&](glm::vec3 b, glm::vec3 mr) { return b * (1.0F - metallic_at(mr)); });
  });
  result.fresnel.r0 = glm::vec3(1.0F);
  result.specular_texture =
      made_texture(placed,
                   "specular " + sources + " " + text_of(metallic) + " " + text_of(p.dielectric_r0) + " " +
                       text_of(p.base),
                   [&] {
                     return make(3, [&](glm::vec3 b, glm::vec3 mr) {
                       return glm::mix(glm::vec3(p.dielectric_r0), p.base * b, metallic_at(mr));
                     });
                   });
  if (base_image) reader_.release(*base_image);
  if (mr_image) reader_.release(*mr_image);
}

// α is the square of the perceptual roughness.
void MaterialReader::set_roughness(const Parameters& p, Material& result) {
  const float alpha = p.roughness * p.roughness;
  if (alpha < kMirrorAlpha) return;
  result.lobe = SpecularLobe::ggx;
  result.roughness = alpha;
  if (!p.metallic_roughness_use) return;
  result.roughness_texture = made_texture(
      *p.metallic_roughness_use, "roughness " + std::to_string(p.metallic_roughness_use->image), [&] {
        const Image source = decode(p.metallic_roughness_use->image, Transfer::linear);
        Image image =
            combined(nullptr, &source, 1, [](glm::vec3, glm::vec3 mr) { return glm::vec3(mr.y * mr.y); });
        reader_.release(source);
        reader_.reserve(path_, image.width, image.height, 1);
        Texture texture;
        texture.image = std::move(image);
        return texture;
      });
}

// glTF 2.0 §3.9.4.
void MaterialReader::set_opacity(const tinygltf::Material& material, const Parameters& p,
                                 const std::string& where, Material& result) {
  if (material.alphaMode.empty() || material.alphaMode == "OPAQUE") return;
  if (material.alphaMode == "MASK") {
    if (!(material.alphaCutoff >= 0.0)) {
      fail(path_, where + "alphaCutoff is " + text_of(material.alphaCutoff) + ", expected at least 0");
    }
    result.opacity_cutoff =
        static_cast<float>(std::min(material.alphaCutoff, double{std::numeric_limits<float>::max()}));
  } else if (material.alphaMode != "BLEND") {
    fail(path_,
         where + "alphaMode is '" + material.alphaMode.substr(0, 40) + "', expected OPAQUE, MASK or BLEND");
  }
  result.opacity = p.alpha;
  if (!p.base_use) return;
  const int index = p.base_use->image;
  result.opacity_texture =
      made_texture(*p.base_use, "opacity " + std::to_string(index), [&]() -> std::optional<Texture> {
        std::optional<Image> image =
            read_image(index, [&](const std::string& name, std::span<const unsigned char> bytes) {
              return reader_.read_opacity(name, bytes, false);
            });
        if (!image) return std::nullopt;
        Texture texture;
        texture.image = std::move(*image);
        return texture;
      });
}

// glTF 2.0 §3.9.3.
void MaterialReader::set_normal(const tinygltf::Material& material, const std::string& where,
                                Material& result) {
  const auto& info = material.normalTexture;
  const std::optional<Use> use = use_of(info.index, info.texCoord, info.extensions, where + "normal");
  if (!use) return;
  if (!std::isfinite(info.scale)) fail(path_, where + "normal scale is not finite");
  result.normal_scale = static_cast<float>(std::clamp(info.scale, -1e6, 1e6));
  result.normal_texture =
      made_texture(*use, "normal " + std::to_string(use->image), [&]() -> std::optional<Texture> {
        Texture texture;
        texture.image = decode(use->image, Transfer::linear);
        return texture;
      });
}

void MaterialReader::warn_of_what_is_lost(const tinygltf::Material& material) {
  if (material.occlusionTexture.index >= 0) {
    warnings_.add("occlusion textures are not used: the ray tracer finds what is occluded");
  }
}

Material MaterialReader::convert(const tinygltf::Material& material, const std::string& where) {
  Material result;
  const Parameters p = parameters(material, where);
  warn_of_what_is_lost(material);
  set_opacity(material, p, where, result);
  set_normal(material, where, result);
  if (extension(material.extensions, "KHR_materials_unlit") != nullptr) {
    // The colour is what the eye sees, whatever the light.
    result.albedo = glm::vec3(0.0F);
    result.emission = p.base / nits_per_radiance_;
    if (p.base_use) result.emission_texture = plain_texture(*p.base_use);
    return result;
  }
  result.layers = LayerModel::coated;
  set_colours(p, result);
  result.specular = result.specular_texture.texture >= 0 || result.fresnel.r0 != glm::vec3(0.0F);
  if (result.specular) set_roughness(p, result);

  if (material.emissiveFactor.size() != 3) fail(path_, where + "emissiveFactor is not three numbers");
  double strength = 1.0;
  if (const tinygltf::Value* e = extension(material.extensions, "KHR_materials_emissive_strength")) {
    strength = number_property(path_, *e, "emissiveStrength", 1.0, where + "KHR_materials_emissive_strength");
  }
  const double factor = strength / static_cast<double>(nits_per_radiance_);
  result.emission =
      radiance(path_, where + "emission",
               glm::vec3(material.emissiveFactor[0] * factor, material.emissiveFactor[1] * factor,
                         material.emissiveFactor[2] * factor));
  const auto& info = material.emissiveTexture;
  const std::optional<Use> emission = use_of(info.index, info.texCoord, info.extensions, where + "emissive");
  if (emission && result.emission != glm::vec3(0.0F)) {
    result.emission_texture = plain_texture(*emission);
  }
  return result;
}

int MaterialReader::add(int index) {
  Material material;
  if (index < 0) {
    // glTF 2.0 §3.7.2.1: the defaults of all properties.
    tinygltf::Material source;
    source.emissiveFactor = {0.0, 0.0, 0.0};
    material = convert(source, "default material ");
    material.name = "default";
  } else {
    const tinygltf::Material& source = element(path_, model_.materials, index, "material");
    material = convert(source, "material " + std::to_string(index) + " ");
    material.name = source.name.empty() ? "material " + std::to_string(index) : source.name;
  }
  scene_.materials.push_back(std::move(material));
  return static_cast<int>(scene_.materials.size()) - 1;
}

}  // namespace mirrorbake::gltf
