#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>
#include <glm/geometric.hpp>

#include "mesh_checks.hpp"
#include "mirrorbake/scene/room.hpp"

namespace mirrorbake {
namespace {

const Scene& room() {
  static const Scene scene = make_room();
  return scene;
}

const Object& object_named(const Scene& scene, std::string_view name) {
  const auto it = std::find_if(scene.objects.begin(), scene.objects.end(),
                               [&](const Object& o) { return o.name == name; });
  EXPECT_NE(it, scene.objects.end()) << name;
  return *it;
}

TEST(Room, IsValidAndSmall) {
  const Scene& scene = room();
  ASSERT_NO_THROW(validate(scene));
  std::size_t triangles = 0;
  std::set<std::string> names;
  for (const Object& object : scene.objects) {
    triangles += object.mesh.triangles.size();
    EXPECT_TRUE(names.insert(object.name).second) << object.name;
  }
  EXPECT_LT(triangles, 60'000U);
  EXPECT_GT(scene.objects.size(), 40U);
}

TEST(Room, TableTopIsTheGroundPlaneAndNothingStandsWhereTheReflectorGoes) {
  const Scene& scene = room();
  const Bounds table = bounds(object_named(scene, "table top").mesh);
  EXPECT_EQ(table.max.y, 0.0F);
  EXPECT_EQ(table.min.x + table.max.x, 0.0F);
  EXPECT_EQ(table.min.z + table.max.z, 0.0F);
  constexpr float kFreeRadius = 0.17F;  // the teapot's spout reaches 0.164 m at a height of 0.15 m
  for (const Object& object : scene.objects) {
    if (object.name == "table top") continue;
    for (const glm::vec3 p : object.mesh.positions) {
      const bool is_on_table = p.y > -0.01F && p.y < 0.3F;
      EXPECT_FALSE(is_on_table && std::hypot(p.x, p.z) < kFreeRadius) << object.name;
    }
  }
}

TEST(Room, EverythingIsInsideTheWalls) {
  const Scene& scene = room();
  const Bounds floor = bounds(object_named(scene, "floor").mesh);
  const float ceiling = bounds(object_named(scene, "ceiling").mesh).max.y;
  for (const Object& object : scene.objects) {
    const Bounds box = bounds(object.mesh);
    EXPECT_TRUE(glm::all(glm::greaterThanEqual(box.min, floor.min - 1e-5F))) << object.name;
    EXPECT_TRUE(box.max.x <= floor.max.x + 1e-5F && box.max.z <= floor.max.z + 1e-5F) << object.name;
    EXPECT_LE(box.max.y, ceiling + 1e-5F) << object.name;
  }
}

// Shading takes the side that the normals are on for the front: triangles and vertex normals must agree.
TEST(Room, TrianglesFaceAsTheirVertexNormals) {
  for (const Object& object : room().objects) {
    ASSERT_EQ(object.mesh.normals.size(), object.mesh.positions.size()) << object.name;
    for (const glm::uvec3 t : object.mesh.triangles) {
      const glm::dvec3 facet = testing::area_vector(object.mesh, t);
      ASSERT_GT(glm::length(facet), 0.0) << object.name;
      for (int k = 0; k < 3; ++k) {
        ASSERT_GT(glm::dot(facet, glm::dvec3(object.mesh.normals[t[k]])), 0.0) << object.name;
      }
    }
  }
}

TEST(Room, FourWallsFaceInwardsWithFourTextures) {
  const Scene& scene = room();
  std::set<int> textures;
  for (const char* name : {"north wall", "east wall", "south wall", "west wall"}) {
    const Object& wall = object_named(scene, name);
    textures.insert(scene.materials[static_cast<std::size_t>(wall.material)].albedo_texture.texture);
    for (std::size_t i = 0; i < wall.mesh.positions.size(); ++i) {
      EXPECT_LT(glm::dot(wall.mesh.positions[i], wall.mesh.normals[i]), 0.0F) << name;
    }
  }
  EXPECT_EQ(textures.size(), 4U);
  EXPECT_FALSE(textures.contains(-1));
}

TEST(Room, LightsShineIntoTheRoom) {
  const Scene& scene = room();
  ASSERT_EQ(scene.rectangle_lights.size(), 2U);
  for (const RectangleLight& light : scene.rectangle_lights) {
    const glm::vec3 centre = light.corner + 0.5F * (light.edge_u + light.edge_v);
    EXPECT_LT(glm::dot(glm::cross(light.edge_u, light.edge_v), centre), 0.0F);
  }
}

TEST(Room, IsTheSameEveryTime) {
  const Scene& a = room();
  const Scene b = make_room();
  ASSERT_EQ(a.textures.size(), b.textures.size());
  for (std::size_t i = 0; i < a.textures.size(); ++i)
    EXPECT_EQ(a.textures[i].image.pixels, b.textures[i].image.pixels);
  ASSERT_EQ(a.objects.size(), b.objects.size());
  for (std::size_t i = 0; i < a.objects.size(); ++i)
    EXPECT_EQ(a.objects[i].mesh.positions, b.objects[i].mesh.positions);
}

}  // namespace
}  // namespace mirrorbake
