#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <optional>
#include <string>
#include <utility>

#include "bind.hpp"
#include "bind_enums.hpp"
#include "mirrorbake/scene/scene.hpp"

namespace mirrorbake::bindings {
namespace {

void bind_texture(nb::module_& m) {
  m.def("set_texture_cache_bytes", &set_texture_cache_bytes, nb::arg("bytes"),
        "Bound the cache of all texture files together; 1 GiB until it is set, at least 16 MiB.");
  nb::class_<TextureReference> texture_reference(
      m, "TextureReference",
      R"(A texture of a scene, by its index (−1: none), and the transform of the texture coordinates as
of KHR_texture_transform, whose v counts downwards: scaled, turned counter-clockwise by `rotation`
radians about (0, 0), then moved.)");
  texture_reference
      .def(
          "__init__",
          [](TextureReference* self, int texture, glm::vec2 offset, glm::vec2 scale, float rotation) {
            new (self) TextureReference{texture, offset, scale, rotation};
          },
          nb::arg("texture") = -1, nb::arg("offset") = glm::vec2(0.0F), nb::arg("scale") = glm::vec2(1.0F),
          nb::arg("rotation") = 0.0F)
      .def_rw("texture", &TextureReference::texture)
      .def_rw("offset", &TextureReference::offset)
      .def_rw("scale", &TextureReference::scale)
      .def_rw("rotation", &TextureReference::rotation)
      .def(
          "__eq__",
          [](const TextureReference& self, nb::handle other) {
            return nb::isinstance<TextureReference>(other) &&
                   self == nb::cast<const TextureReference&>(other);
          },
          nb::arg("other"));
  record(texture_reference, {"texture", "offset", "scale", "rotation"});
}

namespace {

void bind_fresnel(nb::module_& m) {
  nb::class_<Fresnel> reflectance(m, "Fresnel", "Reflectance per colour channel as a function of the angle.");
  reflectance
      .def(
          "__init__",
          [](Fresnel* self, FresnelModel model, glm::vec3 r0, glm::vec3 eta, glm::vec3 k) {
            new (self) Fresnel{model, r0, eta, k};
          },
          nb::arg("model") = FresnelModel::constant, nb::arg("r0") = glm::vec3(0.0F),
          nb::arg("eta") = glm::vec3(1.5F), nb::arg("k") = glm::vec3(0.0F))
      .def_rw("model", &Fresnel::model)
      .def_rw("r0", &Fresnel::r0,
              "constant: reflectance; schlick: reflectance at normal incidence; in [0, 1]")
      .def_rw("eta", &Fresnel::eta, "dielectric, conductor: real part of the relative index, above 0")
      .def_rw("k", &Fresnel::k, "conductor: extinction coefficient, at least 0");
  record(reflectance, {"model", "r0", "eta", "k"});
}

void bind_material(nb::module_& m) {
  nb::class_<Material> material(m, "Material", "What a surface does with light.");
  material
      .def(
          "__init__",
          [](Material* self, std::string name, glm::vec3 albedo, const TextureReference& albedo_texture,
             bool specular, const Fresnel& fresnel, const TextureReference& specular_texture,
             SpecularLobe lobe, float roughness, const TextureReference& roughness_texture, float exponent,
             LayerModel layers, glm::vec3 emission, const TextureReference& emission_texture, float opacity,
             const TextureReference& opacity_texture, std::optional<float> opacity_cutoff,
             const TextureReference& normal_texture, float normal_scale, bool colors_tint_reflectance) {
            new (self) Material{std::move(name),
                                albedo,
                                albedo_texture,
                                specular,
                                fresnel,
                                specular_texture,
                                lobe,
                                roughness,
                                roughness_texture,
                                exponent,
                                layers,
                                emission,
                                emission_texture,
                                opacity,
                                opacity_texture,
                                opacity_cutoff,
                                normal_texture,
                                normal_scale,
                                colors_tint_reflectance};
          },
          nb::kw_only(), nb::arg("name") = "", nb::arg("albedo") = glm::vec3(0.5F),
          nb::arg("albedo_texture") = TextureReference{}, nb::arg("specular") = false,
          nb::arg("fresnel") = Fresnel{}, nb::arg("specular_texture") = TextureReference{},
          nb::arg("lobe") = SpecularLobe::mirror, nb::arg("roughness") = Material{}.roughness,
          nb::arg("roughness_texture") = TextureReference{}, nb::arg("exponent") = Material{}.exponent,
          nb::arg("layers") = LayerModel::additive, nb::arg("emission") = glm::vec3(0.0F),
          nb::arg("emission_texture") = TextureReference{}, nb::arg("opacity") = 1.0F,
          nb::arg("opacity_texture") = TextureReference{}, nb::arg("opacity_cutoff") = nb::none(),
          nb::arg("normal_texture") = TextureReference{}, nb::arg("normal_scale") = 1.0F,
          nb::arg("colors_tint_reflectance") = false)
      .def_rw("name", &Material::name)
      .def_rw("albedo", &Material::albedo, "Lambertian reflectance per channel, in [0, 1]")
      .def_rw("albedo_texture", &Material::albedo_texture, "multiplies `albedo`")
      .def_rw("specular", &Material::specular, "whether it has a specular lobe, weighted by `fresnel`")
      .def_rw("fresnel", &Material::fresnel)
      .def_rw("specular_texture", &Material::specular_texture,
              "multiplies the `r0` of a constant or Schlick's reflectance")
      .def_rw("lobe", &Material::lobe)
      .def_rw("roughness", &Material::roughness, "of the lobe `ggx`: its α, in (0, 1]")
      .def_rw("roughness_texture", &Material::roughness_texture, "its first channel multiplies `roughness`")
      .def_rw("exponent", &Material::exponent, "of the lobe `phong`: N, in [1, 1e6]")
      .def_rw("layers", &Material::layers)
      .def_rw("emission", &Material::emission, "radiance emitted on the front side, W sr⁻¹ m⁻²")
      .def_rw("emission_texture", &Material::emission_texture, "multiplies `emission`")
      .def_rw("opacity", &Material::opacity,
              "part of the surface that is there, in [0, 1]: rays pass between")
      .def_rw("opacity_texture", &Material::opacity_texture,
              "its first channel multiplies `opacity`; its texels have to be in memory")
      .def_rw("opacity_cutoff", &Material::opacity_cutoff,
              "None, or: all is there where the opacity is at least this, nothing elsewhere")
      .def_rw("normal_texture", &Material::normal_texture,
              "bends the normal: texels (x, y, z)/2 + 1/2 along ∂p/∂u, ∂p/∂v (v up) and the normal")
      .def_rw("normal_scale", &Material::normal_scale, "of the x and y of `normal_texture`")
      .def_rw("colors_tint_reflectance", &Material::colors_tint_reflectance,
              "the mesh's colours multiply `fresnel.r0`, too: of a metal");
  record(material,
         {"name", "albedo", "albedo_texture", "specular", "fresnel", "specular_texture", "lobe", "roughness",
          "roughness_texture", "exponent", "layers", "emission", "emission_texture", "opacity",
          "opacity_texture", "opacity_cutoff", "normal_texture", "normal_scale", "colors_tint_reflectance"});
}

}  // namespace

void bind_surface_material(nb::module_& m) {
  bind_fresnel(m);
  bind_material(m);
}

}  // namespace

void bind_material(nb::module_& m) {
  bind_texture(m);
  bind_surface_material(m);
}

}  // namespace mirrorbake::bindings
