#pragma once

#include <array>
#include <cstdint>
#include <vector>
#include <glm/vec3.hpp>

#include "cache_cells.hpp"
#include "mirrorbake/tracer/tracer.hpp"
#include "surface.hpp"

namespace mirrorbake::tracing {

struct World;
class BrightSurfaces;
class CausticGuide;

/// Indirect irradiance at the nodes of CacheCells, one value per side (IndirectLight::cached): light by way
/// of specular or diffuse surfaces.
///
/// Each pass gathers one more diffuse bounce: rays with a cosine distribution leave points around a node, and
/// pick up the direct light (first pass) or the previous pass's irradiance where they land. A ray that lands
/// on a mirror follows it a few bounces, without the emission seen that way: rays that the guide aims find
/// those caustics with less noise, in the first pass, as rays to points of BrightSurfaces do with what these
/// reflect. Nodes buried in another body see only the dark inside
/// of it; they take the value of their neighbours, or triangles that stick out of the body would fade to
/// black.
///
/// On an object of many nodes each one takes fewer rays and the mean with its neighbours, whose rays it
/// shares: what is gathered is as noisy as elsewhere, and blurred over distances that are small there.
class IrradianceCache {
 public:
  IrradianceCache();
  IrradianceCache(const World& world, const CausticGuide& guide, const TracerOptions& options);
  ~IrradianceCache();
  IrradianceCache(const IrradianceCache&);
  IrradianceCache& operator=(const IrradianceCache&);
  IrradianceCache(IrradianceCache&&) noexcept;
  IrradianceCache& operator=(IrradianceCache&&) noexcept;

  /// On the side that the surface is seen from.
  glm::vec3 irradiance(const Surface& surface) const { return interpolate(total_, surface); }

 private:
  static constexpr std::uint32_t kStartPoints = 16;  ///< of a node, from which its rays start in turn

  /// Irradiance per node: of the front and of the back side.
  struct Sides {
    std::vector<glm::vec3> side[2];
  };

  static std::uint64_t side_number(std::size_t node, int side) {
    return 2 * node + static_cast<std::size_t>(side);
  }
  glm::vec3 interpolate(const Sides& values, const Surface& surface) const {
    return cells_.interpolate(values.side[surface.front ? 0 : 1], surface);
  }
  /// One pass's irradiance on one side of a node.
  struct NodeGather {
    glm::vec3 irradiance{0.0F};
    bool buried = false;    ///< most rays hit the dark inside of a body
    bool given_up = false;  ///< the first rays found that, or, on a back side, nothing at all
  };
  /// What bright surfaces reflect is weighted for a partner that takes `bright_rays` rays to them.
  template <typename IrradianceAt>
  NodeGather gather_node(const World& world, std::size_t node, int side, int rays,
                         const BrightSurfaces& bright, int bright_rays,
                         const IrradianceAt& irradiance_at) const;
  /// That partner: irradiance by `bright_rays` rays to bright surfaces beside `rays` along the cosine.
  glm::vec3 from_bright(const World& world, const BrightSurfaces& bright, std::size_t node, int side,
                        int rays, int bright_rays) const;
  /// Random points around a node, seen from one side; `count` ≤ kStartPoints.
  std::array<Surface, kStartPoints> start_points(const World& world, std::size_t node, int side,
                                                 std::uint32_t count) const;
  glm::vec3 node_caustics(const World& world, const CausticGuide& guide, std::size_t node, int side,
                          int rays) const;
  /// Adds up caustics and what the passes bring.
  void gather(const World& world, const CausticGuide& guide, const TracerOptions& options);
  /// Those after the last one that is followed: each keeps of the one before what the last one kept.
  void add_further_bounces(const Sides& before, const Sides& last);
  void fill_buried(std::vector<glm::vec3>& values, const std::vector<std::uint8_t>& buried) const;
  /// Takes means with the neighbours, buried ones left out, where nodes have a share of the rays.
  void share_rays(std::vector<glm::vec3>& values, const std::vector<std::uint8_t>& buried) const;
  int rays_of(std::size_t node, int rays, int least) const;

  CacheCells cells_;
  std::vector<float> ray_share_;  ///< per object, of the rays that a node has elsewhere, in (0,1]
  Sides total_;
  std::uint64_t seed_ = 0;
};

}  // namespace mirrorbake::tracing
