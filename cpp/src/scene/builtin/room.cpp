#include "mirrorbake/scene/room.hpp"

#include <string>
#include <utility>
#include <glm/geometric.hpp>

#include "furniture.hpp"
#include "mesh_tools.hpp"
#include "mirrorbake/scene/shapes.hpp"
#include "textures.hpp"

namespace mirrorbake {
namespace {

using furniture::Furnisher;
using textures::from_srgb;

// Inner faces of the room, metres. The table stands off its middle, so that no two walls look alike from
// there.
constexpr float kWest = -2.4F;
constexpr float kEast = 2.1F;
constexpr float kNorth = -3.1F;
constexpr float kSouth = 2.4F;
constexpr float kFloor = -0.75F;
constexpr float kCeiling = 2.05F;
constexpr float kWidth = kEast - kWest;
constexpr float kDepth = kSouth - kNorth;
constexpr float kHeight = kCeiling - kFloor;
constexpr float kWallCell = 0.15F;

// The window in the east wall.
constexpr float kWindowSouth = 0.45F;
constexpr float kWindowNorth = -1.05F;
constexpr float kWindowBottom = 0.15F;
constexpr float kWindowTop = 1.55F;

// Every wall has its own colour and pattern: a mirrored or turned map is seen at once.
void add_walls(Furnisher& f) {
  const glm::vec3 x(kWidth, 0, 0);
  const glm::vec3 y(0, kHeight, 0);
  const glm::vec3 z(0, 0, kDepth);
  const glm::vec3 north_west(kWest, kFloor, kNorth);
  const glm::vec3 north_east(kEast, kFloor, kNorth);
  const glm::vec3 south_west(kWest, kFloor, kSouth);
  const glm::vec3 south_east(kEast, kFloor, kSouth);
  const auto wall = [&](const char* name, glm::vec3 corner, glm::vec3 along, Image image, glm::vec2 tile) {
    f.add(name, make_panel(corner, along, y, kWallCell, tile), f.matte(name, f.texture(std::move(image))));
  };
  wall("north wall", north_west, x, textures::trellis(from_srgb(0xe3b261), from_srgb(0xc58a34)),
       {0.6F, 0.7F});
  wall("east wall", north_east, z, textures::stripes(from_srgb(0xb9cfae), from_srgb(0x7fa27a)), {0.9F, 0.9F});
  wall("south wall", south_east, -x, textures::bricks(), {1.0F, 1.0F});
  wall("west wall", south_west, -z, textures::diamonds(from_srgb(0x5b8cc0), from_srgb(0xa9cbe8)),
       {0.7F, 0.7F});
  f.add("floor", make_panel(south_west, x, -z, kWallCell, glm::vec2(1.2F)),
        f.matte("floor", f.texture(textures::floorboards())));
  f.add("ceiling", make_panel({kWest, kCeiling, kNorth}, x, z, 2.0F * kWallCell, glm::vec2(1.0F)),
        f.white_paint());

  TriangleMesh skirting;
  constexpr float kHigh = kFloor + 0.1F;
  constexpr float kThick = 0.015F;
  append(skirting, make_block({kWest, kFloor, kNorth}, {kEast, kHigh, kNorth + kThick}, 0.3F, 1.0F));
  append(skirting, make_block({kWest, kFloor, kSouth - kThick}, {kEast, kHigh, kSouth}, 0.3F, 1.0F));
  append(skirting,
         make_block({kWest, kFloor, kNorth + kThick}, {kWest + kThick, kHigh, kSouth - kThick}, 0.3F, 1.0F));
  append(skirting,
         make_block({kEast - kThick, kFloor, kNorth + kThick}, {kEast, kHigh, kSouth - kThick}, 0.3F, 1.0F));
  f.add("skirting boards", std::move(skirting), f.white_paint());
}

void add_window(Scene& scene, Furnisher& f) {
  constexpr float kBar = 0.04F;
  constexpr float kFrame = 0.07F;
  TriangleMesh frame;
  const auto bar = [&](float bottom, float top, float north, float south, float thickness) {
    append(frame, make_block({kEast - thickness, bottom, north}, {kEast, top, south}, 0.3F, 1.0F));
  };
  bar(kWindowBottom - kFrame, kWindowBottom, kWindowNorth - kFrame, kWindowSouth + kFrame, 0.06F);
  bar(kWindowTop, kWindowTop + kFrame, kWindowNorth - kFrame, kWindowSouth + kFrame, 0.06F);
  bar(kWindowBottom, kWindowTop, kWindowNorth - kFrame, kWindowNorth, 0.06F);
  bar(kWindowBottom, kWindowTop, kWindowSouth, kWindowSouth + kFrame, 0.06F);
  const float middle = 0.5F * (kWindowNorth + kWindowSouth);
  const float crossbar = kWindowBottom + 0.62F * (kWindowTop - kWindowBottom);
  bar(kWindowBottom, kWindowTop, middle - 0.5F * kBar, middle + 0.5F * kBar, 0.04F);
  bar(crossbar - 0.5F * kBar, crossbar + 0.5F * kBar, kWindowNorth, middle - 0.5F * kBar, 0.04F);
  bar(crossbar - 0.5F * kBar, crossbar + 0.5F * kBar, middle + 0.5F * kBar, kWindowSouth, 0.04F);
  append(frame, make_block({kEast - 0.18F, kWindowBottom - kFrame - 0.03F, kWindowNorth - 0.15F},
                           {kEast, kWindowBottom - kFrame, kWindowSouth + 0.15F}, 0.15F, 1.0F));  // sill
  f.add("window frame", std::move(frame), f.white_paint());

  const int cloth = f.matte("curtain cloth", f.texture(textures::weave(from_srgb(0xa8423f))));
  TriangleMesh curtains;
  constexpr float kDrop = kFloor + 0.05F;
  constexpr float kRail = kWindowTop + 0.22F;
  const glm::vec3 width(0, 0, 0.38F);
  append(curtains,
         make_curtain({kEast - 0.11F, kDrop, kWindowNorth - 0.40F}, width, kRail - kDrop, 6, 0.03F));
  append(curtains,
         make_curtain({kEast - 0.11F, kDrop, kWindowSouth + 0.02F}, width, kRail - kDrop, 6, 0.03F));
  f.add("curtains", std::move(curtains), cloth);
  f.add("curtain rail",
        make_block({kEast - 0.12F, kRail, kWindowNorth - 0.5F},
                   {kEast - 0.10F, kRail + 0.02F, kWindowSouth + 0.5F}, 0.3F, 1.0F),
        f.brass());

  RectangleLight daylight;  // the panes
  daylight.corner = {kEast - 0.005F, kWindowBottom, kWindowNorth};
  daylight.edge_u = {0, 0, kWindowSouth - kWindowNorth};
  daylight.edge_v = {0, kWindowTop - kWindowBottom, 0};
  daylight.radiance = {2.4F, 2.9F, 3.6F};
  scene.rectangle_lights.push_back(daylight);
}

void add_ceiling_light(Scene& scene, Furnisher& f) {
  constexpr float kHalf = 0.5F;
  constexpr float kDrop = 0.06F;
  RectangleLight light;
  light.corner = {-0.2F - kHalf, kCeiling - kDrop, -0.1F - kHalf};
  light.edge_u = {2.0F * kHalf, 0, 0};
  light.edge_v = {0, 0, 2.0F * kHalf};
  light.radiance = {10.4F, 10.0F, 9.2F};
  scene.rectangle_lights.push_back(light);

  const glm::vec3 min = light.corner;
  const glm::vec3 max = min + light.edge_u + light.edge_v;
  constexpr float kBorder = 0.04F;
  constexpr float kBottom = kCeiling - kDrop - 0.015F;
  TriangleMesh frame;
  append(frame, make_block({min.x - kBorder, kBottom, min.z - kBorder}, {max.x + kBorder, kCeiling, min.z},
                           0.3F, 1.0F));
  append(frame, make_block({min.x - kBorder, kBottom, max.z}, {max.x + kBorder, kCeiling, max.z + kBorder},
                           0.3F, 1.0F));
  append(frame, make_block({min.x - kBorder, kBottom, min.z}, {min.x, kCeiling, max.z}, 0.3F, 1.0F));
  append(frame, make_block({max.x, kBottom, min.z}, {max.x + kBorder, kCeiling, max.z}, 0.3F, 1.0F));
  f.add("ceiling light frame", std::move(frame), f.walnut());
}

// A framed picture: `corner` is its lower left one, `along` points right, both in the wall's plane.
void add_painting(Furnisher& f, const char* name, glm::vec3 corner, glm::vec3 along, float height,
                  Image image) {
  constexpr float kDepthOfFrame = 0.03F;
  constexpr float kBorder = 0.035F;
  const glm::vec3 up(0, height, 0);
  const glm::vec3 unit_along = glm::normalize(along);
  const glm::vec3 unit_up(0, 1, 0);
  const glm::vec3 out = glm::cross(unit_along, unit_up);
  f.add(name, make_picture(corner + 0.5F * kDepthOfFrame * out, along, up, 0.1F),
        f.matte(name, f.texture(std::move(image))));
  TriangleMesh frame;
  const auto strip = [&](glm::vec3 from, glm::vec3 to) {
    append(frame, make_block(glm::min(from, to), glm::max(from, to), 0.2F, 0.6F));
  };
  const glm::vec3 front = kDepthOfFrame * out;
  const glm::vec3 right = corner + along;
  strip(corner - kBorder * unit_along - kBorder * unit_up, right + kBorder * unit_along + front);
  strip(corner + up - kBorder * unit_along, right + up + kBorder * unit_along + kBorder * unit_up + front);
  strip(corner - kBorder * unit_along, corner + up + front);
  strip(right, right + up + kBorder * unit_along + front);
  f.add(std::string(name) + " frame", std::move(frame), f.walnut());
}

void add_door(Furnisher& f) {
  constexpr float kNorthEdge = 1.20F;
  constexpr float kSouthEdge = 2.05F;
  constexpr float kTop = kFloor + 2.05F;
  TriangleMesh frame;
  append(frame,
         make_block({kWest, kFloor, kNorthEdge - 0.08F}, {kWest + 0.04F, kTop, kNorthEdge}, 0.3F, 1.0F));
  append(frame,
         make_block({kWest, kFloor, kSouthEdge}, {kWest + 0.04F, kTop, kSouthEdge + 0.08F}, 0.3F, 1.0F));
  append(frame, make_block({kWest, kTop, kNorthEdge - 0.08F},
                           {kWest + 0.04F, kTop + 0.08F, kSouthEdge + 0.08F}, 0.3F, 1.0F));
  f.add("door frame", std::move(frame), f.white_paint());
  const int green = f.matte("door paint", from_srgb(0x2f5d50));
  TriangleMesh door = make_block({kWest, kFloor, kNorthEdge}, {kWest + 0.02F, kTop, kSouthEdge}, 0.2F, 1.0F);
  for (float bottom : {kFloor + 0.12F, kFloor + 1.08F}) {
    append(door, make_block({kWest + 0.02F, bottom, kNorthEdge + 0.12F},
                            {kWest + 0.03F, bottom + 0.82F, kSouthEdge - 0.12F}, 0.2F, 1.0F));
  }
  f.add("door", std::move(door), green);
  f.add("door knob", make_sphere({kWest + 0.06F, kFloor + 1.0F, kNorthEdge + 0.07F}, 0.03F, 20), f.brass());
}

void add_clock(Furnisher& f, glm::vec3 centre, float radius) {
  // It hangs on the south wall and faces −Z: its right is −X.
  const glm::vec3 half_right(-radius, 0, 0);
  const glm::vec3 half_up(0, radius, 0);
  TriangleMesh face;
  TriangleMesh rim;
  constexpr int kSegments = 48;
  constexpr float kThickness = 0.03F;
  // The lathe's disc and rim, tipped from +Y to −Z.
  const auto tipped = [&](TriangleMesh mesh) {
    for (glm::vec3& p : mesh.positions) p = centre + glm::vec3(-p.x, -p.z, -p.y);
    for (glm::vec3& n : mesh.normals) n = {-n.x, -n.z, -n.y};
    return mesh;
  };
  face = tipped(make_lathe({0, 0, 0}, {{radius, kThickness}, {0.0F, kThickness}}, kSegments));
  for (std::size_t i = 0; i < face.positions.size(); ++i) {
    const glm::vec3 d = face.positions[i] - centre;
    face.uvs[i] = {0.5F + 0.5F * glm::dot(d, half_right) / (radius * radius),
                   0.5F + 0.5F * glm::dot(d, half_up) / (radius * radius)};
  }
  rim = tipped(make_lathe({0, 0, 0},
                          {{radius + 0.02F, 0.0F},
                           {radius + 0.02F, kThickness + 0.01F},
                           {radius, kThickness + 0.01F},
                           {radius, kThickness}},
                          kSegments));
  f.add("clock face", std::move(face), f.matte("clock face", f.texture(textures::clock_face())));
  f.add("clock rim", std::move(rim), f.brass());
}

}  // namespace

Scene make_room() {
  Scene scene;
  Furnisher f(scene);
  add_walls(f);
  add_window(scene, f);
  add_ceiling_light(scene, f);
  add_door(f);
  f.add("rug", make_picture({-1.35F, kFloor + 0.004F, 1.0F}, {2.7F, 0, 0}, {0, 0, -2.0F}, 0.1F),
        f.matte("rug", f.texture(textures::rug())));

  const int blue_cloth = f.matte("blue cloth", f.texture(textures::weave(from_srgb(0x3a6ea5))));
  const int green_cloth = f.matte("green cloth", f.texture(textures::weave(from_srgb(0x4f8a4c))));
  furniture::add_table(f, kFloor, 1.4F, 0.9F);
  furniture::add_chair(f, "north chair", {0.12F, kFloor, -0.86F}, 172.0F, blue_cloth);
  furniture::add_chair(f, "west chair", {-1.10F, kFloor, 0.12F}, -95.0F, green_cloth);
  furniture::add_chair(f, "south chair", {0.35F, kFloor, 1.05F}, 20.0F, blue_cloth);
  furniture::add_sofa(f, {kWest + 0.48F, kFloor, -0.60F}, -90.0F);
  furniture::add_bookshelf(f, {0.0F, kFloor, kNorth + 0.016F}, 1.3F, 1.95F);
  furniture::add_sideboard(f, {-1.3F, kFloor, kSouth - 0.46F}, {0.6F, kFloor + 0.75F, kSouth - 0.016F});
  furniture::add_floor_lamp(f, {1.70F, kFloor, -2.70F});
  furniture::add_potted_tree(f, {1.68F, kFloor, 1.60F});

  add_painting(f, "landscape", {-1.75F, 0.35F, kNorth}, {1.2F, 0, 0}, 0.8F, textures::landscape());
  add_painting(f, "composition", {kWest, 0.40F, -0.20F}, {0, 0, -0.8F}, 1.0F, textures::rectangles());
  add_painting(f, "circles", {0.10F, 0.45F, kSouth}, {-1.0F, 0, 0}, 0.75F, textures::circles());
  add_clock(f, {1.25F, 1.05F, kSouth}, 0.2F);

  // The side towards +Z and +X is where views usually are: only low things lie there, near the table's edge,
  // where they are reflected but hide nothing.
  furniture::add_book_pile(f, {-0.10F, 0.0F, -0.30F}, 8.0F);
  furniture::add_vase(f, {0.10F, 0.0F, -0.36F});
  furniture::add_cup_and_saucer(f, "mint cup", {-0.27F, 0.0F, -0.17F}, 200.0F, from_srgb(0x9fd0bf));
  furniture::add_fruit(f, {-0.38F, 0.0F, 0.0F});
  furniture::add_draughts(f, {-0.36F, 0.0F, 0.24F}, 18.0F);
  furniture::add_toys(f, {0.33F, 0.0F, -0.30F}, 200.0F);
  furniture::add_cup_and_saucer(f, "white cup", {0.36F, 0.0F, 0.24F}, 30.0F, from_srgb(0xf1ede4));
  furniture::add_napkin(f, {0.02F, 0.0F, 0.33F}, -12.0F);
  furniture::add_lemon(f, {0.46F, 0.0F, 0.02F});
  return scene;
}

}  // namespace mirrorbake
