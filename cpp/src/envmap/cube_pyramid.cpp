#include "mirrorbake/envmap/cube_pyramid.hpp"

#include <bit>
#include <string>
#include <utility>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/envmap/mipmap.hpp"

namespace mirrorbake {

CubePyramidLayout CubePyramidLayout::full(int size) {
  check_range("size", size, 1, 16384, " texels");
  return {size, static_cast<int>(std::bit_width(static_cast<unsigned>(size)))};
}

std::size_t CubePyramidLayout::level_texels(int level) const {
  const std::size_t n = static_cast<std::size_t>(level_size(level));
  return 6 * n * n;
}

std::size_t CubePyramidLayout::level_offset(int level) const {
  std::size_t offset = 0;
  for (int l = 0; l < level; ++l) offset += level_texels(l);
  return offset;
}

std::vector<float> build_cube_pyramid(std::span<const float> faces, const CubePyramidLayout& layout,
                                      int channels) {
  const std::size_t c = static_cast<std::size_t>(channels);
  if (channels < 1 || faces.size() != layout.level_texels(0) * c) {
    throw InvalidArgument("faces", std::to_string(faces.size()) + " values",
                          "6 · size² · channels = " + std::to_string(layout.level_texels(0) * c));
  }
  const EnvMapLayout finest{{ProjectionKind::cube}, layout.size, layout.size, 1, channels};
  EnvMap mips = build_mips(EnvMapView{finest, faces}, MipFilter::solid_angle);
  mips.values.resize(layout.texels() * c);
  return std::move(mips.values);
}

}  // namespace mirrorbake
