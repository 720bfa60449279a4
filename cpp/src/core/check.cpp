#include "mirrorbake/core/check.hpp"

#include <algorithm>

#include <glm/matrix.hpp>

#include "mirrorbake/core/text.hpp"

namespace mirrorbake {
namespace {

// Matrices that were composed or read in float32 keep four digits.
constexpr float kOrthonormalTolerance = 1e-4F;

std::string indexed(std::string_view name, std::size_t i) {
  return std::string(name) + "[" + std::to_string(i) + "]";
}

}  // namespace

void check_length(std::string_view name, std::size_t length, std::size_t expected, std::string_view meaning) {
  if (length == expected) return;
  std::string wanted = std::to_string(expected);
  if (!meaning.empty()) wanted += ", " + std::string(meaning);
  throw InvalidArgument(name, std::to_string(length) + " elements", wanted);
}

void check_finite(std::string_view name, float value) { check_finite(name, static_cast<double>(value)); }

void check_finite(std::string_view name, double value) {
  if (!std::isfinite(value)) throw InvalidArgument(name, text_of(value), "a finite number");
}

void check_finite(std::string_view name, const glm::vec3& value) {
  if (!is_finite(value)) throw InvalidArgument(name, text_of(value), "finite coordinates");
}

void check_finite(std::string_view name, std::span<const glm::vec3> points) {
  const auto bad = std::find_if_not(points.begin(), points.end(), is_finite<float>);
  if (bad != points.end()) check_finite(indexed(name, static_cast<std::size_t>(bad - points.begin())), *bad);
}

void check_finite(std::string_view name, std::span<const float> values) {
  const auto bad = std::count_if(values.begin(), values.end(), [](float v) { return !std::isfinite(v); });
  if (bad > 0)
    throw InvalidArgument(name, "not finite in " + std::to_string(bad) + " values", "finite numbers");
}

void check_at_least(std::string_view name, double value, double least) {
  if (!(std::isfinite(value) && value >= least)) {
    throw InvalidArgument(name, text_of(value), "a finite number ≥ " + text_of(least));
  }
}

void check_above(std::string_view name, double value, double low, double high) {
  if (!(value > low && value <= high)) {
    throw InvalidArgument(name, text_of(value), "a number in (" + text_of(low) + ", " + text_of(high) + "]");
  }
}

void check_orthonormal(std::string_view name, const glm::mat3& matrix) {
  // A NaN anywhere fails the comparison.
  const glm::mat3 product = matrix * glm::transpose(matrix);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (std::abs(product[i][j] - (i == j ? 1.0F : 0.0F)) <= kOrthonormalTolerance) continue;
      throw InvalidArgument(
          name, text_of(matrix[0]) + ", " + text_of(matrix[1]) + ", " + text_of(matrix[2]) + " (columns)",
          "an orthonormal matrix");
    }
  }
}

void check_triangles(std::span<const glm::uvec3> triangles, std::size_t vertices) {
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const unsigned largest = std::max({triangles[i].x, triangles[i].y, triangles[i].z});
    if (largest < vertices) continue;
    throw InvalidArgument(indexed("triangles", i), std::to_string(largest),
                          "indices below " + std::to_string(vertices));
  }
}

}  // namespace mirrorbake
