#include "resample_job.hpp"

#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mirrorbake/projection/traits.hpp"

namespace mirrorbake {
namespace {

constexpr int kFewTexels = 64;

TexelDensity density_of(const EnvMapLayout& layout) {
  TexelDensity density;
  density.width = layout.width;
  density.height = layout.height;
  const double area = 4.0 / (static_cast<double>(layout.width) * layout.height);
  density.scale = area;
  const ProjectionTraits& known = traits(layout.projection.kind);
  const glm::dvec2 largest = known.largest_texel(layout.projection);
  switch (known.density) {
    case CenterDensity::tabulated: return density;  // all weights come from a table
    case CenterDensity::equal: break;
    case CenterDensity::cube: density.kind = TexelDensity::cube; break;
    case CenterDensity::paraboloid: density.kind = TexelDensity::paraboloid; break;
    case CenterDensity::fisheye:
      density.kind = TexelDensity::fisheye;
      density.half_angle = largest.x;
      break;
  }
  density.scale = largest.x * largest.y * area;
  return density;
}

}  // namespace

ResampleJob::ResampleJob(const EnvMapLayout& source_, const EnvMapLayout& target_,
                         const ResampleOptions& options)
    : source(source_),
      target(target_),
      filter(options.filter),
      source_from_target(options.source_from_target),
      density(density_of(source_)) {
  source.levels = target.levels = 1;
  source.channels = target.channels = 1;
  if (is_periodic()) {
    for (int row = 0; row < height(); ++row) {
      weights.push_back(texel_solid_angle(projection(), width(), height(), 0, row));
    }
  } else if (const CenterDensity known = traits(projection().kind).density;
             known == CenterDensity::tabulated || (known == CenterDensity::cube && width() <= kFewTexels)) {
    weights = texel_solid_angles(projection(), width(), height());
    density.kind = TexelDensity::equal;
  }
}

double ResampleJob::weight(int row, int column) const {
  if (is_periodic()) return weights[static_cast<std::size_t>(row)];
  if (!weights.empty()) {
    return weights[static_cast<std::size_t>(row) * static_cast<std::size_t>(width()) +
                   static_cast<std::size_t>(column)];
  }
  const double x = column_center(column, width());
  const double y = row_center(row, height());
  const double r2 = x * x + y * y;
  switch (density.kind) {
    case TexelDensity::equal: break;
    case TexelDensity::cube: return density.scale / ((1.0 + r2) * std::sqrt(1.0 + r2));
    case TexelDensity::paraboloid: return density.scale / ((1.0 + r2) * (1.0 + r2));
    case TexelDensity::fisheye: {
      const double angle = density.half_angle * std::sqrt(r2);
      return density.scale * (angle > 1e-8 ? std::abs(std::sin(angle) / angle) : 1.0);
    }
  }
  return density.scale;
}

DiscExtent disc_extent(ProjectionKind kind, glm::dvec2 low, glm::dvec2 high) {
  if (traits(kind).shape != FaceShape::disc) return DiscExtent::inside;
  const glm::dvec2 a = glm::min(low, high);
  const glm::dvec2 b = glm::max(low, high);
  const glm::dvec2 nearest = glm::clamp(glm::dvec2(0.0), a, b);
  const glm::dvec2 farthest = glm::max(glm::abs(a), glm::abs(b));
  if (glm::dot(farthest, farthest) <= 1.0) return DiscExtent::inside;
  return glm::dot(nearest, nearest) >= 1.0 ? DiscExtent::outside : DiscExtent::crosses_rim;
}

}  // namespace mirrorbake
