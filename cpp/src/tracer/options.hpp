#pragma once

#include "mirrorbake/tracer/tracer.hpp"

namespace mirrorbake::tracing {

/// Throws InvalidArgument unless `value` is in [low, high].
void check_range(const char* argument, int value, int low, int high);
void validate(const TraceOptions& options);

}  // namespace mirrorbake::tracing
