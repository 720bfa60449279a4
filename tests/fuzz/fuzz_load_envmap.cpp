// Bytes as an image, KTX2 or DDS file, in memory. The first byte chooses the arrangement of faces and the
// projection; what the rest is follows from its own first bytes.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <span>

#include "fuzz_targets.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/envmap/envmap_io.hpp"
#include "mirrorbake/envmap/repair.hpp"
#include "mirrorbake/envmap/resample.hpp"

int fuzz_load_envmap(const std::uint8_t* data, std::size_t size) {
  using namespace mirrorbake;  // NOLINT(google-build-using-namespace): one function
  if (size == 0) return 0;
  const FaceLayout layouts[] = {FaceLayout::automatic, FaceLayout::strip, FaceLayout::cross,
                                FaceLayout::grid};
  const int arrangement = data[0] % 4;
  std::optional<Projection> projection;
  if (data[0] >= 64) projection = Projection{ProjectionKind::cube};
  if (data[0] >= 128) projection = Projection{ProjectionKind::latlong};
  try {
    EnvMap map = decode_envmap("fuzzed", std::span(data + 1, size - 1), projection, layouts[arrangement],
                               {.max_side = 4096, .max_channels = 16, .max_bytes = std::uint64_t{1} << 20});
    validate(EnvMapView(map));
    if (map.values.size() > 4096) return 0;
    repair_not_finite("fuzzed", map);
    if (count_not_finite(map) != 0) std::abort();
    const EnvMap cube = resample(map, Projection{ProjectionKind::cube}, 4, 4);
    if (cube.values.size() != cube.layout.size()) std::abort();
  } catch (const FileError&) {
  } catch (const InvalidArgument&) {
    // An arrangement of faces that the projection does not have.
  }
  return 0;
}
