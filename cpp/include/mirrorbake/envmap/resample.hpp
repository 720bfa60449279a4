#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string_view>

#include <glm/mat3x3.hpp>

#include "mirrorbake/core/enum_names.hpp"
#include "mirrorbake/envmap/envmap.hpp"

/// From any projection to any other (spec P7).
namespace mirrorbake {

/// How a texel of the new map is made from those of the old one. `area`: the mean over the texel's area on
/// the sphere of the source, whose texels are areas of constant radiance: exact for straight texel edges, and
/// it conserves flux (first-order conservative remapping; Jones, Monthly Weather Review 127, 1999).
/// `bilinear`: interpolation at the centre of the texel. `nearest`: the texel that its centre lies in.
/// `automatic`: `area` where a texel covers at least one of the source; the mean of bilinear interpolation
/// over its area where it is at most three quarters as long (as wide, of long ones around a pole); and a
/// blend in between. It conserves flux, too, but for what the change from one to the other moves.
enum class ResampleFilter { automatic, area, bilinear, nearest };

template <>
struct EnumNames<ResampleFilter> {
  static constexpr std::string_view what = "filter";
  static constexpr auto names = enum_names("automatic", "area", "bilinear", "nearest");
};

struct ResampleOptions {
  ResampleFilter filter = ResampleFilter::automatic;
  glm::mat3 source_from_target{1.0F};  ///< rotation or reflection of directions, orthonormal to 1e-4
};

/// The finest level of `source` in another projection and size, as a map of one level. What the source does
/// not cover (a fisheye of less than 360°) is 0. Texels of round maps outside of the unit disc hold what lies
/// beyond the rim, in angular maps and fisheyes interpolated from two texels on. Same bits on any number of
/// threads. Throws InvalidArgument for layouts or matrices that are not valid, or of more than 2³² − 1
/// texels.
EnvMap resample(const EnvMapView& source, const Projection& target, int width, int height,
                const ResampleOptions& options = {});

/// resample() for many maps of one layout, such as the frames of a film: finds once what every texel of the
/// target is made from, which is most of the work, and keeps it. Gives the same bits as resample().
class Resampler {
 public:
  /// `source`: the projection and size of the maps to come, of any number of channels. Keeps at most
  /// `max_bytes`; what does not fit into them is found again every time. 5 bytes for each texel of the source
  /// that a texel of the target reads are typical, divided by the symmetries that both maps share: 16 between
  /// a panorama and a cube, 1 if they are turned against each other. Throws as resample().
  Resampler(const EnvMapLayout& source, const Projection& target, int width, int height,
            const ResampleOptions& options = {}, std::size_t max_bytes = std::size_t{1} << 30);
  ~Resampler();
  Resampler(Resampler&&) noexcept;
  Resampler& operator=(Resampler&&) noexcept;

  /// Throws InvalidArgument if the map's projection or size is another than what the resampler was made for.
  EnvMap apply(const EnvMapView& source) const;
  /// Into all values of a map of layout(channels). Throws InvalidArgument if `result` has another size, too.
  void apply(const EnvMapView& source, std::span<float> result) const;

  /// Of what apply() makes from maps of so many channels.
  EnvMapLayout layout(int channels) const;
  std::size_t bytes() const;  ///< of what is kept

 private:
  struct Plan;
  std::unique_ptr<Plan> plan_;
};

}  // namespace mirrorbake
