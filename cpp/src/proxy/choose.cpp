#include "mirrorbake/proxy/choose.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <glm/geometric.hpp>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/text.hpp"
#include "shape_families.hpp"

namespace mirrorbake {
namespace {

using namespace shape_families;

/// The rays of a fit, and the unit vectors from the origin towards what they meet.
struct Problem {
  std::vector<glm::dvec3> positions, directions, targets;
  glm::vec3 origin{0.0F};
  double scale = 1;

  void add(const Problem& other, std::size_t i) {
    positions.push_back(other.positions[i]);
    directions.push_back(other.directions[i]);
    targets.push_back(other.targets[i]);
  }
};

/// Unit lookup directions of all rays.
std::vector<glm::dvec3> unit_lookups(const Problem& problem, const Proxy& proxy) {
  std::vector<glm::dvec3> lookups(problem.positions.size());
  lookup_directions(proxy, problem.positions, problem.directions, lookups);
  for (glm::dvec3& lookup : lookups) lookup = glm::normalize(lookup);
  return lookups;
}

double angle_between(const glm::dvec3& a, const glm::dvec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

double mean_angle(const Problem& problem, const Proxy& proxy) {
  const std::vector<glm::dvec3> lookups = unit_lookups(problem, proxy);
  double sum = 0;
  for (std::size_t i = 0; i < lookups.size(); ++i) sum += angle_between(lookups[i], problem.targets[i]);
  return sum / static_cast<double>(lookups.size());
}

struct Fit {
  Parameters parameters;
  double cost = std::numeric_limits<double>::infinity();
};

/// Below this chord the loss is quadratic, above linear (Huber): well below what one sees, well above
/// rounding.
constexpr double kHuberChord = 1e-3;

/// Minimises Σ huber(|lookup − target|), chords between unit vectors.
Fit fit_shape(const Family& family, const Problem& problem, const Parameters& start, int max_steps) {
  Fit fit;
  fit.parameters = start;
  if (!feasible(family, start)) return fit;
  const auto lookups_of = [&](const Parameters& q) {
    return unit_lookups(problem, make_proxy(family, q, problem.origin, problem.scale));
  };
  const auto cost_of = [&](const std::vector<glm::dvec3>& lookups) {
    double cost = 0;
    for (std::size_t i = 0; i < lookups.size(); ++i) {
      const double r = glm::length(lookups[i] - problem.targets[i]);
      cost += r <= kHuberChord ? 0.5 * r * r / kHuberChord : r - 0.5 * kHuberChord;
    }
    return cost / static_cast<double>(lookups.size());
  };
  const Eigen::Index n = start.size();
  std::vector<glm::dvec3> lookups = lookups_of(start);
  fit.cost = cost_of(lookups);
  if (n == 0) return fit;
  double damping = 1e-2;
  for (int step = 0; step < max_steps; ++step) {
    // Finite differences of the parameters, all of which are of order 1; the proxy keeps them as floats.
    constexpr double kDifference = 1e-3;
    std::vector<std::vector<glm::dvec3>> columns(static_cast<std::size_t>(n));
    for (Eigen::Index j = 0; j < n; ++j) {
      Parameters moved = fit.parameters;
      moved[j] += kDifference;
      columns[static_cast<std::size_t>(j)] = lookups_of(moved);
    }
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(n);
    Eigen::Matrix<double, 3, Eigen::Dynamic> jacobian(3, n);
    for (std::size_t i = 0; i < lookups.size(); ++i) {
      const glm::dvec3 r = lookups[i] - problem.targets[i];
      const double weight = 1.0 / std::max(glm::length(r), kHuberChord);
      for (Eigen::Index j = 0; j < n; ++j) {
        const glm::dvec3 slope = (columns[static_cast<std::size_t>(j)][i] - lookups[i]) / kDifference;
        jacobian.col(j) << slope.x, slope.y, slope.z;
      }
      normal.noalias() += weight * jacobian.transpose() * jacobian;
      gradient.noalias() += weight * jacobian.transpose() * Eigen::Vector3d(r.x, r.y, r.z);
    }
    bool moved = false;
    double gain = 0;
    for (int attempt = 0; attempt < 8 && !moved; ++attempt) {
      Eigen::MatrixXd damped = normal;
      // The floor keeps parameters in place which no ray feels, such as the side of a box nobody sees.
      const double floor = 1e-6 * normal.trace() + std::numeric_limits<double>::min();
      damped.diagonal().array() += damping * normal.diagonal().array().max(floor);
      Eigen::VectorXd change = damped.ldlt().solve(-gradient);
      if (change.allFinite()) {
        change = change.cwiseMax(-0.5).cwiseMin(0.5);
        const Parameters next = fit.parameters + change;
        if (feasible(family, next)) {
          std::vector<glm::dvec3> next_lookups = lookups_of(next);
          const double cost = cost_of(next_lookups);
          if (cost < fit.cost) {
            gain = (fit.cost - cost) / fit.cost;
            fit.parameters = next;
            fit.cost = cost;
            lookups = std::move(next_lookups);
            moved = true;
          }
        }
      }
      damping = moved ? std::max(0.2 * damping, 1e-9) : 5.0 * damping;
    }
    if (!moved || gain < 1e-6) break;
  }
  return fit;
}

void check(const TracedRays& rays, glm::vec3 origin, const ProxyChoiceOptions& options) {
  const std::size_t n = rays.positions.size();
  if (rays.directions.size() != n || rays.distances.size() != n || rays.views.size() != n) {
    throw InvalidArgument("rays",
                          std::to_string(n) + " positions, " + std::to_string(rays.directions.size()) +
                              " directions, " + std::to_string(rays.distances.size()) + " distances, " +
                              std::to_string(rays.views.size()) + " views",
                          "spans of one length");
  }
  constexpr std::size_t kMinRays = 16;
  if (n < kMinRays) throw InvalidArgument("rays", std::to_string(n), "at least 16");
  check_finite("origin", origin);
  check_finite("positions", rays.positions);
  for (std::size_t i = 0; i < n; ++i) {
    const std::string index = "[" + std::to_string(i) + "]";
    if (!is_finite(rays.directions[i]) || rays.directions[i] == glm::vec3(0.0F)) {
      throw InvalidArgument("directions" + index, text_of(rays.directions[i]), "a length > 0");
    }
    if (!(rays.distances[i] > 0)) {
      throw InvalidArgument("distances" + index, std::to_string(rays.distances[i]), "a distance > 0");
    }
  }
  check_at_least("tolerance", options.tolerance, 0.0);
  check_at_least("negligible_angle", options.negligible_angle, 0.0);
  if (options.max_rays_per_view < kMinRays) {
    throw InvalidArgument("max_rays_per_view", std::to_string(options.max_rays_per_view), "at least 16");
  }
}

std::string angle_text(double radians) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g mrad", 1e3 * radians);
  return text;
}

std::string explain(const ProxyChoice& choice, std::size_t best, const ProxyChoiceOptions& options) {
  const ProxyCandidate& chosen = choice.best();
  std::string text = chosen.name + ": predicted off-view error " + angle_text(chosen.off_view_error);
  if (choice.chosen != best) {
    const ProxyCandidate& least = choice.candidates[best];
    text += ", the simplest shape " +
            (chosen.off_view_error <= options.negligible_angle
                 ? "below the negligible " + angle_text(options.negligible_angle)
                 : "within " + std::to_string(std::lround(100 * options.tolerance)) + " % of the best") +
            " (" + least.name + ", " + angle_text(least.off_view_error) + ")";
  } else {
    text += ", the least of all shapes";
  }
  std::string simpler;
  for (std::size_t i = 0; i < choice.chosen; ++i) {
    const ProxyCandidate& candidate = choice.candidates[i];
    simpler += (simpler.empty() ? "" : ", ") + candidate.name + " " + angle_text(candidate.off_view_error);
  }
  return text + (simpler.empty() ? "." : "; simpler ones are worse: " + simpler + ".");
}

/// What the shapes are fitted to: an even selection of each view's rays, in folds of which each is predicted
/// from the others.
struct Selection {
  Problem rays;
  std::vector<std::size_t> fold;  ///< of each ray
  std::size_t folds = 0;
  std::vector<glm::vec3> hits;  ///< of the rays that meet something
};

// A fold is a view; a single view becomes two folds by alternating.
Selection select(const TracedRays& rays, glm::vec3 origin, const ProxyChoiceOptions& options) {
  std::map<int, std::vector<std::size_t>> rays_of_view;
  for (std::size_t i = 0; i < rays.views.size(); ++i) rays_of_view[rays.views[i]].push_back(i);
  Selection chosen;
  chosen.rays.origin = origin;
  chosen.folds = std::max<std::size_t>(rays_of_view.size(), 2);
  std::vector<double> hit_distances;
  std::size_t view_number = 0;
  for (const auto& [view, indices] : rays_of_view) {
    const std::size_t count = std::min(indices.size(), options.max_rays_per_view);
    for (std::size_t j = 0; j < count; ++j) {
      const std::size_t i = indices[j * indices.size() / count];
      const glm::dvec3 p(rays.positions[i]);
      const glm::dvec3 d(rays.directions[i]);
      glm::dvec3 target = glm::normalize(d);
      if (std::isfinite(rays.distances[i])) {
        const glm::dvec3 hit = p + static_cast<double>(rays.distances[i]) * target;
        const glm::dvec3 seen = hit - glm::dvec3(origin);
        const double distance = glm::length(seen);
        if (!(distance > 0)) continue;  // nothing can be said of a hit at the origin
        target = seen / distance;
        chosen.hits.emplace_back(hit);
        hit_distances.push_back(distance);
      }
      chosen.rays.positions.push_back(p);
      chosen.rays.directions.push_back(d);
      chosen.rays.targets.push_back(target);
      chosen.fold.push_back(rays_of_view.size() > 1 ? view_number : j % 2);
    }
    ++view_number;
  }
  if (!hit_distances.empty()) {
    const auto middle = hit_distances.begin() + static_cast<std::ptrdiff_t>(hit_distances.size() / 2);
    std::nth_element(hit_distances.begin(), middle, hit_distances.end());
    chosen.rays.scale = *middle;
  }
  return chosen;
}

constexpr int kMaxSteps = 60;

// A few steps from each start show which leads where; the best one is followed to the end. The cost is
// infinite if no start has the origin inside.
Fit best_fit(const Family& family, const Selection& selection) {
  constexpr int kFirstSteps = 10;
  const std::vector<Parameters> candidates =
      starts(family, selection.hits, selection.rays.origin, selection.rays.scale);
  std::vector<Fit> fits(candidates.size());
  parallel_for(candidates.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      fits[i] = fit_shape(family, selection.rays, candidates[i], kFirstSteps);
    }
  });
  Fit best;
  for (const Fit& fit : fits) {
    if (fit.cost < best.cost) best = fit;
  }
  return std::isfinite(best.cost) ? fit_shape(family, selection.rays, best.parameters, kMaxSteps) : best;
}

// Mean angle by which a fit to the other folds misses. Each starts from the fit to everything: what is left
// to predict is the shape, not which local minimum the search finds.
double off_view_error(const Family& family, const Selection& selection, const Parameters& start) {
  const Problem& all = selection.rays;
  std::vector<double> sums(selection.folds, 0.0);
  parallel_for(selection.folds, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t fold = begin; fold < end; ++fold) {
      Problem seen, unseen;
      seen.origin = unseen.origin = all.origin;
      seen.scale = unseen.scale = all.scale;
      for (std::size_t i = 0; i < selection.fold.size(); ++i) {
        (selection.fold[i] == fold ? unseen : seen).add(all, i);
      }
      if (unseen.positions.empty() || seen.positions.empty()) continue;
      const Fit fit = fit_shape(family, seen, start, kMaxSteps);
      sums[fold] = mean_angle(unseen, make_proxy(family, fit.parameters, all.origin, all.scale)) *
                   static_cast<double>(unseen.positions.size());
    }
  });
  double sum = 0;
  for (double fold_sum : sums) sum += fold_sum;
  return sum / static_cast<double>(all.positions.size());
}

}  // namespace

std::vector<std::string> proxy_families() {
  std::vector<std::string> names;
  for (const Family& family : kFamilies) names.emplace_back(family.name);
  return names;
}

ProxyChoice choose_proxy(const TracedRays& rays, glm::vec3 origin, const ProxyChoiceOptions& options) {
  check(rays, origin, options);
  const Selection selection = select(rays, origin, options);
  ProxyChoice choice;
  for (const Family& family : kFamilies) {
    if (family.shape != Shape::infinite && selection.hits.empty()) continue;
    const Fit best = best_fit(family, selection);
    if (!std::isfinite(best.cost)) continue;
    ProxyCandidate candidate;
    candidate.name = family.name;
    candidate.parameters = family.parameters;
    candidate.proxy = make_proxy(family, best.parameters, origin, selection.rays.scale);
    candidate.fit_error = mean_angle(selection.rays, candidate.proxy);
    candidate.off_view_error = off_view_error(family, selection, best.parameters);
    choice.candidates.push_back(std::move(candidate));
  }

  const auto least =
      std::min_element(choice.candidates.begin(), choice.candidates.end(),
                       [](const auto& a, const auto& b) { return a.off_view_error < b.off_view_error; });
  const double limit = std::max((1.0 + options.tolerance) * least->off_view_error, options.negligible_angle);
  const auto chosen =
      std::find_if(choice.candidates.begin(), choice.candidates.end(),
                   [&](const ProxyCandidate& candidate) { return candidate.off_view_error <= limit; });
  choice.chosen = static_cast<std::size_t>(chosen - choice.candidates.begin());
  choice.reason = explain(choice, static_cast<std::size_t>(least - choice.candidates.begin()), options);
  return choice;
}

}  // namespace mirrorbake
