#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "mirrorbake/proxy/proxy.hpp"

/// Automatic choice of geometry (spec G4; [PEM] leaves it to future work).
namespace mirrorbake {

/// Reflected rays of a few views of an object and where they met the surroundings. The spans have one length.
struct TracedRays {
  std::span<const glm::vec3> positions;   ///< on the object, metres
  std::span<const glm::vec3> directions;  ///< length > 0
  std::span<const float> distances;       ///< to the surroundings, metres, > 0; ∞: the ray leaves the scene
  std::span<const int> views;             ///< which view a ray belongs to, any numbers
};

struct ProxyChoiceOptions {
  /// A simpler shape is taken if its predicted error is at most this much above the least one, relatively.
  double tolerance = 0.05;
  /// Errors below this angle do not count: a tenth of a texel of a cube map with 256² texels per face,
  /// radians.
  double negligible_angle = 6e-4;
  /// Of each view at most this many rays are used, evenly spaced.
  std::size_t max_rays_per_view = 1000;
};

/// Names of the families of shapes that are fitted, in rising order of parameters.
std::vector<std::string> proxy_families();

struct ProxyCandidate {
  std::string name;    ///< of its family
  int parameters = 0;  ///< numbers that the fit sets
  Proxy proxy;         ///< fitted to all views
  /// Mean angle, as seen from the map's origin, between the lookup and the point that the ray really meets,
  /// radians:
  double fit_error = 0;       ///< over the rays that it was fitted to
  double off_view_error = 0;  ///< predicted: each view in turn, with a fit to the others
};

struct ProxyChoice {
  std::vector<ProxyCandidate> candidates;  ///< in rising order of parameters
  std::size_t chosen = 0;                  ///< index into `candidates`
  std::string reason;                      ///< one sentence for people
  const ProxyCandidate& best() const { return candidates[chosen]; }
};

/// Fits every shape to the rays, predicts how far off its lookups are in views that it was not fitted to
/// (cross-validation: each view is left out in turn), and chooses the simplest shape within tolerance of the
/// best. A single view is cut in two halves instead.
///
/// Shapes are fitted to what matters, the angle between the lookup and the true hit point seen from `origin`,
/// summed without squares, so that furniture in a room does not bend its walls: iteratively reweighted least
/// squares with Levenberg-Marquardt steps from several starts. Finite shapes always contain `origin` and are
/// only tried if a ray meets something.
///
/// Throws InvalidArgument for spans of different length, fewer than 16 rays, coordinates that are not finite,
/// zero directions, distances that are not positive, options outside of [0, ∞).
ProxyChoice choose_proxy(const TracedRays& rays, glm::vec3 origin, const ProxyChoiceOptions& options = {});

}  // namespace mirrorbake
