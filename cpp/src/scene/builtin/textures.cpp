#include "textures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/sampling.hpp"

namespace mirrorbake::textures {
namespace {

constexpr float kTwoPi = 2.0F * std::numbers::pi_v<float>;

// Calls colour(u, v) for points of the unit square, v up. Every texel is the mean of kSupersampling² points:
// 1 is enough for what has no sharp edges.
template <int kSupersampling = 2, typename Colour>
Image paint(int width, int height, const Colour& colour) {
  Image image(width, height, {"R", "G", "B"});
  const auto paint_row = [&](int y) {
    for (int x = 0; x < width; ++x) {
      glm::vec3 sum(0.0F);
      for (int j = 0; j < kSupersampling; ++j) {
        for (int i = 0; i < kSupersampling; ++i) {
          const float sx = static_cast<float>(x) + (static_cast<float>(i) + 0.5F) / kSupersampling;
          const float sy = static_cast<float>(y) + (static_cast<float>(j) + 0.5F) / kSupersampling;
          sum += colour(sx / static_cast<float>(width), 1.0F - sy / static_cast<float>(height));
        }
      }
      const glm::vec3 mean =
          glm::clamp(sum / static_cast<float>(kSupersampling * kSupersampling), 0.0F, 1.0F);
      for (int c = 0; c < 3; ++c) image.at(x, y)[c] = mean[c];
    }
  };
  parallel_for(static_cast<std::size_t>(height), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) paint_row(static_cast<int>(y));
  });
  return image;
}

float random(int x, int y, std::uint64_t seed) {
  const std::uint64_t cell =
      (static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) << 32) | static_cast<std::uint32_t>(y);
  return unit_float(static_cast<std::uint32_t>(hash64(cell, seed) >> 32));
}

int wrap(int i, int period) { return ((i % period) + period) % period; }

// Value noise in [0,1] on a lattice of periods_u × periods_v cells over the unit square; it repeats.
float noise(float u, float v, int periods_u, int periods_v, std::uint64_t seed) {
  const float x = u * static_cast<float>(periods_u);
  const float y = v * static_cast<float>(periods_v);
  const int i = static_cast<int>(std::floor(x));
  const int j = static_cast<int>(std::floor(y));
  const float a = glm::smoothstep(0.0F, 1.0F, x - static_cast<float>(i));
  const float b = glm::smoothstep(0.0F, 1.0F, y - static_cast<float>(j));
  const auto corner = [&](int di, int dj) {
    return random(wrap(i + di, periods_u), wrap(j + dj, periods_v), seed);
  };
  return glm::mix(glm::mix(corner(0, 0), corner(1, 0), a), glm::mix(corner(0, 1), corner(1, 1), a), b);
}

// Grain along u: long streaks at three scales, darkest in thin lines.
float grain(float u, float v, std::uint64_t seed) {
  const float bend = 0.02F * (noise(u, v, 3, 4, seed) - 0.5F);
  const float w = v + bend;
  return 0.5F * noise(u, w, 2, 24, seed + 1) + 0.3F * noise(u, w, 4, 64, seed + 2) +
         0.2F * noise(u, w, 8, 160, seed + 3);
}

float square(float x) { return x * x; }

}  // namespace

glm::vec3 from_srgb(unsigned hex) {
  glm::vec3 colour(0.0F);
  for (int i = 0; i < 3; ++i) {
    const float c = static_cast<float>((hex >> (16 - 8 * i)) & 0xffU) / 255.0F;
    colour[i] = c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F);  // IEC 61966-2-1
  }
  return colour;
}

Image wood(glm::vec3 light, glm::vec3 dark) {
  return paint<1>(512, 512, [&](float u, float v) {
    return glm::mix(light, dark, glm::smoothstep(0.2F, 0.8F, grain(u, v, 11)));
  });
}

Image floorboards() {
  constexpr int kRows = 8;  // of boards per tile, each with one joint
  const glm::vec3 light = from_srgb(0xc69a6b);
  const glm::vec3 dark = from_srgb(0x83552f);
  return paint<1>(512, 512, [&](float u, float v) {
    const float rows = v * kRows;
    const int row = wrap(static_cast<int>(std::floor(rows)), kRows);
    const float across = rows - std::floor(rows);
    const float joint = random(row, 0, 21);
    const float along = glm::fract(u - joint);
    const float edge = std::min(std::min(across, 1.0F - across) / kRows, std::min(along, 1.0F - along));
    const float tint = random(row, 1, 22);
    const float streaks = grain(u, v, 23 + static_cast<std::uint64_t>(row));
    const glm::vec3 board =
        glm::mix(light, dark, glm::clamp(0.55F * streaks + 0.6F * tint - 0.05F, 0.0F, 1.0F));
    return board * glm::mix(0.25F, 1.0F, glm::smoothstep(0.0015F, 0.004F, edge));
  });
}

Image bricks() {
  const glm::vec3 dark_clay = from_srgb(0x8c3b2a);
  const glm::vec3 light_clay = from_srgb(0xc46a4a);
  constexpr int kColumns = 4;
  constexpr int kRows = 12;
  const glm::vec3 mortar = from_srgb(0xbdb3a4);
  return paint<1>(512, 512, [&](float u, float v) {
    const float y = v * kRows;
    const int row = wrap(static_cast<int>(std::floor(y)), kRows);
    const float x = u * kColumns + (row % 2 == 0 ? 0.0F : 0.5F);
    const int column = wrap(static_cast<int>(std::floor(x)), kColumns);
    const float inside_x =
        std::min(glm::fract(x), 1.0F - glm::fract(x)) * 3.0F;  // a brick is three times as long
    const float inside_y = std::min(glm::fract(y), 1.0F - glm::fract(y));
    const float rough = 0.06F * (noise(u, v, 40, 40, 31) - 0.5F);
    const float brick = glm::smoothstep(0.06F, 0.11F, std::min(inside_x, inside_y) + rough);
    const glm::vec3 clay = glm::mix(dark_clay, light_clay, random(column, row, 32));
    return glm::mix(mortar, clay * (0.8F + 0.4F * noise(u, v, 60, 60, 33)), brick);
  });
}

Image stripes(glm::vec3 ground, glm::vec3 stripe) {
  return paint(256, 64, [&](float u, float) {
    const float x = glm::fract(4.0F * u);
    const bool is_wide = x > 0.1F && x < 0.5F;
    const bool is_narrow = x > 0.72F && x < 0.78F;
    return is_wide || is_narrow ? stripe : ground;
  });
}

Image diamonds(glm::vec3 ground, glm::vec3 figure) {
  return paint(256, 256, [&](float u, float v) {
    const float x = std::abs(glm::fract(2.0F * u) - 0.5F);
    const float y = std::abs(glm::fract(2.0F * v) - 0.5F);
    const float d = x + y;  // 0 in the middle of a diamond, ½ on its outline
    if (std::abs(d - 0.5F) < 0.035F) return figure;
    return d < 0.14F ? figure : ground;
  });
}

Image trellis(glm::vec3 ground, glm::vec3 figure) {
  return paint(256, 256, [&](float u, float v) {
    // Waving upright ribbons and a flower of five petals between them.
    const float wave = 0.11F * std::sin(kTwoPi * 2.0F * v);
    const float x = glm::fract(2.0F * u + 0.5F) - 0.5F;
    const float ribbon = std::min(std::abs(std::abs(x) - 0.5F + wave), std::abs(std::abs(x) - 0.5F - wave));
    if (ribbon < 0.045F) return figure;
    const float y = glm::fract(2.0F * v) - 0.5F;
    const float radius = std::hypot(x, y);
    const float petals = 0.2F + 0.08F * std::cos(5.0F * std::atan2(y, x));
    if (radius < 0.06F) return ground;
    return radius < petals ? figure : ground;
  });
}

Image checkers(int squares, glm::vec3 light, glm::vec3 dark) {
  return paint(256, 256, [&](float u, float v) {
    const int column = static_cast<int>(u * static_cast<float>(squares));
    const int row = static_cast<int>(v * static_cast<float>(squares));
    return (column + row) % 2 == 0 ? dark : light;
  });
}

Image weave(glm::vec3 colour) {
  return paint<1>(256, 256, [&](float u, float v) {
    const float warp = std::sin(kTwoPi * 32.0F * u);
    const float weft = std::sin(kTwoPi * 32.0F * v);
    return colour * (0.85F + 0.15F * warp * weft) * (0.9F + 0.2F * noise(u, v, 24, 24, 41));
  });
}

Image leaves() {
  const glm::vec3 shade = from_srgb(0x16330f);
  const glm::vec3 light = from_srgb(0x7fa845);
  return paint<1>(256, 256, [&](float u, float v) {
    const float t = 0.6F * noise(u, v, 24, 24, 51) + 0.4F * noise(u, v, 48, 48, 52);
    return glm::mix(shade, light, glm::smoothstep(0.25F, 0.8F, t));
  });
}

Image rug() {
  const glm::vec3 red = from_srgb(0x8e1f2c);
  const glm::vec3 cream = from_srgb(0xe6d6b3);
  const glm::vec3 navy = from_srgb(0x1f2f55);
  return paint(512, 512, [&](float u, float v) {
    const float x = std::abs(2.0F * u - 1.0F);
    const float y = std::abs(2.0F * v - 1.0F);
    const float border = std::max(x, y);
    glm::vec3 colour = red;
    if (border > 0.94F) {
      colour = navy;
    } else if (border > 0.90F) {
      colour = cream;
    } else if (border > 0.72F) {
      const float along = 10.0F * (x > y ? v : u);
      const float zigzag = std::abs(2.0F * glm::fract(along) - 1.0F);
      colour = (border - 0.72F) / 0.18F < 0.2F + 0.6F * zigzag ? navy : cream;
    } else if (border > 0.69F) {
      colour = cream;
    } else {
      const float d = x + y;
      if (d < 0.16F || (d > 0.3F && d < 0.42F)) colour = cream;
      if (d >= 0.16F && d <= 0.3F) colour = navy;
      if (d > 0.8F && d < 0.86F) colour = cream;
      if (d > 1.08F) colour = navy;
    }
    return colour * (0.88F + 0.24F * noise(u, v, 128, 128, 61));
  });
}

Image landscape() {
  const glm::vec3 horizon = from_srgb(0xf6c98b);
  const glm::vec3 zenith = from_srgb(0x4f7fc0);
  const glm::vec3 sunlight = from_srgb(0xfff3c4);
  const glm::vec3 far_hills = from_srgb(0x6c7fa6);
  const glm::vec3 hills = from_srgb(0x3f6b4f);
  const glm::vec3 glitter = from_srgb(0xf6d9a0);
  const glm::vec3 near_water = from_srgb(0x274a72);
  const glm::vec3 far_water = from_srgb(0x6f98bd);
  const glm::vec3 shore = from_srgb(0x26351c);
  return paint(384, 256, [&](float u, float v) {
    const auto ridge = [&](float base, float height, int periods, std::uint64_t seed) {
      return base + height * (noise(u, 0.5F, periods, 1, seed) - 0.5F);
    };
    const float sun = std::hypot(1.5F * (u - 0.68F), v - 0.72F);
    glm::vec3 colour = glm::mix(horizon, zenith, glm::smoothstep(0.45F, 1.0F, v));
    if (sun < 0.09F) colour = sunlight;
    if (v < ridge(0.58F, 0.26F, 7, 71)) colour = far_hills;
    if (v < ridge(0.47F, 0.18F, 5, 72)) colour = hills;
    if (v < 0.36F) {
      const bool is_glitter = std::abs(u - 0.68F) < 0.07F && glm::fract(24.0F * v) < 0.5F;
      colour = is_glitter ? glitter : glm::mix(near_water, far_water, v / 0.36F);
    }
    if (v < ridge(0.14F, 0.14F, 4, 73)) colour = shore;
    return colour;
  });
}

Image rectangles() {
  const glm::vec3 black = from_srgb(0x141414);
  const glm::vec3 white = from_srgb(0xf0ead8);
  const glm::vec3 yellow = from_srgb(0xe9c62b);
  const glm::vec3 red = from_srgb(0xc32a22);
  const glm::vec3 blue = from_srgb(0x23479b);
  struct Field {
    float left, right, bottom, top;
    glm::vec3 colour;
  };
  // Fractions of the canvas; what no field covers is a black bar.
  const std::array<Field, 8> fields = {{{0.00F, 0.22F, 0.00F, 0.30F, white},
                                        {0.00F, 0.22F, 0.33F, 0.70F, yellow},
                                        {0.00F, 0.22F, 0.73F, 1.00F, white},
                                        {0.25F, 1.00F, 0.33F, 1.00F, red},
                                        {0.25F, 0.60F, 0.00F, 0.30F, blue},
                                        {0.63F, 0.82F, 0.00F, 0.30F, white},
                                        {0.85F, 1.00F, 0.16F, 0.30F, white},
                                        {0.85F, 1.00F, 0.00F, 0.13F, yellow}}};
  return paint(256, 320, [&](float u, float v) {
    for (const Field& f : fields) {
      if (u >= f.left && u <= f.right && v >= f.bottom && v <= f.top) return f.colour;
    }
    return black;
  });
}

Image circles() {
  const std::array<glm::vec3, 8> palette = {from_srgb(0xd9442f), from_srgb(0xf0a830), from_srgb(0x2f6f8f),
                                            from_srgb(0xf4e6c1), from_srgb(0x1f2a44), from_srgb(0x7fb069),
                                            from_srgb(0x8a4f9e), from_srgb(0xe57c9b)};
  constexpr int kColumns = 4;
  constexpr int kRows = 3;
  return paint(384, 288, [&](float u, float v) {
    const int column = std::min(kColumns - 1, static_cast<int>(u * kColumns));
    const int row = std::min(kRows - 1, static_cast<int>(v * kRows));
    const float radius = std::hypot(glm::fract(u * kColumns) - 0.5F, glm::fract(v * kRows) - 0.5F);
    const int ring = radius < 0.12F ? 0 : radius < 0.23F ? 1 : radius < 0.34F ? 2 : radius < 0.45F ? 3 : 4;
    const int first = static_cast<int>(8.0F * random(column, row, 81));
    return palette[static_cast<std::size_t>((first + 3 * ring) % 8)];
  });
}

Image toy_block() {
  const glm::vec3 blue = from_srgb(0x2d6fb5);
  const glm::vec3 white = from_srgb(0xf2efe6);
  const glm::vec3 red = from_srgb(0xd8342b);
  const glm::vec3 cream = from_srgb(0xf2d8a0);
  return paint(128, 128, [&](float u, float v) {
    const float border = std::max(std::abs(u - 0.5F), std::abs(v - 0.5F));
    const float radius = std::hypot(u - 0.5F, v - 0.5F);
    if (border > 0.4F) return blue;
    if (radius < 0.12F) return white;
    return radius < 0.27F ? red : cream;
  });
}

Image clock_face() {
  const glm::vec3 ink = from_srgb(0x1c1c1c);
  const glm::vec3 paper = from_srgb(0xf3efe2);
  return paint(256, 256, [&](float u, float v) {
    const glm::vec2 p(u - 0.5F, v - 0.5F);
    const float radius = glm::length(p);
    const auto is_on_hand = [&](float hours, float length, float width) {
      const float angle = kTwoPi * hours / 12.0F;
      const glm::vec2 d(std::sin(angle), std::cos(angle));
      const float along = glm::dot(p, d);
      return along > -0.04F && along < length && std::abs(p.x * d.y - p.y * d.x) < width;
    };
    if (is_on_hand(10.15F, 0.24F, 0.016F) || is_on_hand(1.8F, 0.36F, 0.01F)) return ink;
    const float hour = glm::fract(12.0F * std::atan2(p.x, p.y) / kTwoPi + 0.5F) - 0.5F;
    if (radius > 0.36F && radius < 0.44F && square(hour) < square(0.09F)) return ink;
    return radius > 0.47F ? ink : paper;
  });
}

}  // namespace mirrorbake::textures
