#pragma once

#include <cstddef>
#include <vector>

#include <glm/vec3.hpp>

#include "mirrorbake/envmap/envmap.hpp"

/// The texels of a map as lights: where they are, and how much of the sphere they cover.
namespace mirrorbake {

/// Every texel may be taken in parts × parts pieces, as if the map had been enlarged without interpolation.
class SourceTexels {
 public:
  SourceTexels(const EnvMapLayout& layout, int parts);

  int parts() const { return parts_; }
  int width() const { return width_; }    ///< of a face, in pieces
  int height() const { return height_; }  ///< of a face, in pieces
  /// Unit direction of the middle of a piece.
  glm::dvec3 direction(int face, int row, int column) const;
  /// Steradians; 0 outside of the disc of round maps.
  double solid_angle(int row, int column) const {
    return is_panorama_ ? angles_[static_cast<std::size_t>(row)]
                        : angles_[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
                                  static_cast<std::size_t>(column)];
  }

 private:
  Projection projection_;
  int parts_;
  int width_;
  int height_;
  bool is_panorama_;
  std::vector<double> angles_;
  std::vector<double> sines_;  ///< of the longitudes and then of the latitudes, of a latlong
  std::vector<double> cosines_;
};

/// About how wide a texel is where it is widest, in radians.
double texel_width(const EnvMapLayout& layout);

/// Into how many parts along each side texels are to be cut so that sums over them, with weights of a
/// Gaussian of this width, are integrals to 1e-5: none while σ is 0.8 of a texel (the first alias is 2
/// exp(−2π²σ²)).
int parts_for_width(const EnvMapLayout& layout, double sigma);

}  // namespace mirrorbake
