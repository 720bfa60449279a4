#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "shell_rays.hpp"
#include "surface.hpp"

namespace mirrorbake::tracing {

/// Sums over the samples of a pixel for one reflector, then their means.
class PixelLayers {
 public:
  explicit PixelLayers(std::size_t shells) : shells_(shells, glm::dvec4(0.0)) {}

  /// Samples are told apart by quarters of the `planned` ones: each quarter of a power of two is stratified
  /// by itself, so that what the quarters differ by tells the error of their mean.
  void plan(int samples);

  /// The next sample sees the reflector, or something else.
  void add(const Surface& s, glm::vec3 beauty, glm::vec3 body, const IncidentShells& incident,
           glm::dvec3 position, std::uint16_t part);
  void add_other(glm::vec3 beauty);

  int covered() const { return covered_; }
  int planned() const { return planned_; }

  /// Squared standard error of the displayed value (sRGB, 0…1, mean of the channels) of the covered samples'
  /// mean; 0 where fewer than two quarters see the reflector.
  double display_variance() const;

  /// Writes the channels of `layer_channels`.
  void write(float* out) const;

 private:
  struct Quarter {
    glm::dvec3 beauty{0.0};
    int covered = 0;
  };
  int most_frequent_part() const;

  int planned_ = 1;
  int taken_ = 0;
  int covered_ = 0;
  int finite_distances_ = 0;
  double distance_ = 0.0;
  glm::dvec3 background_{0.0}, diffuse_{0.0}, fresnel_{0.0}, reflection_{0.0}, normal_{0.0}, position_{0.0};
  std::vector<glm::dvec4> shells_;
  std::array<Quarter, 4> quarters_;
  std::vector<std::uint16_t> parts_;
};

std::vector<std::string> layer_channels(std::span<const ShellRule> shells);

}  // namespace mirrorbake::tracing
