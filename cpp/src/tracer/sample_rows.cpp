#include "sample_rows.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <numeric>
#include <type_traits>
#include <utility>

#include "mirrorbake/core/parallel.hpp"

namespace mirrorbake::tracing {
namespace {

/// Calls `task(member)` for every array of SurfaceSamples, in parallel.
template <typename Task>
void for_each_array(const Task& task) {
  using S = SurfaceSamples;
  const auto call = [&](auto... members) {
    const std::array<std::function<void()>, sizeof...(members)> calls{[&task, members] { task(members); }...};
    parallel_for(calls.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) calls[i]();
    });
  };
  call(&S::pixel, &S::part, &S::triangle, &S::barycentric, &S::position, &S::normal, &S::reflection,
       &S::dposition_dx, &S::dposition_dy, &S::dreflection_dx, &S::dreflection_dy, &S::fresnel, &S::albedo,
       &S::emission, &S::back, &S::diffuse);
}

/// Moves the rows' arrays one behind the other; `array` picks one out of a row's samples.
template <typename Array>
auto join(std::vector<Row>& rows, const Array& array) {
  std::size_t size = 0;
  for (Row& row : rows) size += array(row.samples).size();
  std::remove_reference_t<decltype(array(rows.front().samples))> whole;
  whole.reserve(size);
  for (Row& row : rows) {
    auto& part = array(row.samples);
    whole.insert(whole.end(), part.begin(), part.end());
    part = {};
  }
  return whole;
}

}  // namespace

SurfaceSamples concatenate(std::vector<Row>& rows, const PixelWindow& window, const TraceOptions& options,
                           glm::dvec3 origin) {
  SurfaceSamples all;
  all.width = window.width;
  all.height = window.height;
  all.samples_per_pixel = options.samples_per_pixel;
  all.origin = origin;
  for_each_array([&](auto member) {
    all.*member = join(
        rows, [member](SurfaceSamples & samples) -> auto& { return samples.*member; });
  });
  all.shells.resize(rows.front().samples.shells.size());
  parallel_for(all.shells.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      ShellLight& shell = all.shells[k];
      shell.name = rows.front().samples.shells[k].name;
      shell.radiance = join(
          rows, [k](SurfaceSamples & s) -> auto& { return s.shells[k].radiance; });
      shell.hit_distance = join(
          rows, [k](SurfaceSamples & s) -> auto& { return s.shells[k].hit_distance; });
    }
  });
  return all;
}

void sort_by_pixel(Row& row) {
  std::vector<std::uint32_t> order(row.samples.size());
  std::iota(order.begin(), order.end(), 0U);
  // Samples of a pixel stay in their order.
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(row.samples.pixel[a], a) < std::pair(row.samples.pixel[b], b);
  });
  const auto sort = [&](auto& array) {
    auto sorted = array;
    for (std::size_t i = 0; i < order.size(); ++i) sorted[i] = array[order[i]];
    array = std::move(sorted);
  };
  for_each_array([&](auto member) { sort(row.samples.*member); });
  for (ShellLight& shell : row.samples.shells) {
    sort(shell.radiance);
    sort(shell.hit_distance);
  }
  sort(row.beauty);
}

void record_surface(SurfaceSamples& out, const World& world, const Surface& s, float distance,
                    const CameraRays::Direction& ray, std::uint32_t pixel) {
  const std::vector<std::uint16_t>& parts =
      world.scene.objects[static_cast<std::size_t>(s.object)].mesh.parts;
  out.pixel.push_back(pixel);
  out.part.push_back(parts.empty() ? std::uint16_t{0} : parts[s.triangle]);
  out.triangle.push_back(s.triangle);
  out.barycentric.push_back(s.barycentric);
  out.position.push_back(s.position);
  out.normal.push_back(s.normal);
  out.reflection.push_back(s.reflection);
  const auto dx = surface_differential(world.scene, world.rays, s, distance, ray.dx);
  const auto dy = surface_differential(world.scene, world.rays, s, distance, ray.dy);
  out.dposition_dx.push_back(dx.position);
  out.dposition_dy.push_back(dy.position);
  out.dreflection_dx.push_back(dx.reflection);
  out.dreflection_dy.push_back(dy.reflection);
  out.fresnel.push_back(s.fresnel);
  out.albedo.push_back(s.albedo);
  out.emission.push_back(s.emission);
  out.back.push_back(s.front ? 0 : 1);
}

void record_light(SurfaceSamples& out, glm::vec3 body, const IncidentShells& incident) {
  out.diffuse.push_back(body);
  for (std::size_t k = 0; k < out.shells.size(); ++k) {
    out.shells[k].radiance.push_back(incident.shells[k].radiance);
    out.shells[k].hit_distance.push_back(incident.shells[k].distance);
  }
}

}  // namespace mirrorbake::tracing
