#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "mirrorbake/core/enum_names.hpp"
#include "mirrorbake/envmap/envmap.hpp"
#include "mirrorbake/image/image_io.hpp"

/// Environment maps in files.
namespace mirrorbake {

/// How the faces of a map share an image. `automatic`: reading, by the shape of the image; writing, `strip`.
/// `strip`: side by side in their order. `column`: one below the other. `grid`: three by two, in reading
/// order. `cross` (4×3) and `vertical_cross` (3×4), empty parts black; faces that touch there touch on the
/// sphere, and of the vertical cross −Z at the bottom is turned by 180°:
///
///            +Y                       +Y
///         −X +Z +X −Z              −X +Z +X
///            −Y                       −Y
///                                     −Z
///
/// `files`: one image per face; the path has `{}` where px, nx, py, ny, pz, nz goes (front, back for the
/// paraboloid).
enum class FaceLayout { automatic, strip, column, grid, cross, vertical_cross, files };

template <>
struct EnumNames<FaceLayout> {
  static constexpr std::string_view what = "faces";
  static constexpr auto names =
      enum_names("automatic", "strip", "column", "grid", "cross", "vertical_cross", "files");
};

/// One level of a map as an image; a map of one face is its face. Throws InvalidArgument for a cross or grid
/// of anything but a cube, and for `files`.
Image pack_faces(const EnvMapView& map, int level, FaceLayout layout);

/// The map in an image. `projection` nothing: 2:1 is a latlong, shapes of a cube's layouts (6:1, 1:6, 3:2,
/// 4:3, 3:4) are cubes. Throws InvalidArgument if the shape of the image does not fit.
EnvMap unpack_faces(const Image& image, const std::optional<Projection>& projection, FaceLayout layout);

/// Reads any image format, KTX2 or DDS: which one follows from the first bytes. A path with `{}` names one
/// image per face. A KTX2 file of one face is a map as an image is, and keeps its levels if it has one face.
/// `choice` is of EXR's parts and layers. Throws FileError, also for a shape that fits no projection.
EnvMap load_envmap(const std::string& path, const std::optional<Projection>& projection = std::nullopt,
                   FaceLayout layout = FaceLayout::automatic, const ImageLimits& limits = {},
                   const ImageChoice& choice = {});

/// The same of a file that is in memory; `name` stands for its path in errors.
EnvMap decode_envmap(const std::string& name, std::span<const unsigned char> bytes,
                     const std::optional<Projection>& projection = std::nullopt,
                     FaceLayout layout = FaceLayout::automatic, const ImageLimits& limits = {},
                     const ImageChoice& choice = {});

/// A panorama as it lights a scene: finite, nowhere below 0.
struct Panorama {
  Image image;
  std::size_t negative = 0;  ///< values that were below 0 in the file and are 0 here
  std::size_t repaired = 0;  ///< values that were NaN or infinite and have been filled
};

struct PanoramaOptions {
  ImageChoice choice;
  bool repairs = false;  ///< whether NaN and infinite values are filled, as repair_not_finite does
  ImageLimits limits = {};
};

/// Reads a map as light: a latlong of R, G and B, grey repeated, without alpha, depth and other channels. A
/// picture of 2:1 is one; cubes are recognised, and resampled, as KTX2 and DDS files, by 6:1 or 1:6, and as
/// crosses whose corners are all alike. Throws FileError for any other picture, which is no panorama unless
/// somebody says so, for no or several layers of colours among which `choice` has not chosen, for values that
/// are not finite and are not to be repaired, and for what load_image refuses. Panoramas that were scaled
/// down with a sharpening filter undershoot beside their lights: that is taken as 0.
Panorama load_panorama(const std::string& path, const PanoramaOptions& options = {});

/// What save_envmap would refuse whatever the map's values are, before they are computed. Throws FileError
/// for a path that cannot be written or stored in `format`; InvalidArgument for a layout or `{}` that does
/// not fit the projection, and a layout of faces in a KTX2 file, which has its own. Nothing is written.
void check_envmap_path(const std::string& path, const Projection& projection,
                       FaceLayout layout = FaceLayout::automatic,
                       PixelFormat format = PixelFormat::automatic);

/// Writes the finest level as an image, or all levels as KTX2. Throws as check_envmap_path does, and as
/// save_image and save_ktx2 do.
SaveReport save_envmap(const std::string& path, const EnvMapView& map,
                       FaceLayout layout = FaceLayout::automatic,
                       PixelFormat format = PixelFormat::automatic);

/// Whether the extension is that of files of cubes with all their levels: .ktx2, .dds.
bool stores_levels(const std::string& path);

}  // namespace mirrorbake
