#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "mirrorbake/surface/surface_samples.hpp"

namespace mirrorbake {

/// What maps should make a view look like: sums over traced samples, pixel by pixel, so that a view of many
/// samples never has to be in memory at once.
class ViewTargets {
 public:
  /// For each part, front to back, the number of the traced shell that each of its own shells ends with: it
  /// holds that one and those in front of it that no other shell of the part holds.
  using Stacks = std::vector<std::vector<int>>;

  /// Of an image of width × height pixels, a reflector of `parts` parts, and as many shells as the samples
  /// will have. Without `stacks` the shells of every part are the traced ones. Throws InvalidArgument for a
  /// number below 1, or stacks that are not one for each part, rise and end with the last shell.
  ViewTargets(int width, int height, int parts, int shells, const Stacks& stacks = {});

  /// Adds samples with traced light, at most one trace of every pixel. (x, y): where their image's top left
  /// pixel lies in this one. Samples whose light is NaN or infinite count as not traced (`rejected`). Throws
  /// InvalidArgument if they do not fit or have no light.
  void add(const SurfaceSamples& samples, int x = 0, int y = 0);

  /// Means over the samples of a pixel that see the reflector, of which nothing else is known.
  struct PixelMeans {
    float coverage = 0.0F;                   ///< share of the pixel's samples that see it, (0, 1]
    int part = 0;                            ///< to which all of them are counted
    glm::vec3 reflected{0.0F};               ///< F times the incident light
    glm::vec3 diffuse{0.0F};                 ///< the body's own light
    std::span<const glm::vec4> shells = {};  ///< what arrives from each traced shell, premultiplied, and α
  };
  /// Adds a pixel of which there are means alone, as in an image of layers. Of a stack's shells that hold
  /// several traced ones the light is composed from the means, which is not the mean of what is composed, but
  /// for the last one's. Means that are not finite count as not traced (`rejected`). Throws InvalidArgument.
  void add_means(std::size_t pixel, const PixelMeans& means);
  /// A pixel in which nothing sees the reflector.
  void add_nothing(std::size_t pixel) { traced_[pixel] += kWhole; }

  int width() const { return width_; }
  int height() const { return height_; }
  int parts() const { return parts_; }
  int shells() const { return shells_; }
  /// Samples that were left out so far, since their light is not finite.
  std::size_t rejected() const { return rejected_; }

  /// Share of a pixel's traced samples that see the reflector, or one of its parts.
  float coverage(std::size_t pixel) const { return share(count(pixel), pixel); }
  float coverage(std::size_t pixel, int part) const { return share(count(pixel, part), pixel); }
  /// Of a pixel that see a part.
  std::uint32_t count(std::size_t pixel, int part) const {
    const std::uint32_t entry = find(pixel, part);
    return entry == kNone ? 0 : entries_[entry].count;
  }
  std::uint32_t count(std::size_t pixel) const;
  /// Means over the samples that see the reflector: F times the incident light, and the body's own light D.
  glm::vec3 reflected(std::size_t pixel) const;
  glm::vec3 diffuse(std::size_t pixel) const;
  /// Mean over the samples that see the part; `shell` is a number in its stack.
  glm::vec4 shell(std::size_t pixel, int part, int shell) const;
  /// Mean of what arrives from this shell and all behind it: what a part's last shell has to show.
  glm::vec3 light_from(std::size_t pixel, int part, int shell) const;

 private:
  /// Of pixels known by their means: what stands for all of their samples.
  static constexpr std::uint32_t kWhole = 1U << 16;
  static constexpr std::uint32_t kNone = 0xffffffffU;

  /// Sums of a part in a pixel. Few pixels see more than one part: entries are made when they are needed,
  /// those of a pixel are chained.
  struct Entry {
    std::uint32_t next = kNone;
    std::uint32_t count = 0;
    int part = 0;
  };

  /// Number of the entry of a part in a pixel; kNone if it has none.
  std::uint32_t find(std::size_t pixel, int part) const;
  std::uint32_t find_or_add(std::size_t pixel, int part);
  std::size_t at(std::uint32_t entry, int shell) const {
    return std::size_t{entry} * static_cast<std::size_t>(shells_) + static_cast<std::size_t>(shell);
  }

  float share(std::uint32_t count, std::size_t pixel) const {
    return traced_[pixel] == 0 ? 0.0F : static_cast<float>(count) / static_cast<float>(traced_[pixel]);
  }
  /// Adds to an entry, `count` times, what arrives from the traced shells.
  void add_shells(std::uint32_t entry, std::span<const glm::vec4> layers, std::uint32_t count);

  int width_, height_, parts_, shells_;
  std::size_t rejected_ = 0;
  std::vector<int> own_shell_;         // of parts × traced shells: the number in the part's stack
  std::vector<std::uint32_t> traced_;  // samples of a pixel, those beside the reflector included
  std::vector<std::uint32_t> first_;   // entry of a pixel
  std::vector<glm::dvec3> reflected_, diffuse_;
  std::vector<Entry> entries_;
  // Of entries × shells.
  std::vector<glm::dvec4> radiance_;
  std::vector<glm::dvec3> light_from_;
};

}  // namespace mirrorbake
