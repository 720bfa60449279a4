// Compiled once per instruction set (mirrorbake_add_isa_sources): MIRRORBAKE_ISA names the level.
#include "lobe_kernels.hpp"

namespace mirrorbake::MIRRORBAKE_ISA {
namespace {

// Of x in (0, 2]: the mantissa in [√½, √2) by the series of atanh, absolute error 1e-7.
inline float log2_of(float x) {
  const std::int32_t bits = __builtin_bit_cast(std::int32_t, x);
  const std::int32_t exponent = (bits - 0x3f3504f3) >> 23;
  const float m = __builtin_bit_cast(float, bits - exponent * (1 << 23));
  const float s = (m - 1.0F) / (m + 1.0F);
  const float z = s * s;
  const float series = s * (1.0F + z * (1.0F / 3.0F + z * (1.0F / 5.0F + z * (1.0F / 7.0F + z / 9.0F))));
  return static_cast<float>(exponent) + 2.885390081777927F * series;
}

// Of x ≤ 0.5, relative error 2e-7; what is below −60 counts as −60, 1e-18, which is nothing beside the peak
// and keeps products of it normal.
inline float exp2_of(float x) {
  const float y = x < -60.0F ? -60.0F : x;
  const std::int32_t whole = static_cast<std::int32_t>(y - 0.5F);
  const float f = (y - static_cast<float>(whole)) * 0.6931471805599453F;
  const float series =
      1.0F + f * (1.0F + f * (0.5F + f * (1.0F / 6.0F +
                                          f * (1.0F / 24.0F + f * (1.0F / 120.0F + f * (1.0F / 720.0F))))));
  return series * __builtin_bit_cast(float, (whole + 127) * (1 << 23));
}

struct Weights {
  float value;
  float first;
  float second;
};

struct Phong {
  float exponent;
  explicit Phong(const LobeTerms& terms) : exponent(terms.exponent) {}
  Weights operator()(float h) const {
    const float c = 1.0F - 2.0F * h;
    const float safe = c > 1e-6F ? c : 1e-6F;
    const float before = c > 0.0F ? 1.0F : 0.0F;  // the horizon
    const float inverse = 1.0F / safe;
    const float weight = before * exp2_of(exponent * log2_of(safe));
    const float first = exponent * weight * inverse;
    return {weight, first, (exponent - 1.0F) * first * inverse};
  }
};

struct Ggx {
  float a;
  explicit Ggx(const LobeTerms& terms) : a(terms.alpha_squared) {}
  Weights operator()(float h) const {
    const float c = 1.0F - 2.0F * h;
    const float inverse = 1.0F / (a + (1.0F - a) * h);
    const float root = a * inverse;
    const float d = c > 0.0F ? root * root : 0.0F;
    const float slope = 0.5F * (1.0F - a) * inverse;
    const float d1 = 2.0F * slope * d;
    const float d2 = 3.0F * slope * d1;
    return {c * d, d + c * d1, 2.0F * d1 + c * d2};
  }
};

struct Table {
  const float* values;
  float scale;
  int last;
  explicit Table(const LobeTerms& terms)
      : values(terms.table), scale(terms.table_scale), last(terms.table_last) {}
  Weights operator()(float h) const {
    const float position = __builtin_sqrtf(h) * scale;
    const int whole = static_cast<int>(position);
    const int i = whole < last ? whole : last;
    const float t = position - static_cast<float>(i);
    const float share = t < 1.0F ? t : 1.0F;
    const float* p = values + 4 * i;
    return {p[0] + share * (p[4] - p[0]), p[1] + share * (p[5] - p[1]), p[2] + share * (p[6] - p[2])};
  }
};

// Sums of so many nodes are taken in float, and those sums in double.
constexpr std::size_t kNodesInFloat = 64;

template <typename Kernel>
void accumulate_with(const MomentNode* nodes, const std::uint32_t* list, std::size_t count, const float* x,
                     const float* y, const float* z, const LobeTerms& terms, double* sums) {
  const Kernel kernel(terms);
  for (std::size_t begin = 0; begin < count; begin += kNodesInFloat) {
    const std::size_t end = begin + kNodesInFloat < count ? begin + kNodesInFloat : count;
    float part[4][kOutputs] = {};
    for (std::size_t i = begin; i < end; ++i) {
      const MomentNode& node = nodes[list[i]];
      for (std::size_t k = 0; k < kOutputs; ++k) {
        const float dx = x[k] - node.direction[0];
        const float dy = y[k] - node.direction[1];
        const float dz = z[k] - node.direction[2];
        float h = 0.25F * (dx * dx + dy * dy + dz * dz);
        h = h < 1.0F ? h : 1.0F;
        const Weights w = kernel(h);
        const float u = dx * node.tangent[0][0] + dy * node.tangent[0][1] + dz * node.tangent[0][2];
        const float v = dx * node.tangent[1][0] + dy * node.tangent[1][1] + dz * node.tangent[1][2];
        // The sphere falls away from its tangents by (u² + v²)/2, along l₀.
        const float fall = w.first * (1.0F - 2.0F * h);
        const float along_u = w.second * u;
        const float uu = along_u * u - fall;
        const float vv = w.second * v * v - fall;
        const float uv = 2.0F * along_u * v;
        const float first_u = w.first * u;
        const float first_v = w.first * v;
        for (std::size_t c = 0; c < 4; ++c) {
          part[c][k] +=
              (w.value * node.light[c] + (first_u * node.shift[0][c] + first_v * node.shift[1][c])) +
              (uu * node.spread[0][c] + vv * node.spread[1][c] + uv * node.spread[2][c]);
        }
      }
    }
    for (std::size_t c = 0; c < 4; ++c) {
      for (std::size_t k = 0; k < kOutputs; ++k) {
        sums[c * kOutputs + k] += static_cast<double>(part[c][k]);
      }
    }
  }
}

void accumulate(const MomentNode* nodes, const std::uint32_t* list, std::size_t count, const float* x,
                const float* y, const float* z, const LobeTerms& terms, double* sums) {
  switch (terms.form) {
    case LobeForm::phong: return accumulate_with<Phong>(nodes, list, count, x, y, z, terms, sums);
    case LobeForm::ggx: return accumulate_with<Ggx>(nodes, list, count, x, y, z, terms, sums);
    case LobeForm::table: return accumulate_with<Table>(nodes, list, count, x, y, z, terms, sums);
  }
}

// Leaves whose sums are taken in float, lane by lane, before they are added in double.
constexpr std::size_t kLeavesInFloat = 16;

void sum_cosines(const LightLeaf* leaves, const std::uint32_t* list, std::size_t count, const float* r,
                 double* sums) {
  for (std::size_t begin = 0; begin < count; begin += kLeavesInFloat) {
    const std::size_t end = begin + kLeavesInFloat < count ? begin + kLeavesInFloat : count;
    float part[4][kLeafTexels] = {};
    for (std::size_t i = begin; i < end; ++i) {
      const LightLeaf& leaf = leaves[list[i]];
      for (std::size_t t = 0; t < kLeafTexels; ++t) {
        const float along =
            r[0] * leaf.direction[0][t] + r[1] * leaf.direction[1][t] + r[2] * leaf.direction[2][t];
        const float cosine = along > 0.0F ? along : 0.0F;
        for (std::size_t c = 0; c < 4; ++c) part[c][t] += cosine * leaf.light[c][t];
      }
    }
    for (std::size_t c = 0; c < 4; ++c) {
      for (std::size_t t = 0; t < kLeafTexels; ++t) sums[c] += static_cast<double>(part[c][t]);
    }
  }
}

}  // namespace

extern const AccumulateLoop kAccumulate;
const AccumulateLoop kAccumulate = &accumulate;
extern const CosineLoop kCosines;
const CosineLoop kCosines = &sum_cosines;

}  // namespace mirrorbake::MIRRORBAKE_ISA
