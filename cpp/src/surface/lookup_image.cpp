#include "mirrorbake/surface/lookup_image.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <glm/geometric.hpp>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/surface/lookup.hpp"

namespace mirrorbake {
namespace {

using Vectors = std::vector<glm::vec3>;

struct Layer {
  const char* name;
  const char* axes;
  Vectors SurfaceSamples::*array;
};

constexpr std::array<Layer, 7> kLayers{{{"position", "XYZ", &SurfaceSamples::position},
                                        {"reflection", "XYZ", &SurfaceSamples::reflection},
                                        {"position_dx", "XYZ", &SurfaceSamples::dposition_dx},
                                        {"position_dy", "XYZ", &SurfaceSamples::dposition_dy},
                                        {"reflection_dx", "XYZ", &SurfaceSamples::dreflection_dx},
                                        {"reflection_dy", "XYZ", &SurfaceSamples::dreflection_dy},
                                        {"fresnel", "RGB", &SurfaceSamples::fresnel}}};
constexpr std::size_t kChannels = 1 + 3 * kLayers.size();

// A unit vector in the precision of a file of half floats.
constexpr float kUnit = 4e-3F;

std::ptrdiff_t find(const Image& image, const std::string& channel) {
  const auto found = std::find(image.channels.begin(), image.channels.end(), channel);
  return found == image.channels.end() ? -1 : found - image.channels.begin();
}

}  // namespace

std::vector<std::string> lookup_channels(int lookups) {
  std::vector<std::string> names;
  for (int n = 0; n < lookups; ++n) {
    const std::string lookup = "lookup." + std::to_string(n) + ".";
    names.push_back(lookup + "part");
    for (const Layer& layer : kLayers) {
      for (const char* axis = layer.axes; *axis != 0; ++axis)
        names.push_back(lookup + layer.name + "." + *axis);
    }
  }
  return names;
}

Image lookup_image(const SurfaceSamples& samples, int lookups) {
  check_range("lookups", lookups, 1, 64);
  check_lookup_arrays(samples);
  check_length("fresnel", samples.fresnel.size(), samples.size(), "as many as pixel");
  Image image(samples.width, samples.height, lookup_channels(lookups));
  for (std::size_t i = 0; i < image.pixels.size(); i += kChannels) image.pixels[i] = -1.0F;
  std::size_t first = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples.pixel[i] != samples.pixel[first]) first = i;
    if (i - first >= static_cast<std::size_t>(lookups)) {
      throw InvalidArgument(
          "samples", "more than " + std::to_string(lookups) + " of pixel " + std::to_string(samples.pixel[i]),
          "at most as many as lookups");
    }
    float* to =
        image.pixels.data() + (samples.pixel[i] * static_cast<std::size_t>(lookups) + i - first) * kChannels;
    *to++ = static_cast<float>(samples.part[i]);
    for (const Layer& layer : kLayers) {
      glm::vec3 v = (samples.*layer.array)[i];
      if (layer.array == &SurfaceSamples::position) v = glm::vec3(glm::dvec3(v) + samples.origin);
      for (int k = 0; k < 3; ++k) *to++ = v[k];
    }
  }
  return image;
}

int count_lookups(const Image& image, std::string_view prefix) {
  int count = 0;
  while (count < 64 && find(image, std::string(prefix) + "lookup." + std::to_string(count) + ".part") >= 0)
    ++count;
  return count;
}

SurfaceSamples lookups_of(const std::string& name, const Image& image, std::string_view prefix) {
  const int lookups = count_lookups(image, prefix);
  std::vector<std::size_t> channels;
  for (const std::string& channel : lookup_channels(lookups)) {
    const std::ptrdiff_t found = find(image, std::string(prefix) + channel);
    if (found < 0) throw FileError(name, "has no channel " + std::string(prefix) + channel);
    channels.push_back(static_cast<std::size_t>(found));
  }
  SurfaceSamples samples;
  samples.width = image.width;
  samples.height = image.height;
  samples.samples_per_pixel = std::max(lookups, 1);
  const std::size_t pixels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  for (std::size_t p = 0; p < pixels; ++p) {
    const float* pixel = image.pixels.data() + p * image.channels.size();
    for (int n = 0; n < lookups; ++n) {
      const std::size_t* channel = channels.data() + static_cast<std::size_t>(n) * kChannels;
      const float part = pixel[channel[0]];
      if (part == -1.0F) continue;
      const auto refuse = [&](const std::string& problem) {
        throw FileError(name,
                        "lookup " + std::to_string(n) + " of pixel " + std::to_string(p) + " " + problem);
      };
      if (!(part >= 0.0F && part <= std::numeric_limits<std::uint16_t>::max() && part == std::floor(part))) {
        refuse("has part " + std::to_string(part) + ", expected a whole number from 0 to 65535, or -1");
      }
      samples.pixel.push_back(static_cast<std::uint32_t>(p));
      samples.part.push_back(static_cast<std::uint16_t>(part));
      for (std::size_t l = 0; l < kLayers.size(); ++l) {
        glm::vec3 v;
        for (std::size_t k = 0; k < 3; ++k) v[static_cast<int>(k)] = pixel[channel[1 + 3 * l + k]];
        if (!is_finite(v)) refuse(std::string("has a ") + kLayers[l].name + " that is not finite");
        if (kLayers[l].array == &SurfaceSamples::reflection && !(std::abs(glm::length(v) - 1.0F) < kUnit)) {
          refuse("has a reflection that is no unit vector");
        }
        (samples.*kLayers[l].array).push_back(v);
      }
    }
  }
  return samples;
}

}  // namespace mirrorbake
