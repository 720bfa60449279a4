#include "mirrorbake/envmap/resample.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <glm/matrix.hpp>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/isa.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "resample_job.hpp"
#include "symmetry.hpp"
#include "tap_builder.hpp"

// Resampling is linear: a texel of the target is a sum of weights times texels of the source, its taps. Turns
// and mirrors that take both grids to themselves take taps to taps, so that they are found for one texel of
// every orbit and applied to all (docs/adr/0021). The target is worked off in square tiles; the taps of a
// tile stay in the cache while they are applied.

namespace mirrorbake {

const ResampleKernels& resample_kernels() {
#ifdef MIRRORBAKE_HAS_X86_LEVELS
  switch (active_isa()) {
    case Isa::avx512: return avx512::kResampleKernels;
    case Isa::avx2: return avx2::kResampleKernels;
    case Isa::sse42: return sse42::kResampleKernels;
    case Isa::baseline: break;
  }
#endif
  return baseline::kResampleKernels;
}

namespace {

// Texels are counted in 32 bits.
void check_texels(const char* name, const EnvMapLayout& layout) {
  if (layout.level_texels(0) > std::numeric_limits<std::uint32_t>::max()) {
    throw InvalidArgument(name, std::to_string(layout.level_texels(0)) + " texels", "at most 4294967295");
  }
}

// Tiles of the target that have texels to find taps for.
std::vector<Tile> tiles_of(const ResampleJob& job, std::span<const SharedSymmetry> symmetries) {
  // Tiles that read some 90² texels of the source, as far as these are spread evenly, and wider than high,
  // since most symmetries take rows to rows; of small maps small ones, so that every thread gets some.
  constexpr int kAspect = 4;
  const double texels = static_cast<double>(job.target.level_texels(0));
  const double ratio = std::sqrt(static_cast<double>(job.source.level_texels(0)) / texels);
  const double most = std::sqrt(texels / static_cast<double>(symmetries.size()) / 16.0);
  const int down = static_cast<int>(std::clamp(std::min(45.0 / ratio, most), 1.0, 16.0));
  const int across = kAspect * down;
  std::vector<Tile> tiles;
  for (int face = 0; face < face_count(job.target.projection); ++face) {
    for (int row = 0; row < job.target.height; row += down) {
      for (int column = 0; column < job.target.width; column += across) {
        const Tile tile{face, row, column, std::min(down, job.target.height - row),
                        std::min(across, job.target.width - column)};
        if (may_have_first_texels(tile, symmetries)) tiles.push_back(tile);
      }
    }
  }
  return tiles;
}

// Of the texels of one face, after a symmetry.
TexelNumbering numbering(const EnvMapLayout& layout, const FaceMap& map) {
  const auto width = static_cast<std::uint32_t>(layout.width);
  const auto number = [&](int row, int column) {
    return static_cast<std::uint32_t>(row) * width + static_cast<std::uint32_t>(column);
  };
  const std::uint32_t face =
      static_cast<std::uint32_t>(map.face) * width * static_cast<std::uint32_t>(layout.height);
  return {face + number(map.row_offset, map.column_offset),
          number(map.row_per_row, map.column_per_row),
          number(map.row_per_column, map.column_per_column),
          map.column_per_row,
          map.column_per_column,
          map.column_offset,
          layout.width};
}

// Applies taps to a map, for one thread.
class TapApplication {
 public:
  TapApplication(const ResampleJob& job, std::span<const SharedSymmetry> symmetries,
                 std::span<const float> values, int channels, std::span<float> result)
      : job_(job),
        kernels_(resample_kernels()),
        symmetries_(symmetries),
        values_(values),
        channels_(channels),
        last_texel_(static_cast<std::uint32_t>(job.source.level_texels(0) - 1)),
        result_(result) {}

  void apply(const TapChunk& chunk) {
    for (const SharedSymmetry& symmetry : symmetries_) {
      const TexelNumbering targets =
          numbering(job_.target, symmetry.target.faces[static_cast<std::size_t>(chunk.face)]);
      apply(chunk.blocks, symmetry.source, targets);
      apply(chunk.lists, symmetry.source, targets);
    }
    for (const FaceTexel& giant : chunk.giants) apply_giant(giant);
  }

 private:
  void apply(const TapChunk::Blocks& blocks, const TexelMap& map, const TexelNumbering& targets) {
    number(targets, blocks.target_rows, blocks.target_columns, targets_);
    std::size_t first = 0;
    const float* weights = blocks.weights.data();
    for (auto group = blocks.groups.begin(); group != blocks.groups.end();) {
      const auto same_face = [&](const BlockGroup& other) { return other.face == group->face; };
      const auto end = std::find_if_not(group, blocks.groups.end(), same_face);
      std::uint32_t count = 0;
      for (auto other = group; other != end; ++other) count += other->targets;
      const FaceMap& face = map.faces[static_cast<std::size_t>(group->face)];
      const TexelNumbering texels = numbering(job_.source, face);
      texels_.resize(count);
      const std::uint32_t last = kernels_.number_texels(texels, blocks.rows.data() + first,
                                                        blocks.columns.data() + first, count, texels_.data());
      const BlockSteps steps{static_cast<std::int32_t>(texels.per_row),
                             static_cast<std::int32_t>(texels.per_column)};
      const bool crosses = crosses_seam(face, blocks.left, blocks.right);
      const std::uint32_t* texel = texels_.data();
      for (; group != end; ++group) {
        if (crosses) {
          apply_around_seam(*group, blocks, first, face, steps, last, texel, weights);
        } else {
          apply_blocks(*group, steps, last, texel, weights, targets_.data() + first);
        }
        first += group->targets;
        texel += group->targets;
        weights += static_cast<std::size_t>(group->targets) * group->rows * group->columns;
      }
    }
  }

  // `last`: the largest of `texels`.
  void apply_blocks(const BlockGroup& group, const BlockSteps& steps, std::uint32_t last,
                    const std::uint32_t* texels, const float* weights, const std::uint32_t* targets) {
    const std::int64_t reach = static_cast<std::int64_t>(std::max(steps.per_row, 0)) * (group.rows - 1) +
                               static_cast<std::int64_t>(std::max(steps.per_column, 0)) * (group.columns - 1);
    kernels_.apply_blocks(values_.data(), channels_, group, steps, texels, weights, targets,
                          last + reach < last_texel_, result_.data());
  }

  // Whether columns of a panorama, from left to right, lie on both sides of its seam after a symmetry.
  bool crosses_seam(const FaceMap& map, int left, int right) const {
    if (!job_.is_periodic()) return false;
    const auto turn = [&](int column) {
      const int x = map.column_per_column * column + map.column_offset;
      return (x >= 0 ? x : x - job_.width() + 1) / job_.width();
    };
    return turn(left) != turn(right - 1);
  }

  // Blocks that lie across the seam, texel by texel.
  void apply_around_seam(const BlockGroup& group, const TapChunk::Blocks& blocks, std::size_t first,
                         const FaceMap& face, const BlockSteps& steps, std::uint32_t last,
                         const std::uint32_t* texels, const float* weights) {
    const TexelNumbering numbers = numbering(job_.source, face);
    const std::size_t taps = static_cast<std::size_t>(group.rows) * group.columns;
    const auto crosses = [&](std::uint32_t i) {
      // Whether the first and the last column are not as far apart as they should be, after a symmetry.
      const int one = face.column_per_column * blocks.columns[first + i] + face.column_offset;
      const int other = one + face.column_per_column * (static_cast<int>(group.columns) - 1);
      const auto turn = [&](int x) {
        const int width = job_.width();
        return (x >= -width) + (x >= 0) + (x >= width) + (x >= 2 * width);
      };
      return turn(one) != turn(other);
    };
    for (std::uint32_t i = 0; i < group.targets;) {
      BlockGroup part = group;
      part.targets = 0;
      while (i + part.targets < group.targets && !crosses(i + part.targets)) ++part.targets;
      apply_blocks(part, steps, last, texels + i, weights + i * taps, targets_.data() + first + i);
      i += part.targets;
      const std::uint32_t begin = i;
      taps_.clear();
      for (; i < group.targets && crosses(i); ++i) {
        for (std::uint32_t k = 0; k < taps; ++k) {
          const int column = blocks.columns[first + i] + static_cast<int>(k % group.columns);
          taps_.push_back(number(numbers, blocks.rows[first + i] + static_cast<int>(k / group.columns),
                                 column < job_.width() ? column : column - job_.width()));
        }
      }
      counts_.assign(i - begin, static_cast<std::uint32_t>(taps));
      apply_taps(counts_, weights + begin * taps, targets_.data() + first + begin);
    }
  }

  void apply(const TapChunk::Lists& lists, const TexelMap& map, const TexelNumbering& targets) {
    if (lists.counts.empty()) return;
    if (face_count(job_.projection()) == 1) {
      number(numbering(job_.source, map.faces[0]), lists.rows, lists.columns, taps_);
    } else {
      std::array<TexelNumbering, 6> numbers;
      for (std::size_t face = 0; face < 6; ++face) numbers[face] = numbering(job_.source, map.faces[face]);
      taps_.clear();
      for (std::size_t i = 0; i < lists.faces.size(); ++i) {
        taps_.push_back(number(numbers[lists.faces[i]], lists.rows[i], lists.columns[i]));
      }
    }
    number(targets, lists.target_rows, lists.target_columns, targets_);
    apply_taps(lists.counts, lists.weights.data(), targets_.data());
  }

  // Of taps_.
  void apply_taps(std::span<const std::uint32_t> counts, const float* weights, const std::uint32_t* targets) {
    std::uint32_t last = 0;
    for (const std::uint32_t tap : taps_) last = std::max(last, tap);
    kernels_.apply_taps(values_.data(), channels_, taps_.data(), weights, counts.data(), counts.size(),
                        targets, last < last_texel_, result_.data());
  }

  static std::uint32_t number(const TexelNumbering& n, int row, int column) {
    const int at = n.column_per_row * row + n.column_per_column * column + n.column_offset;
    const int turn = at < 0 ? n.width : at >= n.width ? -n.width : 0;
    return n.first + n.per_row * static_cast<std::uint32_t>(row) +
           n.per_column * static_cast<std::uint32_t>(column) + static_cast<std::uint32_t>(turn);
  }

  void number(const TexelNumbering& numbering, const std::vector<std::uint16_t>& rows,
              const std::vector<std::uint16_t>& columns, std::vector<std::uint32_t>& numbers) {
    numbers.resize(rows.size());
    kernels_.number_texels(numbering, rows.data(), columns.data(), rows.size(), numbers.data());
  }

  static std::uint32_t number(const EnvMapLayout& layout, const FaceTexel& texel) {
    return static_cast<std::uint32_t>(layout.index(0, texel.face, texel.row, texel.column));
  }

  void apply_giant(const FaceTexel& target) {
    // A symmetry may take the texel to itself.
    std::vector<TexelMap> maps;
    std::vector<std::uint32_t> targets;
    for (const SharedSymmetry& symmetry : symmetries_) {
      const std::uint32_t image = number(job_.target, symmetry.target(target));
      if (std::find(targets.begin(), targets.end(), image) != targets.end()) continue;
      targets.push_back(image);
      maps.push_back(symmetry.source);
    }
    const std::size_t channels = static_cast<std::size_t>(channels_);
    std::vector<double> sums(maps.size() * channels, 0.0);
    const auto corner = [&](int row, int column) {
      return glm::dvec2(2.0 * column / job_.target.width - 1.0, 1.0 - 2.0 * row / job_.target.height);
    };
    if (!irregular_) irregular_.emplace(job_);
    const double total = irregular_->stream(
        target.face, corner(target.row, target.column), corner(target.row + 1, target.column + 1),
        [&](std::span<const Tap> taps) {
          for (std::size_t i = 0; i < maps.size(); ++i) {
            double* sum = sums.data() + i * channels;
            for (const Tap& tap : taps) {
              const float* texel = values_.data() + number(job_.source, maps[i](tap.texel)) * channels;
              for (std::size_t c = 0; c < channels; ++c) sum[c] += tap.weight * static_cast<double>(texel[c]);
            }
          }
        });
    for (std::size_t i = 0; i < maps.size(); ++i) {
      for (std::size_t c = 0; c < channels; ++c) {
        result_[targets[i] * channels + c] = static_cast<float>(sums[i * channels + c] / total);
      }
    }
  }

  const ResampleJob& job_;
  const ResampleKernels& kernels_;
  const std::span<const SharedSymmetry> symmetries_;
  const std::span<const float> values_;
  const int channels_;
  const std::uint32_t last_texel_;
  const std::span<float> result_;
  std::vector<std::uint32_t> texels_, taps_, targets_, counts_;
  std::optional<IrregularTexels> irregular_;
};

// In some 64 pieces: few enough to amortise what each sets up.
std::size_t tile_grain(std::size_t tiles) { return (tiles + 63) / 64; }

}  // namespace

struct Resampler::Plan {
  Plan(const EnvMapLayout& source, const EnvMapLayout& target, const ResampleOptions& options)
      : job(source, target, options),
        symmetries(shared_symmetries(job.source, job.target, options.source_from_target)),
        lines(job),
        tiles(tiles_of(job, symmetries)) {}

  void keep_taps(std::size_t max_bytes) {
    chunks.resize(tiles.size());
    std::atomic<std::size_t> total{0};
    parallel_for(tiles.size(), tile_grain(tiles.size()), [&](std::size_t begin, std::size_t end) {
      TapBuilder builder(job, lines, symmetries);
      TapChunk chunk;
      for (std::size_t i = begin; i < end; ++i) {
        if (total > max_bytes) return;
        builder.build(tiles[i], chunk);
        const std::size_t size = chunk.bytes();
        if ((total += size) > max_bytes) {
          total -= size;
        } else {
          chunks[i] = chunk;  // of no more capacity than it needs
        }
      }
    });
    bytes = total;
  }

  void apply(std::span<const float> values, int channels, std::span<float> result) const {
    parallel_for(tiles.size(), tile_grain(tiles.size()), [&](std::size_t begin, std::size_t end) {
      TapApplication application(job, symmetries, values, channels, result);
      std::optional<TapBuilder> builder;
      TapChunk chunk;
      for (std::size_t i = begin; i < end; ++i) {
        if (i < chunks.size() && chunks[i]) {
          application.apply(*chunks[i]);
          continue;
        }
        if (!builder) builder.emplace(job, lines, symmetries);
        builder->build(tiles[i], chunk);
        application.apply(chunk);
      }
    });
  }

  ResampleJob job;
  std::vector<SharedSymmetry> symmetries;
  TexelLines lines;
  std::vector<Tile> tiles;
  std::vector<std::optional<TapChunk>> chunks;  // of the tiles, those that are kept
  std::size_t bytes = 0;
};

Resampler::Resampler(const EnvMapLayout& source, const Projection& target, int width, int height,
                     const ResampleOptions& options, std::size_t max_bytes) {
  const EnvMapLayout result{target, width, height, 1, 1};
  validate(source);
  validate(result);
  check_texels("source", source);
  check_texels("target", result);
  check_orthonormal("source_from_target", options.source_from_target);
  plan_ = std::make_unique<Plan>(source, result, options);
  if (max_bytes > 0) plan_->keep_taps(max_bytes);
}

Resampler::~Resampler() = default;
Resampler::Resampler(Resampler&&) noexcept = default;
Resampler& Resampler::operator=(Resampler&&) noexcept = default;

EnvMapLayout Resampler::layout(int channels) const {
  EnvMapLayout layout = plan_->job.target;
  layout.channels = channels;
  return layout;
}

std::size_t Resampler::bytes() const { return plan_->bytes; }

EnvMap Resampler::apply(const EnvMapView& source) const {
  EnvMap result = make_envmap(layout(source.layout.channels), source.channels);
  apply(source, result.values);
  return result;
}

void Resampler::apply(const EnvMapView& source, std::span<float> result) const {
  validate(source);
  const EnvMapLayout& expected = plan_->job.source;
  if (source.layout.projection != expected.projection || source.layout.width != expected.width ||
      source.layout.height != expected.height) {
    const auto text = [](const EnvMapLayout& l) {
      return to_string(l.projection) + " of " + std::to_string(l.width) + " x " + std::to_string(l.height);
    };
    throw InvalidArgument("source", text(source.layout), text(expected));
  }
  const std::size_t size = layout(source.layout.channels).size();
  check_length("result", result.size(), size, "texels × channels");
  plan_->apply(source.level(0), source.layout.channels, result);
}

EnvMap resample(const EnvMapView& source, const Projection& target, int width, int height,
                const ResampleOptions& options) {
  validate(source);
  return Resampler(source.layout, target, width, height, options, 0).apply(source);
}

}  // namespace mirrorbake
