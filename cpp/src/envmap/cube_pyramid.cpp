#include "mirrorbake/envmap/cube_pyramid.hpp"

#include <algorithm>
#include <bit>
#include <string>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/projection/cube.hpp"

namespace mirrorbake {
namespace {

std::vector<double> solid_angles(int size) {
  std::vector<double> angles;
  angles.reserve(static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
  for (int row = 0; row < size; ++row) {
    for (int column = 0; column < size; ++column) angles.push_back(cube_texel_solid_angle(size, column, row));
  }
  return angles;
}

}  // namespace

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
  std::vector<float> pyramid(layout.texels() * c);
  std::copy(faces.begin(), faces.end(), pyramid.begin());
  std::vector<double> angles = solid_angles(layout.size);  // of the finer level
  for (int level = 1; level < layout.levels; ++level) {
    const int n = layout.level_size(level);
    const int fine = layout.level_size(level - 1);
    parallel_for(static_cast<std::size_t>(6 * n), 16, [&](std::size_t begin, std::size_t end) {
      std::vector<double> sum(c);
      for (std::size_t line = begin; line < end; ++line) {
        const int face = static_cast<int>(line) / n;
        const int row = static_cast<int>(line) % n;
        // An odd side leaves a rest that the last texel takes along.
        const int row_end = row == n - 1 ? fine : 2 * row + 2;
        for (int column = 0; column < n; ++column) {
          const int column_end = column == n - 1 ? fine : 2 * column + 2;
          double angle = 0;
          std::fill(sum.begin(), sum.end(), 0.0);
          for (int y = 2 * row; y < row_end; ++y) {
            for (int x = 2 * column; x < column_end; ++x) {
              const double w = angles[static_cast<std::size_t>(y * fine + x)];
              const float* texel = pyramid.data() + layout.index(level - 1, face, y, x) * c;
              angle += w;
              for (std::size_t k = 0; k < c; ++k) sum[k] += w * static_cast<double>(texel[k]);
            }
          }
          float* texel = pyramid.data() + layout.index(level, face, row, column) * c;
          for (std::size_t k = 0; k < c; ++k) texel[k] = static_cast<float>(sum[k] / angle);
        }
      }
    });
    angles = solid_angles(n);
  }
  return pyramid;
}

}  // namespace mirrorbake
