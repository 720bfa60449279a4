#include "mtl.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include <glm/common.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"
#include "text_lines.hpp"

namespace mirrorbake::mtl {
namespace {

constexpr std::string_view kSpace = " \t";

std::string_view trimmed(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(kSpace), text.size()));
  return text.substr(0, text.find_last_not_of(kSpace) + 1);
}

std::optional<float> number(std::string_view token) {
  if (token.starts_with('+')) token.remove_prefix(1);
  float value = 0.0F;
  const auto [stop, code] = std::from_chars(token.data(), token.data() + token.size(), value);
  if (code != std::errc() || stop != token.data() + token.size() || !std::isfinite(value))
    return std::nullopt;
  return value;
}

// Thrown for a line that says nothing; never leaves parse().
struct Unusable {
  std::string problem;
};

// Linear Rec. 709 from CIE XYZ (IEC 61966-2-1).
glm::vec3 rec709_from_xyz(glm::vec3 v) {
  return glm::max(
      glm::vec3(3.2406F * v.x - 1.5372F * v.y - 0.4986F * v.z, -0.9689F * v.x + 1.8758F * v.y + 0.0415F * v.z,
                0.0557F * v.x - 0.2040F * v.y + 1.0570F * v.z),
      0.0F);
}

// Where options begin that follow the name of a file, which may have spaces and dashes itself.
std::size_t options_after(std::string_view text) {
  constexpr std::array<std::string_view, 11> kOptions = {
      "-o", "-s", "-t", "-mm", "-clamp", "-blendu", "-blendv", "-boost", "-bm", "-texres", "-imfchan"};
  for (std::size_t at = text.find_first_of(kSpace); at != std::string_view::npos;
       at = text.find_first_of(kSpace, at + 1)) {
    const std::string_view token = split_keyword(text.substr(at)).first;
    if (std::find(kOptions.begin(), kOptions.end(), token) != kOptions.end()) return at;
  }
  return text.size();
}

// One line, of which the keyword has been read.
class Line {
 public:
  Line(std::string_view keyword, std::string_view rest) : keyword_(keyword), rest_(rest) {}

  [[noreturn]] void fail(const std::string& expected) const {
    throw Unusable{std::string(keyword_.substr(0, 40)) + " '" + std::string(rest_.substr(0, 40)) +
                   "', expected " + expected};
  }

  std::string_view rest() const { return rest_; }

  float one_number() const {
    const std::optional<float> value = number(rest_);
    if (!value) fail("one finite number");
    return *value;
  }

  // One number, or the mean of three, cut to [0, 1].
  float fraction(Warnings& warnings) const {
    const glm::vec3 value = colour();
    const float mean = (value.x + value.y + value.z) / 3.0F;
    if (mean <= 1.0F) return mean;
    warnings.add("MTL " + std::string(keyword_.substr(0, 40)) + ": values above 1 are taken as 1");
    return 1.0F;
  }

  // Three numbers, or one for all three.
  glm::vec3 colour() const {
    glm::vec3 value(0.0F);
    std::string_view left = rest_;
    const bool is_xyz = split_keyword(left).first == "xyz";
    if (is_xyz) left = split_keyword(left).second;
    for (int i = 0; i < 3; ++i) {
      const auto [token, rest] = split_keyword(left);
      if (i == 1 && token.empty()) return glm::vec3(value.x);
      const std::optional<float> component = number(token);
      if (!component || !(*component >= 0.0F)) fail("one or three finite numbers of at least 0");
      value[i] = *component;
      left = rest;
    }
    return is_xyz ? rec709_from_xyz(value) : value;
  }

  // The name of a file, which may have spaces, with options before or after it.
  Map map(Warnings& warnings) const {
    Map map;
    std::array<float, 3> offset{0.0F, 0.0F, 0.0F};
    std::array<float, 3> scale{1.0F, 1.0F, 1.0F};
    std::string_view left = rest_;
    while (!left.empty()) {
      if (!left.starts_with('-')) {
        if (!map.file.empty()) break;
        const std::size_t end = options_after(left);
        map.file = trimmed(left.substr(0, end));
        left = trimmed(left.substr(end));
        continue;
      }
      const auto [option, rest] = split_keyword(left);
      left = rest;
      if (option == "-o" || option == "-s" || option == "-t") {
        std::array<float, 3> values = option == "-s" ? scale : offset;
        int count = 0;
        for (; count < 3; ++count) {
          const auto [token, after] = split_keyword(left);
          const std::optional<float> value = number(token);
          if (!value) break;
          values[static_cast<std::size_t>(count)] = *value;
          left = after;
        }
        if (count == 0) fail("a number after " + std::string(option));
        if (option == "-o") offset = values;
        if (option == "-s") scale = values;
        if (option == "-t") warnings.add("MTL map option -t is not supported");
        continue;
      }
      const auto [argument, after] = split_keyword(left);
      left = after;
      if (option == "-clamp") {
        map.wrap = argument == "on" ? TextureWrap::clamp : TextureWrap::repeat;
      } else if (option == "-mm") {
        left = split_keyword(left).second;
        warnings.add("MTL map option -mm is not supported");
      } else if (option != "-blendu" && option != "-blendv") {
        warnings.add("MTL map option " + std::string(option.substr(0, 40)) + " is not supported");
      }
    }
    if (map.file.empty()) fail("the name of an image");
    std::replace(map.file.begin(), map.file.end(), '\\', '/');
    // MTL's v points up, that of the transform down: 1 − (s·v + o) = s·(1 − v) + (1 − s − o).
    map.transform.scale = {scale[0], scale[1]};
    map.transform.offset = {offset[0], 1.0F - scale[1] - offset[1]};
    return map;
  }

 private:
  std::string_view keyword_;
  std::string_view rest_;
};

void read_line(const Line& line, std::string_view keyword, Definition& material, Warnings& warnings) {
  if (keyword == "Kd") {
    material.diffuse = line.colour();
  } else if (keyword == "Ks") {
    material.specular = line.colour();
  } else if (keyword == "Ke") {
    material.emission = line.colour();
  } else if (keyword == "Ns") {
    material.exponent = line.one_number();
  } else if (keyword == "Ni") {
    const float index = line.one_number();
    if (!(index > 0.0F)) line.fail("a refractive index above 0");
    material.index = index;
  } else if (keyword == "illum") {
    const float value = line.one_number();
    if (!(value >= 0.0F && value <= 10.0F)) line.fail("0 to 10");
    material.illumination = static_cast<int>(value);
  } else if (keyword == "map_Kd") {
    material.diffuse_map = line.map(warnings);
  } else if (keyword == "map_Ks") {
    material.specular_map = line.map(warnings);
  } else if (keyword == "map_Ke") {
    material.emission_map = line.map(warnings);
  } else if (keyword == "map_d") {
    material.dissolve_map = line.map(warnings);
  } else if (keyword == "d") {
    material.dissolve = line.fraction(warnings);
  } else if (keyword == "Tr") {
    material.transparency = line.fraction(warnings);
  } else if (keyword != "Ka" && keyword != "map_Ka" && keyword != "Tf" && keyword != "sharpness") {
    warnings.add("MTL keyword " + std::string(keyword.substr(0, 40)) + " is not supported");
  }
}

}  // namespace

std::pair<std::string_view, std::string_view> split_keyword(std::string_view line) {
  line = trimmed(line);
  const std::size_t end = std::min(line.find_first_of(kSpace), line.size());
  return {line.substr(0, end), trimmed(line.substr(end))};
}

std::vector<Definition> parse(std::string_view text, Warnings& warnings) {
  std::vector<Definition> materials;
  TextLines lines(text);
  while (lines.next()) {
    const auto [keyword, rest] = split_keyword(lines.line());
    if (keyword.empty() || keyword.starts_with('#')) continue;
    const Line line(keyword, rest);
    try {
      if (keyword == "newmtl") {
        materials.emplace_back();
        materials.back().name = rest;
      } else if (materials.empty()) {
        line.fail("newmtl first");
      } else {
        read_line(line, keyword, materials.back(), warnings);
      }
    } catch (const Unusable& unusable) {
      warnings.add("MTL: ignored " + unusable.problem);
    }
  }
  return materials;
}

Material material_from(const std::string& path, const Definition& definition, Warnings& warnings) {
  const std::string where = "material '" + definition.name + "' ";
  Material material;
  material.name = valid_utf8(definition.name);
  const glm::vec3 default_diffuse = definition.diffuse_map.file.empty() ? glm::vec3(0.5F) : glm::vec3(1.0F);
  material.albedo = reflectance(path, where + "Kd", definition.diffuse.value_or(default_diffuse), warnings);
  material.albedo_texture = definition.diffuse_map.transform;
  material.emission = radiance(path, where + "Ke", definition.emission);
  material.emission_texture = definition.emission_map.transform;
  material.opacity = definition.dissolve.value_or(1.0F - definition.transparency.value_or(0.0F));
  material.opacity_texture = definition.dissolve_map.transform;

  const int illumination = definition.illumination.value_or(2);
  const bool is_mirror = illumination >= 3 && illumination <= 9;
  const bool has_fresnel = illumination == 5 || illumination == 6 || illumination == 7 || illumination == 9;
  if (illumination == 4 || illumination == 6 || illumination == 7 || illumination == 9) {
    warnings.add(
        "MTL illumination models with refraction (4, 6, 7, 9) are not supported: nothing is refracted");
  }
  const glm::vec3 specular = reflectance(path, where + "Ks", definition.specular, warnings);
  if (has_fresnel && specular == glm::vec3(0.0F) && definition.index) {
    material.specular = true;
    material.fresnel.model = FresnelModel::dielectric;
    material.fresnel.eta = glm::vec3(*definition.index);
    return material;
  }
  material.specular = illumination >= 2 && illumination <= 9 && specular != glm::vec3(0.0F);
  if (!material.specular) return material;
  material.fresnel.model = has_fresnel ? FresnelModel::schlick : FresnelModel::constant;
  material.fresnel.r0 = specular;
  material.specular_texture = definition.specular_map.transform;
  if (!is_mirror) {
    material.lobe = SpecularLobe::phong;
    material.exponent = std::clamp(definition.exponent.value_or(10.0F), 1.0F, 1e6F);
  }
  return material;
}

}  // namespace mirrorbake::mtl
