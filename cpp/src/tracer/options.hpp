#pragma once

#include "mirrorbake/tracer/tracer.hpp"
#include "sample_stream.hpp"

namespace mirrorbake::tracing {

/// Throws InvalidArgument unless `value` is in [low, high].
void check_range(const char* argument, int value, int low, int high);
void validate(const TraceOptions& options);

/// The random numbers of sample `index` of pixel (x, y).
inline SampleStream pixel_stream(const Camera& camera, const TraceOptions& options, int x, int y, int index) {
  return sample_stream(options.seed,
                       static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(camera.width) +
                           static_cast<std::uint64_t>(x),
                       static_cast<std::uint32_t>(index));
}

}  // namespace mirrorbake::tracing
