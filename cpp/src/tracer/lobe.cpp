#include "mirrorbake/tracer/lobe.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "sample_stream.hpp"

namespace mirrorbake {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

// Trowbridge and Reitz: D = α² / (π (1 + (α² − 1) cos²θ)²), with sin²θ from x and y, which keeps its digits
// near the peak.
float ggx_distribution(float alpha, glm::vec3 h) {
  const float a2 = alpha * alpha;
  const float t = h.x * h.x + h.y * h.y + a2 * h.z * h.z;
  return t > 0.0F ? a2 / (kPi * t * t) : 0.0F;
}

// 1 + Λ is (1 + root)/2, root = √(1 + α² tan²θ): here root times cosθ.
float scaled_root(float alpha, glm::vec3 v) {
  return std::sqrt(v.z * v.z + alpha * alpha * (v.x * v.x + v.y * v.y));
}

glm::vec3 half_vector(glm::vec3 view, glm::vec3 light) {
  const glm::vec3 sum = view + light;
  const float length = glm::length(sum);
  return length > 0.0F ? sum / length : glm::vec3(0.0F, 0.0F, 1.0F);
}

glm::vec3 mirrored(glm::vec3 view) { return {-view.x, -view.y, view.z}; }

float phong_density(float exponent, glm::vec3 view, glm::vec3 light) {
  // log(r·l) from the distance of the two, which keeps its digits where they nearly agree.
  const glm::vec3 difference = light - mirrored(view);
  const double below_one = 0.5 * glm::dot(glm::dvec3(difference), glm::dvec3(difference));
  if (below_one >= 1.0) return 0.0F;
  const double power = std::exp(static_cast<double>(exponent) * std::log1p(-below_one));
  return static_cast<float>((static_cast<double>(exponent) + 1.0) / (2.0 * std::numbers::pi) * power);
}

}  // namespace

float lobe_response(const LobeShape& shape, glm::vec3 view, glm::vec3 light) {
  if (!(view.z > 0.0F) || !(light.z > 0.0F)) return 0.0F;
  if (shape.lobe == SpecularLobe::phong) return phong_density(shape.exponent, view, light);
  // D G₁(v) G₁(l) / (4 cosθv cosθl) · cosθl, with G₁ = 2 cosθ/(cosθ + root).
  const float denominator =
      (view.z + scaled_root(shape.roughness, view)) * (light.z + scaled_root(shape.roughness, light));
  return ggx_distribution(shape.roughness, half_vector(view, light)) * light.z / denominator;
}

float lobe_density(const LobeShape& shape, glm::vec3 view, glm::vec3 light) {
  if (!(view.z > 0.0F)) return 0.0F;
  if (shape.lobe == SpecularLobe::phong) return phong_density(shape.exponent, view, light);
  const glm::vec3 h = half_vector(view, light);
  if (!(h.z > 0.0F) || !(glm::dot(h, view) > 0.0F)) return 0.0F;
  // G₁ D (v·h) / cosθv per normal, over 4 (v·h) per direction: G₁/cosθv = 2/(cosθv + root).
  return ggx_distribution(shape.roughness, h) / (2.0F * (view.z + scaled_root(shape.roughness, view)));
}

glm::vec3 sample_lobe(const LobeShape& shape, glm::vec3 view, glm::vec2 u) {
  if (shape.lobe == SpecularLobe::phong) {
    const glm::vec3 r = mirrored(view);
    // cos^(N+1) is uniform.
    const double log_cosine =
        std::log1p(-static_cast<double>(u.x)) / (static_cast<double>(shape.exponent) + 1.0);
    const auto cosine = static_cast<float>(std::exp(log_cosine));
    const auto sine = static_cast<float>(std::sqrt(-std::expm1(2.0 * log_cosine)));
    const float phi = 2.0F * kPi * u.y;
    return glm::normalize(tracing::Frame(r).to_world({sine * std::cos(phi), sine * std::sin(phi), cosine}));
  }
  // Heitz 2018, appendix A: stretch the view, sample the projected half disk, unstretch.
  const float alpha = shape.roughness;
  const glm::vec3 stretched = glm::normalize(glm::vec3(alpha * view.x, alpha * view.y, view.z));
  const float length = std::sqrt(stretched.x * stretched.x + stretched.y * stretched.y);
  const glm::vec3 t1 =
      length > 0.0F ? glm::vec3(-stretched.y, stretched.x, 0.0F) / length : glm::vec3(1.0F, 0.0F, 0.0F);
  const glm::vec3 t2 = glm::cross(stretched, t1);
  const float radius = std::sqrt(u.x);
  const float phi = 2.0F * kPi * u.y;
  const float p1 = radius * std::cos(phi);
  const float s = 0.5F * (1.0F + stretched.z);
  const float rim = std::sqrt(std::max(0.0F, 1.0F - p1 * p1));
  const float p2 = (1.0F - s) * rim + s * radius * std::sin(phi);
  const glm::vec3 n = p1 * t1 + p2 * t2 + std::sqrt(std::max(0.0F, 1.0F - p1 * p1 - p2 * p2)) * stretched;
  const glm::vec3 h = glm::normalize(glm::vec3(alpha * n.x, alpha * n.y, std::max(1e-6F, n.z)));
  return glm::normalize(2.0F * glm::dot(view, h) * h - view);
}

float lobe_fresnel_cosine(const LobeShape& shape, glm::vec3 view, glm::vec3 light) {
  if (shape.lobe == SpecularLobe::phong) return view.z;
  return std::clamp(glm::dot(half_vector(view, light), view), 0.0F, 1.0F);
}

}  // namespace mirrorbake
