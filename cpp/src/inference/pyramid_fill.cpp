#include "pyramid_fill.hpp"

#include "mirrorbake/envmap/cube_sampling.hpp"
#include "mirrorbake/projection/cube.hpp"

namespace mirrorbake {
namespace {

constexpr int kRelaxations = 4;

// Calls body(face, row, column, index) for every texel of a level, in parallel.
template <typename Body>
void for_each_texel(const CubePyramidLayout& layout, int level, const Body& body) {
  const int n = layout.level_size(level);
  parallel_for(static_cast<std::size_t>(6 * n), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t line = begin; line < end; ++line) {
      const int face = static_cast<int>(line) / n;
      const int row = static_cast<int>(line) % n;
      for (int column = 0; column < n; ++column)
        body(face, row, column, layout.index(level, face, row, column));
    }
  });
}

}  // namespace

void fill_unknown(const CubePyramidLayout& layout, const std::vector<std::uint8_t>& known,
                  FillTowards towards, std::vector<Channels>& texels) {
  std::vector<std::uint8_t> filled = known;
  for (int level = 1; level < layout.levels; ++level) {
    for_each_texel(layout, level, [&](int face, int row, int column, std::size_t i) {
      if (filled[i]) return;
      Channels sum{};
      int count = 0;
      for (int child = 0; child < 4; ++child) {
        const std::size_t c = layout.index(level - 1, face, 2 * row + child / 2, 2 * column + child % 2);
        if (!filled[c]) continue;
        sum += texels[c];
        ++count;
      }
      if (count == 0) return;
      texels[i] = sum / broadcast(static_cast<float>(towards == FillTowards::zero ? 4 : count));
      filled[i] = 1;
    });
  }

  // On the coarsest level a face that is still unknown takes the mean of those that are not.
  const std::size_t first = layout.level_offset(layout.levels - 1);
  Channels sum{};
  int count = 0;
  for (std::size_t i = first; i < layout.texels(); ++i) {
    if (!filled[i]) continue;
    sum += texels[i];
    ++count;
  }
  for (std::size_t i = first; i < layout.texels(); ++i) {
    if (filled[i]) continue;
    texels[i] =
        count == 0 || towards == FillTowards::zero ? Channels{} : sum / broadcast(static_cast<float>(count));
    filled[i] = 1;
  }

  std::vector<Channels> relaxed;
  for (int level = layout.levels - 2; level >= 0; --level) {
    const int n = layout.level_size(level);
    const float scale = 1.0F / static_cast<float>(n);
    for_each_texel(layout, level, [&](int face, int row, int column, std::size_t i) {
      if (filled[i]) return;
      CubeFootprint footprint;
      add_bilinear(layout, level + 1,
                   direction_from_cube(face, (static_cast<float>(column) + 0.5F) * scale,
                                       (static_cast<float>(row) + 0.5F) * scale),
                   1.0F, footprint);
      Channels value{};
      for (int t = 0; t < footprint.count; ++t) {
        const TexelWeight& entry = footprint.texels[static_cast<std::size_t>(t)];
        value += broadcast(entry.weight) * texels[entry.texel];
      }
      texels[i] = value;
    });
    const std::size_t offset = layout.level_offset(level);
    relaxed.resize(layout.level_texels(level));
    for (int sweep = 0; sweep < kRelaxations; ++sweep) {
      for_each_texel(layout, level, [&](int face, int row, int column, std::size_t i) {
        if (filled[i]) {
          relaxed[i - offset] = texels[i];
          return;
        }
        relaxed[i - offset] =
            broadcast(0.25F) * (texels[cube_texel_across_edges(layout, level, face, row - 1, column)] +
                                texels[cube_texel_across_edges(layout, level, face, row + 1, column)] +
                                texels[cube_texel_across_edges(layout, level, face, row, column - 1)] +
                                texels[cube_texel_across_edges(layout, level, face, row, column + 1)]);
      });
      std::copy(relaxed.begin(), relaxed.end(), texels.begin() + static_cast<std::ptrdiff_t>(offset));
    }
  }
}

}  // namespace mirrorbake
