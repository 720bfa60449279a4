#include "mirrorbake/tracer/camera.hpp"

#include <cmath>
#include <numbers>
#include <string>
#include <glm/geometric.hpp>

#include "camera_rays.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake {
namespace {

// As far out as a scene may reach: Embree aborts on rays that start beyond 1.844e18.
void check_coordinates(const char* name, glm::vec3 v) {
  constexpr float kMaxCoordinate = 1e12F;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(v[axis]) <= kMaxCoordinate) continue;
    throw InvalidArgument(std::string("camera.") + name, text_of(v), "finite coordinates up to 1e12");
  }
}

}  // namespace

void validate(const Camera& camera) {
  constexpr int kMaxSide = 16384;
  for (auto [name, side] :
       {std::pair{"camera.width", camera.width}, std::pair{"camera.height", camera.height}}) {
    if (side < 1 || side > kMaxSide) throw InvalidArgument(name, std::to_string(side), "1 to 16384 pixels");
  }
  const float fov = camera.vertical_fov_degrees;
  if (!(fov > 0.0F && fov < 180.0F)) {
    throw InvalidArgument("camera.vertical_fov_degrees", text_of(fov), "more than 0 and less than 180");
  }
  check_coordinates("eye", camera.eye);
  check_coordinates("target", camera.target);
  check_coordinates("up", camera.up);
  const glm::dvec3 view = glm::dvec3(camera.target) - glm::dvec3(camera.eye);
  const double distance = glm::length(view);
  if (!(distance > 0.0))
    throw InvalidArgument("camera.target", text_of(camera.target), "a point other than the eye");
  const double up = glm::length(glm::dvec3(camera.up));
  if (!(up > 0.0) || glm::length(glm::cross(view / distance, glm::dvec3(camera.up) / up)) < 1e-6) {
    throw InvalidArgument("camera.up", text_of(camera.up), "a direction that is not along the view");
  }
}

namespace tracing {

CameraRays::CameraRays(const Camera& camera) {
  const glm::dvec3 forward = glm::normalize(glm::dvec3(camera.target) - glm::dvec3(camera.eye));
  const glm::dvec3 right = glm::normalize(glm::cross(forward, glm::normalize(glm::dvec3(camera.up))));
  const glm::dvec3 up = glm::cross(right, forward);
  const double half_height = std::tan(camera.vertical_fov_degrees * std::numbers::pi / 360.0);
  const double pixel = 2.0 * half_height / camera.height;
  corner_ = glm::vec3(forward - right * (0.5 * pixel * camera.width) + up * half_height);
  right_ = glm::vec3(right * pixel);
  down_ = glm::vec3(-up * pixel);
}

glm::vec3 CameraRays::direction(glm::vec2 point) const { return glm::normalize(unnormalised(point)); }

CameraRays::Direction CameraRays::direction_with_differentials(glm::vec2 point) const {
  const glm::vec3 d = unnormalised(point);
  const float length = glm::length(d);
  const glm::vec3 unit = d / length;
  return {unit, (right_ - glm::dot(right_, unit) * unit) / length,
          (down_ - glm::dot(down_, unit) * unit) / length};
}

}  // namespace tracing
}  // namespace mirrorbake
