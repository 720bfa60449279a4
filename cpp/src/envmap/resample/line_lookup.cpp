#include "line_lookup.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "mirrorbake/projection/traits.hpp"

namespace mirrorbake {

LineTables::LineTables(const Projection& target, std::vector<double> x_) : x(std::move(x_)) {
  for (const double at : x) {
    if (target.kind == ProjectionKind::cube) u.push_back(at);
    if (target.kind == ProjectionKind::dual_paraboloid) u.push_back(at), v.push_back(at * at);
    if (is_panorama(target.kind)) {
      u.push_back(std::sin(std::numbers::pi * at));
      v.push_back(std::cos(std::numbers::pi * at));
    }
  }
  v.resize(x.size());
}

PositionLoop position_loop(ProjectionKind kind) {
  switch (kind) {
    case ProjectionKind::latlong: return resample_kernels().latlong_positions;
    case ProjectionKind::cube: return resample_kernels().cube_positions;
    case ProjectionKind::dual_paraboloid: return resample_kernels().dual_paraboloid_positions;
    default: return nullptr;
  }
}

LineLookup::LineLookup(const ResampleJob& job, const LineTables& tables)
    : job_(job), tables_(tables), find_positions_(position_loop(job.projection().kind)) {}

void LineLookup::find(int face, double y, int first, std::size_t count, Positions& result,
                      std::size_t offset) {
  for (std::vector<double>* d : {&dx_, &dy_, &dz_}) d->resize(count);
  set_directions(face, y, static_cast<std::size_t>(first), count);
  const PositionArrays to = result.from(offset);
  if (find_positions_ != nullptr) {
    return find_positions_(dx_.data(), dy_.data(), dz_.data(), count, job_.width(), job_.height(), to);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const MapPoint point = point_from_direction(job_.projection(), {dx_[i], dy_[i], dz_[i]});
    const glm::dvec2 position = job_.position(point.x, point.y);
    to.x[i] = std::clamp(position.x, 0.0, static_cast<double>(job_.width()));
    to.y[i] = std::clamp(position.y, 0.0, static_cast<double>(job_.height()));
    to.face[i] = point.covered ? point.face : -1;
  }
}

void LineLookup::set_directions(int face, double y, std::size_t first, std::size_t count) {
  const Projection& target = job_.target.projection;
  const auto at = [&](double x) { return direction_from_point(target, face, x, y); };
  glm::dvec3 p(0.0);
  glm::dvec3 q(0.0);
  glm::dvec3 r(0.0);
  switch (target.kind) {
    case ProjectionKind::cube: {
      const glm::dvec3 left = at(-1.0);
      const glm::dvec3 right = at(1.0);
      // Both ends are equally far from the centre of the cube, so that their unit directions span the line.
      p = 0.5 * (left + right);
      q = 0.5 * (right - left);
      break;
    }
    case ProjectionKind::latlong:
    case ProjectionKind::equal_area: {
      const glm::dvec3 middle = at(0.0);  // towards −Z at this latitude
      p = glm::dvec3(0.0, middle.y, 0.0);
      q = glm::dvec3(-middle.z, 0.0, 0.0);
      r = glm::dvec3(0.0, 0.0, middle.z);
      break;
    }
    case ProjectionKind::dual_paraboloid: {
      const double front = face == 0 ? 1.0 : -1.0;
      p = glm::dvec3(0.0, 2.0 * y, front * (1.0 - y * y));
      q = glm::dvec3(2.0, 0.0, 0.0);
      r = glm::dvec3(0.0, 0.0, -front);
      break;
    }
    case ProjectionKind::angular:
    case ProjectionKind::fisheye: {
      const double half_angle = traits(target.kind).largest_texel(target).x;
      resample_kernels().fisheye_directions(tables_.x.data() + first, y, half_angle, count, dx_.data(),
                                            dy_.data(), dz_.data());
      return turn(count);
    }
    default:
      for (std::size_t i = 0; i < count; ++i) {
        const glm::dvec3 d = at(tables_.x[first + i]);
        dx_[i] = d.x;
        dy_[i] = d.y;
        dz_[i] = d.z;
      }
      return turn(count);
  }
  p = job_.source_from_target * p;
  q = job_.source_from_target * q;
  r = job_.source_from_target * r;
  for (std::size_t i = 0; i < count; ++i) {
    dx_[i] = p.x + tables_.u[first + i] * q.x + tables_.v[first + i] * r.x;
    dy_[i] = p.y + tables_.u[first + i] * q.y + tables_.v[first + i] * r.y;
    dz_[i] = p.z + tables_.u[first + i] * q.z + tables_.v[first + i] * r.z;
  }
}

void LineLookup::turn(std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const glm::dvec3 d = job_.source_from_target * glm::dvec3(dx_[i], dy_[i], dz_[i]);
    dx_[i] = d.x;
    dy_[i] = d.y;
    dz_[i] = d.z;
  }
}

std::vector<double> side_coordinates(int texels) {
  std::vector<double> x;
  for (int i = 0; i <= texels; ++i) x.push_back(2.0 * i / texels - 1.0);
  return x;
}
std::vector<double> center_coordinates(int texels) {
  std::vector<double> x;
  for (int i = 0; i < texels; ++i) x.push_back(column_center(i, texels));
  return x;
}

}  // namespace mirrorbake
