#include "bind.hpp"

namespace mirrorbake::bindings {

// One function per module, each in bind_<module>.cpp; they only map names.
void bind_core(nb::module_& m);
void bind_proxy(nb::module_& m);
void bind_proxy_fits(nb::module_& m);
void bind_envmap(nb::module_& m);
void bind_image(nb::module_& m);
void bind_material(nb::module_& m);
void bind_mesh(nb::module_& m);
void bind_scene(nb::module_& m);
void bind_surface(nb::module_& m);
void bind_tracer(nb::module_& m);
void bind_projection(nb::module_& m);
void bind_display_fit(nb::module_& m);
void bind_inference(nb::module_& m);
void bind_pem(nb::module_& m);
void bind_probe(nb::module_& m);
void bind_prefilter(nb::module_& m);
void bind_shading(nb::module_& m);

}  // namespace mirrorbake::bindings

NB_MODULE(_core, m) {
  using namespace mirrorbake::bindings;
  m.doc() = "Compiled part of mirrorbake. Use it through the package `mirrorbake`.";
  bind_core(m);
  bind_proxy(m);
  bind_proxy_fits(m);
  bind_image(m);
  bind_material(m);
  bind_mesh(m);
  bind_scene(m);
  bind_surface(m);
  bind_tracer(m);
  bind_projection(m);
  bind_envmap(m);
  bind_inference(m);
  bind_display_fit(m);
  bind_pem(m);
  bind_probe(m);
  bind_prefilter(m);
  bind_shading(m);
}
