#include "mirrorbake/inference/rendering_matrix.hpp"

#include <algorithm>
#include <bit>
#include <string>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake {
namespace {

constexpr std::size_t kRowsPerChunk = 256;

// The samples of one row: entries [begin, end) of `members`.
struct RowSamples {
  std::vector<std::uint32_t> members;  // indices into SurfaceSamples
  std::vector<std::size_t> offsets;    // rows + 1, into members
};

RowSamples group_by_pixel(const SurfaceSamples& samples, const SampleSelection& selection) {
  if (!selection.triangles.empty() && samples.triangle.size() != samples.size()) {
    throw InvalidArgument("samples.triangle", std::to_string(samples.triangle.size()) + " entries",
                          std::to_string(samples.size()) + ", as many as samples.pixel");
  }
  RowSamples rows;
  rows.offsets.push_back(0);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples.part[i] != selection.part) continue;
    if (!selection.triangles.empty()) {
      if (samples.triangle[i] >= selection.triangles.size()) {
        throw InvalidArgument("triangles", std::to_string(selection.triangles.size()) + " entries",
                              "one per triangle of the reflector, of which number " +
                                  std::to_string(samples.triangle[i]) + " is seen");
      }
      if (selection.triangles[samples.triangle[i]] == 0) continue;
    }
    if (!rows.members.empty() && samples.pixel[rows.members.back()] != samples.pixel[i]) {
      rows.offsets.push_back(rows.members.size());
    }
    rows.members.push_back(static_cast<std::uint32_t>(i));
  }
  if (!rows.members.empty()) rows.offsets.push_back(rows.members.size());
  return rows;
}

void check_lengths(const SurfaceSamples& samples) {
  const std::size_t n = samples.size();
  const auto check = [n](const char* name, std::size_t length) {
    if (length != n) {
      throw InvalidArgument(std::string("samples.") + name, std::to_string(length) + " entries",
                            std::to_string(n) + ", as many as samples.pixel");
    }
  };
  check("part", samples.part.size());
  check("position", samples.position.size());
  check("reflection", samples.reflection.size());
  check("dposition_dx", samples.dposition_dx.size());
  check("dposition_dy", samples.dposition_dy.size());
  check("dreflection_dx", samples.dreflection_dx.size());
  check("dreflection_dy", samples.dreflection_dy.size());
}

// One row under construction: adds up the weights of equal texels. The footprints of a pixel's samples overlap almost
// everywhere, so that a hash table of what is there beats sorting what comes.
class RowAccumulator {
 public:
  // Empties the row and makes room for `entries` additions.
  void start(std::size_t entries) {
    const std::size_t wanted = std::bit_ceil(2 * entries + 2);
    if (slots_.size() < wanted) {
      slots_.assign(wanted, kEmpty);
      shift_ = 32 - std::countr_zero(wanted);
    } else {
      for (std::uint32_t slot : used_) slots_[slot] = kEmpty;
    }
    used_.clear();
    row_.clear();
  }

  void add(std::uint32_t texel, float weight) {
    // Fibonacci hashing (Knuth, TAOCP 3, §6.4) with linear probing.
    std::uint32_t slot = (texel * 2654435769u) >> shift_;
    const std::uint32_t mask = static_cast<std::uint32_t>(slots_.size() - 1);
    while (slots_[slot] != kEmpty) {
      TexelWeight& entry = row_[slots_[slot]];
      if (entry.texel == texel) {
        entry.weight += weight;
        return;
      }
      slot = (slot + 1) & mask;
    }
    slots_[slot] = static_cast<std::uint32_t>(row_.size());
    used_.push_back(slot);
    row_.push_back({texel, weight});
  }

  // The row, by ascending texel. Valid until the next start; nothing may be added any more.
  const std::vector<TexelWeight>& finish() {
    std::sort(row_.begin(), row_.end(),
              [](const TexelWeight& a, const TexelWeight& b) { return a.texel < b.texel; });
    return row_;
  }

 private:
  static constexpr std::uint32_t kEmpty = 0xffffffffu;
  std::vector<std::uint32_t> slots_;  // index into row_
  std::vector<std::uint32_t> used_;
  std::vector<TexelWeight> row_;
  int shift_ = 32;
};

}  // namespace

CubeFootprint lookup_footprint(const SurfaceSamples& samples, std::size_t i, const Proxy& proxy,
                               const CubePyramidLayout& layout, const LookupOptions& options) {
  const glm::vec3 p = samples.position[i];
  const glm::vec3 r = samples.reflection[i];
  const float s = options.footprint_scale;
  const glm::vec3 direction = lookup_direction(proxy, p, r);
  const glm::vec3 right =
      lookup_direction(proxy, p + s * samples.dposition_dx[i], r + s * samples.dreflection_dx[i]);
  const glm::vec3 down =
      lookup_direction(proxy, p + s * samples.dposition_dy[i], r + s * samples.dreflection_dy[i]);
  const float level = cube_level_of_detail(layout, direction, right - direction, down - direction);
  return trilinear_footprint(layout, direction, level);
}

RenderingMatrix build_rendering_matrix(const SurfaceSamples& samples, const SampleSelection& selection,
                                       const Proxy& proxy, const CubePyramidLayout& layout,
                                       const LookupOptions& options) {
  check_lengths(samples);
  validate(proxy);
  if (!(options.footprint_scale > 0.0F) || options.footprint_scale > 1024.0F) {
    throw InvalidArgument("footprint_scale", text_of(options.footprint_scale), "a number in (0, 1024]");
  }
  const RowSamples groups = group_by_pixel(samples, selection);
  const std::size_t rows = groups.offsets.size() - 1;

  RenderingMatrix matrix;
  matrix.columns = layout.texels();
  matrix.row_pixels.resize(rows);
  matrix.row_samples.resize(rows);
  matrix.row_offsets.resize(rows + 1);

  // Every chunk of rows is built on its own, then all are put one behind the other.
  const std::size_t chunks = (rows + kRowsPerChunk - 1) / kRowsPerChunk;
  std::vector<std::vector<TexelWeight>> entries(chunks);
  parallel_for(rows, kRowsPerChunk, [&](std::size_t begin, std::size_t end) {
    std::vector<TexelWeight>& chunk = entries[begin / kRowsPerChunk];
    RowAccumulator accumulator;
    for (std::size_t r = begin; r < end; ++r) {
      const std::size_t count = groups.offsets[r + 1] - groups.offsets[r];
      const float mean = 1.0F / static_cast<float>(count);
      accumulator.start(count * CubeFootprint{}.texels.size());
      for (std::size_t k = groups.offsets[r]; k < groups.offsets[r + 1]; ++k) {
        const CubeFootprint footprint = lookup_footprint(samples, groups.members[k], proxy, layout, options);
        for (int t = 0; t < footprint.count; ++t) {
          const TexelWeight& entry = footprint.texels[static_cast<std::size_t>(t)];
          if (entry.weight > 0.0F) accumulator.add(entry.texel, mean * entry.weight);
        }
      }
      const std::vector<TexelWeight>& row = accumulator.finish();
      matrix.row_pixels[r] = samples.pixel[groups.members[groups.offsets[r]]];
      matrix.row_samples[r] = static_cast<std::uint32_t>(count);
      matrix.row_offsets[r + 1] = row.size();
      chunk.insert(chunk.end(), row.begin(), row.end());
    }
  });
  for (std::size_t r = 0; r < rows; ++r) matrix.row_offsets[r + 1] += matrix.row_offsets[r];

  matrix.texels.resize(matrix.row_offsets[rows]);
  matrix.weights.resize(matrix.row_offsets[rows]);
  parallel_for(chunks, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      std::size_t to = matrix.row_offsets[c * kRowsPerChunk];
      for (const TexelWeight& entry : entries[c]) {
        matrix.texels[to] = entry.texel;
        matrix.weights[to++] = entry.weight;
      }
    }
  });
  return matrix;
}

std::vector<float> average_over_rows(const RenderingMatrix& matrix, const SurfaceSamples& samples,
                                     const SampleSelection& selection, std::span<const float> values,
                                     int channels) {
  const std::size_t c = static_cast<std::size_t>(channels);
  if (channels < 1 || values.size() != samples.size() * c) {
    throw InvalidArgument("values", std::to_string(values.size()) + " numbers",
                          "samples × channels = " + std::to_string(samples.size() * c));
  }
  const RowSamples groups = group_by_pixel(samples, selection);
  const std::size_t rows = groups.offsets.size() - 1;
  if (rows != matrix.rows()) {
    throw InvalidArgument("matrix", std::to_string(matrix.rows()) + " rows",
                          std::to_string(rows) + ", one per pixel that sees the selected samples of part " +
                              std::to_string(selection.part));
  }
  std::vector<float> target(rows * c);
  parallel_for(rows, 4 * kRowsPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      for (std::size_t k = 0; k < c; ++k) {
        double sum = 0;
        for (std::size_t m = groups.offsets[r]; m < groups.offsets[r + 1]; ++m) {
          sum += static_cast<double>(values[groups.members[m] * c + k]);
        }
        target[r * c + k] =
            static_cast<float>(sum / static_cast<double>(groups.offsets[r + 1] - groups.offsets[r]));
      }
    }
  });
  return target;
}

std::vector<float> multiply(const RenderingMatrix& matrix, std::span<const float> x, int channels) {
  const std::size_t c = static_cast<std::size_t>(channels);
  if (channels < 1 || x.size() != matrix.columns * c) {
    throw InvalidArgument("x", std::to_string(x.size()) + " numbers",
                          "columns × channels = " + std::to_string(matrix.columns * c));
  }
  std::vector<float> b(matrix.rows() * c);
  parallel_for(matrix.rows(), 4 * kRowsPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      for (std::uint64_t e = matrix.row_offsets[r]; e < matrix.row_offsets[r + 1]; ++e) {
        const float* texel = x.data() + matrix.texels[e] * c;
        for (std::size_t k = 0; k < c; ++k) b[r * c + k] += matrix.weights[e] * texel[k];
      }
    }
  });
  return b;
}

}  // namespace mirrorbake
