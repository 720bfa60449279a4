#pragma once

#include <cmath>
#include <concepts>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "mirrorbake/core/error.hpp"

/// What public functions ask of their arguments, each asked in one place. All throw InvalidArgument, which
/// names the argument, its value and what was expected.
namespace mirrorbake {

template <std::floating_point Real>
bool is_finite(const glm::vec<3, Real>& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// `length` has to be `expected`. `meaning` says where the expected number comes from: "texels × channels".
void check_length(std::string_view name, std::size_t length, std::size_t expected,
                  std::string_view meaning = {});

void check_finite(std::string_view name, float value);
void check_finite(std::string_view name, double value);
void check_finite(std::string_view name, const glm::vec3& value);
/// Names the first element that is not finite.
void check_finite(std::string_view name, std::span<const glm::vec3> points);
/// Says how many values are not finite.
void check_finite(std::string_view name, std::span<const float> values);

/// Finite and not below `least`.
void check_at_least(std::string_view name, double value, double least);

/// Finite, above `low` and not above `high`.
void check_above(std::string_view name, double value, double low, double high);

/// From `least` to `most`, both included. `unit` follows them in the message: " texels".
template <std::integral Integer>
void check_range(std::string_view name, Integer value, Integer least, Integer most,
                 std::string_view unit = {}) {
  if (value >= least && value <= most) return;
  throw InvalidArgument(name, std::to_string(value),
                        std::to_string(least) + " to " + std::to_string(most) + std::string(unit));
}

/// A rotation, with or without a reflection: M·Mᵀ = I within 1e-4.
void check_orthonormal(std::string_view name, const glm::mat3& matrix);

/// Every index below `vertices`.
void check_triangles(std::span<const glm::uvec3> triangles, std::size_t vertices);

}  // namespace mirrorbake
