#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <variant>
#include <vector>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/isa.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/proxy/proxy.hpp"

namespace mirrorbake {
namespace {

using Long3 = glm::vec<3, long double>;

/// Rotation whose columns are orthonormal to float rounding, from a random quaternion.
glm::mat3 random_rotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  double w = normal(random), x = normal(random), y = normal(random), z = normal(random);
  const double length = std::sqrt(w * w + x * x + y * y + z * z);
  w /= length, x /= length, y /= length, z /= length;
  return glm::mat3(glm::dmat3(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y),  //
                              2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x),  //
                              2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)));
}

glm::vec3 random_direction(std::mt19937& random) {
  std::normal_distribution<float> normal;
  return {normal(random), normal(random), normal(random)};
}

/// What the tests need to know of a shape: how far a point is out, in units of the extents (< 1 inside).
struct Gauge {
  Long3 centre, extent;
  glm::mat<3, 3, long double> axes;
  enum { box, ellipsoid, hemisphere } kind;

  long double operator()(const Long3& point) const {
    const Long3 q = axes * (point - centre) / extent;
    switch (kind) {
      case box: return std::max({std::abs(q.x), std::abs(q.y), std::abs(q.z)});
      case ellipsoid: return std::sqrt(glm::dot(q, q));
      default: return std::max(std::sqrt(glm::dot(q, q)), 1 - q.y);
    }
  }
};

struct Case {
  Proxy proxy;
  Gauge gauge;
};

/// Shapes of all kinds, extents from 1e-4 to 1e6 m, aspect ratios up to 1e4, rotated or not, away from the
/// world's origin, with the map's origin away from the centre.
std::vector<Case> varied_shapes(std::mt19937& random) {
  std::vector<Case> cases;
  std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
  for (float size : {1e-4F, 1.0F, 7.3F, 1e6F}) {
    for (float aspect : {1.0F, 0.3F, 1e-4F}) {
      for (bool rotated : {false, true}) {
        for (int flat_axis = 0; flat_axis < 3; ++flat_axis) {
          glm::vec3 extent = size * glm::vec3(1.0F, 0.7F, 0.9F);
          extent[flat_axis] = size * aspect;
          const glm::mat3 axes = rotated ? random_rotation(random) : glm::mat3(1.0F);
          const glm::vec3 centre = size * glm::vec3(uniform(random), uniform(random), uniform(random));
          const glm::vec3 inside =
              0.5F * extent * glm::vec3(uniform(random), uniform(random), uniform(random));
          const glm::vec3 origin = centre + glm::transpose(axes) * inside;
          const glm::mat<3, 3, long double> long_axes(axes);
          cases.push_back({{Box{centre, extent, axes}, origin}, {centre, extent, long_axes, Gauge::box}});
          cases.push_back(
              {{Ellipsoid{centre, extent, axes}, origin}, {centre, extent, long_axes, Gauge::ellipsoid}});
        }
        const glm::mat3 axes = rotated ? random_rotation(random) : glm::mat3(1.0F);
        const glm::vec3 centre = size * glm::vec3(uniform(random), uniform(random), uniform(random));
        const glm::vec3 origin = centre + 0.4F * size * glm::vec3(axes[0][1], axes[1][1], axes[2][1]);
        cases.push_back({{Hemisphere{centre, size, axes}, origin},
                         {centre, Long3(size), glm::mat<3, 3, long double>(axes), Gauge::hemisphere}});
      }
    }
  }
  return cases;
}

/// The exit point by bisection with 80-bit numbers: all shapes are convex, so the gauge crosses 1 once ahead
/// of a point inside. Knows nothing of the formulas.
Long3 exit_point(const Gauge& gauge, const Long3& p, const Long3& d) {
  long double outside = 1e-3L * std::max({gauge.extent.x, gauge.extent.y, gauge.extent.z}) / glm::length(d);
  while (gauge(p + outside * d) < 1) outside *= 2;
  long double inside = 0;
  for (int i = 0; i < 90; ++i) {
    const long double middle = 0.5L * (inside + outside);
    (gauge(p + middle * d) < 1 ? inside : outside) = middle;
  }
  return p + inside * d;
}

long double angle(const Long3& a, const Long3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

/// A point at the given gauge value in a random direction from the centre of the hull; `axes` is a rotation.
glm::vec3 point_at(const Gauge& gauge, long double value, std::mt19937& random) {
  const Long3 local(random_direction(random));
  Long3 unit = local;
  Long3 base(0);
  switch (gauge.kind) {
    case Gauge::box: unit /= std::max({std::abs(local.x), std::abs(local.y), std::abs(local.z)}); break;
    case Gauge::ellipsoid: unit /= glm::length(local); break;
    default:  // the gauge of the half ball is not homogeneous: shrink it about a point inside
      base = Long3(0, 0.3L, 0);
      unit /= glm::length(local);
      long double low = 0;
      long double high = 2;
      const Gauge flat{Long3(0), Long3(1), glm::mat<3, 3, long double>(1), Gauge::hemisphere};
      for (int i = 0; i < 60; ++i) {
        const long double middle = 0.5L * (low + high);
        (flat(base + middle * unit) < 1 ? low : high) = middle;
      }
      unit *= low;
  }
  return glm::vec3(gauge.centre + glm::transpose(gauge.axes) * (gauge.extent * (base + value * unit)));
}

TEST(Lookup, InfiniteSphereReturnsTheDirection) {
  const Proxy proxy{InfiniteSphere{}, {1, 2, 3}};
  EXPECT_EQ(lookup_direction(proxy, glm::vec3(5, 6, 7), glm::vec3(0.1F, -2, 1e30F)),
            glm::vec3(0.1F, -2, 1e30F));
}

TEST(Lookup, MeetsWallsAndSpheresWhereTheyAre) {
  const Proxy box{Box{{1, 1, 0}, {2, 1, 3}}, {1, 0.5F, 0}};
  EXPECT_EQ(lookup_direction(box, glm::vec3(0, 1, 0), glm::vec3(1, 0, 0)), glm::vec3(2, 0.5F, 0));
  EXPECT_EQ(lookup_direction(box, glm::vec3(0, 1, 0), glm::vec3(0, -4, 0)), glm::vec3(-1, -0.5F, 0));
  EXPECT_EQ(lookup_direction(box, glm::vec3(0, 1, 0), glm::vec3(1, 1, 0)), glm::vec3(0, 1.5F, 0));
  const Proxy ellipsoid{Ellipsoid{{0, 0, 0}, {3, 2, 1}}, {0, 0, 0}};
  EXPECT_EQ(lookup_direction(ellipsoid, glm::vec3(0), glm::vec3(0, -1, 0)), glm::vec3(0, -2, 0));
  EXPECT_EQ(lookup_direction(ellipsoid, glm::vec3(1, 0, 0), glm::vec3(-5, 0, 0)), glm::vec3(-3, 0, 0));
  const Proxy dome{Hemisphere{{0, 0, 0}, 2}, {0, 1, 0}};
  EXPECT_EQ(lookup_direction(dome, glm::vec3(0, 0.5F, 0), glm::vec3(0, 1, 0)), glm::vec3(0, 1, 0));
  EXPECT_EQ(lookup_direction(dome, glm::vec3(0, 0.5F, 0), glm::vec3(1, -1, 0)), glm::vec3(0.5F, -1, 0));
}

// Spec G2 asks for 1e-5 rad wherever the point is inside by 1e-4 of the extent. The answer is computed in
// double and rounded to float: half an ulp per component, 1e-7 rad; the bound leaves a factor of two. It
// holds up to the wall.
TEST(Lookup, IsExactToFloatRoundingInsideAllShapesAtAllScales) {
  std::mt19937 random(1);
  long double worst = 0;
  int count = 0;
  for (const Case& c : varied_shapes(random)) {
    for (long double value : {0.0L, 0.5L, 0.9L, 1 - 1e-4L, 1 - 1e-6L}) {
      for (int i = 0; i < 60; ++i) {
        const glm::vec3 p = point_at(c.gauge, value, random);
        if (!(c.gauge(p) < 1 - 1e-7L)) continue;  // rounding to float took the point out
        glm::vec3 d = random_direction(random);
        if (i % 4 == 1) d[i % 3] *= 1e-6F;  // nearly parallel to a wall
        if (i % 4 == 2) d[i % 3] = 0.0F;    // parallel
        const Long3 expected = exit_point(c.gauge, p, d) - Long3(c.proxy.origin);
        const glm::vec3 lookup = lookup_direction(c.proxy, p, d);
        const long double error = angle(Long3(lookup), expected);
        worst = std::max(worst, error);
        ++count;
        ASSERT_LT(error, 2e-7L) << "gauge " << c.gauge(p) << ", kind " << c.gauge.kind;
      }
    }
  }
  EXPECT_GT(count, 40000);
  RecordProperty("worst_radians", std::to_string(static_cast<double>(worst)));
}

TEST(Lookup, DoesNotDependOnTheLengthOfTheDirection) {
  std::mt19937 random(2);
  for (const Case& c : varied_shapes(random)) {
    const glm::vec3 p = point_at(c.gauge, 0.7L, random);
    const glm::vec3 d = glm::normalize(random_direction(random));
    const Long3 expected(lookup_direction(c.proxy, p, d));
    for (float length : {0x1p-100F, 0x1p-20F, 0x1p20F, 0x1p100F}) {
      EXPECT_LT(angle(Long3(lookup_direction(c.proxy, p, length * d)), expected), 2e-7L);
    }
    for (double length : {1e-100, 1e100}) {
      const glm::dvec3 wide = length * glm::dvec3(d);
      EXPECT_LT(angle(Long3(lookup_direction(c.proxy, glm::dvec3(p), wide)), expected), 2e-7L);
    }
  }
}

// From outside, a ray that passes through the proxy leaves it where the same ray, started inside, does.
TEST(Lookup, IsExactForRaysThatPassThroughFromOutside) {
  std::mt19937 random(3);
  for (const Case& c : varied_shapes(random)) {
    for (int i = 0; i < 20; ++i) {
      const glm::dvec3 inside(point_at(c.gauge, 0.5L, random));
      const glm::dvec3 d = glm::normalize(glm::dvec3(random_direction(random)));
      const double size =
          static_cast<double>(std::max({c.gauge.extent.x, c.gauge.extent.y, c.gauge.extent.z}));
      const glm::dvec3 outside = inside - 5.0 * size * d;
      const Long3 expected = exit_point(c.gauge, inside, d) - Long3(c.proxy.origin);
      // Stepping back costs an ulp of 5·size, to which the flat shapes are sensitive: 1e4 · 1e4 · 1e-15.
      EXPECT_LT(angle(Long3(lookup_direction(c.proxy, outside, d)), expected), 1e-6L);
    }
  }
}

// Bisects a path towards its largest change: where the answer is continuous the change vanishes with the
// interval, at a jump it stays. Paths lead from inside to outside and keep the direction or turn it. An
// interval of 2⁻⁴⁸ of the path leaves 2⁻²⁴ at the square-root kinks of curved shapes (where rays start to
// miss), and room for the slopes of shapes of aspect 1e4.
TEST(Lookup, ChangesContinuouslyAlongRandomPathsAcrossTheWall) {
  std::mt19937 random(4);
  int crossings = 0;
  for (const Case& c : varied_shapes(random)) {
    for (int path = 0; path < 40; ++path) {
      const glm::dvec3 start(point_at(c.gauge, 0.6L, random));
      const glm::dvec3 end(point_at(c.gauge, 1.6L, random));
      const glm::dvec3 d0(glm::normalize(random_direction(random)));
      const glm::dvec3 d1 =
          path % 2 == 0 ? d0 : glm::normalize(d0 + 0.4 * glm::dvec3(random_direction(random)));
      if (c.gauge(start) < 1 && c.gauge(end) > 1) ++crossings;
      const auto lookup_at = [&](double s) {
        return Long3(lookup_direction(c.proxy, start + s * (end - start), d0 + s * (d1 - d0)));
      };
      constexpr int kSteps = 256;
      double low = 0;
      long double largest = 0;
      for (int i = 0; i < kSteps; ++i) {
        const double s = static_cast<double>(i) / kSteps;
        const long double change = angle(lookup_at(s), lookup_at(s + 1.0 / kSteps));
        if (change > largest) {
          largest = change;
          low = s;
        }
      }
      double width = 1.0 / kSteps;
      for (int i = 0; i < 40; ++i) {
        width *= 0.5;
        const long double left = angle(lookup_at(low), lookup_at(low + width));
        const long double right = angle(lookup_at(low + width), lookup_at(low + 2 * width));
        if (right > left) low += width;
        largest = std::max(left, right);
      }
      EXPECT_LT(largest, 1e-3L) << "kind " << c.gauge.kind << ", path " << path << ", at " << low;
    }
  }
  EXPECT_GT(crossings, 1000);
}

TEST(Lookup, IsNeverNotANumber) {
  const float tiny = std::numeric_limits<float>::denorm_min();
  const float values[] = {0.0F, -0.0F, 1.0F, -1.0F, 0.99999994F, 1e30F, -1e30F, 1e-30F, tiny};
  for (const Proxy& proxy : {Proxy{Box{}, {}}, Proxy{Ellipsoid{}, {}}, Proxy{Hemisphere{}, {0, 0.5F, 0}},
                             Proxy{InfiniteSphere{}, {}}, Proxy{Box{{0, 0, 0}, {1e-30F, 1, 1e30F}}, {}},
                             Proxy{Ellipsoid{{0, 0, 0}, {1e-30F, 1, 1e30F}}, {}}}) {
    for (float px : values) {
      for (float py : values) {
        for (float dx : values) {
          for (float dy : values) {
            for (float dz : values) {
              const glm::vec3 lookup =
                  lookup_direction(proxy, glm::vec3(px, py, 1.0F), glm::vec3(dx, dy, dz));
              ASSERT_FALSE(std::isnan(lookup.x) || std::isnan(lookup.y) || std::isnan(lookup.z))
                  << px << ' ' << py << " along " << dx << ' ' << dy << ' ' << dz;
            }
          }
        }
      }
    }
  }
}

TEST(Lookup, BatchGivesTheSameBitsAsOneAtATimeOnEveryInstructionSet) {
  for (const Isa isa : {Isa::baseline, Isa::sse42, Isa::avx2, Isa::avx512}) {
    const IsaLimit limit(isa);
    std::mt19937 random(5);
    for (const Case& c : varied_shapes(random)) {
      for (std::size_t count : {0U, 1U, 7U, 128U, 300U}) {
        std::vector<glm::vec3> positions(count), directions(count), lookups(count);
        for (std::size_t i = 0; i < count; ++i) {
          positions[i] = point_at(c.gauge, i % 3 == 0 ? 1.3L : 0.8L, random);
          directions[i] = random_direction(random);
          if (i % 5 == 0) directions[i].y = 0;
        }
        lookup_directions(c.proxy, positions, directions, lookups);
        for (std::size_t i = 0; i < count; ++i) {
          ASSERT_EQ(lookups[i], lookup_direction(c.proxy, positions[i], directions[i]))
              << to_string(isa) << ' ' << i;
        }
      }
    }
  }
}

TEST(Lookup, BatchGivesTheSameBitsInFloat64AndInPlaceAndOnTwoThreads) {
  std::mt19937 random(6);
  const Case c = varied_shapes(random)[20];
  constexpr std::size_t kCount = 40000;
  std::vector<glm::dvec3> positions(kCount), directions(kCount), lookups(kCount);
  for (std::size_t i = 0; i < kCount; ++i) {
    positions[i] = glm::dvec3(point_at(c.gauge, 0.8L, random));
    directions[i] = glm::dvec3(random_direction(random));
  }
  {
    const ThreadLimit two(2);
    lookup_directions(c.proxy, positions, directions, lookups);
  }
  const ThreadLimit one(1);
  std::vector<glm::dvec3> in_place = directions;
  lookup_directions(c.proxy, positions, in_place, in_place);
  for (std::size_t i = 0; i < kCount; ++i) {
    ASSERT_EQ(lookups[i], lookup_direction(c.proxy, positions[i], directions[i]));
    ASSERT_EQ(in_place[i], lookups[i]);
  }
}

// r = 2(n·v)n − v for unit n (spec §0), here in long double; normals of any length have to give the same.
TEST(Lookup, MirrorsFollowTheReflectionOfTheEyesRay) {
  std::mt19937 random(7);
  const glm::vec3 eye(3, 4, -5);
  for (const Case& c : varied_shapes(random)) {
    std::vector<glm::vec3> positions(50), normals(50), lookups(50);
    for (std::size_t i = 0; i < positions.size(); ++i) {
      positions[i] = point_at(c.gauge, 0.8L, random);
      normals[i] = random_direction(random);
    }
    mirror_lookups(std::span(&c.proxy, 1), eye, positions, normals, lookups);
    for (std::size_t i = 0; i < positions.size(); ++i) {
      const Long3 n = glm::normalize(Long3(normals[i]));
      const Long3 v = glm::normalize(Long3(eye) - Long3(positions[i]));
      const Long3 r = 2 * glm::dot(n, v) * n - v;
      const Long3 expected = exit_point(c.gauge, positions[i], r) - Long3(c.proxy.origin);
      // The reflection in double costs 1e-16, times the aspect ratio of flat shapes; then rounding to float.
      EXPECT_LT(angle(Long3(lookups[i]), expected), 2e-7L);
    }
  }
}

TEST(Lookup, BatchRejectsSpansOfDifferentLength) {
  std::vector<glm::vec3> two(2), three(3);
  EXPECT_THROW(lookup_directions(Proxy{Box{}, {}}, two, three, three), InvalidArgument);
  EXPECT_THROW(lookup_directions(Proxy{Box{}, {}}, three, three, two), InvalidArgument);
}

std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const InvalidArgument& error) {
    return error.what();
  }
  return "no error";
}

TEST(Lookup, BatchNamesTheFirstRowThatIsNotFiniteInAnyArrayAndPrecision) {
  const Proxy box{Box{}, {}};
  const float inf = std::numeric_limits<float>::infinity();
  const glm::vec3 largest(std::numeric_limits<float>::max(), -std::numeric_limits<float>::max(), 1);
  for (const Isa isa : {Isa::baseline, Isa::sse42, Isa::avx2, Isa::avx512}) {
    const IsaLimit limit(isa);
    for (std::size_t count : {1U, 11U, 128U, 40000U}) {
      std::vector<glm::vec3> finite(count, largest), lookups(count);
      EXPECT_NO_THROW(lookup_directions(box, finite, finite, lookups));
      for (std::size_t row : {std::size_t{0}, count / 2, count - 1}) {
        for (float bad : {inf, -inf, std::numeric_limits<float>::quiet_NaN()}) {
          std::vector<glm::vec3> broken = finite;
          broken[row][static_cast<int>(row % 3)] = bad;
          broken[count - 1].y = bad;
          const std::vector<glm::dvec3> wide(broken.begin(), broken.end());
          const std::vector<glm::dvec3> wide_finite(finite.begin(), finite.end());
          std::vector<glm::dvec3> wide_lookups(count);
          const auto in_row = testing::HasSubstr(" in row " + std::to_string(row) + ",");
          using testing::AllOf;
          using testing::StartsWith;
          EXPECT_THAT(message_of([&] { lookup_directions(box, broken, finite, lookups); }),
                      AllOf(StartsWith("positions"), in_row));
          EXPECT_THAT(message_of([&] { lookup_directions(box, wide_finite, wide, wide_lookups); }),
                      AllOf(StartsWith("directions"), in_row));
          EXPECT_THAT(message_of([&] {
                        mirror_lookups(std::span(&box, 1), {0, 0, 0}, finite, broken, broken);
                      }),
                      AllOf(StartsWith("normals"), in_row));
        }
      }
    }
  }
  EXPECT_THAT(message_of([&] {
                mirror_lookups(std::span(&box, 1), {inf, 0, 0}, {}, {}, {});
              }),
              testing::StartsWith("eye"));
}

TEST(Lookup, BatchTakesFiniteValuesWhoseSumIsNot) {
  const std::vector<glm::vec3> directions(300, glm::vec3(3e38F, 3e38F, 1.0F));
  const std::vector<glm::vec3> positions(directions.size(), glm::vec3(0.0F));
  std::vector<glm::vec3> lookups(directions.size(), glm::vec3(-1.0F));
  lookup_directions(Proxy{}, positions, directions, lookups);
  EXPECT_EQ(lookups, directions);
}

TEST(Lookup, MirrorsRejectSpansOfDifferentLengthAndNoProxies) {
  const std::vector<Proxy> proxies(2, Proxy{Box{}, {}});
  const std::span one(proxies.data(), 1);
  std::vector<glm::vec3> two(2), three(3);
  const auto message = [&](std::span<const Proxy> in, const auto& positions, const auto& normals,
                           auto& lookups) {
    return message_of([&] { mirror_lookups(in, {0, 0, 0}, positions, normals, lookups); });
  };
  EXPECT_THAT(message(one, two, three, three), testing::StartsWith("normals"));
  EXPECT_THAT(message(one, two, two, three), testing::StartsWith("lookups"));
  EXPECT_THAT(message(proxies, two, two, two), testing::StartsWith("lookups"));
  EXPECT_THAT(message({}, two, two, two), testing::StartsWith("proxies"));
}

// The blocks that several proxies share must not change a bit, nor mix up layers, at any length.
TEST(Lookup, MirrorsInSeveralProxiesAreThoseInEach) {
  std::mt19937 random(8);
  std::vector<Case> cases = varied_shapes(random);
  std::vector<Proxy> proxies;
  for (const Case& c : cases) proxies.push_back(c.proxy);
  const glm::vec3 eye(3, 4, -5);
  for (const Isa isa : {Isa::baseline, Isa::sse42, Isa::avx2, Isa::avx512}) {
    const IsaLimit limit(isa);
    for (const std::size_t count : {1U, 127U, 128U, 20000U}) {
      std::vector<glm::vec3> positions(count), normals(count), alone(count);
      for (std::size_t i = 0; i < count; ++i) {
        positions[i] = point_at(cases[0].gauge, 0.8L, random);
        normals[i] = random_direction(random);
      }
      std::vector<glm::vec3> lookups(proxies.size() * count);
      mirror_lookups(proxies, eye, positions, normals, lookups);
      for (std::size_t j = 0; j < proxies.size(); ++j) {
        mirror_lookups(std::span(&proxies[j], 1), eye, positions, normals, alone);
        ASSERT_TRUE(
            std::equal(alone.begin(), alone.end(), lookups.begin() + static_cast<std::ptrdiff_t>(j * count)));
      }
    }
  }
}

TEST(ProxyShapes, ComeBackFromTheirNamesAndNumbers) {
  std::mt19937 random(7);
  const glm::mat3 axes = random_rotation(random);
  const Proxy shapes[] = {{InfiniteSphere{}, glm::vec3(0)},
                          {Box{{1, 2, 3}, {0.5F, 4, 6}, axes}, {1, 2, 3}},
                          {Ellipsoid{{1, 2, 3}, {0.5F, 4, 6}, axes}, {1, 2, 3}},
                          {Hemisphere{{1, 2, 3}, 2, axes}, glm::vec3(1, 2, 3) + glm::transpose(axes)[1]}};
  ASSERT_EQ(std::size(shapes), std::variant_size_v<decltype(Proxy::shape)>);
  const glm::vec3 position(1.1F, 2.1F, 3.1F);
  const glm::vec3 direction(0.3F, 1, -0.2F);
  for (const Proxy& shape : shapes) {
    const std::optional<Proxy> again =
        proxy_from_numbers(shape_name(shape), {1, 2, 3}, extents_of(shape), axes);
    ASSERT_TRUE(again) << shape_name(shape);
    EXPECT_NO_THROW(validate(*again));
    EXPECT_EQ(again->shape.index(), shape.shape.index());
    EXPECT_EQ(again->origin, shape.origin) << shape_name(shape);
    EXPECT_EQ(lookup_direction(*again, position, direction), lookup_direction(shape, position, direction));
    std::vector<float> more = extents_of(shape);
    more.push_back(1.0F);
    EXPECT_FALSE(proxy_from_numbers(shape_name(shape), {1, 2, 3}, more)) << shape_name(shape);
  }
  EXPECT_FALSE(proxy_from_numbers("cone", {}, {}));
}

TEST(ProxyValidation, NamesTheFieldThatIsUnusable) {
  const auto message = [](const Proxy& proxy) {
    try {
      validate(proxy);
    } catch (const InvalidArgument& error) {
      return std::string(error.what());
    }
    return std::string("valid");
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(message({Box{}, {}}), "valid");
  EXPECT_EQ(message({Hemisphere{}, {0, 0.1F, 0}}), "valid");
  EXPECT_EQ(message({InfiniteSphere{}, {5, 5, 5}}), "valid");
  EXPECT_THAT(message({InfiniteSphere{}, {nan, 0, 0}}), testing::HasSubstr("proxy origin"));
  EXPECT_THAT(message({Box{{}, {1, 0, 1}}, {}}), testing::HasSubstr("box half_extent is (1, 0, 1)"));
  EXPECT_THAT(message({Box{{nan, 0, 0}, {1, 1, 1}}, {}}), testing::HasSubstr("box centre"));
  EXPECT_THAT(message({Ellipsoid{{}, {1, nan, 1}}, {}}), testing::HasSubstr("ellipsoid radii"));
  EXPECT_THAT(message({Ellipsoid{{}, {1, 1, 1}, glm::mat3(1.01F)}, {}}), testing::HasSubstr("orthonormal"));
  EXPECT_THAT(message({Hemisphere{{}, -1}, {}}), testing::HasSubstr("hemisphere radius"));
  EXPECT_THAT(message({Box{{}, {1, 1, 1}}, {0, 1, 0}}), testing::HasSubstr("proxy origin is (0, 1, 0)"));
  EXPECT_THAT(message({Ellipsoid{{}, {1, 1, 1}}, {0.8F, 0.8F, 0}}), testing::HasSubstr("inside"));
  EXPECT_THAT(message({Hemisphere{}, {0, 0, 0}}), testing::HasSubstr("inside"));
}

}  // namespace
}  // namespace mirrorbake
