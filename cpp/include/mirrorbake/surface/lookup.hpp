#pragma once

#include <cstddef>

#include "mirrorbake/envmap/footprint.hpp"
#include "mirrorbake/envmap/reads.hpp"
#include "mirrorbake/proxy/proxy.hpp"
#include "mirrorbake/surface/run_time_model.hpp"
#include "mirrorbake/surface/surface_samples.hpp"

/// Lookups from points of the reflector: proxy, differentials and filter put together.
namespace mirrorbake {

/// Direction in which sample `sample` reads the map on `proxy`, and its change over `footprint_scale` pixels.
Footprint lookup_footprint(const SurfaceSamples& samples, std::size_t sample, const Proxy& proxy,
                           float footprint_scale);

/// Texels and weights that sample `sample` reads when `model` draws it.
TexelReads lookup(const SurfaceSamples& samples, std::size_t sample, const Proxy& proxy,
                  const TexelTopology& topology, const RunTimeModel& model);

/// Throws InvalidArgument unless the arrays that lookups need have the samples' length.
void check_lookup_arrays(const SurfaceSamples& samples);

}  // namespace mirrorbake
