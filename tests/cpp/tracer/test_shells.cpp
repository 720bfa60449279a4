#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/scene/shapes.hpp"
#include "mirrorbake/surface/lookup.hpp"
#include "mirrorbake/surface/shells.hpp"
#include "mirrorbake/tracer/tracer.hpp"
#include "scenes.hpp"

namespace mirrorbake {
namespace {

struct Props {
  Scene scene = test::small_room();
  int reflector = test::add_object(scene, make_sphere({0, 1, 0}, 0.4F, 24), test::mirror(glm::vec3(0.9F)));
  int ball = test::add_object(scene, make_sphere({0.9F, 1, 0.3F}, 0.2F, 16), test::matte({0.7F, 0.2F, 0.2F}));
  Camera camera;

  Props() {
    camera.eye = {0.4F, 1.3F, 1.6F};
    camera.target = {0, 1, 0};
    camera.width = camera.height = 32;
  }
};

TraceOptions with_shells(std::vector<ShellRule> shells) {
  TraceOptions options;
  options.samples_per_pixel = 4;
  options.shells = std::move(shells);
  return options;
}

// However the light is split, what the shells add up to is the same light.
TEST(Shells, AnyNumberOfThemCompositesToTheSameBeauty) {
  const Props props;
  const Tracer tracer(props.scene);
  const LayerTrace two =
      tracer.trace_layers(props.camera, props.reflector, with_shells(default_shell_rules()));
  const std::vector<std::vector<ShellRule>> splits{
      {{"all", {}}},
      {{"local", {ShellRule::kItself}}, {"ball", {props.ball}}, {"rest", {}}},
      {{"local", {ShellRule::kItself}}, {"near", {}, 1.0F}, {"rest", {}}},
      {{"near_ball", {props.ball}, 0.6F}, {"near", {}, 1.5F}, {"solid", {}, 1e9F}, {"sky", {}}}};
  for (const auto& rules : splits) {
    const LayerTrace trace = tracer.trace_layers(props.camera, props.reflector, with_shells(rules));
    ASSERT_EQ(trace.samples.shells.size(), rules.size());
    ASSERT_EQ(trace.sample_beauty, two.sample_beauty);
    for (std::size_t i = 0; i < trace.samples.size(); ++i) {
      EXPECT_EQ(trace.samples.diffuse[i] + trace.samples.fresnel[i] * incident_light(trace.samples.shells, i),
                two.sample_beauty[i]);
    }
  }
}

TEST(Shells, HoldWhatTheirRuleSaysWithTheKindsBeforeThemLeftOut) {
  const Props props;
  const Tracer tracer(props.scene);
  const LayerTrace trace = tracer.trace_layers(
      props.camera, props.reflector, with_shells({{"ball", {props.ball}}, {"near", {}, 3.0F}, {"rest", {}}}));
  const SurfaceSamples& s = trace.samples;
  int balls = 0;
  int behind = 0;
  for (std::size_t i = 0; i < s.size(); ++i) {
    EXPECT_EQ(s.shells[2].radiance[i].a, 1.0F);
    EXPECT_GE(s.shells[2].hit_distance[i], 3.0F);
    EXPECT_TRUE(s.shells[1].radiance[i].a == 0.0F || s.shells[1].hit_distance[i] < 3.0F);
    // What hides another kind is there alone in front of it.
    const glm::vec3 origin = s.position[i] + 1e-3F * s.reflection[i];
    const RayHit hit = tracer.intersect({&origin, 1}, {&s.reflection[i], 1}, {}).front();
    EXPECT_EQ(s.shells[0].radiance[i].a == 1.0F, hit.object == props.ball);
    balls += hit.object == props.ball ? 1 : 0;
    behind += hit.object == props.ball && s.shells[1].radiance[i].a == 1.0F ? 1 : 0;
  }
  EXPECT_GT(balls, 10);
  EXPECT_GT(behind, 0);
}

TEST(Shells, ARuleHoldsItsObjectsWithinItsLimits) {
  const ShellRule near_things{"near", {ShellRule::kItself, 4}, 2.0F};
  const int reflector = 1;
  const float far = std::numeric_limits<float>::infinity();
  const std::vector<std::int32_t> objects{1, 4, 4, 4, 0, -1, -1};
  const std::vector<float> distances{1.0F, 1.0F, 2.0F, far, 1.0F, 1.0F, far};
  using Flags = std::vector<std::uint8_t>;
  EXPECT_EQ(held(near_things, objects, distances, reflector), (Flags{1, 1, 0, 0, 0, 0, 0}));
  // Without names, lights too, which are no object; with any limit or none, never what no ray meets.
  EXPECT_EQ(held({"any", {}, 2.0F}, objects, distances, reflector), (Flags{1, 1, 0, 0, 1, 1, 0}));
  EXPECT_EQ(held({"all", {}}, objects, distances, reflector), (Flags{1, 1, 1, 0, 1, 1, 0}));
  EXPECT_TRUE(near_things.has_limits());
  EXPECT_FALSE(ShellRule{}.has_limits());
  EXPECT_EQ(near_things.holds_all_before(), 0.0F);
  EXPECT_EQ((ShellRule{"any", {}, 2.0F}).holds_all_before(), 2.0F);
}

TEST(Shells, WrongRulesAreErrors) {
  const Props props;
  const Tracer tracer(props.scene);
  const std::vector<std::vector<ShellRule>> wrong{{},
                                                  {{"only", {props.ball}}},
                                                  {{"same", {props.ball}}, {"same", {}}},
                                                  {{"a b", {}, 1.0F}, {"rest", {}}},
                                                  {{"far", {99}}, {"rest", {}}},
                                                  {{"none", {}, 0.0F}, {"rest", {}}},
                                                  std::vector<ShellRule>(kMostShells + 1)};
  for (const auto& rules : wrong) {
    EXPECT_THROW(tracer.trace_layers(props.camera, props.reflector, with_shells(rules)), InvalidArgument);
  }
}

// Positions that are rounded to float in the world would be off by 1 mm here.
TEST(Shells, SamplesOfAFarSceneKeepThePrecisionOfOneAtHome) {
  Props home;
  Props away;
  const glm::vec3 far(16384.0F, 0.0F, -16384.0F);
  // What can be told apart so far out: the same geometry in both places.
  const auto coarse = [&](glm::vec3& p) { p = (p + far) - far; };
  for (Object& object : home.scene.objects) {
    for (glm::vec3& p : object.mesh.positions) coarse(p);
  }
  away.scene = home.scene;
  translate(away.scene, far);
  home.camera.eye = {0.375F, 1.25F, 1.625F};
  away.camera.eye = home.camera.eye + far;
  away.camera.target = home.camera.target + far;
  const TraceOptions options = with_shells(default_shell_rules());
  const SurfaceSamples near = Tracer(home.scene).trace_visibility(home.camera, home.reflector, options);
  const SurfaceSamples there = Tracer(away.scene).trace_visibility(away.camera, away.reflector, options);
  ASSERT_EQ(near.pixel, there.pixel);
  const Proxy room{Ellipsoid{{0, 1, 0}, {2, 2, 2}}, {0, 1, 0}};
  const Proxy room_there = translated(room, far);
  for (std::size_t i = 0; i < near.size(); ++i) {
    const glm::dvec3 back = glm::dvec3(there.position[i]) + there.origin - glm::dvec3(far);
    EXPECT_LT(glm::length(back - glm::dvec3(near.position[i])), 2e-6);
    const glm::vec3 a = glm::normalize(lookup_footprint(near, i, room, 1.0F).direction);
    const glm::vec3 b = glm::normalize(lookup_footprint(there, i, room_there, 1.0F).direction);
    EXPECT_LT(glm::length(a - b), 2e-5F);
  }
}

TEST(Shells, AnEyeInsideOfTheReflectorIsAnError) {
  Props props;
  const Tracer tracer(props.scene);
  EXPECT_TRUE(encloses(props.scene.objects[static_cast<std::size_t>(props.reflector)].mesh, {0, 1.35, 0}));
  EXPECT_FALSE(
      encloses(props.scene.objects[static_cast<std::size_t>(props.reflector)].mesh, {0.35, 1.35, 0}));
  props.camera.eye = {0, 1.35F, 0};
  EXPECT_THROW(tracer.trace_layers(props.camera, props.reflector, TraceOptions{}), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
