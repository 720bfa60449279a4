#include "mesh_tools.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace mirrorbake {
namespace {

constexpr float kTwoPi = 2.0F * std::numbers::pi_v<float>;
const float kSmoothCosine = std::cos(35.0F * std::numbers::pi_v<float> / 180.0F);

int cell_count(float length, float cell) {
  return std::max(1, static_cast<int>(std::ceil(length / cell - 1e-4F)));
}

void add_vertex(TriangleMesh& mesh, glm::vec3 position, glm::vec3 normal, glm::vec2 uv) {
  mesh.positions.push_back(position);
  mesh.normals.push_back(normal);
  mesh.uvs.push_back(uv);
}

void add_cell(TriangleMesh& mesh, std::uint32_t corner, std::uint32_t stride) {
  mesh.triangles.push_back({corner, corner + 1, corner + stride + 1});
  mesh.triangles.push_back({corner, corner + stride + 1, corner + stride});
}

struct Side {
  glm::vec3 corner, u, v;
};

std::array<Side, 6> sides_of_box(glm::vec3 min, glm::vec3 max) {
  const glm::vec3 size = max - min;
  const glm::vec3 x(size.x, 0, 0);
  const glm::vec3 y(0, size.y, 0);
  const glm::vec3 z(0, 0, size.z);
  return {{{min + x + z, -z, y},
           {min, z, y},
           {min + y + z, x, -z},
           {min, x, z},
           {min + z, x, y},
           {min + x, -x, y}}};
}

}  // namespace

void append(TriangleMesh& mesh, const TriangleMesh& other) {
  const std::uint32_t first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  mesh.normals.insert(mesh.normals.end(), other.normals.begin(), other.normals.end());
  mesh.uvs.insert(mesh.uvs.end(), other.uvs.begin(), other.uvs.end());
  for (const glm::uvec3 t : other.triangles) mesh.triangles.push_back(t + first);
}

TriangleMesh placed(TriangleMesh mesh, float degrees, glm::vec3 offset) {
  const float angle = degrees * std::numbers::pi_v<float> / 180.0F;
  const float c = std::cos(angle);
  const float s = std::sin(angle);
  const auto turned = [&](glm::vec3 v) { return glm::vec3(c * v.x + s * v.z, v.y, c * v.z - s * v.x); };
  for (glm::vec3& p : mesh.positions) p = turned(p) + offset;
  for (glm::vec3& n : mesh.normals) n = turned(n);
  return mesh;
}

TriangleMesh make_panel(glm::vec3 corner, glm::vec3 u, glm::vec3 v, float cell, glm::vec2 tile) {
  TriangleMesh mesh;
  const float width = glm::length(u);
  const float height = glm::length(v);
  const int columns = cell_count(width, cell);
  const int rows = cell_count(height, cell);
  const glm::vec3 normal = glm::normalize(glm::cross(u, v));
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i <= columns; ++i) {
      const float a = static_cast<float>(i) / static_cast<float>(columns);
      const float b = static_cast<float>(j) / static_cast<float>(rows);
      add_vertex(mesh, corner + a * u + b * v, normal, {a * width / tile.x, b * height / tile.y});
    }
  }
  const std::uint32_t stride = static_cast<std::uint32_t>(columns) + 1;
  for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(rows); ++j) {
    for (std::uint32_t i = 0; i + 1 < stride; ++i) add_cell(mesh, j * stride + i, stride);
  }
  return mesh;
}

TriangleMesh make_picture(glm::vec3 corner, glm::vec3 u, glm::vec3 v, float cell) {
  return make_panel(corner, u, v, cell, {glm::length(u), glm::length(v)});
}

TriangleMesh make_block(glm::vec3 min, glm::vec3 max, float cell, float tile) {
  TriangleMesh mesh;
  const float start = glm::fract(37.0F * min.x + 17.0F * min.y + 29.0F * min.z);
  for (const Side& side : sides_of_box(min, max)) {
    TriangleMesh panel = make_panel(side.corner, side.u, side.v, cell, glm::vec2(tile));
    const bool is_upright = glm::length(side.v) > glm::length(side.u);
    for (glm::vec2& uv : panel.uvs) uv = (is_upright ? glm::vec2(uv.y, uv.x) : uv) + start;
    append(mesh, panel);
  }
  return mesh;
}

TriangleMesh make_rounded_block(glm::vec3 min, glm::vec3 max, float radius, int cells, float tile) {
  TriangleMesh mesh;
  const glm::vec3 centre = 0.5F * (min + max);
  const glm::vec3 core = 0.5F * (max - min) - radius;
  for (const Side& side : sides_of_box(min, max)) {
    const float cell = std::max(glm::length(side.u), glm::length(side.v)) / static_cast<float>(cells);
    TriangleMesh panel = make_panel(side.corner, side.u, side.v, cell, glm::vec2(tile));
    for (std::size_t i = 0; i < panel.positions.size(); ++i) {
      const glm::vec3 from_centre = panel.positions[i] - centre;
      const glm::vec3 anchor = glm::clamp(from_centre, -core, core);
      panel.normals[i] = glm::normalize(from_centre - anchor);
      panel.positions[i] = centre + anchor + radius * panel.normals[i];
    }
    append(mesh, panel);
  }
  return mesh;
}

TriangleMesh make_lathe(glm::vec3 base, const std::vector<glm::vec2>& profile, int segments, float repeats) {
  TriangleMesh mesh;
  const std::size_t pieces = profile.size() - 1;
  std::vector<glm::vec2> outward(pieces);
  std::vector<float> along(profile.size(), 0.0F);
  for (std::size_t k = 0; k < pieces; ++k) {
    const glm::vec2 d = profile[k + 1] - profile[k];
    along[k + 1] = along[k] + glm::length(d);
    outward[k] = glm::normalize(glm::vec2(d.y, -d.x));
  }
  const std::uint32_t stride = static_cast<std::uint32_t>(segments) + 1;
  const auto add_ring = [&](std::size_t point, glm::vec2 normal) {
    const glm::vec2 p = profile[point];
    for (std::uint32_t i = 0; i < stride; ++i) {
      const float turn = static_cast<float>(i % (stride - 1)) / static_cast<float>(segments);
      const float x = std::cos(kTwoPi * turn);
      const float z = -std::sin(kTwoPi * turn);
      add_vertex(
          mesh, base + glm::vec3(p.x * x, p.y, p.x * z), {normal.x * x, normal.y, normal.x * z},
          {repeats * static_cast<float>(i) / static_cast<float>(segments), along[point] / along.back()});
    }
  };
  // Pieces that meet smoothly share a ring of vertices.
  for (std::size_t k = 0; k < pieces; ++k) {
    const bool is_smooth_below = k > 0 && glm::dot(outward[k - 1], outward[k]) > kSmoothCosine;
    const bool is_smooth_above = k + 1 < pieces && glm::dot(outward[k], outward[k + 1]) > kSmoothCosine;
    if (!is_smooth_below) add_ring(k, outward[k]);
    add_ring(k + 1, is_smooth_above ? glm::normalize(outward[k] + outward[k + 1]) : outward[k]);
    const std::uint32_t first = static_cast<std::uint32_t>(mesh.positions.size()) - 2 * stride;
    for (std::uint32_t i = 0; i + 1 < stride; ++i) {
      const std::uint32_t corner = first + i;
      if (profile[k].x > 0.0F) mesh.triangles.push_back({corner, corner + 1, corner + stride + 1});
      if (profile[k + 1].x > 0.0F) mesh.triangles.push_back({corner, corner + stride + 1, corner + stride});
    }
  }
  return mesh;
}

TriangleMesh make_curtain(glm::vec3 corner, glm::vec3 width, float height, int folds, float depth) {
  constexpr int kColumnsPerFold = 8;
  const float length = glm::length(width);
  const glm::vec3 along = width / length;
  const glm::vec3 up(0.0F, 1.0F, 0.0F);
  const glm::vec3 front = glm::cross(along, up);
  const float frequency = kTwoPi * static_cast<float>(folds) / length;
  TriangleMesh mesh;
  // Cells are as narrow as the folds need but may be long.
  const int rows = cell_count(height, 0.2F);
  const std::uint32_t stride = static_cast<std::uint32_t>(folds * kColumnsPerFold) + 1;
  for (int j = 0; j <= rows; ++j) {
    for (std::uint32_t i = 0; i < stride; ++i) {
      const float x = length * static_cast<float>(i) / static_cast<float>(stride - 1);
      const float y = height * static_cast<float>(j) / static_cast<float>(rows);
      const float slope = depth * frequency * std::cos(frequency * x);
      add_vertex(mesh, corner + x * along + y * up + depth * std::sin(frequency * x) * front,
                 glm::normalize(front - slope * along), {x, y});
    }
  }
  for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(rows); ++j) {
    for (std::uint32_t i = 0; i + 1 < stride; ++i) add_cell(mesh, j * stride + i, stride);
  }
  return mesh;
}

}  // namespace mirrorbake
