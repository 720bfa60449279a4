#include "mirrorbake/envmap/mipmap.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/envmap/texel_lookup.hpp"

namespace mirrorbake {
namespace {

// Fine texels that coarse texel `i` of `count` covers: two, and what is left over for the last one.
struct Children {
  int begin, end;
};
Children children(int i, int count, int fine) {
  const int begin = std::min(2 * i, fine - 1);
  return {begin, i == count - 1 ? fine : begin + 2};
}

void reduce(EnvMap& map, int level, const std::vector<double>& weights) {
  const EnvMapLayout& layout = map.layout;
  const int width = layout.level_width(level);
  const int height = layout.level_height(level);
  const int fine_width = layout.level_width(level - 1);
  const int fine_height = layout.level_height(level - 1);
  const std::size_t channels = static_cast<std::size_t>(layout.channels);
  const std::size_t lines = static_cast<std::size_t>(face_count(layout.projection) * height);
  parallel_for(lines, 16, [&](std::size_t begin, std::size_t end) {
    std::vector<double> sum(channels);
    for (std::size_t line = begin; line < end; ++line) {
      const int face = static_cast<int>(line) / height;
      const int row = static_cast<int>(line) % height;
      const Children rows = children(row, height, fine_height);
      for (int column = 0; column < width; ++column) {
        const Children columns = children(column, width, fine_width);
        // Adds up the fine texels, each times weight_of(row, column); returns the sum of the weights.
        const auto add_up = [&](const auto& weight_of) {
          std::fill(sum.begin(), sum.end(), 0.0);
          double weight = 0.0;
          for (int y = rows.begin; y < rows.end; ++y) {
            const float* texel = map.values.data() + layout.index(level - 1, face, y, columns.begin);
            for (int x = columns.begin; x < columns.end; ++x, texel += channels) {
              const double w = weight_of(y, x);
              if (!(w > 0.0)) continue;
              weight += w;
              for (std::size_t c = 0; c < channels; ++c) sum[c] += w * static_cast<double>(texel[c]);
            }
          }
          return weight;
        };
        const auto alike = [](int, int) { return 1.0; };
        double weight = weights.empty() ? add_up(alike) : add_up([&](int y, int x) {
          return weights[static_cast<std::size_t>(y) * static_cast<std::size_t>(fine_width) +
                         static_cast<std::size_t>(x)];
        });
        // Outside of the disc of a round map texels have no solid angle; they are kept for filtering.
        if (weight == 0.0) weight = add_up(alike);
        float* texel = map.values.data() + layout.index(level, face, row, column);
        for (std::size_t c = 0; c < channels; ++c) texel[c] = static_cast<float>(sum[c] / weight);
      }
    }
  });
}

void share_edges(EnvMap& map, int level) {
  const EnvMapLayout& layout = map.layout;
  const int n = layout.level_width(level);
  const std::size_t channels = static_cast<std::size_t>(layout.channels);
  const std::vector<float> before(
      map.values.begin() + static_cast<std::ptrdiff_t>(layout.level_offset(level)),
      map.values.begin() + static_cast<std::ptrdiff_t>(layout.level_offset(level + 1)));
  const auto value = [&](std::size_t texel, std::size_t c) {
    return static_cast<double>(before[texel - layout.level_offset(level) + c]);
  };
  for (int face = 0; face < 6; ++face) {
    for (int row = 0; row < n; ++row) {
      for (int column = 0; column < n; ++column) {
        std::vector<std::size_t> shared = {layout.index(level, face, row, column)};
        if (n == 1) {
          shared.clear();
          for (int f = 0; f < 6; ++f) shared.push_back(layout.index(level, f, 0, 0));
        } else {
          if (row == 0) shared.push_back(texel_at(layout, level, face, -1, column));
          if (row == n - 1) shared.push_back(texel_at(layout, level, face, n, column));
          if (column == 0) shared.push_back(texel_at(layout, level, face, row, -1));
          if (column == n - 1) shared.push_back(texel_at(layout, level, face, row, n));
        }
        if (shared.size() == 1) continue;
        // Summed in one order from whichever side, so that both get the same bits.
        std::sort(shared.begin(), shared.end());
        float* texel = map.values.data() + layout.index(level, face, row, column);
        for (std::size_t c = 0; c < channels; ++c) {
          double sum = 0.0;
          for (const std::size_t other : shared) sum += value(other, c);
          texel[c] = static_cast<float>(sum / static_cast<double>(shared.size()));
        }
      }
    }
  }
}

void restore_mean(EnvMap& map, int level, const std::vector<double>& flux) {
  const std::vector<double> now = integrate(map, level);
  const std::size_t channels = flux.size();
  for (std::size_t c = 0; c < channels; ++c) {
    // Only radiance has a meaningful ratio: values of both signs may have a mean of nearly zero.
    const std::size_t first = map.layout.level_offset(level) + c;
    const std::size_t end = map.layout.level_offset(level + 1);
    bool positive = now[c] > 0.0;
    for (std::size_t i = first; i < end && positive; i += channels) positive = map.values[i] >= 0.0F;
    const double factor = flux[c] / now[c];
    if (!positive || !std::isfinite(factor)) continue;
    for (std::size_t i = first; i < end; i += channels) {
      map.values[i] = static_cast<float>(static_cast<double>(map.values[i]) * factor);
    }
  }
}

}  // namespace

EnvMap build_mips(const EnvMapView& map, MipFilter filter) {
  validate(map);
  EnvMapLayout layout = map.layout;
  layout.levels = full_level_count(layout.width, layout.height);
  EnvMap result = make_envmap(layout, map.channels);
  const std::span<const float> finest = map.level(0);
  std::copy(finest.begin(), finest.end(), result.values.begin());
  const bool weighted = filter != MipFilter::box;
  std::vector<double> flux;  // of the finest level, once an odd side did not keep it
  for (int level = 1; level < layout.levels; ++level) {
    const int fine_width = layout.level_width(level - 1);
    const int fine_height = layout.level_height(level - 1);
    reduce(result, level,
           weighted ? texel_solid_angles(layout.projection, fine_width, fine_height) : std::vector<double>());
    if (filter == MipFilter::seamless && layout.projection.kind == ProjectionKind::cube)
      share_edges(result, level);
    const bool odd = (fine_width > 1 && fine_width % 2 != 0) || (fine_height > 1 && fine_height % 2 != 0);
    if (weighted && odd && flux.empty()) flux = integrate(map);
    if (!flux.empty()) restore_mean(result, level, flux);
  }
  return result;
}

SeamReport measure_seam(const EnvMapView& map, int level) {
  validate(map);
  check_range("level", level, 0, map.layout.levels - 1);
  const EnvMapLayout& layout = map.layout;
  const int width = layout.level_width(level);
  const int height = layout.level_height(level);
  const bool cube = layout.projection.kind == ProjectionKind::cube;
  const bool wraps = cube || is_panorama(layout.projection.kind);
  SeamReport report;
  const auto compare = [&](std::size_t a, std::size_t b, float& largest) {
    for (std::size_t c = 0; c < static_cast<std::size_t>(layout.channels); ++c) {
      largest = std::max(largest, std::abs(map.values[a + c] - map.values[b + c]));
    }
  };
  for (int face = 0; face < face_count(layout.projection); ++face) {
    for (int row = 0; row < height; ++row) {
      for (int column = 0; column < width; ++column) {
        const std::size_t here = layout.index(level, face, row, column);
        if (column + 1 < width) compare(here, layout.index(level, face, row, column + 1), report.inside);
        if (row + 1 < height) compare(here, layout.index(level, face, row + 1, column), report.inside);
        if (wraps && column == width - 1)
          compare(here, texel_at(layout, level, face, row, width), report.across);
        if (!cube) continue;
        if (column == 0) compare(here, texel_at(layout, level, face, row, -1), report.across);
        if (row == 0) compare(here, texel_at(layout, level, face, -1, column), report.across);
        if (row == height - 1) compare(here, texel_at(layout, level, face, height, column), report.across);
      }
    }
  }
  return report;
}

std::vector<float> add_border(const EnvMapView& map, int level, int border) {
  validate(map);
  const EnvMapLayout& layout = map.layout;
  check_range("level", level, 0, layout.levels - 1);
  const int width = layout.level_width(level);
  const int height = layout.level_height(level);
  if (border < 0 || border > std::min(width, height)) {
    throw InvalidArgument("border", std::to_string(border),
                          "0 to " + std::to_string(std::min(width, height)));
  }
  const std::size_t channels = static_cast<std::size_t>(layout.channels);
  std::vector<float> result;
  result.reserve(static_cast<std::size_t>(face_count(layout.projection)) *
                 static_cast<std::size_t>(width + 2 * border) *
                 static_cast<std::size_t>(height + 2 * border) * channels);
  for (int face = 0; face < face_count(layout.projection); ++face) {
    for (int row = -border; row < height + border; ++row) {
      for (int column = -border; column < width + border; ++column) {
        const float* texel = map.values.data() + texel_at(layout, level, face, row, column);
        result.insert(result.end(), texel, texel + channels);
      }
    }
  }
  return result;
}

}  // namespace mirrorbake
