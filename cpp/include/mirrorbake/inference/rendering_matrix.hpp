#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mirrorbake/envmap/cube_pyramid.hpp"
#include "mirrorbake/envmap/cube_sampling.hpp"
#include "mirrorbake/proxy/proxy.hpp"
#include "mirrorbake/surface/surface_samples.hpp"

/// The rendering matrix ([PEM] §4 "EM Inference"; spec I1): rendering with an environment map is linear in the
/// map's texels, b = A x.
namespace mirrorbake {

/// How a renderer reads the map: what the matrix and the run time have to agree on.
struct LookupOptions {
  /// Size of a lookup's footprint in pixels: differentials are multiplied by it before the level is chosen. 1: the
  /// pixel's, as graphics hardware does. Supersampled images are sharper with less, down to 1/√(samples per pixel):
  /// the default suits 16.
  float footprint_scale = 0.25F;
};

/// Texels and weights with which surface sample `sample` reads a map of `layout` on `proxy`.
CubeFootprint lookup_footprint(const SurfaceSamples& samples, std::size_t sample, const Proxy& proxy,
                               const CubePyramidLayout& layout, const LookupOptions& options);

/// The samples that a matrix is of: those on a part, and of that part on some triangles alone, such as those off the convex
/// hull, which can reflect the object itself.
struct SampleSelection {
  SampleSelection(int part_number,
                  std::span<const std::uint8_t> chosen_triangles = {})  // NOLINT: a part is one
      : part(part_number), triangles(chosen_triangles) {}

  int part = 0;
  std::span<const std::uint8_t>
      triangles;  ///< one entry per triangle of the reflector, 0: not chosen; empty: all
};

/// Sparse matrix in rows (CSR). One row per pixel that sees the selection, holding the mean of its samples' footprints, so
/// that the weights of each row sum to 1; one column per texel of every mip level.
struct RenderingMatrix {
  std::size_t columns = 0;
  std::vector<std::uint64_t> row_offsets;  ///< rows + 1
  std::vector<std::uint32_t> texels;       ///< column of each entry, ascending in a row
  std::vector<float> weights;              ///< > 0
  std::vector<std::uint32_t> row_pixels;   ///< y · width + x, ascending
  std::vector<std::uint32_t> row_samples;  ///< how many samples of the pixel are selected, ≥ 1

  std::size_t rows() const { return row_pixels.size(); }
  std::size_t nonzeros() const { return texels.size(); }
};

/// Matrix of the selected samples, built analytically from their lookups. Throws InvalidArgument if the arrays of
/// `samples` differ in length, a sample's triangle is not in the selection's array, or the proxy is not valid.
RenderingMatrix build_rendering_matrix(const SurfaceSamples& samples, const SampleSelection& selection,
                                       const Proxy& proxy, const CubePyramidLayout& layout,
                                       const LookupOptions& options = {});

/// The target b that belongs to the matrix's rows: the mean of `values` (one entry of `channels` floats per sample of
/// `samples`) over the samples of each row. Returns rows × channels.
std::vector<float> average_over_rows(const RenderingMatrix& matrix, const SurfaceSamples& samples,
                                     const SampleSelection& selection, std::span<const float> values,
                                     int channels);

/// b = A x for x of columns × channels. Returns rows × channels.
std::vector<float> multiply(const RenderingMatrix& matrix, std::span<const float> x, int channels);

}  // namespace mirrorbake
