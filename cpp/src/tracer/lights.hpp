#pragma once

#include <optional>
#include <vector>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "environment_sampler.hpp"
#include "mirrorbake/scene/scene.hpp"
#include "ray_scene.hpp"

namespace mirrorbake::tracing {

/// A direction towards a light, for next-event estimation.
struct LightSample {
  glm::vec3 direction{0.0F};  ///< unit
  float distance = 0.0F;      ///< +inf for the environment
  glm::vec3 radiance{0.0F};  ///< divided by the density: a sum over samples times the cosine gives irradiance
  float pdf =
      0.0F;  ///< density per solid angle of this direction; 0 if rays that are followed cannot find the light
};

/// All lights of a scene, one of which is picked per sample with a probability that mixes equal shares with
/// shares by emitted power.
///
/// `shared` says of a surface that followed rays take every direction from which it reflects light. Then the even part of
/// the sky is left to them, and samples go to what is brighter than the average (Karlík et al., "MIS Compensation:
/// Optimizing Sampling Techniques in Multiple Importance Sampling", ACM TOG 38(6), 2019, §5).
class Lights {
 public:
  Lights(const Scene& scene, const RayScene& rays);

  bool empty() const { return lights_.empty(); }

  /// A direction from `position` to a light; nothing if the light turns its back.
  std::optional<LightSample> sample(glm::vec3 position, glm::vec2 u, bool shared) const;

  /// What a ray in `direction` finds where it leaves the scene, and the density with which `sample` takes it.
  EnvironmentSampler::Found environment(glm::vec3 direction, bool shared) const;

  /// What a ray finds that hits light number `light`: the rectangles come first, then the spheres.
  glm::vec3 hit_radiance(int light, const Ray& ray) const;
  /// Densities with which `sample` at the ray's origin takes the direction of a hit on a light or an emissive mesh.
  float hit_pdf(int light, const Ray& ray, float distance) const;
  float mesh_pdf(int object, glm::vec3 geometric_normal, glm::vec3 direction, float distance) const;

 private:
  enum class Kind { rectangle, sphere, point, directional, spot, mesh, environment };
  struct Light {
    Kind kind;
    int index;  ///< into the scene's list, or of the object
    double power;
    float probability = 0.0F;
  };
  struct Rectangle {
    glm::vec3 corner, edge_u, edge_v, normal, centre, radiance;
    float area, diagonal;
    bool orthogonal;
    glm::dvec3 unit_u, unit_v;  ///< the edges' directions
    double width, height;
  };
  struct Mesh {
    std::vector<float> area_cdf;  ///< triangles + 1, in [0,1]
    float area = 0.0F;
    bool is_reflected = true;  ///< rays that leave surfaces see it
  };
  struct Sphere {
    glm::vec3 centre, radiance;
    float radius;
  };
  struct Point {
    glm::vec3 position, intensity;
  };

  void add(Kind kind, std::size_t index, double power);
  /// `power` for a strength of luminance 1.
  void add(Kind kind, std::size_t index, glm::vec3 strength, double power);
  void add_rectangle(std::size_t i);
  void add_sphere(std::size_t i);
  void add_mesh(std::size_t i);
  void assign_probabilities();
  std::optional<LightSample> sample_rectangle(const Rectangle& r, glm::vec3 position, glm::vec2 u) const;
  std::optional<LightSample> sample_mesh(int object, glm::vec3 position, glm::vec2 u) const;

  const Scene* scene_;
  const RayScene* rays_;
  std::vector<Light> lights_;
  std::vector<float> cdf_;  ///< lights + 1
  std::vector<Rectangle> rectangles_;
  std::vector<Sphere> spheres_;
  std::vector<Point> points_;
  std::vector<Point> spots_;             ///< with the intensity on the axis
  std::vector<Mesh> meshes_;             ///< per object; empty unless it emits
  std::vector<float> mesh_probability_;  ///< per object
  std::vector<float> hit_probability_;   ///< of the rectangles, then of the spheres
  float environment_probability_ = 0.0F;
  std::optional<EnvironmentSampler> environment_;
};

}  // namespace mirrorbake::tracing
