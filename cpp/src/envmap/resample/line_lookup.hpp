#pragma once

#include <cstdint>
#include <vector>

#include "resample_job.hpp"

namespace mirrorbake {

/// Positions of many points of the target in the source, in texels of a face; face −1 where the source has no
/// such direction.
struct Positions {
  std::vector<double> x;
  std::vector<double> y;
  std::vector<std::int32_t> face;

  void resize(std::size_t count) {
    x.resize(count);
    y.resize(count);
    face.resize(count);
  }
  PositionArrays from(std::size_t i) { return {x.data() + i, y.data() + i, face.data() + i}; }
};

/// The vectorised loop for a projection; null where there is none.
PositionLoop position_loop(ProjectionKind kind);

/// The x of points along a line of the target, and what their directions are made of.
struct LineTables {
  LineTables(const Projection& target, std::vector<double> x);

  std::vector<double> x, u, v;
};

/// Directions of points along lines of the target, and where they lie in the source. On cubes, panoramas and
/// paraboloids a line of constant y is p + u(x) q + v(x) r, with tables of u and v.
class LineLookup {
 public:
  LineLookup(const ResampleJob& job, const LineTables& tables);

  /// Positions of the points from number `first` on at height y of a face, from result[offset] on.
  void find(int face, double y, int first, std::size_t count, Positions& result, std::size_t offset);

 private:
  void set_directions(int face, double y, std::size_t first, std::size_t count);
  void turn(std::size_t count);

  const ResampleJob& job_;
  const LineTables& tables_;
  const PositionLoop find_positions_;  // may be null
  std::vector<double> dx_, dy_, dz_;
};

/// The sides of texels (one more than texels) or their centres, from −1 to 1.
std::vector<double> side_coordinates(int texels);
std::vector<double> center_coordinates(int texels);

}  // namespace mirrorbake
