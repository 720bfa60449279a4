#include "mirrorbake/envmap/sampling.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/text.hpp"
#include "mirrorbake/envmap/texel_lookup.hpp"
#include "resample/line_lookup.hpp"

namespace mirrorbake {
namespace {

constexpr double kMostBias = 64.0;

// Change of the position in texels of the finest level that a change of the direction causes.
struct TexelDifferentials {
  glm::dvec2 dx, dy;
};

TexelDifferentials texel_differentials(const EnvMapLayout& layout, const MapPoint& point,
                                       glm::dvec3 direction, glm::dvec3 ddx, glm::dvec3 ddy) {
  const MapJacobian j = map_jacobian(layout.projection, point.face, point.x, point.y);
  // Least squares J (x, y) = d: the metric of the map, bounded away from zero at a pole, where x has no
  // effect.
  const double smallest = 1e-9;
  const double a = std::max(glm::dot(j.dx, j.dx), smallest);
  const double b = glm::dot(j.dx, j.dy);
  const double c = std::max(glm::dot(j.dy, j.dy), smallest);
  const double determinant = std::max(a * c - b * b, smallest * smallest);
  const double length = glm::length(direction);
  const auto solve = [&](glm::dvec3 dd) {
    const double u = glm::dot(j.dx, dd) / length;
    const double v = glm::dot(j.dy, dd) / length;
    glm::dvec2 texels((c * u - b * v) / determinant * 0.5 * layout.width,
                      (b * u - a * v) / determinant * 0.5 * layout.height);
    const double longest = 2.0 * (layout.width + layout.height);
    const double size = glm::length(texels);
    if (!(size <= longest))
      texels = std::isfinite(size) ? texels * (longest / size) : glm::dvec2(longest, 0.0);
    return texels;
  };
  return {solve(ddx), solve(ddy)};
}

// A Gaussian of the squared radius that has fallen to e⁻² at the rim of the ellipse, r² = 1, and is cut
// there, from a table: within 8e-6, as Heckbert 1989 has it.
double ellipse_weight(double r2) {
  constexpr double kFalloff = 2.0;
  constexpr std::size_t kSteps = 256;
  static const std::array<double, kSteps + 2> table = [] {
    std::array<double, kSteps + 2> values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = std::exp(-kFalloff * static_cast<double>(i) / kSteps) - std::exp(-kFalloff);
    }
    return values;
  }();
  const double place = r2 * kSteps;
  const auto i = static_cast<std::size_t>(place);
  const double fraction = place - static_cast<double>(i);
  return (1.0 - fraction) * table[i] + fraction * table[i + 1];
}

struct Sampler {
  const EnvMapView& map;
  const SampleOptions& options;
  std::vector<double> value;
  std::vector<double> part;

  Sampler(const EnvMapView& map_, const SampleOptions& options_)
      : map(map_),
        options(options_),
        value(static_cast<std::size_t>(map_.layout.channels)),
        part(static_cast<std::size_t>(map_.layout.channels)) {}

  glm::dvec2 position(const MapPoint& point, int level) const {
    return {0.5 * (point.x + 1.0) * map.layout.level_width(level),
            0.5 * (1.0 - point.y) * map.layout.level_height(level)};
  }

  void nearest(const MapPoint& point) {
    const EnvMapLayout& layout = map.layout;
    const float* texel = map.values.data() + layout.index(0, point.face, texel_index(-point.y, layout.height),
                                                          texel_index(point.x, layout.width));
    for (std::size_t c = 0; c < value.size(); ++c) value[c] = static_cast<double>(texel[c]);
  }

  void bilinear(const MapPoint& point, int level, std::vector<double>& result) const {
    const glm::dvec2 p = position(point, level);
    interpolate(map, level, point.face, p.x, p.y, result);
  }

  template <typename Lookup>
  void between_levels(double lod, Lookup&& lookup) {
    const auto [level, fraction] = level_pair(lod, map.layout.levels);
    lookup(level, value);
    if (fraction == 0.0) return;
    lookup(level + 1, part);
    for (std::size_t c = 0; c < value.size(); ++c)
      value[c] = (1.0 - fraction) * value[c] + fraction * part[c];
  }

  void at_level(const MapPoint& point, double lod) {
    between_levels(lod, [&](int level, std::vector<double>& result) { bilinear(point, level, result); });
  }

  void trilinear(const MapPoint& point, const TexelDifferentials& d) {
    const double longest = std::sqrt(std::max(glm::dot(d.dx, d.dx), glm::dot(d.dy, d.dy)));
    at_level(point, longest > 1.0 ? std::log2(longest) : 0.0);
  }

  void ewa(const MapPoint& point, TexelDifferentials d) {
    // Semi-axes of the ellipse that the two differentials span, by the singular values of their matrix.
    const double sum = glm::dot(d.dx, d.dx) + glm::dot(d.dy, d.dy);
    const double cross = d.dx.x * d.dy.y - d.dx.y * d.dy.x;
    const double root = std::sqrt(std::max(0.0, 0.25 * sum * sum - cross * cross));
    const double major = std::sqrt(0.5 * sum + root);
    double minor = major > 0.0 ? std::abs(cross) / major : 0.0;
    double widen = 0.0;
    if (minor * options.max_anisotropy < major) {
      const double wanted = major / options.max_anisotropy;
      widen = wanted * wanted - minor * minor;
      minor = wanted;
    }
    const double lod = minor > 1.0 ? std::log2(minor) : 0.0;
    if (lod >= map.layout.levels - 1) {
      at_level(point, lod);
      return;
    }
    between_levels(lod, [&](int level, std::vector<double>& result) {
      const double scale = 1.0 / static_cast<double>(1 << level);
      average_ellipse(point, level, {d.dx * scale, d.dy * scale}, widen * scale * scale, result);
    });
  }

  // The 1 that is added to the squares is the filter of the texels themselves, so that an ellipse smaller
  // than a texel still interpolates; `widen` bounds the anisotropy.
  void average_ellipse(const MapPoint& point, int level, const TexelDifferentials& d, double widen,
                       std::vector<double>& result) const {
    const double xx = d.dx.x * d.dx.x + d.dy.x * d.dy.x + 1.0 + widen;
    const double yy = d.dx.y * d.dx.y + d.dy.y * d.dy.y + 1.0 + widen;
    const double xy = d.dx.x * d.dx.y + d.dy.x * d.dy.y;
    const double determinant = xx * yy - xy * xy;
    const glm::dvec2 center = position(point, level) - 0.5;
    const double radius_x = std::sqrt(xx);
    const double radius_y = std::sqrt(yy);
    const double per_determinant = 1.0 / determinant;
    const int width = map.layout.level_width(level);
    const int height = map.layout.level_height(level);
    const int top = static_cast<int>(std::ceil(center.y - radius_y));
    const int left = static_cast<int>(std::ceil(center.x - radius_x));
    const bool on_face = top >= 0 && left >= 0 && center.y + radius_y < height && center.x + radius_x < width;
    const std::size_t face = map.layout.index(level, point.face, 0, 0);
    double weight = 0.0;
    std::fill(result.begin(), result.end(), 0.0);
    for (int row = top; row <= center.y + radius_y; ++row) {
      const double y = row - center.y;
      for (int column = left; column <= center.x + radius_x; ++column) {
        const double x = column - center.x;
        const double r2 = (yy * x * x - 2.0 * xy * x * y + xx * y * y) * per_determinant;
        if (r2 >= 1.0) continue;
        const double w = ellipse_weight(r2);
        const std::size_t texel =
            on_face ? face + (static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                              static_cast<std::size_t>(column)) *
                                 result.size()
                    : texel_at(map.layout, level, point.face, row, column);
        weight += w;
        for (std::size_t c = 0; c < result.size(); ++c) {
          result[c] += w * static_cast<double>(map.values[texel + c]);
        }
      }
    }
    if (weight > 0.0) {
      for (double& v : result) v /= weight;
    } else {
      bilinear(point, level, result);
    }
  }
};

// Bilinear lookups in the finest level, whose positions come from a vectorised loop. Returns the number of
// directions that are not finite or zero.
std::size_t sample_bilinear(const EnvMapView& map, PositionLoop positions,
                            std::span<const glm::vec3> directions, std::span<float> values) {
  const EnvMapLayout& layout = map.layout;
  const std::size_t count = directions.size();
  const std::size_t channels = static_cast<std::size_t>(layout.channels);
  std::vector<double> components(3 * count);
  double* dx = components.data();
  double* dy = dx + count;
  double* dz = dy + count;
  std::vector<std::uint8_t> usable(count);
  std::size_t unusable = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const glm::dvec3 d(directions[i]);
    const double size = std::abs(d.x) + std::abs(d.y) + std::abs(d.z);
    usable[i] = size > 0.0 && std::isfinite(size) ? 1 : 0;
    unusable += usable[i] ? 0 : 1;
    dx[i] = usable[i] ? d.x : 0.0;
    dy[i] = usable[i] ? d.y : 0.0;
    dz[i] = usable[i] ? d.z : 1.0;
  }
  std::vector<double> x(count);
  std::vector<double> y(count);
  std::vector<std::int32_t> face(count);
  positions(dx, dy, dz, count, layout.width, layout.height, {x.data(), y.data(), face.data()});

  const std::size_t line = static_cast<std::size_t>(layout.width) * channels;
  const std::size_t face_values = line * static_cast<std::size_t>(layout.height);
  std::vector<double> value(channels);
  for (std::size_t i = 0; i < count; ++i) {
    float* result = values.data() + i * channels;
    if (!usable[i]) {
      std::fill_n(result, channels, 0.0F);
      continue;
    }
    const BilinearCell<double> cell = bilinear_cell(x[i], y[i]);
    if (!cell.inside(layout.width, layout.height)) {
      interpolate(map, 0, face[i], x[i], y[i], value);
      for (std::size_t c = 0; c < channels; ++c) result[c] = static_cast<float>(value[c]);
      continue;
    }
    const float* a = map.values.data() + static_cast<std::size_t>(face[i]) * face_values +
                     static_cast<std::size_t>(cell.row) * line +
                     static_cast<std::size_t>(cell.column) * channels;
    const float* b = a + line;
    for (std::size_t c = 0; c < channels; ++c) {
      result[c] =
          static_cast<float>(cell.mix(static_cast<double>(a[c]), static_cast<double>(a[c + channels]),
                                      static_cast<double>(b[c]), static_cast<double>(b[c + channels])));
    }
  }
  return unusable;
}

bool takes_differentials(SampleFilter filter) {
  return filter == SampleFilter::trilinear || filter == SampleFilter::ewa;
}

void check(const SampleOptions& options, std::size_t directions) {
  if (!(options.max_anisotropy >= 1.0)) {
    throw InvalidArgument("max_anisotropy", text_of(options.max_anisotropy), "at least 1");
  }
  if (!(std::abs(options.bias) <= kMostBias)) {
    throw InvalidArgument("bias", text_of(options.bias), "-64 to 64");
  }
  if (options.bias != 0.0 && !takes_differentials(options.filter)) {
    throw InvalidArgument("bias", text_of(options.bias), "0, or the filter trilinear or ewa");
  }
  if (options.level.empty()) return;
  if (options.filter != SampleFilter::trilinear) {
    throw InvalidArgument("level", "given", "none, or the filter trilinear");
  }
  if (options.level.size() != 1 && options.level.size() != directions) {
    throw InvalidArgument("level", std::to_string(options.level.size()) + " numbers",
                          "1, or one for each of " + std::to_string(directions) + " directions");
  }
  for (const float level : options.level) {
    if (std::isnan(level)) throw InvalidArgument("level", text_of(level), "a number");
  }
}

}  // namespace

std::size_t sample(const EnvMapView& map, std::span<const glm::vec3> directions,
                   std::span<const glm::vec3> ddx, std::span<const glm::vec3> ddy,
                   const SampleOptions& options, std::span<float> values) {
  validate(map);
  const std::size_t channels = static_cast<std::size_t>(map.layout.channels);
  if (values.size() != directions.size() * channels) {
    throw InvalidArgument("values", std::to_string(values.size()) + " numbers",
                          std::to_string(directions.size() * channels));
  }
  check(options, directions.size());
  const bool needs_differentials = takes_differentials(options.filter) && options.level.empty();
  if (needs_differentials && (ddx.size() != directions.size() || ddy.size() != directions.size())) {
    throw InvalidArgument("ddx, ddy", "of another length",
                          std::to_string(directions.size()) + " differentials each");
  }
  const double growth = std::exp2(options.bias);
  std::atomic<std::size_t> unusable{0};
  const PositionLoop positions =
      options.filter == SampleFilter::bilinear ? position_loop(map.layout.projection.kind) : nullptr;
  parallel_for(directions.size(), 1024, [&](std::size_t begin, std::size_t end) {
    if (positions != nullptr) {
      unusable += sample_bilinear(map, positions, directions.subspan(begin, end - begin),
                                  values.subspan(begin * channels, (end - begin) * channels));
      return;
    }
    Sampler sampler(map, options);
    for (std::size_t i = begin; i < end; ++i) {
      const glm::dvec3 d(directions[i]);
      const MapPoint point = point_from_direction(map.layout.projection, d);
      const std::span<float> result = values.subspan(i * channels, channels);
      if (!point.covered) {
        const double length = glm::length(d);
        if (!(length > 0.0) || !std::isfinite(length)) ++unusable;
        std::fill(result.begin(), result.end(), 0.0F);
        continue;
      }
      TexelDifferentials differentials{};
      if (needs_differentials) {
        differentials = texel_differentials(map.layout, point, d, growth * glm::dvec3(ddx[i]),
                                            growth * glm::dvec3(ddy[i]));
      }
      switch (options.filter) {
        case SampleFilter::nearest: sampler.nearest(point); break;
        case SampleFilter::bilinear: sampler.bilinear(point, 0, sampler.value); break;
        case SampleFilter::trilinear:
          if (needs_differentials) {
            sampler.trilinear(point, differentials);
          } else {
            const float level = options.level[options.level.size() == 1 ? 0 : i];
            sampler.at_level(point, static_cast<double>(level) + options.bias);
          }
          break;
        case SampleFilter::ewa: sampler.ewa(point, differentials); break;
      }
      for (std::size_t c = 0; c < channels; ++c) result[c] = static_cast<float>(sampler.value[c]);
    }
  });
  return unusable;
}

}  // namespace mirrorbake
