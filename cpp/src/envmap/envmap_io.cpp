#include "mirrorbake/envmap/envmap_io.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "cube_file.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/envmap/dds.hpp"
#include "mirrorbake/envmap/ktx2.hpp"
#include "mirrorbake/envmap/repair.hpp"
#include "mirrorbake/envmap/resample.hpp"
#include "mirrorbake/projection/traits.hpp"

namespace mirrorbake {
namespace {

// Where the faces are, in units of a face.
struct Cell {
  int column, row;
};
struct Arrangement {
  int columns = 1;
  int rows = 1;
  std::vector<Cell> cells;
  bool turns_last = false;
};

std::optional<Arrangement> arrangement(FaceLayout layout, int faces) {
  Arrangement result;
  const auto grid = [&](int columns) {
    result.columns = columns;
    result.rows = (faces + columns - 1) / columns;
    for (int face = 0; face < faces; ++face) result.cells.push_back({face % columns, face / columns});
  };
  if (faces == 1) {
    grid(1);
    return result;
  }
  switch (layout) {
    case FaceLayout::automatic:
    case FaceLayout::strip: grid(faces); return result;
    case FaceLayout::column: grid(1); return result;
    case FaceLayout::grid:
      if (faces != 6) return std::nullopt;
      grid(3);
      return result;
    case FaceLayout::cross:
      if (faces != 6) return std::nullopt;
      return Arrangement{4, 3, {{2, 1}, {0, 1}, {1, 0}, {1, 2}, {1, 1}, {3, 1}}, false};
    case FaceLayout::vertical_cross:
      if (faces != 6) return std::nullopt;
      return Arrangement{3, 4, {{2, 1}, {0, 1}, {1, 0}, {1, 2}, {1, 1}, {1, 3}}, true};
    case FaceLayout::files: return std::nullopt;
  }
  return std::nullopt;
}

// Calls body(pixel, texel) for indices of the image's pixel and the map's texel, in values.
template <typename Body>
void for_each_texel(const Arrangement& a, const Image& image, const EnvMapLayout& layout, int level,
                    Body&& body) {
  const int width = layout.level_width(level);
  const int height = layout.level_height(level);
  for (int face = 0; face < face_count(layout.projection); ++face) {
    const Cell cell = a.cells[static_cast<std::size_t>(face)];
    const bool turned = a.turns_last && face == 5;
    for (int row = 0; row < height; ++row) {
      for (int column = 0; column < width; ++column) {
        const int x = cell.column * width + (turned ? width - 1 - column : column);
        const int y = cell.row * height + (turned ? height - 1 - row : row);
        body(image.offset(x, y), layout.index(level, face, row, column));
      }
    }
  }
}

std::string face_path(const std::string& path, const Projection& projection, int face) {
  std::string result = path;
  return result.replace(result.find("{}"), 2,
                        traits(projection.kind).face_names[static_cast<std::size_t>(face)]);
}

bool names_faces(const std::string& path) { return path.find("{}") != std::string::npos; }

// A cube that nothing else looks like. Photographs are 3:2 and 4:3, as grids and crosses are: of a cross the
// cells that hold no face are all of one colour.
std::optional<FaceLayout> recognised_cube(const Image& image) {
  if (image.width == 6 * image.height) return FaceLayout::strip;
  if (image.height == 6 * image.width) return FaceLayout::column;
  for (const FaceLayout layout : {FaceLayout::cross, FaceLayout::vertical_cross}) {
    const Arrangement a = *arrangement(layout, 6);
    if (image.width % a.columns != 0 || image.width * a.rows != image.height * a.columns) continue;
    const int side = image.width / a.columns;
    const float* corner = image.at(0, 0);
    bool is_empty = true;
    for (int y = 0; y < image.height && is_empty; ++y) {
      for (int x = 0; x < image.width && is_empty; ++x) {
        const bool is_face = std::any_of(a.cells.begin(), a.cells.end(), [&](const Cell& c) {
          return c.column == x / side && c.row == y / side;
        });
        is_empty = is_face || std::equal(corner, corner + image.channels.size(), image.at(x, y));
      }
    }
    if (is_empty) return layout;
  }
  return std::nullopt;
}

EnvMap load_faces(const std::string& path, const Projection& projection, const ImageLimits& limits,
                  const ImageChoice& choice) {
  if (face_count(projection) == 1)
    throw FileError(path, "names several images, but the projection has one face");
  EnvMap map;
  for (int face = 0; face < face_count(projection); ++face) {
    const std::string name = face_path(path, projection, face);
    Image image = load_image(name, limits, choice);
    const EnvMapLayout layout{projection, image.width, image.height, 1, image.channel_count()};
    if (face == 0) {
      if (image.width > 65536 / 6 && layout.size() > limits.max_bytes / sizeof(float))
        throw FileError(name, "is too large");
      try {
        map = make_envmap(layout, image.channels);
      } catch (const InvalidArgument& e) {
        throw FileError(name, e.what());
      }
    } else if (layout != map.layout) {
      throw FileError(name, "differs in size or channels from the first face");
    }
    std::copy(image.pixels.begin(), image.pixels.end(),
              map.values.begin() + static_cast<std::ptrdiff_t>(layout.index(0, face, 0, 0)));
  }
  return map;
}

EnvMap unpacked(const std::string& name, const Image& image, const std::optional<Projection>& projection,
                FaceLayout layout) {
  try {
    return unpack_faces(image, projection, layout);
  } catch (const InvalidArgument& e) {
    throw FileError(name, e.what());
  }
}

// What a file of a map with its levels holds: by its first bytes, or by its name if these are damaged.
std::optional<MapFile> file_of_levels(const std::string& name, const image_files::Bytes& bytes,
                                      const ImageLimits& limits, const ImageChoice& choice) {
  constexpr std::string_view kKtx = "\xabKTX ";
  constexpr std::string_view kDds = "DDS ";
  std::array<unsigned char, kKtx.size()> head{};
  const std::size_t size = bytes.read(0, head);
  const auto starts_with = [&](std::string_view magic) {
    return size >= magic.size() &&
           std::equal(magic.begin(), magic.end(), head.begin(),
                      [](char a, unsigned char b) { return static_cast<unsigned char>(a) == b; });
  };
  const bool ktx = starts_with(kKtx) || is_ktx2(name);
  if (!ktx && !starts_with(kDds) && !is_dds(name)) return std::nullopt;
  if (!choice.part.empty() || !choice.layer.empty()) {
    throw FileError(name, "has no parts and layers to choose from, expected an EXR file");
  }
  if (ktx) return read_ktx2(name, bytes, limits);
  return MapFile{read_dds(name, bytes, limits)};
}

}  // namespace

Image pack_faces(const EnvMapView& map, int level, FaceLayout layout) {
  validate(map);
  const int faces = face_count(map.layout.projection);
  const std::optional<Arrangement> a = arrangement(layout, faces);
  if (!a) {
    throw InvalidArgument("layout", name_of(layout),
                          "one for the " + std::to_string(faces) + " faces of this map");
  }
  std::vector<std::string> names(map.channels.begin(), map.channels.end());
  if (names.empty()) names = default_channels(map.layout.channels);
  Image image(a->columns * map.layout.level_width(level), a->rows * map.layout.level_height(level), names);
  for_each_texel(*a, image, map.layout, level, [&](std::size_t pixel, std::size_t texel) {
    std::copy_n(map.values.begin() + static_cast<std::ptrdiff_t>(texel), names.size(),
                image.pixels.begin() + static_cast<std::ptrdiff_t>(pixel));
  });
  return image;
}

EnvMap unpack_faces(const Image& image, const std::optional<Projection>& projection, FaceLayout layout) {
  const std::string shape = std::to_string(image.width) + " x " + std::to_string(image.height) + " pixels";
  Projection found;
  if (projection) {
    found = *projection;
  } else if (layout == FaceLayout::automatic && image.width == 2 * image.height) {
    found.kind = ProjectionKind::latlong;
  } else {
    found.kind = ProjectionKind::cube;
  }
  const int faces = face_count(found);
  const auto fits = [&](const Arrangement& a) {
    const bool divides = image.width % a.columns == 0 && image.height % a.rows == 0;
    const bool square = image.width / a.columns == image.height / a.rows;
    return divides && (square || found.kind != ProjectionKind::cube);
  };
  std::optional<Arrangement> chosen;
  if (layout != FaceLayout::automatic || faces == 1) {
    chosen = arrangement(layout, faces);
    if (chosen && !fits(*chosen)) chosen.reset();
  } else {
    for (std::size_t i = 0; i < EnumNames<FaceLayout>::names.size(); ++i) {
      const auto candidate = static_cast<FaceLayout>(i);
      if (candidate == FaceLayout::automatic || candidate == FaceLayout::files) continue;
      const std::optional<Arrangement> a = arrangement(candidate, faces);
      // Two faces side by side or above each other are told apart by being square.
      if (a && fits(*a) && image.width * a->rows == image.height * a->columns) {
        chosen = a;
        break;
      }
    }
  }
  if (!chosen) {
    throw InvalidArgument(
        "image", shape,
        projection ? "the faces of the projection " + to_string(found) + " in the layout " +
                         std::string(name_of(layout))
                   : "a panorama (2:1) or a cube (6:1, 1:6, 3:2, 4:3 or 3:4), or a named projection");
  }
  EnvMap map = make_envmap(
      {found, image.width / chosen->columns, image.height / chosen->rows, 1, image.channel_count()},
      image.channels);
  for_each_texel(*chosen, image, map.layout, 0, [&](std::size_t pixel, std::size_t texel) {
    std::copy_n(image.pixels.begin() + static_cast<std::ptrdiff_t>(pixel), image.channels.size(),
                map.values.begin() + static_cast<std::ptrdiff_t>(texel));
  });
  return map;
}

bool stores_levels(const std::string& path) { return is_ktx2(path) || is_dds(path); }

EnvMap unpacked(const std::string& name, MapFile file, const std::optional<Projection>& projection,
                FaceLayout layout) {
  if (!file.is_picture) return std::move(file.map);
  const EnvMapLayout& found = file.map.layout;
  Image finest(found.width, found.height, file.map.channels);
  std::copy_n(file.map.values.begin(), finest.pixels.size(), finest.pixels.begin());
  EnvMap map = unpacked(name, finest, projection, layout);
  if (face_count(map.layout.projection) == 1) {
    map.layout.levels = found.levels;
    map.values = std::move(file.map.values);
  }
  return map;
}

EnvMap load_envmap(const std::string& path, const std::optional<Projection>& projection, FaceLayout layout,
                   const ImageLimits& limits, const ImageChoice& choice) {
  if (names_faces(path)) {
    return load_faces(path, projection.value_or(Projection{ProjectionKind::cube}), limits, choice);
  }
  if (std::optional<MapFile> file = file_of_levels(path, *image_files::open_bytes(path), limits, choice)) {
    return unpacked(path, *std::move(file), projection, layout);
  }
  return unpacked(path, load_image(path, limits, choice), projection, layout);
}

EnvMap decode_envmap(const std::string& name, std::span<const unsigned char> bytes,
                     const std::optional<Projection>& projection, FaceLayout layout,
                     const ImageLimits& limits, const ImageChoice& choice) {
  if (std::optional<MapFile> file = file_of_levels(name, *image_files::bytes_in(bytes), limits, choice)) {
    return unpacked(name, *std::move(file), projection, layout);
  }
  return unpacked(name, decode_image(name, bytes, {.limits = limits, .choice = choice}), projection, layout);
}

Panorama load_panorama(const std::string& path, const PanoramaOptions& options) {
  EnvMap map;
  std::optional<MapFile> file =
      file_of_levels(path, *image_files::open_bytes(path), options.limits, options.choice);
  if (file && !file->is_picture) {
    map = std::move(file->map);
  } else {
    Image image;
    if (file) {
      const EnvMapLayout& layout = file->map.layout;
      image = Image(layout.width, layout.height, file->map.channels);
      std::copy_n(file->map.values.begin(), image.pixels.size(), image.pixels.begin());
    } else {
      image = load_image(path, options.limits, options.choice);
    }
    image = colours_of(path, std::move(image));
    const std::optional<FaceLayout> cube = recognised_cube(image);
    if (image.width != 2 * image.height && !cube) {
      throw FileError(
          path, "has " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                    " pixels, expected a panorama twice as wide as high, a cube's strip of 6:1 or 1:6, or a "
                    "cross with empty corners; mb-envmap convert --from makes one of other maps");
    }
    const Projection projection{cube ? ProjectionKind::cube : ProjectionKind::latlong};
    map = unpack_faces(image, projection, cube.value_or(FaceLayout::automatic));
  }
  if (map.layout.channels == 2) throw FileError(path, "has two channels, expected grey or R, G, B");
  const std::size_t not_finite = count_not_finite(map);
  if (not_finite > 0 && !options.repairs) {
    throw FileError(path, std::to_string(not_finite) +
                              " values are NaN or infinite, expected radiance; the option repair fills them");
  }
  Panorama panorama;
  panorama.repaired = repair_not_finite(path, map);
  if (map.layout.projection.kind == ProjectionKind::cube) {
    EnvMapView finest(map);
    map = resample(finest, Projection{ProjectionKind::latlong}, 4 * map.layout.width, 2 * map.layout.width);
  }
  const auto channels = static_cast<std::size_t>(map.layout.channels);
  panorama.image = Image(map.layout.width, map.layout.height, {"R", "G", "B"});
  for (std::size_t i = 0; i < panorama.image.pixels.size(); ++i) {
    const float value = map.values[i / 3 * channels + (channels == 1 ? 0 : i % 3)];
    if (value < 0.0F) ++panorama.negative;
    panorama.image.pixels[i] = std::max(value, 0.0F);
  }
  return panorama;
}

void check_envmap_path(const std::string& path, const Projection& projection, FaceLayout layout,
                       PixelFormat format) {
  const int faces = face_count(projection);
  if (stores_levels(path)) {
    if (is_dds(path)) {
      check_dds_path(path, projection, format);
    } else {
      check_ktx2_path(path, projection, format);
    }
    if (layout != FaceLayout::automatic) {
      throw InvalidArgument("layout", name_of(layout),
                            "automatic: a KTX2 or DDS file has a layout of its own");
    }
    return;
  }
  if (!path.empty() && !has_image_extension(path)) {
    throw FileError(path,
                    "has an unknown extension, expected .exr, .hdr, .tif, .tiff, .png, .jpg, .jpeg, or .ktx2 "
                    "or .dds for a cube map");
  }
  const bool several = names_faces(path);
  check_image_path(several && faces > 1 ? face_path(path, projection, 0) : path, format);
  if (several && faces == 1) throw InvalidArgument("path", path, "no {}: the map has one face");
  if (several && layout != FaceLayout::automatic && layout != FaceLayout::files) {
    throw InvalidArgument("layout", name_of(layout), "files, as " + path + " names one image per face");
  }
  if (several) return;
  if (layout == FaceLayout::files) throw InvalidArgument("path", path, "a path with {} for the face");
  if (!arrangement(layout, faces)) {
    throw InvalidArgument("layout", name_of(layout), "strip or column for " + to_string(projection));
  }
}

SaveReport save_envmap(const std::string& path, const EnvMapView& map, FaceLayout layout,
                       PixelFormat format) {
  validate(map);
  const Projection& projection = map.layout.projection;
  check_envmap_path(path, projection, layout, format);
  if (is_ktx2(path)) return save_ktx2(path, map, format);
  if (is_dds(path)) return save_dds(path, map, format);
  if (!names_faces(path)) return save_image(path, pack_faces(map, 0, layout), format);
  std::vector<std::string> names(map.channels.begin(), map.channels.end());
  if (names.empty()) names = default_channels(map.layout.channels);
  SaveReport total;
  const std::size_t face_values = map.level(0).size() / static_cast<std::size_t>(face_count(projection));
  for (int face = 0; face < face_count(projection); ++face) {
    const SaveReport report =
        save_image(face_path(path, projection, face), map.layout.width, map.layout.height, names,
                   map.level(0).subspan(static_cast<std::size_t>(face) * face_values, face_values), format);
    total.clamped_to_half += report.clamped_to_half;
    total.clipped += report.clipped;
  }
  return total;
}

}  // namespace mirrorbake
