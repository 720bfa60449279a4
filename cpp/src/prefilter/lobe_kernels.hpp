#pragma once

#include <cstddef>
#include <cstdint>

/// The inner loops of convolution, one set per instruction set (mirrorbake_add_isa_sources).
namespace mirrorbake {

/// Light of a part of the sphere, in up to three channels, and in the fourth the solid angle itself, by its
/// moments up to the second about l₀, the unit vector to where most of the light comes from. With u and v
/// what lies of l − l₀ along the two tangents: Σ w L, Σ w L (u, v), and half of Σ w L (u², v², uv).
struct MomentNode {
  float direction[3];
  float bound;  ///< how far its texels may be from `direction`, as a chord; below 0: it has none
  float tangent[2][3];
  float light[4];
  float shift[2][4];
  float spread[3][4];
};

constexpr std::size_t kOutputs = 16;  ///< directions that are worked on together

enum class LobeForm { phong, ggx, table };

/// A lobe as the loops evaluate it: by h = (1 − cos γ)/2 = sin²(γ/2).
struct LobeTerms {
  LobeForm form = LobeForm::phong;
  float exponent = 1.0F;
  float alpha_squared = 1.0F;
  const float* table = nullptr;  ///< weight and both derivatives at equal steps of sin(γ/2), 4 floats each
  float table_scale = 1.0F;      ///< steps per unit of sin(γ/2)
  int table_last = 0;            ///< number of the last step that has another one after it
};

/// sums[4 · kOutputs] += Σ over the listed nodes, for each of kOutputs unit directions.
using AccumulateLoop = void (*)(const MomentNode* nodes, const std::uint32_t* list, std::size_t count,
                                const float* x, const float* y, const float* z, const LobeTerms& terms,
                                double* sums);

AccumulateLoop accumulate_loop();

constexpr std::size_t kLeafTexels = 16;

/// Texels as lights, read one after the other in loops. Those that do not exist have no light.
struct LightLeaf {
  float direction[3][kLeafTexels];
  float light[4][kLeafTexels];  ///< Ω L in up to three channels, and Ω
};

/// sums[4] += Σ light · max(0, r·l) over the texels of the listed leaves.
using CosineLoop = void (*)(const LightLeaf* leaves, const std::uint32_t* list, std::size_t count,
                            const float* r, double* sums);

CosineLoop cosine_loop();

namespace baseline {
extern const AccumulateLoop kAccumulate;
extern const CosineLoop kCosines;
}  // namespace baseline
namespace sse42 {
extern const AccumulateLoop kAccumulate;
extern const CosineLoop kCosines;
}  // namespace sse42
namespace avx2 {
extern const AccumulateLoop kAccumulate;
extern const CosineLoop kCosines;
}  // namespace avx2
namespace avx512 {
extern const AccumulateLoop kAccumulate;
extern const CosineLoop kCosines;
}  // namespace avx512

}  // namespace mirrorbake
