#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>
#include <glm/vec3.hpp>

#include "cache_cells.hpp"
#include "mirrorbake/tracer/tracer.hpp"
#include "sample_stream.hpp"
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
/// On an object of many vertices each one's node takes fewer rays and the mean with its neighbours, whose
/// rays it shares: what is gathered is as noisy as elsewhere, and blurred over distances that are small
/// there. Nodes that cuts have made share nothing, for cuts are where light changes.
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

  glm::vec3 interpolate(const Sides& values, const Surface& surface) const {
    return cells_.interpolate(values.side[surface.front ? 0 : 1], surface);
  }
  /// One pass's irradiance on one side of a node.
  struct NodeGather {
    glm::vec3 irradiance{0.0F};
    bool buried = false;    ///< most rays hit the dark inside of a body
    bool given_up = false;  ///< the first rays found that, or, on a back side, nothing at all
  };
  /// The rays of one side of a node in one pass.
  struct NodeRays {
    std::uint64_t key = 0;                     ///< of their random numbers, as of all nodes'
    std::uint32_t place = 0;                   ///< of the node, along the curve through all of them
    std::array<Surface, kStartPoints> starts;  ///< random points around it
    bool is_back = false;
    int along_cosine = 0;
    int probing = 0;                      ///< of those, after which a hemisphere may be given up
    int to_bright = 0;                    ///< beside those; 0: those find what bright surfaces reflect
    int to_caustics = 0;                  ///< beside those
    std::uint32_t first_to_caustics = 0;  ///< number of the first among those of all nodes

    /// The numbers of a ray of `count`. Nodes take theirs in turn from one sequence, so that any that are
    /// close to each other together have stratified rays, and their errors cancel where they are seen as one
    /// (as between pixels: Ahmed and Wonka, "Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error
    /// via Hierarchical Ordering of Pixels", ACM TOG 39(6), 2020).
    SampleStream stream(int ray, int count) const {
      return {key, place * static_cast<std::uint32_t>(count) + static_cast<std::uint32_t>(ray)};
    }
    /// Where a ray of `count` starts.
    const Surface& start(int ray, int count) const {
      return starts[static_cast<std::uint32_t>(ray) %
                    std::min(kStartPoints, static_cast<std::uint32_t>(count))];
    }
  };
  /// With starts for at most `most` rays of a kind.
  NodeRays node_rays(const World& world, std::size_t place, int side, int pass, int most) const;
  template <typename IrradianceAt>
  static NodeGather gather_node(const World& world, const BrightSurfaces& bright, const NodeRays& rays,
                                const IrradianceAt& irradiance_at);
  static float mean_rays(const World& world, const BrightSurfaces& bright, const NodeRays& rays,
                         const Ray& ray, const Hit& hit, float cosine);
  /// What the rays to bright surfaces find; those along the cosine have the rest of it.
  static glm::vec3 from_bright(const World& world, const BrightSurfaces& bright, const NodeRays& rays);
  static glm::vec3 node_caustics(const World& world, const CausticGuide& guide, const NodeRays& rays);
  /// Adds up caustics and what the passes bring.
  void gather(const World& world, const CausticGuide& guide, const TracerOptions& options);
  /// Those after the last one that is followed: each keeps of the one before what the last one kept.
  void add_further_bounces(const Sides& before, const Sides& last);
  /// Of all nodes along the curve, the number of the first ray to caustics, and one entry more for their end.
  std::vector<std::uint32_t> rays_to_caustics(const World& world, const CausticGuide& guide, int rays) const;
  void fill_buried(std::vector<glm::vec3>& values, const std::vector<std::uint8_t>& buried) const;
  /// Turns the light at nodes into values of which the interpolation has the right mean over cells. Between
  /// the light at its corners a cell would be too dark on a hill of light, and too bright in a valley.
  void sharpen(const World& world, std::vector<glm::vec3>& values,
               const std::vector<std::uint8_t>& buried) const;
  /// Takes means with the neighbours, buried ones left out, where nodes have a share of the rays.
  void share_rays(std::vector<glm::vec3>& values, const std::vector<std::uint8_t>& buried) const;
  /// Of the rays that nodes have elsewhere, in (0,1].
  float ray_share(std::size_t node) const;
  int rays_of(std::size_t node, int rays, int least) const;

  CacheCells cells_;
  std::vector<float> ray_share_;  ///< per object, of nodes at vertices
  Sides total_;
  std::uint64_t seed_ = 0;
};

}  // namespace mirrorbake::tracing
