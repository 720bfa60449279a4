// Bytes as an image, KTX2 or DDS file. The first byte chooses how it is read: the extension, then the
// arrangement of faces and the projection.
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include "fuzz_targets.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/envmap/envmap_io.hpp"
#include "mirrorbake/envmap/resample.hpp"

int fuzz_load_envmap(const std::uint8_t* data, std::size_t size) {
  using namespace mirrorbake;  // NOLINT(google-build-using-namespace): one function
  if (size == 0) return 0;
  const char* extensions[] = {".exr", ".hdr", ".tif", ".png", ".jpg", ".dds", ".ktx2", ".ktx2"};
  const FaceLayout layouts[] = {FaceLayout::automatic, FaceLayout::strip, FaceLayout::cross,
                                FaceLayout::grid};
  const std::string path = (std::filesystem::temp_directory_path() /
                            ("mirrorbake-fuzz-" + std::to_string(getpid()) + extensions[data[0] % 8]))
                               .string();
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(data) + 1, static_cast<std::streamsize>(size - 1));
  const int arrangement = data[0] / 8 % 4;
  std::optional<Projection> projection;
  if (arrangement > 1) projection = Projection{ProjectionKind::cube};
  if (data[0] >= 128) projection = Projection{ProjectionKind::latlong};
  try {
    const EnvMap map =
        load_envmap(path, projection, layouts[arrangement],
                    {.max_side = 4096, .max_channels = 16, .max_bytes = std::uint64_t{16} << 20});
    validate(EnvMapView(map));
    if (map.values.size() <= 4096) {
      const EnvMap cube = resample(map, Projection{ProjectionKind::cube}, 4, 4);
      if (cube.values.size() != cube.layout.size()) std::abort();
    }
  } catch (const FileError&) {
  } catch (const InvalidArgument&) {
    // An arrangement of faces that the projection does not have.
  }
  return 0;
}
