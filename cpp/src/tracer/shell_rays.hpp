#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "integrator.hpp"
#include "mirrorbake/surface/shells.hpp"
#include "mirrorbake/tracer/tracer.hpp"
#include "world.hpp"

/// Light that arrives along a reflected ray, split into shells by what the ray meets.
namespace mirrorbake::tracing {

/// What a shell holds along one direction; nothing of its kind: α = 0.
struct ShellSample {
  glm::vec4 radiance{0.0F};  ///< premultiplied, and α
  float distance = std::numeric_limits<float>::infinity();
};

/// All shells along one direction, front to back.
struct IncidentShells {
  std::size_t count = 0;
  std::array<ShellSample, kMostShells> shells;

  /// The composite: all that arrives.
  glm::vec3 light() const {
    ShellComposite composite;
    for (std::size_t k = 0; k < count; ++k) composite.add(shells[k].radiance);
    return composite.light();
  }
};

/// The rules of TraceOptions for one reflector.
class ShellRays {
 public:
  /// The rules must be valid.
  ShellRays(const World& world, std::span<const ShellRule> rules, int reflector);

  /// Along a direction of the specular lobe; `lobe` is what next-event estimation found for it, which counts
  /// as part of whatever the ray shows.
  IncidentShells trace(const LitWorld& lit, const Surface& surface, glm::vec3 lobe, const PathLimits& limits,
                       const SampleStream& stream) const;

 private:
  static constexpr float kUnlimited = std::numeric_limits<float>::infinity();

  /// Where to look for what the shells up to one leave.
  struct Rest {
    RayScene::View view;  ///< without the objects that they hold at any distance
    float begin = 0.0F;   ///< distance before which they hold everything
  };

  std::size_t shell_of(const Hit& hit) const;
  Hit first_of_rest(std::size_t shell, Ray ray) const;

  std::vector<ShellRule> rules_;  ///< all but the last, which takes what is left
  int reflector_;
  std::vector<Rest> rests_;  ///< of each rule
};

}  // namespace mirrorbake::tracing
