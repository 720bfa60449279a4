// Uses several modules through their installed headers and checks one known answer of each.
#include <cmath>
#include <cstdio>
#include <vector>

#include <glm/vec3.hpp>

#include "mirrorbake/core/version.hpp"
#include "mirrorbake/envmap/cube_pyramid.hpp"
#include "mirrorbake/envmap/reads.hpp"
#include "mirrorbake/image/image_io.hpp"
#include "mirrorbake/prefilter/convolve.hpp"
#include "mirrorbake/scene/shapes.hpp"
#include "mirrorbake/shading/fresnel.hpp"
#include "mirrorbake/tracer/tracer.hpp"

int main() {
  int failures = 0;
  const auto expect = [&failures](const char* what, double value, double expected, double tolerance) {
    const bool good = std::abs(value - expected) <= tolerance;
    std::printf("%-44s %.9g\n", what, value);
    if (!good) {
      std::fprintf(stderr, "%s: %.9g instead of %.9g\n", what, value, expected);
      ++failures;
    }
  };

  // Glass at normal incidence: ((n − 1) / (n + 1))².
  expect("reflectance of glass", mirrorbake::fresnel_dielectric(1.0F, 1.5F), 0.04, 1e-6);

  // A uniform environment looks the same in every direction and on every level.
  const auto layout = mirrorbake::CubePyramidLayout::full(8);
  const std::vector<float> faces(6 * 8 * 8, 3.0F);
  const std::vector<float> pyramid = mirrorbake::build_cube_pyramid(faces, layout, 1);
  const auto reads = mirrorbake::reads(
      layout, {glm::vec3(0.3F, -2.0F, 1.0F), glm::vec3(0.6F, 0.0F, 0.0F), glm::vec3(0.0F, 0.0F, 0.2F)}, {});
  double radiance = 0.0;
  for (const auto& read : reads) radiance += read.weight * pyramid[read.texel];
  expect("radiance of a uniform environment", radiance, 3.0, 1e-5);

  // A white world lights a white surface with π.
  mirrorbake::EnvMap white = mirrorbake::make_envmap({{mirrorbake::ProjectionKind::latlong}, 64, 32, 1, 1});
  for (float& value : white.values) value = 1.0F;
  const mirrorbake::EnvMap lit = mirrorbake::irradiance(white, {{}, 4, 4});
  expect("irradiance of a white world", lit.values.front(), 3.14159265, 2e-3);

  // A ray from the middle of a box of two metres meets its wall after one.
  mirrorbake::Scene scene;
  scene.materials.emplace_back();
  scene.objects.push_back({"room", mirrorbake::make_box(glm::vec3(-1.0F), glm::vec3(1.0F)), 0, {}});
  const mirrorbake::Tracer tracer(scene);
  const std::vector<glm::vec3> origin{glm::vec3(0.1F, 0.2F, 0.0F)};
  const std::vector<glm::vec3> direction{glm::vec3(0.0F, 0.0F, -1.0F)};
  expect("distance of a wall", tracer.intersect(origin, direction, {}).front().distance, 1.0, 1e-6);

  // EXR files are read by the library itself, PNG files by the one that it loads.
  for (const char* name : {"consumer.exr", "consumer.png"}) {
    mirrorbake::Image image(2, 1, {"R", "G", "B"});
    image.pixels = {1.0F, 0.0F, 1.0F, 0.0F, 1.0F, 1.0F};
    mirrorbake::save_image(name, image);
    const mirrorbake::Image again = mirrorbake::load_image(name);
    expect(name, again.pixels == image.pixels ? 1.0 : 0.0, 1.0, 0.0);
    std::remove(name);
  }

  std::printf("mirrorbake %s\n", mirrorbake::version());
  return failures;
}
