#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/envmap/reads.hpp"
#include "mirrorbake/inference/rendering_matrix.hpp"

namespace mirrorbake {

/// One row of a matrix under construction: adds up the weights of equal texels. The footprints of a pixel's
/// lookups overlap almost everywhere, so that a hash table of what is there beats sorting what comes.
class RowAccumulator {
 public:
  /// Empties the row.
  void start();
  void add(std::uint32_t texel, float weight);
  /// The row, by ascending texel. Valid until the next start; nothing may be added any more.
  const std::vector<TexelWeight>& finish();

 private:
  void grow();
  std::size_t slot_of(std::uint32_t texel) const;

  std::vector<std::uint32_t> slots_;  // index into row_
  std::vector<std::uint32_t> used_;
  std::vector<TexelWeight> row_;
  int shift_ = 32;
};

/// Fills in offsets, texels and weights of `matrix`, whose rows `fill_row(row, accumulator)` makes, in
/// parallel: every chunk of rows is built on its own, then all are put one behind the other.
template <typename FillRow>
void build_rows(RenderingMatrix& matrix, std::size_t rows, const FillRow& fill_row) {
  constexpr std::size_t kRowsPerChunk = 256;
  const std::size_t chunks = (rows + kRowsPerChunk - 1) / kRowsPerChunk;
  std::vector<std::vector<TexelWeight>> entries(chunks);
  matrix.row_offsets.assign(rows + 1, 0);
  parallel_for(rows, kRowsPerChunk, [&](std::size_t begin, std::size_t end) {
    std::vector<TexelWeight>& chunk = entries[begin / kRowsPerChunk];
    RowAccumulator accumulator;
    for (std::size_t r = begin; r < end; ++r) {
      accumulator.start();
      fill_row(r, accumulator);
      const std::vector<TexelWeight>& row = accumulator.finish();
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
}

}  // namespace mirrorbake
