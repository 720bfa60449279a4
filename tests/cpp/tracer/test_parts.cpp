#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "scenes.hpp"

namespace mirrorbake {
namespace {

using test::add_object;
using test::mirror;
using test::small_room;

TEST(Parts, PartsThatAreCutAnewAreSeenInTheSameLight) {
  Camera camera;
  camera.eye = {0.4F, 2.9F, 1.6F};
  camera.target = {0, 1, 0};
  camera.vertical_fov_degrees = 60.0F;
  camera.width = camera.height = 48;
  Scene scene = small_room();
  const int body =
      add_object(scene, make_sphere({0, 1.0F, 0}, 0.7F, 16), mirror(glm::vec3(0.6F), glm::vec3(0.3F)));
  const Object& object = scene.objects[static_cast<std::size_t>(body)];
  std::vector<std::uint16_t> parts;
  for (std::size_t k = 0; k < object.mesh.triangles.size(); ++k) {
    parts.push_back(k % 3 == 0 ? std::uint16_t{1} : std::uint16_t{0});
  }
  const Tracer whole(scene);
  const Tracer cut = whole.with_parts(body, parts, {"most", "third"}, {});
  Scene cut_before = scene;
  cut_before.objects[static_cast<std::size_t>(body)].mesh.parts = parts;
  cut_before.objects[static_cast<std::size_t>(body)].part_names = {"most", "third"};
  const LayerTrace expected = Tracer(cut_before).trace_layers(camera, body, {});
  const LayerTrace got = cut.trace_layers(camera, body, {});
  EXPECT_EQ(got.layers.pixels, expected.layers.pixels);
  EXPECT_EQ(got.samples.part, expected.samples.part);
  EXPECT_TRUE(std::find(got.samples.part.begin(), got.samples.part.end(), 1) != got.samples.part.end());
  // What a triangle is made of decides how light gets about.
  EXPECT_THROW(whole.with_parts(body, parts, {"most", "third"}, {object.material, 0}), InvalidArgument);
  EXPECT_THROW(whole.with_parts(body, {0}, {"one"}, {}), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
