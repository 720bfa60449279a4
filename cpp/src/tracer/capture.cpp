#include <string>
#include <glm/geometric.hpp>

#include "beauty.hpp"
#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/tracer/tracer.hpp"
#include "options.hpp"
#include "state.hpp"

namespace mirrorbake {

Image Tracer::capture(glm::vec3 origin, const Projection& projection, int width, int height,
                      std::span<const int> hidden, const TraceOptions& options) const {
  validate(projection);
  check_range("width", width, 1, 16384);
  check_range("height", height, 1, 16384);
  if (projection.kind == ProjectionKind::cube && width != height) {
    throw InvalidArgument("height", std::to_string(height), "the width: the faces of a cube map are square");
  }
  tracing::validate(options);
  tracing::check_point("origin", origin);
  const tracing::World& world = state_->lit.world;
  const tracing::RayScene::View view = world.rays.without(hidden);
  const glm::vec3 eye = origin - world.rays.origin();
  const auto ray_through = [&](int row, glm::vec2 point) {
    // Rows count through all faces.
    const int face = row / height;
    const double x = 2.0 * static_cast<double>(point.x) / width - 1.0;
    const double y = 1.0 - 2.0 * (static_cast<double>(point.y) - static_cast<double>(face) * height) / height;
    return tracing::Ray{eye, glm::vec3(direction_from_point(projection, face, x, y))};
  };
  const PixelWindow whole{0, 0, width, face_count(projection) * height};
  return trace_image(state_->lit, view, width, whole, options, ray_through);
}

Image Tracer::capture_cube(glm::vec3 origin, int size, std::span<const int> hidden,
                           const TraceOptions& options) const {
  check_range("size", size, 1, 16384);
  return capture(origin, Projection{ProjectionKind::cube}, size, size, hidden, options);
}

}  // namespace mirrorbake
