#include "mirrorbake/envmap/conventions.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/envmap/resample.hpp"

namespace mirrorbake {
namespace {

constexpr std::array<std::string_view, 6> kNames = {"mirrorbake", "openexr", "oiio",
                                                    "mitsuba",    "threejs", "ktx2"};

// The foreign texel of a direction is the one that our projection gives to foreign_from_native · direction;
// of a cube, the faces ±Z may trade places after that.
struct Orientation {
  glm::dmat3 foreign_from_native{1.0};
  bool swaps_z_faces = false;
};

glm::dmat3 columns(glm::dvec3 of_x, glm::dvec3 of_y, glm::dvec3 of_z) { return {of_x, of_y, of_z}; }

std::optional<Orientation> panorama(std::string_view name) {
  // Direction in our panorama, in the centre or right of it, of what the foreign one has there: where our
  // texel looks along −Z, +X and +Y, the foreign one looks along its centre, right and up.
  const auto looking = [](glm::dvec3 center, glm::dvec3 right, glm::dvec3 up) {
    return Orientation{glm::transpose(columns(right, up, -center))};
  };
  if (name == "mirrorbake") return Orientation{};
  if (name == "openexr" || name == "mitsuba") return looking({0, 0, 1}, {-1, 0, 0}, {0, 1, 0});
  if (name == "oiio") return looking({1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  if (name == "threejs") return looking({1, 0, 0}, {0, 0, 1}, {0, 1, 0});
  return std::nullopt;
}

std::optional<Orientation> cube(std::string_view name) {
  if (name == "mirrorbake" || name == "ktx2") return Orientation{};
  if (name == "threejs") return Orientation{columns({-1, 0, 0}, {0, 1, 0}, {0, 0, 1})};
  // ImfEnvmap.h draws +Z with x to the left and y up, −Z with x to the right, +X with z to the right, −X with
  // z to the left, +Y with z up, −Y with z down: OpenGL's faces with z reversed, where ±Z trade places.
  if (name == "openexr") return Orientation{columns({1, 0, 0}, {0, 1, 0}, {0, 0, -1}), true};
  return std::nullopt;
}

}  // namespace

std::span<const std::string_view> convention_names() { return kNames; }

EnvMap convert_convention(const EnvMapView& map, std::string_view name, ConventionWay way) {
  validate(map);
  const EnvMapLayout& layout = map.layout;
  if (std::find(kNames.begin(), kNames.end(), name) == kNames.end()) {
    throw InvalidArgument("convention", name, "mirrorbake, openexr, oiio, mitsuba, threejs or ktx2");
  }
  if (layout.levels != 1) throw InvalidArgument("levels", std::to_string(layout.levels), "1");
  const std::optional<Orientation> orientation =
      layout.projection.kind == ProjectionKind::cube      ? cube(name)
      : layout.projection.kind == ProjectionKind::latlong ? panorama(name)
      : name == "mirrorbake"                              ? std::optional<Orientation>(Orientation{})
                                                          : std::nullopt;
  if (!orientation) {
    throw InvalidArgument("convention", name,
                          "one that is defined for the projection " + to_string(layout.projection));
  }
  const auto swapped = [&](int face) { return orientation->swaps_z_faces && face >= 4 ? 9 - face : face; };
  // From the frame of the map that is made to that of the map that is given: the matrices are orthonormal.
  const glm::dmat3 source_from_target = way == ConventionWay::from_foreign
                                            ? orientation->foreign_from_native
                                            : glm::transpose(orientation->foreign_from_native);
  EnvMap result = make_envmap(layout, map.channels);
  const std::size_t channels = static_cast<std::size_t>(layout.channels);
  for (int face = 0; face < face_count(layout.projection); ++face) {
    for (int row = 0; row < layout.height; ++row) {
      for (int column = 0; column < layout.width; ++column) {
        const int target_face = way == ConventionWay::to_foreign ? swapped(face) : face;
        const glm::dvec3 d =
            direction_from_point(layout.projection, target_face, column_center(column, layout.width),
                                 row_center(row, layout.height));
        const MapPoint point = point_from_direction(layout.projection, source_from_target * d);
        const int source_face = way == ConventionWay::from_foreign ? swapped(point.face) : point.face;
        const int source_row = texel_index(-point.y, layout.height);
        const int source_column = texel_index(point.x, layout.width);
        if (std::abs(column_center(source_column, layout.width) - point.x) * layout.width > 1e-3 ||
            std::abs(row_center(source_row, layout.height) - point.y) * layout.height > 1e-3) {
          // Only panoramas get here: the faces of a cube are square.
          return resample(map, layout.projection, layout.width, layout.height,
                          {ResampleFilter::automatic, glm::mat3(source_from_target)});
        }
        const auto from = map.values.begin() + static_cast<std::ptrdiff_t>(
                                                   layout.index(0, source_face, source_row, source_column));
        std::copy_n(from, channels,
                    result.values.begin() + static_cast<std::ptrdiff_t>(layout.index(0, face, row, column)));
      }
    }
  }
  return result;
}

}  // namespace mirrorbake
