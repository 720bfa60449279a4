#pragma once

#include "world.hpp"

namespace mirrorbake {

struct Tracer::State {
  State(Scene scene, const TracerOptions& options);

  tracing::LitWorld lit;

  /// Throws InvalidArgument unless the arguments are usable.
  void check_object(const char* argument, int object) const;
};

}  // namespace mirrorbake
