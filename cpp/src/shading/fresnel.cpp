#include "mirrorbake/shading/fresnel.hpp"

#include <algorithm>
#include <cmath>

namespace mirrorbake {

float fresnel_schlick(float c, float r0) {
  const float m = 1.0F - std::clamp(c, 0.0F, 1.0F);
  const float m2 = m * m;
  return r0 + (1.0F - r0) * (m2 * m2 * m);
}

// [EMT] eq. 13 without its cancellation: with k = (n−1)(n+1), g = √(k + c²), s = g + c, d = g − c = k/s it reads
// F = ½ (d/s)² [1 + ((c s − 1)/(c d + 1))²]. In double, since k + c² loses its digits near the critical angle.
float fresnel_dielectric(float c_in, float ior) {
  const double c = std::clamp(static_cast<double>(c_in), 0.0, 1.0);
  const double n = ior;
  const double k = (n - 1.0) * (n + 1.0);
  const double g2 = k + c * c;
  if (g2 < 0.0) return 1.0F;
  const double s = std::sqrt(g2) + c;
  if (s == 0.0) return 0.0F;  // n = 1, c = 0: there is no interface
  const double d = k / s;
  const double ratio = d / s;
  const double p = (c * s - 1.0) / (c * d + 1.0);
  return static_cast<float>(std::clamp(0.5 * ratio * ratio * (1.0 + p * p), 0.0, 1.0));
}

// Exact equations for an absorbing medium, as in Born & Wolf §14.2: a² + b² = |η² − sin²θ|.
float fresnel_conductor(float c_in, float eta, float k_in) {
  const double c = std::clamp(static_cast<double>(c_in), 0.0, 1.0);
  const double n = eta;
  const double k = k_in;
  const double c2 = c * c;
  const double s2 = 1.0 - c2;
  const double t0 = (n - k) * (n + k) - s2;
  const double ab = std::hypot(t0, 2.0 * n * k);
  const double a = std::sqrt(std::max(0.0, 0.5 * (ab + t0)));
  const double rs_numerator = ab + c2 - 2.0 * a * c;
  const double rs_denominator = ab + c2 + 2.0 * a * c;
  if (rs_denominator == 0.0) return 1.0F;
  const double rs = rs_numerator / rs_denominator;
  const double rp = rs * (ab * c2 + s2 * s2 - 2.0 * a * c * s2) / (ab * c2 + s2 * s2 + 2.0 * a * c * s2);
  return static_cast<float>(std::clamp(0.5 * (rs + rp), 0.0, 1.0));
}

glm::vec3 evaluate(const Fresnel& fresnel, float c) {
  glm::vec3 f(0.0F);
  for (int i = 0; i < 3; ++i) {
    switch (fresnel.model) {
      case FresnelModel::constant: f[i] = fresnel.r0[i]; break;
      case FresnelModel::schlick: f[i] = fresnel_schlick(c, fresnel.r0[i]); break;
      case FresnelModel::dielectric: f[i] = fresnel_dielectric(c, fresnel.eta[i]); break;
      case FresnelModel::conductor: f[i] = fresnel_conductor(c, fresnel.eta[i], fresnel.k[i]); break;
    }
  }
  return f;
}

}  // namespace mirrorbake
