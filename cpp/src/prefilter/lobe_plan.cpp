#include "lobe_plan.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mirrorbake/core/isa.hpp"

namespace mirrorbake {
namespace {

// Nodes as wide as this share of the scale on which the lobe changes: with the moments that they carry, what
// is left out is of the third order, and cancels where light is spread evenly.
constexpr double kShare = 0.5;
constexpr double kPhongShare = 0.6;  // whose derivatives fall off as fast as the lobe
constexpr double kWidest = 0.2;      // radians, of lobes that are as wide as a hemisphere
// Nodes that may be all that a lobe sees are as much narrower, for an error that is this to the third
// smaller.
constexpr double kBright = 2.5;
// Where a lobe has a corner, nodes that lie across it.
constexpr float kAtHorizon = 0.055F;
constexpr float kBrightAtHorizon = 0.004F;
// Weights are left out below this share of the lobe's integral: a sun of 1e5 times the surroundings, 6e-5 sr
// wide, adds less than 3e-5 of what they add.
constexpr double kNegligible = 4e-6;
constexpr std::size_t kTableSteps = 8192;

double angle_of(double chord) { return 2.0 * std::asin(std::min(1.0, 0.5 * chord)); }

double phong_cut(double exponent) {
  const double weight = kNegligible * 2.0 * std::numbers::pi / (exponent + 1.0);
  const double cosine = std::pow(weight, 1.0 / exponent);
  return std::sqrt(2.0 * (1.0 - cosine));
}

// How much wider nodes may be at so many σ from the axis, where Phong's weight is about exp(−σ²/2): what is
// left out of it is that times σ³ and the width to the third, and no more than next to the axis.
double phong_growth(double sigmas) {
  if (sigmas < 2.0) return 1.0;
  const double left = std::exp(-0.5 * sigmas * sigmas) * sigmas * sigmas * sigmas;
  return std::clamp(std::cbrt(1.1 / left), 1.0, 4.0);
}

void plan_table(const Lobe& lobe, LobePlan& plan) {
  plan.table.resize(4 * (kTableSteps + 1));
  double peak = 0.0;
  for (std::size_t i = 0; i <= kTableSteps; ++i) {
    const LobeDerivatives d = lobe_derivatives(lobe, static_cast<double>(i) / kTableSteps);
    plan.table[4 * i] = static_cast<float>(d.weight);
    plan.table[4 * i + 1] = static_cast<float>(d.first);
    plan.table[4 * i + 2] = static_cast<float>(d.second);
    peak = std::max(peak, d.weight);
  }
  plan.terms = {LobeForm::table,
                1.0F,
                1.0F,
                plan.table.data(),
                static_cast<float>(kTableSteps),
                static_cast<int>(kTableSteps) - 1};
  plan.cut = 2.0 * std::sin(0.5 * lobe.table_angle * std::numbers::pi / 180.0);
  // The lobe changes on the scale √(weight / |second derivative by γ|); where it is small, on that of its
  // peak.
  std::array<double, LobePlan::kSteps + 1> scale{};
  double first_moment = 0.0;
  double mass = 0.0;
  for (std::size_t i = 0; i <= LobePlan::kSteps; ++i) {
    double least = 1.0;
    for (int k = 0; k < 8; ++k) {
      const double s = std::min(1.0, (static_cast<double>(i) + k / 8.0) / LobePlan::kSteps);
      const LobeDerivatives d = lobe_derivatives(lobe, s);
      const double sine = 2.0 * s * std::sqrt(1.0 - s * s);
      const double bend = std::abs(d.second * sine * sine - d.first * (1.0 - 2.0 * s * s));
      least = std::min(least, std::sqrt(std::max(d.weight, 1e-3 * peak) / std::max(bend, 1e-30)));
      first_moment += d.weight * s * s * s;
      mass += d.weight * s;
    }
    scale[i] = std::max(least, 0.004);
  }
  plan.width = std::max(0.004, std::sqrt(2.0 * first_moment / mass));
  for (std::size_t i = 0; i <= LobePlan::kSteps; ++i) {
    // A node beyond `i` may begin up to its own width before it.
    double least = scale[i];
    for (std::size_t k = i > 4 ? i - 4 : 0; k <= std::min(LobePlan::kSteps, i + 4); ++k) {
      least = std::min(least, scale[k]);
    }
    plan.allowed[i] = static_cast<float>(std::min(kWidest, kShare * least));
    plan.allowed_bright[i] = plan.allowed[i] / static_cast<float>(kBright);
  }
}

}  // namespace

double LobePlan::finest() const {
  float least = allowed[0];
  for (std::size_t i = 0; i <= kSteps && 2.0 * static_cast<double>(i) / kSteps <= cut; ++i) {
    least = std::min(least, allowed[i]);
  }
  if (cut >= std::numbers::sqrt2) least = std::min(least, at_horizon);
  return static_cast<double>(least);
}

void make_plan(const Lobe& lobe, LobePlan& plan) {
  plan = {};
  switch (lobe.kind) {
    case LobeKind::lambert:
      plan.cut = std::numbers::sqrt2;
      plan.at_horizon = kAtHorizon;
      plan.bright_at_horizon = kBrightAtHorizon;
      plan.allowed.fill(static_cast<float>(kWidest));
      plan.terms = {LobeForm::phong, 1.0F};
      return;
    case LobeKind::phong:
      plan.width = 1.0 / std::sqrt(lobe.exponent);
      plan.cut = phong_cut(lobe.exponent);
      if (lobe.exponent < 6.0) {
        plan.at_horizon = kAtHorizon;
        plan.bright_at_horizon = kBrightAtHorizon;
      }
      for (std::size_t i = 0; i <= LobePlan::kSteps; ++i) {
        const double sigmas = angle_of(2.0 * static_cast<double>(i) / LobePlan::kSteps) / plan.width;
        plan.allowed[i] =
            static_cast<float>(std::min(kWidest, kPhongShare * plan.width * phong_growth(sigmas)));
        plan.allowed_bright[i] = static_cast<float>(std::min(kWidest, kPhongShare * plan.width) / kBright);
      }
      plan.terms = {LobeForm::phong, static_cast<float>(lobe.exponent)};
      return;
    case LobeKind::ggx: {
      // The weight falls like (1 + (γ/2α)²)⁻²: on the scale 2α at the peak, and half the angle far from it.
      const double core = 2.0 * lobe.alpha;
      plan.width = core / 1.5;
      plan.cut = std::numbers::sqrt2;
      if (lobe.alpha > 0.15) plan.at_horizon = kAtHorizon;
      plan.bright_at_horizon = kBrightAtHorizon;
      for (std::size_t i = 0; i <= LobePlan::kSteps; ++i) {
        const double angle = angle_of(2.0 * static_cast<double>(i) / LobePlan::kSteps);
        plan.allowed[i] =
            static_cast<float>(std::min(kWidest, 0.5 * kShare * std::sqrt(core * core + angle * angle)));
        plan.allowed_bright[i] = plan.allowed[i] / static_cast<float>(kBright);
      }
      plan.terms = {LobeForm::ggx, 1.0F, static_cast<float>(lobe.alpha * lobe.alpha)};
      return;
    }
    case LobeKind::table: plan_table(lobe, plan); return;
  }
}

AccumulateLoop accumulate_loop() {
#ifdef MIRRORBAKE_HAS_X86_LEVELS
  switch (active_isa()) {
    case Isa::avx512: return avx512::kAccumulate;
    case Isa::avx2: return avx2::kAccumulate;
    case Isa::sse42: return sse42::kAccumulate;
    case Isa::baseline: break;
  }
#endif
  return baseline::kAccumulate;
}

CosineLoop cosine_loop() {
#ifdef MIRRORBAKE_HAS_X86_LEVELS
  switch (active_isa()) {
    case Isa::avx512: return avx512::kCosines;
    case Isa::avx2: return avx2::kCosines;
    case Isa::sse42: return sse42::kCosines;
    case Isa::baseline: break;
  }
#endif
  return baseline::kCosines;
}

}  // namespace mirrorbake
