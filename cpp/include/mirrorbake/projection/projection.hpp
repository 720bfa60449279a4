#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mirrorbake/projection/map_point.hpp"

/// All projections behind one interface (spec P1–P6, P8). Computed in double; the batch functions read and
/// write float32.
namespace mirrorbake {

/// In the order of the list in cpp/src/projection/all_projections.hpp.
enum class ProjectionKind { cube, dual_paraboloid, sphere_map, latlong, angular, fisheye, equal_area };

struct Projection {
  ProjectionKind kind = ProjectionKind::latlong;
  float field_of_view = 180.0F;  ///< degrees, of `fisheye` only: (0, 360]

  bool operator==(const Projection&) const = default;
};

/// The name of a projection, "fisheye:DEGREES" for a field of view of its own. Throws InvalidArgument.
Projection parse_projection(std::string_view text);
std::string to_string(const Projection& projection);

/// All names, separated by commas, for help and for errors.
std::string projection_names();

/// Throws InvalidArgument for a field of view outside (0, 360] degrees.
void validate(const Projection& projection);

int face_count(const Projection& projection);

/// Whether columns are longitudes, as of latlong and equal_area: the left side goes on at the right one, and
/// the texels of a row are alike.
bool is_panorama(ProjectionKind kind);

/// Width over height that makes texels roughly square: 2 for panoramas, 1 otherwise.
int natural_aspect(const Projection& projection);

MapPoint point_from_direction(const Projection& projection, glm::dvec3 direction);

/// Position of a usable direction in the plane of a given face, which may lie outside of the face, so that
/// what straddles an edge can be followed beyond it. Cube: behind the face there is none. Fisheye: not
/// clamped to the rim.
std::optional<glm::dvec2> point_on_face(const Projection& projection, int face, glm::dvec3 direction);

/// Unit direction. (x, y) may lie outside of the face, see the single projections. `face` must exist.
glm::dvec3 direction_from_point(const Projection& projection, int face, double x, double y);

MapJacobian map_jacobian(const Projection& projection, int face, double x, double y);

/// Solid angle per unit of area of (x, y), |∂d/∂x × ∂d/∂y|, in steradians. A face has an area of 4, of which
/// round maps use the unit disc.
double solid_angle_density(const Projection& projection, int face, double x, double y);

/// Solid angle in steradians of a texel of a face of width × height texels, the part within the domain of the
/// face (the unit disc for round maps): all faces together have 4π, a fisheye 2π(1 − cos(½ field of view)).
/// Exact to a relative 1e-12; texels cut by the rim to an absolute 1e-14. Faces are alike.
double texel_solid_angle(const Projection& projection, int width, int height, int column, int row);

/// The solid angles of all texels of one face, height × width. Throws InvalidArgument for sizes outside
/// 1…65536.
std::vector<double> texel_solid_angles(const Projection& projection, int width, int height);

/// Column or row in [0, count) of a coordinate in [−1,1] from the left or the top; outside it is clamped.
inline int texel_index(double coordinate, int count) {
  const double position = 0.5 * (coordinate + 1.0) * count;
  if (!(position > 0.0)) return 0;
  return position >= count ? count - 1 : static_cast<int>(position);
}

/// Centre of a texel: x of its column, and y of its row.
inline double column_center(int column, int width) { return (2.0 * column + 1.0) / width - 1.0; }
inline double row_center(int row, int height) { return 1.0 - (2.0 * row + 1.0) / height; }

/// Faces and (x, y) of many directions; all spans have the same length. Returns how many directions were NaN,
/// infinite or zero. Directions that the map does not cover otherwise count in `not_covered`, if given.
std::size_t points_from_directions(const Projection& projection, std::span<const glm::vec3> directions,
                                   std::span<std::int32_t> faces, std::span<glm::vec2> points,
                                   std::size_t* not_covered = nullptr);

/// Unit directions of many points. Throws InvalidArgument for a face that does not exist or a point that is
/// not finite.
void directions_from_points(const Projection& projection, std::span<const std::int32_t> faces,
                            std::span<const glm::vec2> points, std::span<glm::vec3> directions);

}  // namespace mirrorbake
