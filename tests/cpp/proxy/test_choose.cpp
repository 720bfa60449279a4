#include "mirrorbake/proxy/choose.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "mirrorbake/core/error.hpp"

namespace mirrorbake {
namespace {

constexpr float kInfinite = std::numeric_limits<float>::infinity();

/// Distance along a ray to the surroundings: what a tracer would answer.
using Surroundings = std::function<double(const glm::dvec3& p, const glm::dvec3& d)>;

double to_proxy(const Proxy& shape, const glm::dvec3& p, const glm::dvec3& d) {
  return glm::length(lookup_direction(shape, p, d) + glm::dvec3(shape.origin) - p);
}

/// Distance to a ball, ∞ if missed.
double to_ball(const glm::dvec3& centre, double radius, const glm::dvec3& p, const glm::dvec3& d) {
  const glm::dvec3 q = p - centre;
  const double b = glm::dot(q, d);
  const double discriminant = b * b - glm::dot(q, q) + radius * radius;
  const double t = -b - std::sqrt(std::max(discriminant, 0.0));
  return discriminant > 0 && t > 0 ? t : std::numeric_limits<double>::infinity();
}

struct Rays {
  std::vector<glm::vec3> positions, directions;
  std::vector<float> distances;
  std::vector<int> views;
  TracedRays traced() const { return {positions, directions, distances, views}; }
};

/// Reflections off a ball of 0.1 m at the origin, seen from 1 m away at the given angles about the vertical,
/// 20° above.
Rays reflections(const Surroundings& surroundings, const std::vector<double>& degrees, int per_view,
                 std::uint32_t seed) {
  Rays rays;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  constexpr double kDegree = 0.017453292519943295;
  for (std::size_t view = 0; view < degrees.size(); ++view) {
    const double azimuth = degrees[view] * kDegree;
    const double height = 20 * kDegree;
    const glm::dvec3 eye(std::cos(height) * std::cos(azimuth), std::sin(height),
                         std::cos(height) * std::sin(azimuth));
    for (int i = 0; i < per_view;) {
      const glm::dvec3 n = glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
      const glm::dvec3 p = 0.1 * n;
      const glm::dvec3 v = glm::normalize(eye - p);
      if (!(glm::dot(n, v) > 0.05)) continue;
      const glm::dvec3 r = 2.0 * glm::dot(n, v) * n - v;
      rays.positions.emplace_back(p);
      rays.directions.emplace_back(r);
      rays.distances.push_back(static_cast<float>(surroundings(glm::dvec3(glm::vec3(p)), r)));
      rays.views.push_back(static_cast<int>(view));
      ++i;
    }
  }
  return rays;
}

struct Scene {
  const char* name;
  const char* expected;  ///< shape that an artist would take; null: no opinion
  Surroundings distance;
};

std::vector<Scene> varied_scenes() {
  const Proxy room{Box{{0.4F, 0.9F, -0.3F}, {2.5F, 1.2F, 3.0F}}, {0, 0, 0}};
  const Proxy elliptical{Ellipsoid{{0.2F, 0.5F, 0.1F}, {2.0F, 1.0F, 3.0F}}, {0, 0, 0}};
  const Proxy dome{Hemisphere{{0.3F, -0.4F, 0.0F}, 4.0F}, {0, 0, 0}};
  const Proxy distant{Ellipsoid{{30, -20, 0}, glm::vec3(500)}, {0, 0, 0}};
  const float c = std::cos(0.6F);
  const float s = std::sin(0.6F);
  const Proxy turned{Box{{0.3F, 0.8F, 0.2F}, {1.5F, 1.1F, 3.5F}, {{c, 0, s}, {0, 1, 0}, {-s, 0, c}}},
                     {0, 0, 0}};
  return {
      {"box room", "box", [=](auto p, auto d) { return to_proxy(room, p, d); }},
      {"elliptical room", "ellipsoid", [=](auto p, auto d) { return to_proxy(elliptical, p, d); }},
      {"distant panorama", "infinite", [=](auto p, auto d) { return to_proxy(distant, p, d); }},
      {"environment light", "infinite", [](auto, auto) { return std::numeric_limits<double>::infinity(); }},
      {"furnished room", "box",
       [=](auto p, auto d) {
         return std::min({to_proxy(room, p, d), to_ball({1.2, 0.1, 0.6}, 0.5, p, d),
                          to_ball({-0.9, 0.3, -1.5}, 0.7, p, d), to_ball({-0.5, 1.5, 1.0}, 0.3, p, d)});
       }},
      {"dome", "hemisphere", [=](auto p, auto d) { return to_proxy(dome, p, d); }},
      {"turned room", "rotated box", [=](auto p, auto d) { return to_proxy(turned, p, d); }},
      {"plain under a sky", nullptr,
       [](auto p, auto d) {
         const double t = (-0.3 - p.y) / d.y;
         return t > 0 ? t : std::numeric_limits<double>::infinity();
       }},
  };
}

/// Mean angle from the origin between lookups and true hits: the true error in views that no fit has seen.
double error_of(const Proxy& proxy, const Rays& rays) {
  double sum = 0;
  for (std::size_t i = 0; i < rays.positions.size(); ++i) {
    const glm::dvec3 p(rays.positions[i]);
    const glm::dvec3 d(rays.directions[i]);
    const glm::dvec3 truth =
        std::isfinite(rays.distances[i]) ? p + static_cast<double>(rays.distances[i]) * glm::normalize(d) : d;
    const glm::dvec3 lookup = lookup_direction(proxy, p, d);
    sum += std::atan2(glm::length(glm::cross(truth, lookup)), glm::dot(truth, lookup));
  }
  return sum / static_cast<double>(rays.positions.size());
}

TEST(ChooseProxy, TakesTheShapeOfTheSurroundingsAndIsNearTheBestInUnseenViews) {
  for (const Scene& scene : varied_scenes()) {
    const Rays seen = reflections(scene.distance, {0, 10, 20, 30}, 200, 1);
    const Rays unseen = reflections(scene.distance, {5, 15, 25, 36}, 2000, 2);
    const ProxyChoice choice = choose_proxy(seen.traced(), {0, 0, 0});
    std::string table;
    double least = std::numeric_limits<double>::infinity();
    for (const ProxyCandidate& candidate : choice.candidates) {
      const double error = error_of(candidate.proxy, unseen);
      least = std::min(least, error);
      char line[160];
      std::snprintf(line, sizeof line, "%s: fit %.5f, predicted %.5f, unseen views %.5f\n",
                    candidate.name.c_str(), candidate.fit_error, candidate.off_view_error, error);
      table += line;
    }
    SCOPED_TRACE(std::string(scene.name) + "\n" + table + choice.reason);
    if (scene.expected != nullptr) {
      EXPECT_EQ(choice.best().name, scene.expected);
    }
    EXPECT_LE(error_of(choice.best().proxy, unseen),
              std::max(1.1 * least, ProxyChoiceOptions{}.negligible_angle));
    EXPECT_THAT(choice.reason, testing::StartsWith(choice.best().name + ": "));
    EXPECT_NO_THROW(validate(choice.best().proxy));
  }
}

TEST(ChooseProxy, RecoversTheShapeItself) {
  for (const Scene& scene : varied_scenes()) {
    if (std::string(scene.name) != "elliptical room") continue;
    const Rays rays = reflections(scene.distance, {0, 90, 180, 270}, 800, 3);
    const ProxyChoice choice = choose_proxy(rays.traced(), {0, 0, 0});
    const Ellipsoid& e = std::get<Ellipsoid>(choice.best().proxy.shape);
    // Huber's threshold of 1e-3 rad on exact data leaves nothing but the convergence test.
    EXPECT_LT(glm::length(e.centre - glm::vec3(0.2F, 0.5F, 0.1F)), 2e-3F);
    EXPECT_LT(glm::length(e.radii - glm::vec3(2, 1, 3)), 5e-3F);
  }
}

TEST(ChooseProxy, GivesTheSameAnswerEveryTime) {
  const Scene scene = varied_scenes()[3];
  const Rays rays = reflections(scene.distance, {0, 20}, 300, 4);
  const ProxyChoice a = choose_proxy(rays.traced(), {0, 0, 0});
  const ProxyChoice b = choose_proxy(rays.traced(), {0, 0, 0});
  ASSERT_EQ(a.candidates.size(), b.candidates.size());
  for (std::size_t i = 0; i < a.candidates.size(); ++i) {
    EXPECT_EQ(a.candidates[i].off_view_error, b.candidates[i].off_view_error);
  }
  EXPECT_EQ(a.reason, b.reason);
}

TEST(ChooseProxy, CutsASingleViewInTwo) {
  const Scene scene = varied_scenes()[0];
  const Rays rays = reflections(scene.distance, {0}, 800, 5);
  const ProxyChoice choice = choose_proxy(rays.traced(), {0, 0, 0});
  EXPECT_EQ(choice.best().name, "box");
  EXPECT_GT(choice.best().off_view_error, 0);
}

TEST(ChooseProxy, TakesASimplerShapeWithinTheTolerance) {
  const Scene scene = varied_scenes()[0];
  const Rays rays = reflections(scene.distance, {0, 20}, 300, 6);
  ProxyChoiceOptions loose;
  loose.negligible_angle = 10;
  const ProxyChoice choice = choose_proxy(rays.traced(), {0, 0, 0}, loose);
  EXPECT_EQ(choice.best().name, "infinite");
  EXPECT_THAT(choice.reason, testing::HasSubstr("negligible"));
}

TEST(ChooseProxy, NamesBadInput) {
  Rays rays = reflections(varied_scenes()[0].distance, {0}, 20, 7);
  const auto message = [&](glm::vec3 origin = {0, 0, 0}) {
    try {
      choose_proxy(rays.traced(), origin);
    } catch (const InvalidArgument& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(message(), "accepted");
  EXPECT_THAT(message({kInfinite, 0, 0}), testing::HasSubstr("origin"));
  rays.distances[3] = 0;
  EXPECT_THAT(message(), testing::HasSubstr("distances[3]"));
  rays.distances[3] = kInfinite;
  rays.directions[2] = {0, 0, 0};
  EXPECT_THAT(message(), testing::HasSubstr("directions[2]"));
  rays.positions[1].x = kInfinite;
  EXPECT_THAT(message(), testing::HasSubstr("positions[1]"));
  rays.views.pop_back();
  EXPECT_THAT(message(), testing::HasSubstr("spans of one length"));
  rays = reflections(varied_scenes()[0].distance, {0}, 15, 7);
  EXPECT_THAT(message(), testing::HasSubstr("at least 16"));
}

}  // namespace
}  // namespace mirrorbake
