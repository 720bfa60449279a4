#include "mirrorbake/inference/layer_images.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <utility>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/surface/lookup_image.hpp"
#include "mirrorbake/surface/shells.hpp"

namespace mirrorbake {
namespace {

constexpr std::string_view kShell = "specular_";

std::ptrdiff_t find(const Image& image, const std::string& channel) {
  const auto found = std::find(image.channels.begin(), image.channels.end(), channel);
  return found == image.channels.end() ? -1 : found - image.channels.begin();
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "none" : text;
}

// What the channels of the reflector start with.
std::string prefix_of(const LayerImage& layers, const std::string& reflector) {
  constexpr std::string_view kSuffix = "fresnel.R";
  std::vector<std::string> names;
  for (const std::string& channel : layers.image.channels) {
    if (!channel.ends_with(kSuffix) || channel.find("lookup.") != std::string::npos) continue;
    const std::string prefix = channel.substr(0, channel.size() - kSuffix.size());
    if (prefix.empty() ? reflector.empty() : prefix == reflector + ".") return prefix;
    if (prefix.ends_with('.')) names.push_back(prefix.substr(0, prefix.size() - 1));
  }
  if (reflector.empty() && names.size() == 1) return names.front() + ".";
  if (reflector.empty() && names.empty()) {
    throw FileError(layers.name, "has no channel fresnel.R, expected the layers of a reflector");
  }
  if (reflector.empty()) {
    throw FileError(layers.name, "has several reflectors, expected the choice of one: " + joined(names));
  }
  throw InvalidArgument("reflector", reflector, "one of those in " + layers.name + ": " + joined(names));
}

// The traced shells, front to back.
std::vector<std::string> shells_of(const LayerImage& layers, const std::string& prefix,
                                   const std::vector<LayerShell>& wanted) {
  std::vector<std::string> front, last;
  const std::string start = prefix + std::string(kShell);
  for (const std::string& channel : layers.image.channels) {
    if (!channel.starts_with(start) || !channel.ends_with(".R")) continue;
    const std::string name = channel.substr(start.size(), channel.size() - start.size() - 2);
    (find(layers.image, start + name + ".A") >= 0 ? front : last).push_back(name);
  }
  std::vector<std::string> all = front;
  all.insert(all.end(), last.begin(), last.end());
  if (last.size() != 1) {
    throw FileError(layers.name, "has " + std::to_string(last.size()) + " shells without alpha (" +
                                     joined(last) + "), expected one, " + start + "NAME.R, .G and .B");
  }
  std::vector<std::string> named;
  for (const LayerShell& shell : wanted) {
    if (std::find(all.begin(), all.end(), shell.name) == all.end()) {
      throw InvalidArgument("shell", shell.name, "one of " + joined(all) + ", the shells of " + layers.name);
    }
    if (std::find(named.begin(), named.end(), shell.name) != named.end()) {
      throw InvalidArgument("shell", shell.name + " twice", "every shell once");
    }
    named.push_back(shell.name);
  }
  if (!named.empty() && named.back() != last.front()) {
    throw InvalidArgument("shell", joined(named), "the opaque shell " + last.front() + " at the end");
  }
  if (named.size() == all.size()) return named;
  if (front.size() < 2) return all;
  throw InvalidArgument("shell", joined(named),
                        "all of " + joined(all) + ", front to back: a file does not keep their order");
}

// Reads the layers of one reflector, pixel by pixel.
class LayerReader {
 public:
  LayerReader(const LayerImage& layers, std::string prefix, const std::vector<std::string>& shells)
      : image_(layers.image), name_(layers.name), prefix_(std::move(prefix)) {
    coverage_ = require("coverage");
    part_ = find(image_, prefix_ + "part");
    for (std::size_t k = 0; k < 3; ++k) {
      const std::string suffix = std::string(".") + "RGB"[k];
      fresnel_[k] = require("fresnel" + suffix);
      diffuse_[k] = find(image_, prefix_ + "diffuse" + suffix);
      covariance_[k] = find(image_, prefix_ + "covariance" + suffix);
    }
    for (const std::string& shell : shells) {
      auto& channels = shells_.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        channels[k] = require(std::string(kShell) + shell + "." + "RGB"[k]);
      }
      channels[3] = &shell == &shells.back() ? -1 : require(std::string(kShell) + shell + ".A");
    }
  }

  // -1: nothing is seen.
  int part(std::size_t pixel) const {
    const float coverage = value(pixel, coverage_, 0.0F);
    if (!(coverage >= 0.0F && coverage <= 1.0F)) refuse(pixel, "coverage", coverage, "a number from 0 to 1");
    const float part = value(pixel, part_, 0.0F);
    if (coverage == 0.0F) return -1;
    if (!(part >= 0.0F && part <= 65535.0F && part == std::floor(part))) {
      refuse(pixel, "part", part, "a whole number from 0 to 65535");
    }
    return static_cast<int>(part);
  }

  void add(std::size_t pixel, ViewTargets& targets) const {
    const int part_seen = part(pixel);
    if (part_seen < 0) {
      targets.add_nothing(pixel);
      return;
    }
    std::vector<glm::vec4> light;
    ShellComposite composite;
    for (const auto& channels : shells_) {
      light.emplace_back(colour(pixel, channels), value(pixel, channels[3], 1.0F));
      composite.add(light.back());
    }
    targets.add_means(pixel,
                      {.coverage = value(pixel, coverage_, 0.0F),
                       .part = part_seen,
                       .reflected = colour(pixel, fresnel_) * composite.light() + colour(pixel, covariance_),
                       .diffuse = colour(pixel, diffuse_),
                       .shells = light});
  }

 private:
  std::ptrdiff_t require(const std::string& channel) const {
    const std::ptrdiff_t found = find(image_, prefix_ + channel);
    if (found < 0) throw FileError(name_, "has no channel " + prefix_ + channel);
    return found;
  }
  [[noreturn]] void refuse(std::size_t pixel, const std::string& channel, float is,
                           const std::string& expected) const {
    throw FileError(name_, prefix_ + channel + " of pixel " + std::to_string(pixel) + " is " +
                               std::to_string(is) + ", expected " + expected);
  }
  float value(std::size_t pixel, std::ptrdiff_t channel, float missing) const {
    if (channel < 0) return missing;
    return image_.pixels[pixel * image_.channels.size() + static_cast<std::size_t>(channel)];
  }
  template <typename Channels>
  glm::vec3 colour(std::size_t pixel, const Channels& channels) const {
    return {value(pixel, channels[0], 0.0F), value(pixel, channels[1], 0.0F),
            value(pixel, channels[2], 0.0F)};
  }

  const Image& image_;
  const std::string& name_;
  std::string prefix_;
  std::ptrdiff_t coverage_ = -1, part_ = -1;
  std::array<std::ptrdiff_t, 3> fresnel_{}, diffuse_{}, covariance_{};
  std::vector<std::array<std::ptrdiff_t, 4>> shells_;
};

struct Views {
  std::vector<SurfaceSamples> lookups;
  std::vector<ViewTargets> targets;
  int parts = 1;
};

SurfaceSamples checked_lookups(const LayerImage& layers, const std::string& prefix,
                               const RunTimeModel& run_time) {
  const int lookups = count_lookups(layers.image, prefix);
  if (static_cast<std::size_t>(lookups) != run_time.places.size()) {
    throw FileError(layers.name, "has " + std::to_string(lookups) + " lookups a pixel, expected the " +
                                     std::to_string(run_time.places.size()) + " of the run time " +
                                     run_time.name);
  }
  return lookups_of(layers.name, layers.image, prefix);
}

// For every part the number of the traced shell that each of the wanted ones ends with.
std::vector<int> stack_of(const std::vector<LayerShell>& wanted, const std::vector<std::string>& traced) {
  std::vector<int> ends;
  for (const LayerShell& shell : wanted) {
    ends.push_back(static_cast<int>(std::find(traced.begin(), traced.end(), shell.name) - traced.begin()));
  }
  return ends;
}

Views read_views(std::span<const LayerImage> images, const LayerInferenceOptions& options,
                 std::vector<LayerShell>& shells) {
  Views views;
  std::vector<LayerReader> readers;
  std::vector<std::string> traced;
  for (const LayerImage& layers : images) {
    const std::string prefix = prefix_of(layers, options.reflector);
    std::vector<std::string> names = shells_of(layers, prefix, options.shells);
    if (!traced.empty() && names != traced) {
      throw FileError(layers.name, "has the shells " + joined(names) + ", expected " + joined(traced) +
                                       " as in " + images.front().name);
    }
    traced = names;
    const LayerReader& reader = readers.emplace_back(layers, prefix, traced);
    views.lookups.push_back(checked_lookups(layers, prefix, options.run_time));
    const std::size_t pixels =
        static_cast<std::size_t>(layers.image.width) * static_cast<std::size_t>(layers.image.height);
    for (std::size_t p = 0; p < pixels; ++p) views.parts = std::max(views.parts, reader.part(p) + 1);
    for (const std::uint16_t part : views.lookups.back().part) views.parts = std::max(views.parts, part + 1);
  }
  if (shells.empty()) {
    for (const std::string& name : traced) shells.push_back({name, {}});
  }
  const ViewTargets::Stacks stacks(static_cast<std::size_t>(views.parts), stack_of(shells, traced));
  for (std::size_t v = 0; v < images.size(); ++v) {
    const Image& image = images[v].image;
    ViewTargets& targets = views.targets.emplace_back(image.width, image.height, views.parts,
                                                      static_cast<int>(traced.size()), stacks);
    const std::size_t pixels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
    for (std::size_t p = 0; p < pixels; ++p) readers[v].add(p, targets);
  }
  return views;
}

}  // namespace

LayerInference infer_from_layers(std::span<const LayerImage> images, const LayerInferenceOptions& options) {
  if (images.empty()) throw InvalidArgument("images", "none", "one view at least");
  std::vector<LayerShell> shells = options.shells;
  const Views views = read_views(images, options, shells);

  const bool per_part = options.sharing == MapSharing::per_part;
  LayerInference result;
  std::vector<FitPart> parts;
  for (int p = 0; p < views.parts; ++p) {
    FitPart& part = parts.emplace_back();
    for (std::size_t k = 0; k < shells.size(); ++k) {
      const std::size_t map = k + (per_part ? static_cast<std::size_t>(p) * shells.size() : 0);
      part.push_back({shells[k].proxy, static_cast<int>(map), {}});
      if (map < result.maps.size()) continue;
      const std::string suffix = per_part ? ".part" + std::to_string(p) : "";
      result.maps.push_back({shells[k].name + suffix, k + 1 < shells.size(), {}});
    }
  }
  std::vector<DisplayView> display;
  for (std::size_t v = 0; v < images.size(); ++v) {
    display.push_back({.lookups = &views.lookups[v], .targets = &views.targets[v]});
    result.rejected += views.targets[v].rejected();
    const std::size_t pixels = static_cast<std::size_t>(views.targets[v].width()) *
                               static_cast<std::size_t>(views.targets[v].height());
    for (std::size_t p = 0; p < pixels; ++p) result.pixels += views.targets[v].count(p) > 0 ? 1U : 0U;
  }
  const std::vector<TexelTopology> maps(result.maps.size(), options.map);
  const DisplayFit fit = fit_display(display, parts, maps, 1, options.run_time, options.fit);
  result.report = fit.passes.back();
  for (std::size_t m = 0; m < maps.size(); ++m) {
    InferredMap& map = result.maps[m];
    const std::size_t channels = map.has_alpha ? 4 : 3;
    map.texels.resize(options.map.texels() * channels);
    for (std::size_t t = 0; t < options.map.texels(); ++t) {
      std::copy_n(fit.texels.data() + 4 * (m * options.map.texels() + t), channels,
                  map.texels.data() + t * channels);
    }
  }
  return result;
}

}  // namespace mirrorbake
