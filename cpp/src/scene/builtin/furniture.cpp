#include "furniture.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "mesh_tools.hpp"
#include "mirrorbake/core/sampling.hpp"
#include "mirrorbake/scene/shapes.hpp"
#include "textures.hpp"

namespace mirrorbake::furniture {
namespace {

using textures::from_srgb;

constexpr float kCell = 0.2F;      // metres between vertices on furniture
constexpr float kWoodTile = 0.6F;  // metres per repeat of the wood textures
constexpr float kClothTile = 0.3F;

TriangleMesh wooden(glm::vec3 min, glm::vec3 max) { return make_block(min, max, kCell, kWoodTile); }

void add_block(TriangleMesh& mesh, glm::vec3 min, glm::vec3 max) { append(mesh, wooden(min, max)); }

float random(std::uint64_t index, std::uint64_t seed) {
  return unit_float(static_cast<std::uint32_t>(hash64(index, seed) >> 32));
}

}  // namespace

Furnisher::Furnisher(Scene& scene) : scene_(scene), oak_(0), walnut_(0), white_paint_(0), brass_(0) {
  oak_ = matte("oak", texture(textures::wood(from_srgb(0xd8bb93), from_srgb(0xa27c53))));
  walnut_ = matte("walnut", texture(textures::wood(from_srgb(0x8a5a38), from_srgb(0x4a2c19))));
  white_paint_ = matte("white paint", from_srgb(0xe9e6df));
  brass_ = matte("brass", from_srgb(0xb08d3c));
}

int Furnisher::texture(Image image) {
  scene_.textures.push_back({std::move(image)});
  return static_cast<int>(scene_.textures.size()) - 1;
}

int Furnisher::matte(std::string name, glm::vec3 albedo) {
  Material material;
  material.name = std::move(name);
  material.albedo = albedo;
  scene_.materials.push_back(std::move(material));
  return static_cast<int>(scene_.materials.size()) - 1;
}

int Furnisher::matte(std::string name, int albedo_texture) {
  const int material = matte(std::move(name), glm::vec3(1.0F));
  scene_.materials.back().albedo_texture.texture = albedo_texture;
  return material;
}

int Furnisher::glazed(std::string name, glm::vec3 albedo) {
  const int material = matte(std::move(name), albedo);
  scene_.materials.back().specular = true;
  scene_.materials.back().fresnel.model = FresnelModel::dielectric;
  scene_.materials.back().fresnel.eta = glm::vec3(1.5F);
  scene_.materials.back().layers = LayerModel::coated;
  return material;
}

void Furnisher::add(std::string name, TriangleMesh mesh, int material) {
  scene_.objects.push_back({std::move(name), std::move(mesh), material, {}});
}

void add_table(Furnisher& f, float floor, float top_width, float top_depth) {
  constexpr float kThickness = 0.035F;
  constexpr float kFineCell = 0.035F;  // the props' soft shadows on the top are indirect light too
  const glm::vec3 half(0.5F * top_width, 0.0F, 0.5F * top_depth);
  TriangleMesh top = make_panel({-half.x, 0, half.z}, {top_width, 0, 0}, {0, 0, -top_depth}, kFineCell,
                                glm::vec2(kWoodTile));
  // The rest of the slab lies a hair's breadth below the top, inside which nothing is seen.
  append(top, wooden({-half.x, -kThickness, -half.z}, {half.x, -1e-4F, half.z}));
  f.add("table top", std::move(top), f.oak());

  TriangleMesh frame;
  const float leg = 0.06F;
  const glm::vec2 reach(half.x - 0.09F, half.z - 0.09F);
  for (float x : {-reach.x, reach.x}) {
    for (float z : {-reach.y, reach.y}) {
      add_block(frame, {x - 0.5F * leg, floor, z - 0.5F * leg},
                {x + 0.5F * leg, -kThickness, z + 0.5F * leg});
    }
  }
  const float apron = -kThickness - 0.09F;
  for (float z : {-reach.y, reach.y})
    add_block(frame, {-reach.x, apron, z - 0.012F}, {reach.x, -kThickness, z + 0.012F});
  for (float x : {-reach.x, reach.x})
    add_block(frame, {x - 0.012F, apron, -reach.y}, {x + 0.012F, -kThickness, reach.y});
  f.add("table frame", std::move(frame), f.walnut());
}

void add_chair(Furnisher& f, const std::string& name, glm::vec3 place, float degrees, int cushion_material) {
  TriangleMesh frame;
  constexpr float kSeat = 0.45F;
  constexpr float kBack = 0.90F;
  for (float x : {-0.20F, 0.20F}) {
    add_block(frame, {x - 0.02F, 0, -0.22F}, {x + 0.02F, kSeat - 0.04F, -0.18F});
    add_block(frame, {x - 0.02F, 0, 0.18F}, {x + 0.02F, kBack, 0.22F});
  }
  add_block(frame, {-0.22F, kSeat - 0.04F, -0.22F}, {0.22F, kSeat, 0.18F});
  for (float y : {0.58F, 0.70F, 0.82F}) add_block(frame, {-0.18F, y, 0.19F}, {0.18F, y + 0.06F, 0.21F});
  f.add(name, placed(std::move(frame), degrees, place), f.walnut());
  f.add(name + " cushion",
        placed(
            make_rounded_block({-0.20F, kSeat, -0.20F}, {0.20F, kSeat + 0.05F, 0.17F}, 0.025F, 6, kClothTile),
            degrees, place),
        cushion_material);
}

void add_sofa(Furnisher& f, glm::vec3 place, float degrees) {
  const int cloth = f.matte("sofa cloth", f.texture(textures::weave(from_srgb(0xd9a23a))));
  const int red = f.matte("red cushion", f.texture(textures::weave(from_srgb(0xb5342f))));
  const int teal = f.matte("teal cushion", f.texture(textures::weave(from_srgb(0x1f7a80))));
  TriangleMesh body;
  const auto pad = [&](glm::vec3 min, glm::vec3 max, float radius) {
    append(body, make_rounded_block(min, max, radius, 8, kClothTile));
  };
  pad({-0.85F, 0.08F, -0.40F}, {0.85F, 0.30F, 0.40F}, 0.03F);  // base
  pad({-0.69F, 0.30F, -0.40F}, {0.00F, 0.44F, 0.22F}, 0.05F);  // seats
  pad({0.00F, 0.30F, -0.40F}, {0.69F, 0.44F, 0.22F}, 0.05F);
  pad({-0.85F, 0.30F, 0.18F}, {0.85F, 0.82F, 0.40F}, 0.08F);    // back
  pad({-0.88F, 0.08F, -0.42F}, {-0.69F, 0.60F, 0.40F}, 0.07F);  // arms
  pad({0.69F, 0.08F, -0.42F}, {0.88F, 0.60F, 0.40F}, 0.07F);
  f.add("sofa", placed(std::move(body), degrees, place), cloth);
  const auto cushion = [&](const char* name, float x, float turn, int material) {
    const TriangleMesh pillow =
        make_rounded_block({-0.19F, 0.0F, -0.06F}, {0.19F, 0.36F, 0.06F}, 0.06F, 8, kClothTile);
    f.add(name, placed(placed(pillow, turn, {x, 0.44F, 0.10F}), degrees, place), material);
  };
  cushion("red cushion", -0.45F, 12.0F, red);
  cushion("teal cushion", 0.40F, -18.0F, teal);
  TriangleMesh feet;
  for (float x : {-0.78F, 0.78F}) {
    for (float z : {-0.33F, 0.33F}) append(feet, make_cylinder({x, 0, z}, 0.025F, 0.08F, 12));
  }
  f.add("sofa feet", placed(std::move(feet), degrees, place), f.brass());
}

void add_bookshelf(Furnisher& f, glm::vec3 corner, float width, float height) {
  constexpr int kShelves = 5;
  constexpr float kBoard = 0.025F;
  constexpr float kDepth = 0.30F;
  const glm::vec3 far_corner = corner + glm::vec3(width, height, kDepth);
  TriangleMesh boards;
  add_block(boards, corner, {corner.x + kBoard, far_corner.y, far_corner.z});
  add_block(boards, {far_corner.x - kBoard, corner.y, corner.z}, far_corner);
  add_block(boards, {corner.x + kBoard, corner.y, corner.z},
            {far_corner.x - kBoard, far_corner.y, corner.z + 0.01F});
  const float pitch = (height - kBoard) / kShelves;
  for (int i = 0; i <= kShelves; ++i) {
    const float y = corner.y + pitch * static_cast<float>(i);
    add_block(boards, {corner.x + kBoard, y, corner.z + 0.01F},
              {far_corner.x - kBoard, y + kBoard, far_corner.z});
  }
  f.add("bookshelf", std::move(boards), f.walnut());

  constexpr std::array<unsigned, 9> kCovers = {0xb23a2e, 0x2f5d8a, 0xe0b040, 0x3d7a4a, 0x6d4c7d,
                                               0xe7dcc4, 0x1d2733, 0xd9772f, 0x8fb4bd};
  std::array<TriangleMesh, kCovers.size()> books;
  std::uint64_t index = 0;
  for (int i = 0; i < kShelves; ++i) {
    const float y = corner.y + pitch * static_cast<float>(i) + kBoard;
    float x = corner.x + kBoard + 0.01F;
    // Leave a gap of another length at the end of every shelf.
    const float end = far_corner.x - kBoard - 0.02F - 0.3F * random(static_cast<std::uint64_t>(i), 101);
    while (true) {
      ++index;
      const float thickness = 0.022F + 0.035F * random(index, 102);
      if (x + thickness > end) break;
      const float book_height = (pitch - kBoard) * (0.62F + 0.3F * random(index, 103));
      const float depth = 0.18F + 0.08F * random(index, 104);
      const std::size_t cover =
          static_cast<std::size_t>(random(index, 105) * static_cast<float>(kCovers.size()));
      append(books[cover], make_box({x, y, corner.z + 0.012F},
                                    {x + thickness, y + book_height, corner.z + 0.012F + depth}));
      x += thickness + 0.002F;
    }
  }
  for (std::size_t i = 0; i < kCovers.size(); ++i) {
    if (books[i].triangles.empty()) continue;
    const std::string name = "books " + std::to_string(i + 1);
    f.add(name, std::move(books[i]), f.matte(name, from_srgb(kCovers[i])));
  }
}

void add_sideboard(Furnisher& f, glm::vec3 min, glm::vec3 max) {
  constexpr float kFeet = 0.12F;
  f.add("sideboard", wooden({min.x, min.y + kFeet, min.z}, max), f.oak());
  TriangleMesh feet;
  for (float x : {min.x + 0.05F, max.x - 0.05F}) {
    for (float z : {min.z + 0.05F, max.z - 0.05F})
      append(feet, make_cylinder({x, min.y, z}, 0.02F, kFeet, 12));
  }
  TriangleMesh doors;
  constexpr int kDoors = 3;
  const float pitch = (max.x - min.x) / kDoors;
  for (int i = 0; i < kDoors; ++i) {
    const float x = min.x + pitch * static_cast<float>(i);
    append(doors, make_block({x + 0.02F, min.y + kFeet + 0.02F, min.z - 0.015F},
                             {x + pitch - 0.02F, max.y - 0.03F, min.z}, kCell, kWoodTile));
    append(feet, make_sphere({x + pitch - 0.06F, 0.5F * (min.y + kFeet + max.y), min.z - 0.03F}, 0.015F, 12));
  }
  f.add("sideboard doors", std::move(doors), f.white_paint());
  f.add("sideboard brass", std::move(feet), f.brass());
}

void add_floor_lamp(Furnisher& f, glm::vec3 place) {
  TriangleMesh stand = make_lathe(place,
                                  {{0.0F, 0.0F},
                                   {0.15F, 0.0F},
                                   {0.15F, 0.015F},
                                   {0.03F, 0.03F},
                                   {0.012F, 0.06F},
                                   {0.012F, 1.40F},
                                   {0.0F, 1.40F}},
                                  24);
  f.add("lamp stand", std::move(stand), f.brass());
  // A paper shade, open at both ends.
  const int shade = f.matte("lamp shade", from_srgb(0xf3dfb5));
  f.add("lamp shade",
        make_lathe(place + glm::vec3(0, 1.30F, 0),
                   {{0.21F, 0.0F}, {0.14F, 0.30F}, {0.135F, 0.30F}, {0.205F, 0.0F}, {0.21F, 0.0F}}, 32),
        shade);
}

void add_potted_tree(Furnisher& f, glm::vec3 place) {
  f.add("flower pot",
        make_lathe(place,
                   {{0.0F, 0.0F},
                    {0.13F, 0.0F},
                    {0.17F, 0.30F},
                    {0.185F, 0.30F},
                    {0.185F, 0.34F},
                    {0.16F, 0.34F},
                    {0.155F, 0.29F},
                    {0.0F, 0.29F}},
                   32),
        f.matte("terracotta", from_srgb(0xb9603d)));
  f.add("tree trunk", make_cylinder(place + glm::vec3(0, 0.29F, 0), 0.018F, 0.55F, 12), f.walnut());
  const int green = f.matte("leaves", f.texture(textures::leaves()));
  f.add("tree crown", make_sphere(place + glm::vec3(0, 1.02F, 0), 0.27F, 40), green);
}

void add_cup_and_saucer(Furnisher& f, const std::string& name, glm::vec3 place, float degrees,
                        glm::vec3 colour) {
  const int glaze = f.glazed(name, colour);
  TriangleMesh china = make_lathe({0, 0, 0},
                                  {{0.0F, 0.0F},
                                   {0.035F, 0.0F},
                                   {0.045F, 0.004F},
                                   {0.072F, 0.013F},
                                   {0.070F, 0.016F},
                                   {0.045F, 0.008F},
                                   {0.0F, 0.007F}},
                                  40);
  append(china, make_lathe({0, 0.007F, 0},
                           {{0.0F, 0.0F},
                            {0.020F, 0.0F},
                            {0.022F, 0.004F},
                            {0.034F, 0.018F},
                            {0.040F, 0.036F},
                            {0.042F, 0.056F},
                            {0.0395F, 0.056F},
                            {0.0375F, 0.036F},
                            {0.031F, 0.019F},
                            {0.018F, 0.008F},
                            {0.0F, 0.006F}},
                           40));
  f.add(name, placed(china, degrees, place), glaze);
  // The handle: a ring that stands upright and runs into the cup's wall.
  TriangleMesh ring = make_torus({0, 0, 0}, 0.014F, 0.0035F, 24);
  for (glm::vec3& p : ring.positions) p = {p.x + 0.048F, p.z + 0.042F, -p.y};
  for (glm::vec3& n : ring.normals) n = {n.x, n.z, -n.y};
  f.add(name + " handle", placed(std::move(ring), degrees, place), glaze);
  f.add(name + " tea",
        placed(make_lathe({0, 0, 0}, {{0.041F, 0.0525F}, {0.0F, 0.0525F}}, 40), degrees, place),
        f.glazed("tea", from_srgb(0x7a3b14)));
}

void add_vase(Furnisher& f, glm::vec3 place) {
  f.add("vase",
        make_lathe(place,
                   {{0.0F, 0.0F},
                    {0.035F, 0.0F},
                    {0.052F, 0.03F},
                    {0.060F, 0.07F},
                    {0.050F, 0.11F},
                    {0.028F, 0.15F},
                    {0.024F, 0.175F},
                    {0.034F, 0.20F},
                    {0.030F, 0.20F},
                    {0.020F, 0.175F},
                    {0.020F, 0.16F},
                    {0.0F, 0.16F}},
                   40),
        f.glazed("vase", from_srgb(0x1c4f9c)));
  TriangleMesh stems;
  TriangleMesh blossoms;
  for (int i = 0; i < 5; ++i) {
    const float turn = 72.0F * static_cast<float>(i) + 20.0F;
    const float height = 0.30F + 0.05F * random(static_cast<std::uint64_t>(i), 111);
    // A stem leans outwards: a cylinder whose upper end is moved.
    TriangleMesh stem = make_cylinder({0, 0.15F, 0}, 0.0025F, height - 0.15F, 8);
    const float lean = 0.055F + 0.03F * random(static_cast<std::uint64_t>(i), 112);
    for (glm::vec3& p : stem.positions) p.x += lean * (p.y - 0.15F) / (height - 0.15F);
    append(stems, placed(std::move(stem), turn, place));
    append(
        blossoms,
        placed(make_lathe(
                   {lean, height - 0.012F, 0},
                   {{0.0F, 0.0F}, {0.018F, 0.012F}, {0.022F, 0.028F}, {0.014F, 0.048F}, {0.0F, 0.040F}}, 16),
               turn, place));
  }
  f.add("tulip stems", std::move(stems), f.matte("stems", from_srgb(0x4c7a2d)));
  f.add("tulips", std::move(blossoms), f.matte("tulips", from_srgb(0xd94a6a)));
}

void add_fruit(Furnisher& f, glm::vec3 place) {
  f.add("bowl",
        make_lathe(place,
                   {{0.0F, 0.0F},
                    {0.040F, 0.0F},
                    {0.045F, 0.006F},
                    {0.075F, 0.022F},
                    {0.098F, 0.050F},
                    {0.094F, 0.051F},
                    {0.070F, 0.027F},
                    {0.040F, 0.013F},
                    {0.0F, 0.010F}},
                   48),
        f.glazed("bowl", from_srgb(0xe8e2d0)));
  TriangleMesh oranges;
  append(oranges, make_sphere(place + glm::vec3(0.036F, 0.050F, 0.008F), 0.035F, 24));
  append(oranges, make_sphere(place + glm::vec3(-0.022F, 0.050F, 0.034F), 0.034F, 24));
  f.add("oranges", std::move(oranges), f.matte("oranges", from_srgb(0xf08a1d)));
  TriangleMesh apples;
  append(apples, make_sphere(place + glm::vec3(-0.020F, 0.050F, -0.034F), 0.034F, 24));
  append(apples, make_sphere(place + glm::vec3(-0.002F, 0.100F, 0.002F), 0.031F, 24));
  f.add("apples", std::move(apples), f.glazed("apples", from_srgb(0xa31621)));
}

void add_draughts(Furnisher& f, glm::vec3 place, float degrees) {
  constexpr float kSide = 0.24F;
  constexpr float kThickness = 0.012F;
  const float half = 0.5F * kSide;
  const int squares =
      f.matte("board squares", f.texture(textures::checkers(8, from_srgb(0xefe3c6), from_srgb(0x2a1a12))));
  f.add("draughts board",
        placed(make_box({-half - 0.012F, 0, -half - 0.012F}, {half + 0.012F, kThickness, half + 0.012F}),
               degrees, place),
        f.walnut());
  f.add("draughts squares",
        placed(make_picture({-half, kThickness + 5e-4F, half}, {kSide, 0, 0}, {0, 0, -kSide}, 0.03F), degrees,
               place),
        squares);
  const std::vector<glm::vec2> draught = {{0.0F, 0.0F},      {0.0115F, 0.0F},    {0.0125F, 0.0015F},
                                          {0.0125F, 0.006F}, {0.0115F, 0.0075F}, {0.0F, 0.0075F}};
  const std::array<std::array<int, 2>, 10> squares_taken = {
      {{0, 0}, {2, 0}, {6, 0}, {1, 1}, {4, 2}, {7, 7}, {3, 7}, {1, 7}, {6, 6}, {3, 5}}};
  TriangleMesh white;
  TriangleMesh black;
  for (std::size_t i = 0; i < squares_taken.size(); ++i) {
    const float step = kSide / 8.0F;
    const glm::vec3 at(-half + step * (static_cast<float>(squares_taken[i][0]) + 0.5F), kThickness + 5e-4F,
                       half - step * (static_cast<float>(squares_taken[i][1]) + 0.5F));
    append(i < squares_taken.size() / 2 ? white : black, make_lathe(at, draught, 20));
  }
  f.add("white draughts", placed(std::move(white), degrees, place),
        f.matte("white draughts", from_srgb(0xf0ece0)));
  f.add("red draughts", placed(std::move(black), degrees, place),
        f.matte("red draughts", from_srgb(0xc1272d)));
}

void add_book_pile(Furnisher& f, glm::vec3 place, float degrees) {
  struct Book {
    float width, depth, thickness, turn;
    unsigned cover;
  };
  constexpr std::array<Book, 3> kBooks = {{{0.21F, 0.15F, 0.028F, 0.0F, 0x1e5c4a},
                                           {0.19F, 0.13F, 0.022F, 14.0F, 0xe2b33c},
                                           {0.15F, 0.11F, 0.030F, -9.0F, 0x9c2f3f}}};
  const int paper = f.matte("paper", from_srgb(0xefe8d8));
  TriangleMesh pages;
  float y = 0.0F;
  for (std::size_t i = 0; i < kBooks.size(); ++i) {
    const Book& b = kBooks[i];
    constexpr float kCover = 0.003F;
    const glm::vec3 half(0.5F * b.width, 0, 0.5F * b.depth);
    TriangleMesh cover = make_box({-half.x, 0, -half.z}, {half.x, kCover, half.z});
    append(cover, make_box({-half.x, b.thickness - kCover, -half.z}, {half.x, b.thickness, half.z}));
    append(cover,
           make_box({-half.x, kCover, half.z - kCover}, {half.x, b.thickness - kCover, half.z}));  // spine
    const glm::vec3 at = place + glm::vec3(0, y, 0);
    const std::string name = "book " + std::to_string(i + 1);
    f.add(name, placed(std::move(cover), degrees + b.turn, at), f.matte(name, from_srgb(b.cover)));
    append(pages, placed(make_box({-half.x + 0.004F, kCover, -half.z + 0.004F},
                                  {half.x - 0.004F, b.thickness - kCover, half.z - kCover}),
                         degrees + b.turn, at));
    y += b.thickness;
  }
  f.add("pages", std::move(pages), paper);
}

void add_napkin(Furnisher& f, glm::vec3 place, float degrees) {
  constexpr float kThickness = 0.004F;
  const glm::vec3 half(0.10F, 0.0F, 0.065F);
  const int cloth =
      f.matte("napkin", f.texture(textures::checkers(6, from_srgb(0xf4efe6), from_srgb(0xc8343c))));
  TriangleMesh napkin =
      make_picture({-half.x, kThickness, half.z}, {2.0F * half.x, 0, 0}, {0, 0, -2.0F * half.z}, 0.05F);
  append(napkin, make_box(-half, half + glm::vec3(0.0F, kThickness - 5e-4F, 0.0F)));
  f.add("napkin", placed(std::move(napkin), degrees, place), cloth);
}

void add_lemon(Furnisher& f, glm::vec3 place) {
  f.add("lemon",
        make_lathe(place,
                   {{0.0F, 0.0F},
                    {0.013F, 0.003F},
                    {0.022F, 0.010F},
                    {0.0265F, 0.021F},
                    {0.0265F, 0.033F},
                    {0.022F, 0.045F},
                    {0.013F, 0.053F},
                    {0.006F, 0.058F},
                    {0.0F, 0.060F}},
                   32),
        f.matte("lemon", from_srgb(0xf3d32f)));
}

void add_toys(Furnisher& f, glm::vec3 place, float degrees) {
  f.add("toy block", placed(make_box({-0.03F, 0, -0.03F}, {0.03F, 0.06F, 0.03F}), degrees, place),
        f.matte("toy block", f.texture(textures::toy_block())));
  f.add("toy cone", placed(make_cone({0.085F, 0, 0.02F}, 0.032F, 0.085F, 40), degrees, place),
        f.matte("toy cone", from_srgb(0xf2c52e)));
  f.add("toy ball", placed(make_sphere({0.02F, 0.028F, 0.085F}, 0.028F, 40), degrees, place),
        f.glazed("toy ball", from_srgb(0x2b9348)));
  f.add("toy ring", placed(make_torus({-0.075F, 0.014F, 0.045F}, 0.034F, 0.0135F, 40), degrees, place),
        f.matte("toy ring", from_srgb(0x8a4fae)));
}

}  // namespace mirrorbake::furniture
