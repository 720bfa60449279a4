#pragma once

#include <cstddef>
#include <span>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "mirrorbake/surface/surface_samples.hpp"

/// The shells of an environment: what arrives at a point along a reflected ray is a stack of layers, the
/// nearest first ([PEM] §4).
namespace mirrorbake {

/// The composite L₀ + (1 − α₀)(L₁ + (1 − α₁)(…)) of premultiplied layers, built front to back.
class ShellComposite {
 public:
  void add(glm::vec4 layer) {
    light_ += transmittance_ * glm::vec3(layer);
    transmittance_ *= 1.0F - layer.a;
  }
  glm::vec3 light() const { return light_; }
  /// Share of what lies behind the layers so far that still comes through, Π(1 − α).
  float transmittance() const { return transmittance_; }

 private:
  glm::vec3 light_{0.0F};
  float transmittance_ = 1.0F;
};

/// Composite of one sample's light: the incident radiance.
inline glm::vec3 incident_light(std::span<const ShellLight> shells, std::size_t sample) {
  ShellComposite composite;
  for (const ShellLight& shell : shells) composite.add(shell.radiance[sample]);
  return composite.light();
}

}  // namespace mirrorbake
