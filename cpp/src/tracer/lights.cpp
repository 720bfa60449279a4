#include "lights.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "barycentric.hpp"
#include "cdf.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "sample_stream.hpp"
#include "surface.hpp"
#include "triangle_sampler.hpp"

namespace mirrorbake::tracing {
namespace {

// A rectangle seen from a point, in the rectangle's frame, with the constants of Ureña, Fajardo, King, An
// Area-Preserving Parametrization for Spherical Rectangles, EGSR 2013. In double: the angles nearly cancel.
struct SphericalRectangle {
  glm::dvec3 x, y, z;  // frame, z away from the point's side
  double x0, y0, x1, y1, z0;
  double b0, b1, k;
  double solid_angle;

  /// Unit edges, their lengths, and the way from the point to the corner.
  SphericalRectangle(const glm::dvec3& unit_u, const glm::dvec3& unit_v, double width, double height,
                     const glm::dvec3& d)
      : x(unit_u), y(unit_v) {
    z = glm::cross(x, y);
    z0 = glm::dot(d, z);
    if (z0 > 0.0) {
      z = -z;
      z0 = -z0;
    }
    x0 = glm::dot(d, x);
    y0 = glm::dot(d, y);
    x1 = x0 + width;
    y1 = y0 + height;
    // z components of the normals of the four planes through the point and an edge.
    const auto length = [](double a, double b) { return std::sqrt(a * a + b * b); };
    const double n0 = -y0 / length(y0, z0);
    const double n1 = x1 / length(x1, z0);
    const double n2 = y1 / length(y1, z0);
    const double n3 = -x0 / length(x0, z0);
    const auto angle = [](double a, double b) { return std::acos(std::clamp(-a * b, -1.0, 1.0)); };
    b0 = n0;
    b1 = n2;
    k = 2.0 * std::numbers::pi - angle(n2, n3) - angle(n3, n0);
    solid_angle = angle(n0, n1) + angle(n1, n2) - k;
  }

  glm::dvec3 sample(glm::vec2 s) const {
    const double au = s.x * solid_angle + k;
    const double fu = (std::cos(au) * b0 - b1) / std::sin(au);
    double cu = std::copysign(1.0, fu) / std::sqrt(fu * fu + b0 * b0);
    cu = std::clamp(cu, -1.0, 1.0);
    double xu = -(cu * z0) / std::max(1e-12, std::sqrt(1.0 - cu * cu));
    xu = std::clamp(xu, x0, x1);
    const double d = std::sqrt(xu * xu + z0 * z0);
    const double h0 = y0 / std::sqrt(d * d + y0 * y0);
    const double h1 = y1 / std::sqrt(d * d + y1 * y1);
    const double hv = h0 + s.y * (h1 - h0);
    const double yv = hv * hv < 1.0 - 1e-12 ? hv * d / std::sqrt(1.0 - hv * hv) : y1;
    return xu * x + yv * y + z0 * z;  // relative to the point
  }
};

// By area when the rectangle is small and far, where the two densities agree and the angles lose their
// digits.
bool by_solid_angle(glm::vec3 centre, float diagonal, bool orthogonal, glm::vec3 position) {
  return orthogonal && glm::length(centre - position) < diagonal;
}

template <typename Rectangle>
SphericalRectangle seen_from(const Rectangle& r, glm::vec3 position) {
  return {r.unit_u, r.unit_v, r.width, r.height, glm::dvec3(r.corner) - glm::dvec3(position)};
}

// 1 − cosθ of the cone that a sphere fills; 0 from inside it.
double cone_cap(double distance, float radius) {
  const double sine = static_cast<double>(radius) / distance;
  return sine < 1.0 ? sine * sine / (1.0 + std::sqrt(1.0 - sine * sine)) : 0.0;
}

// Unit radiance from a direction in the cone that the sphere fills.
std::optional<LightSample> sample_sphere(glm::vec3 centre, float radius, glm::vec3 position, glm::vec2 u) {
  const glm::dvec3 to = glm::dvec3(centre) - glm::dvec3(position);
  const double distance = glm::length(to);
  const double cap = cone_cap(distance, radius);
  if (!(cap > 0.0)) return std::nullopt;
  const double below_one = static_cast<double>(u.x) * cap;
  const double sine2 = below_one * (2.0 - below_one);
  const double cosine = 1.0 - below_one;
  const double azimuth = 2.0 * std::numbers::pi * static_cast<double>(u.y);
  const double sine = std::sqrt(std::max(0.0, sine2));
  const Frame frame(glm::vec3(to / distance));
  const glm::vec3 direction = glm::normalize(
      frame.to_world({static_cast<float>(sine * std::cos(azimuth)),
                      static_cast<float>(sine * std::sin(azimuth)), static_cast<float>(cosine)}));
  const double r = radius;
  const double half_chord = std::sqrt(std::max(0.0, r * r - distance * distance * sine2));
  // The shadow ray ends a thousandth of the radius before the sphere: near the rim it hits early by some
  // 1e-4.
  const auto reach = static_cast<float>(std::max(0.0, distance * cosine - half_chord - 1e-3 * r));
  const auto pdf = static_cast<float>(1.0 / (2.0 * std::numbers::pi * cap));
  return LightSample{direction, reach, glm::vec3(1.0F / pdf), pdf};
}

// Unit intensity from a point.
std::optional<LightSample> towards(glm::vec3 point, glm::vec3 position) {
  const glm::vec3 to = point - position;
  const float distance = glm::length(to);
  if (!(distance > 0.0F)) return std::nullopt;
  return LightSample{to / distance, distance, glm::vec3(1.0F / (distance * distance)), 0.0F};
}

}  // namespace

Lights::Lights(const Scene& scene, const RayScene& rays)
    : scene_(&scene),
      rays_(&rays),
      meshes_(scene.objects.size()),
      light_of_mesh_(scene.objects.size(), -1),
      light_of_hit_(scene.rectangle_lights.size() + scene.sphere_lights.size(), -1) {
  const double scene_disk =
      std::numbers::pi * static_cast<double>(rays.radius()) * static_cast<double>(rays.radius());
  for (std::size_t i = 0; i < scene.rectangle_lights.size(); ++i) add_rectangle(i);
  for (std::size_t i = 0; i < scene.sphere_lights.size(); ++i) add_sphere(i);
  for (std::size_t i = 0; i < scene.point_lights.size(); ++i) {
    const PointLight& light = scene.point_lights[i];
    points_.push_back({light.position - rays.origin(), light.intensity});
    add(Kind::point, i, light.intensity, 4.0 * std::numbers::pi);
  }
  for (std::size_t i = 0; i < scene.directional_lights.size(); ++i) {
    add(Kind::directional, i, scene.directional_lights[i].irradiance, scene_disk);
  }
  for (std::size_t i = 0; i < scene.spot_lights.size(); ++i) {
    const SpotLight& light = scene.spot_lights[i];
    spots_.push_back({light.position - rays.origin(), light.intensity});
    const double cone = 1.0 - std::cos(static_cast<double>(light.outer_degrees) * std::numbers::pi / 180.0);
    add(Kind::spot, i, light.intensity, 2.0 * std::numbers::pi * cone);
  }
  for (std::size_t i = 0; i < scene.objects.size(); ++i) add_mesh(i);
  if (scene.environment) {
    environment_.emplace(*scene.environment);
    add(Kind::environment, 0, glm::vec3(static_cast<float>(environment_->flux())), scene_disk);
  }
  if (!lights_.empty()) share_by_power();
}

void Lights::add_rectangle(std::size_t i) {
  const RectangleLight& light = scene_->rectangle_lights[i];
  Rectangle r;
  r.corner = light.corner - rays_->origin();
  r.edge_u = light.edge_u;
  r.edge_v = light.edge_v;
  const glm::dvec3 normal = glm::cross(glm::dvec3(light.edge_u), glm::dvec3(light.edge_v));
  r.area = static_cast<float>(glm::length(normal));
  r.normal = glm::vec3(glm::normalize(normal));
  r.centre = r.corner + 0.5F * (r.edge_u + r.edge_v);
  r.diagonal = glm::length(r.edge_u + r.edge_v);
  r.orthogonal =
      std::abs(glm::dot(r.edge_u, r.edge_v)) <= 1e-5F * glm::length(r.edge_u) * glm::length(r.edge_v);
  r.radiance = light.radiance;
  r.width = glm::length(glm::dvec3(light.edge_u));
  r.height = glm::length(glm::dvec3(light.edge_v));
  r.unit_u = glm::dvec3(light.edge_u) / r.width;
  r.unit_v = glm::dvec3(light.edge_v) / r.height;
  rectangles_.push_back(r);
  add(Kind::rectangle, i, light.radiance, static_cast<double>(r.area) * std::numbers::pi);
}

void Lights::add_sphere(std::size_t i) {
  const SphereLight& light = scene_->sphere_lights[i];
  spheres_.push_back({light.centre - rays_->origin(), light.radiance, light.radius});
  const double radius = light.radius;
  add(Kind::sphere, i, light.radiance, 4.0 * std::numbers::pi * std::numbers::pi * radius * radius);
}

// Mean luminance that each triangle emits, 0 where its part does not, by samples no further apart than texels
// and at most kMostAcross along an edge. Bright texels that slip through them are made up for in add_mesh().
std::vector<double> Lights::triangle_emission(const Object& object) const {
  constexpr int kMostAcross = 16;
  std::vector<double> emission(object.mesh.triangles.size(), 0.0);
  parallel_for(emission.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const Material& material = scene_->materials[static_cast<std::size_t>(material_of(object, k))];
      emission[k] = static_cast<double>(luminance(material.emission));
      if (!(emission[k] > 0.0) || material.emission_texture.texture < 0) continue;
      const auto triangle = static_cast<std::uint32_t>(k);
      const auto at = [&](glm::vec2 barycentric) {
        return texture_coordinates(material.emission_texture, uv_at(object.mesh, triangle, barycentric));
      };
      const Texture& texture = scene_->textures[static_cast<std::size_t>(material.emission_texture.texture)];
      const glm::vec2 size = texture.file ? glm::vec2(texture.file->width(), texture.file->height())
                                          : glm::vec2(texture.image.width, texture.image.height);
      const float edge = std::max(glm::length(size * (at({1.0F, 0.0F}) - at({0.0F, 0.0F}))),
                                  glm::length(size * (at({0.0F, 1.0F}) - at({0.0F, 0.0F}))));
      const int across = std::clamp(static_cast<int>(std::min(edge, 1e6F)) + 1, 1, kMostAcross);
      double sum = 0.0;
      int count = 0;
      for (int i = 0; i < across; ++i) {
        for (int j = 0; i + j < across; ++j) {
          const glm::vec2 barycentric =
              (glm::vec2(static_cast<float>(i), static_cast<float>(j)) + 1.0F / 3.0F) /
              static_cast<float>(across);
          sum += static_cast<double>(luminance(material.emission * texture_lookup(texture, at(barycentric))));
          ++count;
        }
      }
      emission[k] = sum / count;
    }
  });
  return emission;
}

void Lights::add_mesh(std::size_t i) {
  const Object& object = scene_->objects[i];
  // By material, in the order of materials_of().
  const std::vector<int> materials = materials_of(object);
  std::vector<glm::vec3> emissions;
  for (const int index : materials) {
    const Material& material = scene_->materials[static_cast<std::size_t>(index)];
    glm::vec3& emission = emissions.emplace_back(material.emission);
    if (luminance(emission) > 0.0F && material.emission_texture.texture >= 0) {
      emission *= texture_mean(scene_->textures[static_cast<std::size_t>(material.emission_texture.texture)]);
    }
  }
  const auto emits = [](glm::vec3 emission) { return luminance(emission) > 0.0F; };
  if (std::none_of(emissions.begin(), emissions.end(), emits)) return;
  // Parts that do not emit have no area to choose a point from.
  Mesh& mesh = meshes_[i];
  std::vector<double> areas;
  std::vector<glm::vec3> means;
  double area = 0.0;
  for (std::size_t k = 0; k < object.mesh.triangles.size(); ++k) {
    const auto found = std::find(materials.begin(), materials.end(), material_of(object, k));
    const glm::vec3 emission = emissions[static_cast<std::size_t>(found - materials.begin())];
    const double of_one = triangle_area(object.mesh.positions, object.mesh.triangles[k]);
    if (!emits(emission) || !(of_one > 0.0)) continue;
    mesh.triangles.push_back(static_cast<std::uint32_t>(k));
    areas.push_back(of_one);
    means.push_back(emission);
    area += of_one;
  }
  if (mesh.triangles.empty()) return;
  const std::vector<double> emission = triangle_emission(object);
  double power = 0.0;
  for (std::size_t n = 0; n < areas.size(); ++n) power += areas[n] * emission[mesh.triangles[n]];
  // By what they emit, and a tenth by area alone: no place that emits may be left out, however small.
  constexpr double kByArea = 0.1;
  std::vector<double> shares;
  glm::dvec3 mean(0.0);
  for (std::size_t n = 0; n < areas.size(); ++n) {
    const double by_area = areas[n] / area;
    const double by_power = power > 0.0 ? areas[n] * emission[mesh.triangles[n]] / power : by_area;
    shares.push_back(kByArea * by_area + (1.0 - kByArea) * by_power);
    mean += by_area * glm::dvec3(means[n]);
  }
  mesh.cdf.resize(shares.size() + 1);
  normalise_cdf(mesh.cdf.data(), shares.data(), static_cast<int>(shares.size()));
  mesh.area = static_cast<float>(area);
  mesh.density.assign(object.mesh.triangles.size(), 0.0F);
  for (std::size_t n = 0; n < areas.size(); ++n) {
    mesh.density[mesh.triangles[n]] = static_cast<float>(interval_width(mesh.cdf.data(), n) / areas[n]);
  }
  mesh.is_reflected = (object.visibility & Visibility::reflection) != Visibility::none;
  const Bounds& bounds = rays_->object_bounds(static_cast<int>(i));
  mesh.centre = 0.5F * (bounds.min + bounds.max);
  mesh.radius = 0.5F * glm::length(bounds.max - bounds.min);
  add(Kind::mesh, i, materials.size() == 1 ? emissions.front() : glm::vec3(mean), area * std::numbers::pi);
}

void Lights::add(Kind kind, std::size_t index, glm::vec3 strength, double power_of_one) {
  const float of_strength = luminance(strength);
  const double power = static_cast<double>(of_strength) * power_of_one;
  if (!(power > 0.0)) return;
  const auto number = static_cast<int>(lights_.size());
  lights_.push_back({kind, static_cast<int>(index), power, of_strength});
  if (kind == Kind::mesh) light_of_mesh_[index] = number;
  if (kind == Kind::rectangle) light_of_hit_[index] = number;
  if (kind == Kind::sphere) light_of_hit_[rectangles_.size() + index] = number;
  if (kind == Kind::environment) light_of_environment_ = number;
}

void Lights::share_by_power() {
  double total = 0.0;
  for (const Light& light : lights_) total += light.power;
  std::vector<double> shares;
  const double equal = 1.0 / static_cast<double>(lights_.size());
  for (const Light& light : lights_) shares.push_back(0.5 * equal + 0.5 * light.power / total);
  power_cdf_.resize(lights_.size() + 1);
  normalise_cdf(power_cdf_.data(), shares.data(), static_cast<int>(lights_.size()));
}

std::optional<LightSample> Lights::sample_light(const Light& light, glm::vec3 position, glm::vec2 u,
                                                bool shared) const {
  const auto index = static_cast<std::size_t>(light.index);
  std::optional<LightSample> sample;
  switch (light.kind) {
    case Kind::rectangle: sample = sample_rectangle(rectangles_[index], position, u); break;
    case Kind::sphere:
      sample = sample_sphere(spheres_[index].centre, spheres_[index].radius, position, u);
      if (sample) sample->radiance *= spheres_[index].radiance;
      break;
    case Kind::point:
      sample = towards(points_[index].position, position);
      if (sample) sample->radiance *= points_[index].intensity;
      break;
    case Kind::directional:
      sample =
          LightSample{-scene_->directional_lights[index].direction, std::numeric_limits<float>::infinity(),
                      scene_->directional_lights[index].irradiance, 0.0F};
      break;
    case Kind::spot:
      sample = towards(spots_[index].position, position);
      if (sample) {
        const SpotLight& spot = scene_->spot_lights[index];
        sample->radiance *= spot_falloff(spot, -glm::dot(spot.direction, sample->direction));
        sample->radiance *= spot.intensity;
      }
      break;
    case Kind::mesh: sample = sample_mesh(light.index, position, u); break;
    case Kind::environment: {
      const EnvironmentSampler::Sample sky = environment_->sample(u, shared);
      const float pdf = sky.found.pdf;
      if (pdf > 0.0F) {
        sample = {sky.direction, std::numeric_limits<float>::infinity(), sky.found.radiance / pdf, pdf};
      }
      break;
    }
  }
  return sample;
}

std::optional<LightSample> Lights::sample_mesh(int object, glm::vec3 position, glm::vec2 u) const {
  const auto index = static_cast<std::size_t>(object);
  const Mesh& mesh = meshes_[index];
  const TriangleMesh& source = scene_->objects[index].mesh;
  const CdfSample t = sample_cdf(mesh.cdf.data(), static_cast<int>(mesh.triangles.size()), u.x);
  const std::uint32_t triangle = mesh.triangles[static_cast<std::size_t>(t.index)];
  const glm::uvec3 corner = source.triangles[triangle];
  const std::span<const glm::vec3> p = rays_->positions(object);
  const glm::vec2 barycentric = uniform_on_triangle({t.place, u.y});
  const glm::vec3 point = interpolate(p, corner, barycentric);
  const glm::vec3 to = point - position;
  const float distance = glm::length(to);
  if (!(distance > 0.0F)) return std::nullopt;
  const glm::vec3 direction = to / distance;
  const float cosine = -glm::dot(direction, triangle_normal(p[corner.x], p[corner.y], p[corner.z]));
  if (!(cosine > 0.0F)) return std::nullopt;
  const Material& material =
      scene_->materials[static_cast<std::size_t>(material_of(scene_->objects[index], triangle))];
  glm::vec3 emission = material.emission;
  const glm::vec2 uv = uv_at(source, triangle, barycentric);
  if (material.emission_texture.texture >= 0) {
    emission *= texture_lookup(*scene_, material.emission_texture, uv);
  }
  if (has_gaps(material)) emission *= opacity_at(*scene_, material, uv);
  const float pdf = mesh.density[triangle] * distance * distance / cosine;
  if (emission == glm::vec3(0.0F) || !(pdf > 0.0F)) return std::nullopt;
  return LightSample{direction, distance, emission / pdf, mesh.is_reflected ? pdf : 0.0F};
}

std::optional<LightSample> Lights::sample_rectangle(const Rectangle& r, glm::vec3 position,
                                                    glm::vec2 u) const {
  // One-sided.
  if (!(glm::dot(position - r.corner, r.normal) > 0.0F)) return std::nullopt;
  glm::vec3 to;
  float pdf = 0.0F;
  if (by_solid_angle(r.centre, r.diagonal, r.orthogonal, position)) {
    const SphericalRectangle seen = seen_from(r, position);
    if (!(seen.solid_angle > 0.0)) return std::nullopt;
    to = glm::vec3(seen.sample(u));
    pdf = static_cast<float>(1.0 / seen.solid_angle);
  } else {
    to = r.corner + u.x * r.edge_u + u.y * r.edge_v - position;
  }
  const float distance = glm::length(to);
  if (!(distance > 0.0F)) return std::nullopt;
  const glm::vec3 direction = to / distance;
  if (pdf == 0.0F) {
    const float cosine = -glm::dot(direction, r.normal);
    if (!(cosine > 0.0F)) return std::nullopt;
    pdf = distance * distance / (r.area * cosine);
  }
  return LightSample{direction, distance, r.radiance / pdf, pdf};
}

EnvironmentSampler::Found Lights::environment(const Ray& ray, NextEvent how) const {
  if (!environment_) return {glm::vec3(0.0F), 0.0F};
  EnvironmentSampler::Found found = environment_->find(ray.direction, how.shared);
  found.pdf *= mean_samples(light_of_environment_, ray.origin, how.effort);
  return found;
}

glm::vec3 Lights::hit_radiance(int light, const Ray& ray) const {
  const auto index = static_cast<std::size_t>(light);
  if (index < rectangles_.size()) {
    const Rectangle& r = rectangles_[index];
    return glm::dot(ray.direction, r.normal) < 0.0F ? r.radiance : glm::vec3(0.0F);
  }
  const Sphere& s = spheres_[index - rectangles_.size()];
  return glm::length(ray.origin - s.centre) > s.radius ? s.radiance : glm::vec3(0.0F);
}

float Lights::hit_pdf(int light, const Ray& ray, float distance, Effort effort) const {
  const auto index = static_cast<std::size_t>(light);
  const float samples = mean_samples(light_of_hit_[index], ray.origin, effort);
  if (index >= rectangles_.size()) {
    const Sphere& s = spheres_[index - rectangles_.size()];
    const double cap = cone_cap(glm::length(glm::dvec3(s.centre) - glm::dvec3(ray.origin)), s.radius);
    return cap > 0.0 ? samples / static_cast<float>(2.0 * std::numbers::pi * cap) : 0.0F;
  }
  const Rectangle& r = rectangles_[index];
  if (by_solid_angle(r.centre, r.diagonal, r.orthogonal, ray.origin)) {
    const double solid_angle = seen_from(r, ray.origin).solid_angle;
    return solid_angle > 0.0 ? samples * static_cast<float>(1.0 / solid_angle) : 0.0F;
  }
  const float cosine = -glm::dot(ray.direction, r.normal);
  return cosine > 0.0F ? samples * distance * distance / (r.area * cosine) : 0.0F;
}

float Lights::mesh_pdf(const Hit& hit, glm::vec3 geometric_normal, const Ray& ray, Effort effort) const {
  const float cosine = -glm::dot(ray.direction, geometric_normal);
  const int light = light_of_mesh_[hit.geometry];
  if (!(cosine > 0.0F) || light < 0) return 0.0F;
  return mean_samples(light, ray.origin, effort) * meshes_[hit.geometry].density[hit.triangle] *
         hit.distance * hit.distance / cosine;
}

}  // namespace mirrorbake::tracing
