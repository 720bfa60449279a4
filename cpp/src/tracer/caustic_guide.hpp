#pragma once

#include <array>
#include <cstdint>
#include <vector>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "ray_scene.hpp"
#include "sample_stream.hpp"

namespace mirrorbake::tracing {

struct World;
class TriangleSampler;

/// Where to look for caustics: from which directions light arrives at a place by way of specular surfaces. A
/// diffuse path finds such light by chance alone, seldom and brightly; the guide tells where rays of their
/// own should look (after Jensen, "Importance Driven Path Tracing using the Photon Map", EGWR 1995). It only
/// chooses directions: what is found along them is weighted by their density, so that the guide need not be
/// right.
///
/// A photon starts at a random point of the specular surfaces, lit by a random light, and follows their
/// reflection to a diffuse surface. A grid of cells, each with a histogram of directions, holds what arrived.
class CausticGuide {
 public:
  /// Knows nothing.
  CausticGuide() = default;
  CausticGuide(const World& world, std::uint64_t seed);

  bool knows_nothing() const { return grid_.empty(); }

  /// Bins of directions: the octahedral map, cut into squares.
  static constexpr int kSide = 40;
  static constexpr int kBins = kSide * kSide;
  /// Specular surfaces between a light and a diffuse one, at most.
  static constexpr int kSpecularBounces = 4;

  /// What is known of one place.
  struct Cell {
    /// Guided rays that are worth their while beside a path of weight 1, in [0,1); 0: there is nothing to
    /// find.
    float rays = 0.0F;
    std::uint32_t number = 0;       ///< among the cells with rays
    std::uint64_t lit_squares = 0;  ///< which of 8 × 8 squares of bins light arrives from
  };
  Cell cell(glm::vec3 position) const {
    const glm::vec3 place = (position - corner_) * cells_per_metre_;
    if (!(place.x >= 0.0F && place.y >= 0.0F && place.z >= 0.0F && place.x < static_cast<float>(size_.x) &&
          place.y < static_cast<float>(size_.y) && place.z < static_cast<float>(size_.z))) {
      return {};
    }
    return grid_[grid_index(glm::ivec3(place))];
  }
  /// The same for a vertex of a path: nothing where there is so little to find that it is not worth the look.
  Cell cell_of_path(glm::vec3 position) const {
    constexpr float kWorthwhile = 0.1F;
    const Cell found = cell(position);
    return found.rays < kWorthwhile ? Cell{} : found;
  }

  /// Irradiance of caustics there, as a share of that on the specular surfaces.
  static float strength(Cell cell);

  /// A unit direction, with the density `pdf` per solid angle. `u` in [0,1)².
  glm::vec3 sample(Cell cell, glm::vec2 u) const;
  float pdf(Cell cell, glm::vec3 direction) const;

 private:
  struct Photon {
    glm::vec3 position;
    glm::vec3 direction;  ///< unit, to where it came from
    float power;          ///< luminance, W
  };
  /// Which bins of a cell light arrives from: 64 of them, and how many there are before these.
  struct LitBins {
    std::uint64_t bits = 0;
    std::uint32_t before = 0;
  };
  static constexpr std::size_t kWords = kBins / 64;
  static_assert(kBins % 64 == 0);

  struct Photons {
    std::vector<Photon> landed;
    double received = 0.0;  ///< power that falls on the specular surfaces, luminance, W
  };

  static Photons shoot(const World& world, const TriangleSampler& specular, std::uint64_t seed);
  /// From a point of a specular surface that stands for `area`.
  static void shoot_one(const World& world, const Hit& start, float area, const SampleStream& stream,
                        Photons& photons);
  void lay_grid(const std::vector<Photon>& photons);
  void fill(const std::vector<Photon>& photons, double irradiance_of_reflectors);

  std::size_t grid_index(glm::ivec3 c) const {
    return static_cast<std::size_t>((c.z * size_.y + c.y) * size_.x + c.x);
  }

  glm::vec3 corner_{0.0F};
  float cells_per_metre_ = 0.0F;
  glm::ivec3 size_{0};
  std::vector<Cell> grid_;
  std::vector<LitBins> lit_;  ///< kWords per cell with rays
  /// Of the cells' lit bins, one cell after the other.
  std::vector<std::uint32_t> first_;  ///< per cell with rays, + 1
  std::vector<std::uint16_t> bins_;
  /// Before each bin; a cell's begins with 0 and ends with 1, an entry more than bins
  std::vector<float> cdf_;
};

}  // namespace mirrorbake::tracing
