#include "mirrorbake/prefilter/convolve.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <glm/geometric.hpp>

#include "lobe_kernels.hpp"
#include "lobe_plan.hpp"
#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/envmap/resample.hpp"
#include "moment_grid.hpp"
#include "source_texels.hpp"
#include "texel_blocks.hpp"

namespace mirrorbake {
namespace {

// Lobes that need smaller nodes than this, in radians, are summed texel by texel: Phong from N = 5,625.
constexpr double kNarrow = 0.008;
constexpr std::size_t kReports = 50;  // of progress, for every three channels
// Steps of the table of weights of narrow lobes, by (1 − cos γ)/2: 3e-6 of a weight between them.
constexpr std::size_t kNarrowSteps = 4096;

bool is_cosine(const Lobe& lobe) {
  return lobe.kind == LobeKind::lambert || (lobe.kind == LobeKind::phong && lobe.exponent == 1.0) ||
         (lobe.kind == LobeKind::ggx && lobe.alpha == 1.0);
}

bool is_narrow(const Lobe& lobe, const LobePlan& plan) {
  return (lobe.kind == LobeKind::phong || plan.cut < 0.15) && plan.finest() < kNarrow;
}

// Outputs that are worked on together are 4 × 4 texels of a face.
struct Tile {
  std::array<std::size_t, kOutputs> output{};  ///< number of the texel, or of the direction
  std::size_t count = 0;
};

// What is to be made, of up to three channels at a time.
struct Job {
  std::span<const glm::vec3> directions;
  const std::vector<Tile>& tiles;
  LobeScale scale;
  std::span<float> values;
  const std::function<void(double)>& progress;
  int first_channel = 0;
};

}  // namespace

struct Convolver::State {
  EnvMapView map;
  std::map<int, SourceTexels> texels;               ///< by parts
  std::map<std::pair<int, int>, MomentGrid> grids;  ///< by cells and parts, of the current channels
  std::map<int, TexelBlocks> blocks;                ///< by parts
  int group = -1;                                   ///< first channel of the grids
  std::map<int, int> moments;                       ///< first channel of the moments of the blocks, by parts

  const SourceTexels& texels_of(int parts) {
    return texels.try_emplace(parts, map.layout, parts).first->second;
  }
  TexelBlocks& blocks_of(int parts) {
    return blocks.try_emplace(parts, map.layout, texels_of(parts)).first->second;
  }
  // A grid of at least so many cells.
  const MomentGrid& grid_of(int first_channel, int cells, int parts) {
    if (group != first_channel) grids.clear();
    group = first_channel;
    for (const auto& [key, grid] : grids) {
      if (key.first >= cells && key.second == parts) return grid;
    }
    return grids.try_emplace({cells, parts}, map, first_channel, texels_of(parts), cells).first->second;
  }

  // A loop over outputs, which reports now and then.
  void for_outputs(const Job& job, std::size_t count, std::size_t grain,
                   const std::function<void(std::size_t, std::size_t)>& body) const {
    if (!job.progress) return parallel_for(count, grain, body);
    const int groups = (map.layout.channels + 2) / 3;
    const int made = job.first_channel / 3;
    const std::size_t step = (count / kReports / grain + 1) * grain;
    for (std::size_t at = 0; at < count; at += step) {
      const std::size_t size = std::min(step, count - at);
      parallel_for(size, grain, [&](std::size_t begin, std::size_t end) { body(at + begin, at + end); });
      const double done = static_cast<double>(at + size) / static_cast<double>(count);
      job.progress((made + done) / groups);
    }
  }

  void store(const Job& job, std::size_t output, const double* sums, std::size_t stride) const {
    const std::size_t channels = static_cast<std::size_t>(map.layout.channels);
    const std::size_t first = static_cast<std::size_t>(job.first_channel);
    const double divisor = job.scale == LobeScale::mean ? sums[3 * stride] : 1.0;
    for (std::size_t c = 0; c < 3 && first + c < channels; ++c) {
      job.values[output * channels + first + c] =
          divisor > 0.0 ? static_cast<float>(sums[c * stride] / divisor) : 0.0F;
    }
  }

  void cosine(const Job& job) {
    const int parts = parts_for_width(map.layout, 0.25);
    TexelBlocks& tree = blocks_of(parts);
    const auto known = moments.find(parts);
    if (known == moments.end() || known->second != job.first_channel) {
      tree.make_moments(map, job.first_channel, texels_of(parts));
      moments[parts] = job.first_channel;
    }
    for_outputs(job, job.directions.size(), 16, [&](std::size_t begin, std::size_t end) {
      std::vector<std::uint32_t> leaves;
      for (std::size_t i = begin; i < end; ++i) {
        const std::array<double, 4> sums =
            tree.sum_cosines(glm::normalize(glm::dvec3(job.directions[i])), leaves);
        store(job, i, sums.data(), 1);
      }
    });
  }

  void narrow(const Lobe& lobe, const LobePlan& plan, const Job& job);
  void wide(const LobePlan& plan, const Job& job);
  void apply(const Lobe& lobe, Job job);
};

void Convolver::State::narrow(const Lobe& lobe, const LobePlan& plan, const Job& job) {
  const int parts = parts_for_width(map.layout, plan.width);
  const SourceTexels& pieces = texels_of(parts);
  const TexelBlocks& tree = blocks_of(1);
  const SourceTexels& whole = texels_of(1);
  const double cut_h = 0.25 * plan.cut * plan.cut;
  std::vector<float> weights(kNarrowSteps + 2);
  for (std::size_t i = 0; i <= kNarrowSteps; ++i) {
    weights[i] = static_cast<float>(
        lobe_derivatives(lobe, std::sqrt(cut_h * static_cast<double>(i) / kNarrowSteps)).weight);
  }
  const double per_h = static_cast<double>(kNarrowSteps) / cut_h;
  const double reach = plan.cut + (parts > 1 ? texel_width(map.layout) : 0.0);
  const std::size_t channels = static_cast<std::size_t>(map.layout.channels);
  const std::size_t first_channel = static_cast<std::size_t>(job.first_channel);
  const std::size_t used = std::min<std::size_t>(3, channels - first_channel);
  const double integral = lobe_integral(lobe);
  const auto weight_at = [&](double squared_chord) {
    const double position = 0.25 * squared_chord * per_h;
    if (!(position < static_cast<double>(kNarrowSteps))) return 0.0;
    const std::size_t i = static_cast<std::size_t>(position);
    const double low = static_cast<double>(weights[i]);
    return low + (position - static_cast<double>(i)) * (static_cast<double>(weights[i + 1]) - low);
  };
  const std::size_t width = static_cast<std::size_t>(map.layout.width);
  const std::size_t height = static_cast<std::size_t>(map.layout.height);
  for_outputs(job, job.directions.size(), 16, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> found;
    for (std::size_t i = begin; i < end; ++i) {
      const glm::dvec3 r = glm::normalize(glm::dvec3(job.directions[i]));
      found.clear();
      tree.find_near(r, reach, found);
      std::array<double, 4> sums{};
      for (const std::uint32_t t : found) {
        const int column = static_cast<int>(t % width);
        const int row = static_cast<int>(t / width % height);
        double w = 0.0;
        if (parts == 1) {
          const glm::dvec3 along = r - glm::dvec3(tree.direction(t));
          w = weight_at(glm::dot(along, along)) * whole.solid_angle(row, column);
        } else {
          const int face = static_cast<int>(t / (width * height));
          for (int y = row * parts; y < (row + 1) * parts; ++y) {
            for (int x = column * parts; x < (column + 1) * parts; ++x) {
              const glm::dvec3 along = r - pieces.direction(face, y, x);
              w += weight_at(glm::dot(along, along)) * pieces.solid_angle(y, x);
            }
          }
        }
        const float* texel = map.values.data() + t * channels + first_channel;
        for (std::size_t c = 0; c < used; ++c) sums[c] += w * static_cast<double>(texel[c]);
        sums[3] += w;
      }
      if (sums[3] == 0.0) {
        // The lobe is smaller than the smallest piece: it sees the texel that it points at.
        const MapPoint p = point_from_direction(map.layout.projection, r);
        if (p.covered) {
          const std::size_t at = map.layout.index(0, p.face, texel_index(-p.y, map.layout.height),
                                                  texel_index(p.x, map.layout.width));
          for (std::size_t c = 0; c < used; ++c) {
            sums[c] = integral * static_cast<double>(map.values[at + first_channel + c]);
          }
          sums[3] = integral;
        }
      }
      store(job, i, sums.data(), 1);
    }
  });
}

void Convolver::State::wide(const LobePlan& plan, const Job& job) {
  const int cells = MomentGrid::cells_for(plan.finest());
  const MomentGrid& grid = grid_of(job.first_channel, cells, parts_for_width(map.layout, plan.width));
  const AccumulateLoop accumulate = accumulate_loop();
  for_outputs(job, job.tiles.size(), 4, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> list;
    for (std::size_t i = begin; i < end; ++i) {
      const Tile& tile = job.tiles[i];
      std::array<float, kOutputs> x{};
      std::array<float, kOutputs> y{};
      std::array<float, kOutputs> z{};
      glm::dvec3 middle(0.0);
      for (std::size_t k = 0; k < kOutputs; ++k) {
        const glm::vec3 d = job.directions[tile.output[std::min(k, tile.count - 1)]];
        x[k] = d.x;
        y[k] = d.y;
        z[k] = d.z;
        middle += glm::dvec3(d);
      }
      middle =
          glm::length(middle) > 0.0 ? glm::normalize(middle) : glm::dvec3(job.directions[tile.output[0]]);
      double radius = 0.0;
      for (std::size_t k = 0; k < tile.count; ++k) {
        radius = std::max(radius, glm::length(middle - glm::dvec3(job.directions[tile.output[k]])));
      }
      const std::array<float, 3> center{static_cast<float>(middle.x), static_cast<float>(middle.y),
                                        static_cast<float>(middle.z)};
      list.clear();
      grid.find(plan, cells, center.data(), static_cast<float>(radius) + 1e-6F, list);
      std::array<double, 4 * kOutputs> sums{};
      accumulate(grid.nodes(), list.data(), list.size(), x.data(), y.data(), z.data(), plan.terms,
                 sums.data());
      for (std::size_t k = 0; k < tile.count; ++k) {
        store(job, tile.output[k], sums.data() + k, kOutputs);
      }
    }
  });
}

void Convolver::State::apply(const Lobe& lobe, Job job) {
  LobePlan plan;
  make_plan(lobe, plan);
  for (; job.first_channel < map.layout.channels; job.first_channel += 3) {
    if (is_cosine(lobe)) {
      cosine(job);
    } else if (is_narrow(lobe, plan)) {
      narrow(lobe, plan, job);
    } else {
      wide(plan, job);
    }
  }
}

Convolver::Convolver(const EnvMapView& map) : state_(std::make_unique<State>()) {
  validate(map);
  const std::size_t bad = count_not_finite(map);
  if (bad > 0) {
    throw InvalidArgument("map", std::to_string(bad) + " NaN or infinite values", "finite values");
  }
  state_->map = map;
}

Convolver::~Convolver() = default;
Convolver::Convolver(Convolver&&) noexcept = default;
Convolver& Convolver::operator=(Convolver&&) noexcept = default;

EnvMap Convolver::apply(const Lobe& lobe, const PrefilterTarget& target, LobeScale scale,
                        const std::function<void(double)>& progress) {
  const EnvMapView& map = state_->map;
  validate(lobe);
  const EnvMapLayout layout{target.projection, target.width, target.height, 1, map.layout.channels};
  validate(layout);
  if (is_mirror(lobe)) {
    if (scale == LobeScale::sum) throw InvalidArgument("scale", "sum", "mean for a mirror");
    EnvMapView finest = map;
    finest.layout.levels = 1;
    finest.values = map.level(0);
    EnvMap result = resample(finest, target.projection, target.width, target.height);
    result.channels.assign(map.channels.begin(), map.channels.end());
    if (progress) progress(1.0);
    return result;
  }
  EnvMap result = make_envmap(layout, map.channels);
  const std::size_t width = static_cast<std::size_t>(target.width);
  const std::size_t height = static_cast<std::size_t>(target.height);
  std::vector<glm::vec3> directions(layout.level_texels(0));
  parallel_for(directions.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      directions[i] =
          glm::vec3(direction_from_point(target.projection, static_cast<int>(i / (width * height)),
                                         column_center(static_cast<int>(i % width), target.width),
                                         row_center(static_cast<int>(i / width % height), target.height)));
    }
  });
  std::vector<Tile> tiles;
  for (std::size_t face = 0; face < directions.size() / (width * height); ++face) {
    for (std::size_t top = 0; top < height; top += 4) {
      for (std::size_t left = 0; left < width; left += 4) {
        Tile tile;
        for (std::size_t row = top; row < std::min(height, top + 4); ++row) {
          for (std::size_t column = left; column < std::min(width, left + 4); ++column) {
            tile.output[tile.count++] = (face * height + row) * width + column;
          }
        }
        tiles.push_back(tile);
      }
    }
  }
  state_->apply(lobe, {directions, tiles, scale, result.values, progress});
  return result;
}

void Convolver::apply(const Lobe& lobe, std::span<const glm::vec3> directions, LobeScale scale,
                      std::span<float> values) {
  validate(lobe);
  if (is_mirror(lobe))
    throw InvalidArgument("lobe", "a mirror", "a lobe of some width for single directions");
  check_length("values", values.size(),
               directions.size() * static_cast<std::size_t>(state_->map.layout.channels),
               "directions × channels");
  std::vector<Tile> tiles(directions.size());
  std::vector<glm::vec3> unit(directions.size());
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const glm::dvec3 d = glm::dvec3(directions[i]);
    if (!is_finite(d) || !(glm::length(d) > 0.0)) {
      throw InvalidArgument("directions[" + std::to_string(i) + "]", "NaN, infinite or zero",
                            "a finite vector of a length above 0");
    }
    unit[i] = glm::vec3(glm::normalize(d));
    tiles[i].output[0] = i;
    tiles[i].count = 1;
  }
  const std::function<void(double)> silent;
  state_->apply(lobe, {unit, tiles, scale, values, silent});
}

EnvMap irradiance(const EnvMapView& map, const PrefilterTarget& target) {
  return Convolver(map).apply({LobeKind::lambert}, target, LobeScale::sum);
}

double chain_alpha(int level, int levels, RoughnessScale roughness) {
  if (level == 0) return 0.0;
  const double share = static_cast<double>(level) / (levels - 1);
  return std::max(0.01, roughness == RoughnessScale::squared ? share * share : share);
}

EnvMap ggx_chain(const EnvMapView& map, const ChainOptions& options) {
  check_range("size", options.size, 1, 16384, " texels");
  const int full = full_level_count(options.size, options.size);
  check_range("levels", options.levels, 0, full);
  const int levels = options.levels > 0 ? options.levels : std::max(1, full - 2);
  Convolver convolver(map);
  EnvMap result = make_envmap(
      {{ProjectionKind::cube}, options.size, options.size, levels, map.layout.channels}, map.channels);
  for (int level = 0; level < levels; ++level) {
    const Lobe lobe{LobeKind::ggx, 1.0, chain_alpha(level, levels, options.roughness)};
    const int size = result.layout.level_width(level);
    const EnvMap filtered = convolver.apply(lobe, {{ProjectionKind::cube}, size, size});
    std::copy(filtered.values.begin(), filtered.values.end(),
              result.values.begin() + static_cast<std::ptrdiff_t>(result.layout.level_offset(level)));
    if (options.progress) options.progress(level, levels);
  }
  return result;
}

}  // namespace mirrorbake
