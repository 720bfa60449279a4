#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mirrorbake/envmap/texel_topology.hpp"
#include "mirrorbake/proxy/proxy.hpp"
#include "mirrorbake/surface/run_time_model.hpp"
#include "mirrorbake/surface/surface_samples.hpp"

/// The rendering matrix ([PEM] §4 "EM Inference"; spec I1): rendering with an environment map is linear in
/// the map's texels, b = A x.
namespace mirrorbake {

/// The samples that a matrix is of: those on a part, and of that part on some triangles alone, such as those
/// off the convex hull, which can reflect the object itself.
struct SampleSelection {
  SampleSelection(int part_number,
                  std::span<const std::uint8_t> chosen_triangles = {})  // NOLINT: a part is one
      : part(part_number), triangles(chosen_triangles) {}

  int part = 0;
  /// One entry per triangle of the reflector, 0: not chosen; empty: all
  std::span<const std::uint8_t> triangles;
};

/// Sparse matrix in rows (CSR). One row per pixel that sees the selection, holding the mean of its samples'
/// reads, so that the weights of each row sum to 1; one column per texel of every mip level.
struct RenderingMatrix {
  std::size_t columns = 0;
  std::vector<std::uint64_t> row_offsets;  ///< rows + 1
  std::vector<std::uint32_t> texels;       ///< column of each entry, ascending in a row
  std::vector<float> weights;              ///< > 0
  std::vector<std::uint32_t> row_pixels;   ///< y · width + x, ascending
  /// What the rows are the means of: row r of the samples member[member_offsets[r]] … of `sample_count`
  /// samples.
  std::vector<std::uint64_t> member_offsets;  ///< rows + 1; empty for a matrix whose samples are not known
  std::vector<std::uint32_t> members;
  std::size_t sample_count = 0;

  std::size_t rows() const { return row_pixels.size(); }
  std::size_t nonzeros() const { return texels.size(); }
  std::uint32_t row_samples(std::size_t row) const {
    return static_cast<std::uint32_t>(member_offsets[row + 1] - member_offsets[row]);
  }
};

/// Matrix of the selected samples, built analytically from the lookups by which `model` draws them; the
/// model's places are not looked at: the lookups are where the samples are. Throws InvalidArgument if the
/// arrays of `samples` differ in length, a sample's triangle is not in the selection's array, or the proxy or
/// the model is not valid.
RenderingMatrix build_rendering_matrix(const SurfaceSamples& samples, const SampleSelection& selection,
                                       const Proxy& proxy, const TexelTopology& topology,
                                       const RunTimeModel& model = reference_run_time());

/// The target b that belongs to the matrix's rows: the mean of `values` (one entry of `channels` floats per
/// sample) over the samples of each row. Returns rows × channels.
std::vector<float> average_over_rows(const RenderingMatrix& matrix, std::span<const float> values,
                                     int channels);

/// b = A x for x of columns × channels. Returns rows × channels.
std::vector<float> multiply(const RenderingMatrix& matrix, std::span<const float> x, int channels);

/// Row weights for a target that will be looked at on a display: coverage (samples of the row over samples
/// per pixel) over (1 + luminance)², since a display compresses what is bright, and least squares would spend
/// the map on lights. Returns one weight per row and channel. `pixel_samples` as in SurfaceSamples: empty, or
/// the samples of every pixel in place of samples_per_pixel.
std::vector<float> display_row_weights(const RenderingMatrix& matrix, int samples_per_pixel,
                                       std::span<const float> target, int channels,
                                       std::span<const std::uint32_t> pixel_samples = {});

}  // namespace mirrorbake
