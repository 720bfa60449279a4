#include <array>
#include <cmath>
#include <string>
#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/scene/shapes.hpp"
#include "utah_teapot_data.hpp"

namespace mirrorbake {
namespace {

using namespace utah_teapot;
using ControlPoints = std::array<glm::dvec3, 16>;
using Weights = std::array<double, 4>;

constexpr int kMaxSubdivisions = 512;  // 16.8 million triangles
constexpr double kTotalHeight = 3.15;  // of the data, foot to knob

// Half the gap between the charts of two patches in texture space, as a fraction of a chart's cell: four
// texels of a 512 × 1024 texture, so that bilinear lookups and two mip levels stay within a patch.
constexpr double kChartInset = 1.0 / 32.0;

// Bernstein polynomials of degree 3 at t = i/n, with s = 1 − t, and their first derivatives. Both are written
// so that exchanging t and s reverses them bit for bit: patches that run along a shared edge in opposite
// directions get identical vertices.
Weights bernstein(double s, double t) { return {s * s * s, 3.0 * (s * t) * s, 3.0 * (s * t) * t, t * t * t}; }
Weights bernstein_derivative(double s, double t) {
  return {-3.0 * (s * s), 3.0 * (s * (s - 2.0 * t)), 3.0 * (t * (2.0 * s - t)), 3.0 * (t * t)};
}

// The outer and the inner pair are added first, which makes the sum symmetric as well.
glm::dvec3 weighted_sum(const Weights& w, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                        const glm::dvec3& d) {
  return (w[0] * a + w[3] * d) + (w[1] * b + w[2] * c);
}

glm::dvec3 evaluate(const ControlPoints& p, const Weights& u, const Weights& v) {
  std::array<glm::dvec3, 4> row;
  for (std::size_t j = 0; j < 4; ++j)
    row[j] = weighted_sum(u, p[4 * j], p[4 * j + 1], p[4 * j + 2], p[4 * j + 3]);
  return weighted_sum(v, row[0], row[1], row[2], row[3]);
}

// Normal S_u × S_v. Where the edge v = 0 is collapsed to a point, S_u vanishes there; S_u = v·S_uv + O(v²)
// makes S_uv × S_v the limit of its direction.
glm::dvec3 evaluate_normal(const ControlPoints& p, const Weights& u, const Weights& du, const Weights& v,
                           const Weights& dv, bool at_pole) {
  const glm::dvec3 along_u = evaluate(p, du, at_pole ? dv : v);
  const glm::dvec3 along_v = evaluate(p, u, dv);
  return glm::normalize(glm::cross(along_u, along_v));
}

bool is_collapsed_at_v0(const std::array<std::uint16_t, 16>& patch) {
  return patch[0] == patch[1] && patch[0] == patch[2] && patch[0] == patch[3];
}

// From the data's +Z up to +Y up.
glm::vec3 y_up(const glm::dvec3& p) {
  return {static_cast<float>(p.x), static_cast<float>(p.z), static_cast<float>(-p.y)};
}

// Every patch has its own chart, one band of the pot per row of the atlas. In the data u grows to the left
// and v downwards for somebody who looks at the pot; both are turned round.
glm::vec2 chart_uv(std::size_t patch, double u, double v) {
  const double column = static_cast<double>(patch % kPatchesPerBand);
  const std::size_t band = patch / kPatchesPerBand;
  const double row = static_cast<double>(band);
  const double width = 1.0 - 2.0 * kChartInset;
  return {static_cast<float>(1.0 - (column + kChartInset + width * u) / static_cast<double>(kPatchesPerBand)),
          static_cast<float>(1.0 - (row + kChartInset + width * v) / static_cast<double>(kBandCount))};
}

}  // namespace

std::vector<std::string> teapot_part_names() { return {"body", "lid"}; }

TriangleMesh make_teapot(int subdivisions, float height) {
  if (subdivisions < 1 || subdivisions > kMaxSubdivisions) {
    throw InvalidArgument("subdivisions", std::to_string(subdivisions),
                          "1 to " + std::to_string(kMaxSubdivisions));
  }
  if (!(height > 0.0F) || !std::isfinite(height)) {
    throw InvalidArgument("height", std::to_string(height), "a finite length above 0");
  }
  const double scale = static_cast<double>(height) / kTotalHeight;
  const std::size_t cells = static_cast<std::size_t>(subdivisions);
  const std::size_t side = cells + 1;

  TriangleMesh mesh;
  mesh.positions.reserve(kPatchCount * side * side);
  mesh.normals.reserve(kPatchCount * side * side);
  mesh.uvs.reserve(kPatchCount * side * side);
  mesh.triangles.reserve(kPatchCount * cells * cells * 2);
  mesh.parts.reserve(kPatchCount * cells * cells * 2);

  std::vector<Weights> weights;
  std::vector<Weights> derivatives;
  for (std::size_t i = 0; i < side; ++i) {
    const double t = static_cast<double>(i) / subdivisions;
    const double s = static_cast<double>(cells - i) / subdivisions;
    weights.push_back(bernstein(s, t));
    derivatives.push_back(bernstein_derivative(s, t));
  }

  for (std::size_t patch = 0; patch < kPatchCount; ++patch) {
    ControlPoints points;
    for (std::size_t k = 0; k < 16; ++k) points[k] = kControlPoints[kPatches[patch][k]];
    const bool has_pole = is_collapsed_at_v0(kPatches[patch]);
    const std::uint32_t first = static_cast<std::uint32_t>(mesh.positions.size());
    for (std::size_t j = 0; j < side; ++j) {
      for (std::size_t i = 0; i < side; ++i) {
        mesh.positions.push_back(y_up(scale * evaluate(points, weights[i], weights[j])));
        mesh.normals.push_back(y_up(evaluate_normal(points, weights[i], derivatives[i], weights[j],
                                                    derivatives[j], has_pole && j == 0)));
        mesh.uvs.push_back(
            chart_uv(patch, static_cast<double>(i) / subdivisions, static_cast<double>(j) / subdivisions));
      }
    }
    const std::size_t band = patch / kPatchesPerBand;
    const std::uint16_t part = band == kKnobBand || band == kLidBand ? 1 : 0;
    const std::uint32_t stride = static_cast<std::uint32_t>(side);
    for (std::uint32_t j = 0; j < cells; ++j) {
      for (std::uint32_t i = 0; i < cells; ++i) {
        const std::uint32_t corner = first + j * stride + i;
        // The diagonal leaves the pole (j = 0) so that one triangle of each cell there keeps its area.
        mesh.triangles.push_back({corner, corner + 1, corner + stride + 1});
        mesh.triangles.push_back({corner, corner + stride + 1, corner + stride});
        mesh.parts.insert(mesh.parts.end(), 2, part);
      }
    }
  }
  return mesh;
}

}  // namespace mirrorbake
