#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "environment_sampler.hpp"
#include "mirrorbake/scene/scene.hpp"
#include "ray_scene.hpp"
#include "sample_stream.hpp"

namespace mirrorbake::tracing {

/// A direction towards a light, for next-event estimation.
struct LightSample {
  glm::vec3 direction{0.0F};  ///< unit
  float distance = 0.0F;      ///< +inf for the environment
  glm::vec3 radiance{0.0F};  ///< divided by the density: a sum over samples times the cosine gives irradiance
  /// Density per solid angle of this direction; 0 if rays that are followed cannot find the light
  float pdf = 0.0F;
};

/// How many directions next-event estimation takes at a surface. `one` picks a light by what it may bring
/// there at most, shadows apart. `many` takes every light if they are few, some several times, else a few
/// picks.
enum class Effort { one, many };

/// How next-event estimation was done at a surface: what a followed ray from there has to share with.
struct NextEvent {
  Effort effort = Effort::one;
  bool shared = false;  ///< see Lights
};

/// The directions of Effort::many. A sum over them estimates all light.
struct LightSamples {
  static constexpr std::uint32_t kMost = 8;
  std::array<LightSample, kMost> sample;
  std::uint32_t count = 0;
};

/// All lights of a scene.
///
/// `shared` says of a surface that followed rays take every direction from which it reflects light. Then the
/// even part of the sky is left to them, and samples go to what is brighter than the average (Karlík et al.,
/// "MIS Compensation: Optimizing Sampling Techniques in Multiple Importance Sampling", ACM TOG 38(6), 2019,
/// §5).
class Lights {
 public:
  Lights(const Scene& scene, const RayScene& rays);

  bool empty() const { return lights_.empty(); }

  /// Effort::one: a direction from `position` to a light; nothing if the light turns its back.
  std::optional<LightSample> sample(glm::vec3 position, glm::vec2 u, bool shared) const;

  /// Effort::many. Takes numbers of its own for each light, stratified over the stream's samples.
  LightSamples sample_many(glm::vec3 position, const SampleStream& stream, std::uint32_t dimension,
                           bool shared) const;

  /// What a ray finds where it leaves the scene, and the density with which its direction is taken at its
  /// origin: the mean number of samples per solid angle, as all densities here.
  EnvironmentSampler::Found environment(const Ray& ray, NextEvent how) const;

  /// What a ray finds that hits light number `light`: the rectangles come first, then the spheres.
  glm::vec3 hit_radiance(int light, const Ray& ray) const;
  /// Densities with which the direction of a hit on a light or an emissive mesh is taken at the ray's origin.
  float hit_pdf(int light, const Ray& ray, float distance, Effort effort) const;
  float mesh_pdf(const Hit& hit, glm::vec3 geometric_normal, const Ray& ray, Effort effort) const;

 private:
  enum class Kind { rectangle, sphere, point, directional, spot, mesh, environment };
  struct Light {
    Kind kind;
    int index;        ///< into the scene's list, or of the object
    double power;     ///< emitted
    float luminance;  ///< of its radiance, intensity or irradiance
  };
  struct Rectangle {
    glm::vec3 corner, edge_u, edge_v, normal, centre, radiance;
    float area, diagonal;
    bool orthogonal;
    glm::dvec3 unit_u, unit_v;  ///< the edges' directions
    double width, height;
  };
  struct Mesh {
    std::vector<std::uint32_t> triangles;  ///< of the parts that emit
    std::vector<float> cdf;                ///< their number + 1, in [0,1]
    /// Per triangle of the object: probability density of its points, m⁻²; 0: it does not emit.
    std::vector<float> density;
    float area = 0.0F;  ///< of what emits
    glm::vec3 centre{0.0F};
    float radius = 0.0F;       ///< about the centre
    bool is_reflected = true;  ///< rays that leave surfaces see it
  };
  struct Sphere {
    glm::vec3 centre, radiance;
    float radius;
  };
  struct Point {
    glm::vec3 position, intensity;
  };

  void add(Kind kind, std::size_t index, glm::vec3 strength, double power_of_one);
  void add_rectangle(std::size_t i);
  void add_sphere(std::size_t i);
  void add_mesh(std::size_t i);
  std::vector<double> triangle_emission(const Object& object) const;
  void share_by_power();

  /// Luminance of the irradiance that a light may bring to a place, roughly; 0 only where it brings none.
  float estimate(const Light& light, glm::vec3 position) const;
  struct Pick {
    int light;          ///< into lights_; −1: none can be seen from there
    float place;        ///< a number in [0,1), used up by no choice
    float probability;  ///< of the choice
  };
  Pick pick(glm::vec3 position, float u) const;
  float pick_probability(int light, glm::vec3 position) const;
  bool few() const { return lights_.size() <= kFew; }
  /// Of Effort::many where lights are few.
  std::uint32_t samples_of(const Light& light) const;
  /// How many directions of a light are taken, on average.
  float mean_samples(int light, glm::vec3 position, Effort effort) const;
  /// A direction of one light, as if it were the only one.
  std::optional<LightSample> sample_light(const Light& light, glm::vec3 position, glm::vec2 u,
                                          bool shared) const;
  std::optional<LightSample> sample_rectangle(const Rectangle& r, glm::vec3 position, glm::vec2 u) const;
  std::optional<LightSample> sample_mesh(int object, glm::vec3 position, glm::vec2 u) const;

  /// Lights of which every one is sampled by Effort::many.
  static constexpr std::uint32_t kFew = 4;
  /// Lights that are weighed one by one for a pick; of more, power alone decides.
  static constexpr std::size_t kWeighed = 64;

  const Scene* scene_;
  const RayScene* rays_;
  std::vector<Light> lights_;
  std::vector<float> power_cdf_;  ///< lights + 1
  std::vector<Rectangle> rectangles_;
  std::vector<Sphere> spheres_;
  std::vector<Point> points_;
  std::vector<Point> spots_;  ///< with the intensity on the axis
  std::vector<Mesh> meshes_;  ///< per object; empty unless it emits
  // Numbers in lights_, −1 for what gives no light.
  std::vector<int> light_of_mesh_;  ///< per object
  std::vector<int> light_of_hit_;   ///< of the rectangles, then of the spheres
  int light_of_environment_ = -1;
  std::optional<EnvironmentSampler> environment_;
};

}  // namespace mirrorbake::tracing
