#include "mirrorbake/prefilter/background.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/envmap/sampling.hpp"

namespace mirrorbake {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kLongest = 64.0;  // of an ellipse, in its widths: the rest is left to more steps

bool is_seen(const glm::dvec3& d) { return std::isfinite(d.x) && std::isfinite(d.y) && std::isfinite(d.z); }

void check_rotation(const char* name, const glm::dmat3& m) {
  double worst = 0.0;
  const glm::dmat3 square = m * glm::transpose(m);
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) worst = std::max(worst, std::abs(square[i][k] - (i == k ? 1.0 : 0.0)));
  }
  if (!(worst < 1e-4) || !(glm::determinant(m) > 0.0)) throw InvalidArgument(name, "no rotation", "one");
}

// Axis times angle.
glm::dvec3 turn_between(const glm::dmat3& from, const glm::dmat3& to) {
  const glm::dmat3 turn = to * glm::transpose(from);  // columns
  const glm::dvec3 skew(turn[1][2] - turn[2][1], turn[2][0] - turn[0][2], turn[0][1] - turn[1][0]);
  const double sine = 0.5 * glm::length(skew);
  const double angle = std::atan2(sine, 0.5 * (turn[0][0] + turn[1][1] + turn[2][2] - 1.0));
  if (angle > 3.1415)
    throw InvalidArgument("world_from_camera_end", "half a turn away", "less, which has one way");
  return sine > 1e-12 ? 0.5 * skew * (angle / sine) : 0.5 * skew;
}

// Rodrigues' formula.
glm::dvec3 turned(const glm::dvec3& v, const glm::dvec3& axis_angle) {
  const double angle = glm::length(axis_angle);
  if (angle == 0.0) return v;
  const glm::dvec3 axis = axis_angle / angle;
  return std::cos(angle) * v + std::sin(angle) * glm::cross(axis, v) +
         (1.0 - std::cos(angle)) * glm::dot(axis, v) * axis;
}

// Central differences along a row or a column, one-sided beside what is not seen.
glm::dvec3 differential(std::span<const glm::dvec3> d, int at, int count, std::size_t index,
                        std::size_t stride) {
  const bool after = at + 1 < count && is_seen(d[index + stride]);
  const bool before = at > 0 && is_seen(d[index - stride]);
  const glm::dvec3 sum = (after ? d[index + stride] : d[index]) - (before ? d[index - stride] : d[index]);
  return after && before ? 0.5 * sum : sum;
}

struct Ellipse {
  glm::vec3 longer;
  glm::vec3 shorter;
};

// Footprints add as covariances do, across the direction: x xᵀ + y yᵀ + p pᵀ.
Ellipse ellipse(const glm::dvec3& d, const std::array<glm::dvec3, 3>& parts) {
  const glm::dvec3 u = glm::normalize(
      glm::cross(d, std::abs(d.x) < std::abs(d.y) ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0)));
  const glm::dvec3 v = glm::normalize(glm::cross(d, u));
  double uu = 0.0;
  double uv = 0.0;
  double vv = 0.0;
  for (const glm::dvec3& part : parts) {
    const double a = glm::dot(part, u);
    const double b = glm::dot(part, v);
    uu += a * a;
    uv += a * b;
    vv += b * b;
  }
  const double middle = 0.5 * (uu + vv);
  const double apart = std::hypot(0.5 * (uu - vv), uv);
  const double angle = 0.5 * std::atan2(2.0 * uv, uu - vv);
  const double long_side = std::sqrt(middle + apart);
  const double short_side = std::sqrt(std::max(0.0, middle - apart));
  return {glm::vec3(long_side * (std::cos(angle) * u + std::sin(angle) * v)),
          glm::vec3(short_side * (std::cos(angle) * v - std::sin(angle) * u))};
}

}  // namespace

std::vector<glm::dvec3> lens_directions(Lens lens, int width, int height, double field_of_view) {
  check_range("width", width, 1, 65536, " pixels");
  check_range("height", height, 1, 65536, " pixels");
  const double most = lens == Lens::perspective ? 179.9 : 360.0;
  check_above("field_of_view", field_of_view, 0.0, most);
  const double half = field_of_view * kPi / 360.0;
  const double pixel = 2.0 / (lens == Lens::perspective ? height : std::min(width, height));
  std::vector<glm::dvec3> directions;
  directions.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      const double x = (column + 0.5 - 0.5 * width) * pixel;
      const double y = (0.5 * height - row - 0.5) * pixel;
      if (lens == Lens::perspective) {
        directions.emplace_back(x * std::tan(half), y * std::tan(half), -1.0);
        continue;
      }
      const double radius = std::hypot(x, y);
      const double across = radius > 0.0 ? std::sin(radius * half) / radius : half;
      directions.push_back(radius > 1.0 ? glm::dvec3(std::numeric_limits<double>::quiet_NaN())
                                        : glm::dvec3(across * x, across * y, -std::cos(radius * half)));
    }
  }
  return directions;
}

std::vector<float> background(const EnvMapView& map, std::span<const glm::dvec3> directions, int width,
                              int height, const BackgroundOptions& options) {
  check_range("width", width, 2, 65536, " pixels");
  check_range("height", height, 2, 65536, " pixels");
  check_range("steps", options.steps, 1, 1024);
  check_length("directions", directions.size(),
               static_cast<std::size_t>(width) * static_cast<std::size_t>(height), "width × height");
  check_rotation("world_from_camera", options.world_from_camera);
  check_rotation("world_from_camera_end", options.world_from_camera_end);
  const glm::dvec3 whole = turn_between(options.world_from_camera, options.world_from_camera_end);
  const std::size_t channels = static_cast<std::size_t>(map.layout.channels);
  std::vector<double> sums(directions.size() * channels);
  std::vector<glm::vec3> at(directions.size());
  std::vector<glm::vec3> ddx(at.size());
  std::vector<glm::vec3> ddy(at.size());
  std::vector<float> values(sums.size());
  SampleOptions sampling{SampleFilter::ewa};
  sampling.max_anisotropy = kLongest;
  const glm::dvec3 piece = whole / static_cast<double>(options.steps);
  for (int step = 0; step < options.steps; ++step) {
    const glm::dvec3 now = piece * (step + 0.5);
    const auto place = [&](const glm::dvec3& v) { return turned(options.world_from_camera * v, now); };
    parallel_for(at.size(), 1024, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const int row = static_cast<int>(i) / width;
        const int column = static_cast<int>(i) % width;
        at[i] = ddx[i] = ddy[i] = glm::vec3(0.0F);
        if (!is_seen(directions[i])) continue;
        const glm::dvec3 d = place(directions[i]);
        const Ellipse pixel =
            ellipse(d, {place(differential(directions, column, width, i, 1)),
                        place(differential(directions, row, height, i, static_cast<std::size_t>(width))),
                        glm::cross(piece, d)});
        at[i] = glm::vec3(d);
        ddx[i] = pixel.longer;
        ddy[i] = pixel.shorter;
      }
    });
    sample(map, at, ddx, ddy, sampling, values);
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += static_cast<double>(values[i]);
  }
  for (std::size_t i = 0; i < sums.size(); ++i) values[i] = static_cast<float>(sums[i] / options.steps);
  return values;
}

}  // namespace mirrorbake
