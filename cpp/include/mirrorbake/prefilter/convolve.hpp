#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string_view>

#include "mirrorbake/core/enum_names.hpp"
#include "mirrorbake/envmap/envmap.hpp"
#include "mirrorbake/prefilter/lobe.hpp"

/// Maps of the light that a lobe gathers, by the direction of its axis (spec B1–B3).
namespace mirrorbake {

/// `mean`: Σ weight Ω L / Σ weight Ω over the texels, which keeps white white. `sum`: Σ weight Ω L, as [AEM]
/// eq. 7 has it with k_s = 1; of a mirror, whose weights sum to nothing, it is an error.
enum class LobeScale { mean, sum };

template <>
struct EnumNames<LobeScale> {
  static constexpr std::string_view what = "scale";
  static constexpr auto names = enum_names("mean", "sum");
};

/// What there is to make. Values are those at the middles of the texels.
struct PrefilterTarget {
  Projection projection{ProjectionKind::cube};
  int width = 128;
  int height = 128;
};

/// Convolves one map with any number of lobes, and keeps what it has found out about it.
///
/// The texels of the source are lights at their middles, of their exact solid angle; those wider than 1.25 σ
/// of the lobe are cut into parts. Nothing is thrown away but weights below 4e-6 of the lobe's integral.
/// Cosine lobes (irradiance, Phong with exponent 1, GGX with α = 1) are exact but for rounding: light before
/// the horizon is summed by first moments, and along it texel by texel. Narrow lobes are summed texel by
/// texel, too. All others read the moments of cells, each expanded about where most of its light comes from,
/// so that a sun counts from where it stands; cells are as large as the lobe allows at their distance from
/// its axis. What a fisheye does not cover has no light and no weight. Same bits for any number of threads
/// and every instruction set.
class Convolver {
 public:
  /// Of the finest level; refers to the map's values, which have to stay. Throws InvalidArgument for a map
  /// that is not valid, and for NaN and infinite values, with their number.
  explicit Convolver(const EnvMapView& map);
  ~Convolver();
  Convolver(Convolver&&) noexcept;
  Convolver& operator=(Convolver&&) noexcept;

  /// Throws InvalidArgument for a lobe or a target that is not valid. `progress` is called with the share of
  /// the texels that are done, rising to 1, by the thread that called.
  EnvMap apply(const Lobe& lobe, const PrefilterTarget& target, LobeScale scale = LobeScale::mean,
               const std::function<void(double done)>& progress = {});

  /// At unit directions: directions.size() × channels values.
  void apply(const Lobe& lobe, std::span<const glm::vec3> directions, LobeScale scale,
             std::span<float> values);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Irradiance: ∫ max(0, n·l) L dω by n, π for a white map. As an environment map of radiance reflected by a
/// white surface it is divided by π ([AEM] eq. 4).
EnvMap irradiance(const EnvMapView& map, const PrefilterTarget& target);

/// How roughness runs over the levels of a chain. `squared`: α = (level / last)², since renderers look levels
/// up by perceptual roughness. `linear`: α = level / last.
enum class RoughnessScale { squared, linear };

template <>
struct EnumNames<RoughnessScale> {
  static constexpr std::string_view what = "roughness";
  static constexpr auto names = enum_names("squared", "linear");
};

struct ChainOptions {
  int size = 256;  ///< of the faces of the cube
  int levels = 0;  ///< 0: down to 4 × 4 texels, at least one
  RoughnessScale roughness = RoughnessScale::squared;
  std::function<void(int level, int levels)> progress = {};  ///< after every level
};

/// α of a level: 0 of the first, then at least 0.01.
double chain_alpha(int level, int levels, RoughnessScale roughness);

/// A cube whose levels are prefiltered with GGX of rising α, from the map itself to α = 1, as Filament,
/// three.js, Unreal and Unity expect. Throws InvalidArgument.
EnvMap ggx_chain(const EnvMapView& map, const ChainOptions& options = {});

}  // namespace mirrorbake
