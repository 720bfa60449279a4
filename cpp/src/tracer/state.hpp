#pragma once

#include <utility>

#include "world.hpp"

namespace mirrorbake {

struct Tracer::State {
  State(Scene scene, const TracerOptions& options);
  State(Scene scene, const tracing::Indirect& known) : lit(std::move(scene), known) {}

  tracing::LitWorld lit;

  /// Throws InvalidArgument unless the arguments are usable.
  void check_object(const char* argument, int object) const;
};

}  // namespace mirrorbake
