#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "mirrorbake/image/image.hpp"
#include "mirrorbake/surface/surface_samples.hpp"

/// Lookups of a run time as channels of an image, so that maps can be inferred from files.
namespace mirrorbake {

/// Channels of `lookups` lookups a pixel, in their order: of each, with N from 0, `lookup.N.part`, −1 where
/// it misses the reflector, and with `.X`, `.Y`, `.Z` `lookup.N.position` (in the scene), `.reflection`,
/// `.position_dx`, `.position_dy`, `.reflection_dx`, `.reflection_dy` as in SurfaceSamples;
/// `lookup.N.fresnel.R` `.G` `.B`.
std::vector<std::string> lookup_channels(int lookups);

/// What a renderer's lookups meet, as an image of these channels; those of a pixel from N = 0 on. Throws
/// InvalidArgument if a pixel has more than `lookups`, or an array has another length.
Image lookup_image(const SurfaceSamples& samples, int lookups);

/// How many lookups a pixel of an image with these channels has, which start with `prefix`; 0: none.
int count_lookups(const Image& image, std::string_view prefix = {});

/// The lookups of such an image: all of SurfaceSamples that lookups and Fresnel need. Throws FileError(name)
/// if a channel is missing, or holds what no lookup can be.
SurfaceSamples lookups_of(const std::string& name, const Image& image, std::string_view prefix = {});

}  // namespace mirrorbake
