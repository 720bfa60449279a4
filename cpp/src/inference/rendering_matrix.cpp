#include "mirrorbake/inference/rendering_matrix.hpp"

#include <algorithm>
#include <string>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/surface/lookup.hpp"
#include "row_builder.hpp"

namespace mirrorbake {
namespace {

constexpr std::size_t kRowsPerChunk = 1024;

// Pixels and members of the rows.
void group_by_pixel(const SurfaceSamples& samples, const SampleSelection& selection,
                    RenderingMatrix& matrix) {
  if (!selection.triangles.empty()) {
    check_length("samples.triangle", samples.triangle.size(), samples.size(), "as many as samples.pixel");
  }
  matrix.member_offsets.push_back(0);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples.part[i] != selection.part) continue;
    // What a matte surface does not mirror says nothing about the maps.
    if (!samples.fresnel.empty() && samples.fresnel[i] == glm::vec3(0.0F)) continue;
    if (!selection.triangles.empty()) {
      if (samples.triangle[i] >= selection.triangles.size()) {
        throw InvalidArgument("triangles", std::to_string(selection.triangles.size()) + " entries",
                              "one per triangle of the reflector, of which number " +
                                  std::to_string(samples.triangle[i]) + " is seen");
      }
      if (selection.triangles[samples.triangle[i]] == 0) continue;
    }
    if (matrix.members.empty() || samples.pixel[matrix.members.back()] != samples.pixel[i]) {
      if (!matrix.members.empty()) matrix.member_offsets.push_back(matrix.members.size());
      matrix.row_pixels.push_back(samples.pixel[i]);
    }
    matrix.members.push_back(static_cast<std::uint32_t>(i));
  }
  if (!matrix.members.empty()) matrix.member_offsets.push_back(matrix.members.size());
  matrix.sample_count = samples.size();
}

}  // namespace

RenderingMatrix build_rendering_matrix(const SurfaceSamples& samples, const SampleSelection& selection,
                                       const Proxy& proxy, const TexelTopology& topology,
                                       const RunTimeModel& model) {
  check_lookup_arrays(samples);
  validate(proxy);
  validate(model);
  RenderingMatrix matrix;
  matrix.columns = topology.texels();
  group_by_pixel(samples, selection, matrix);
  build_rows(matrix, matrix.rows(), [&](std::size_t r, RowAccumulator& row) {
    const float mean = 1.0F / static_cast<float>(matrix.row_samples(r));
    for (std::uint64_t k = matrix.member_offsets[r]; k < matrix.member_offsets[r + 1]; ++k) {
      for (const TexelWeight& entry : lookup(samples, matrix.members[k], proxy, topology, model)) {
        if (entry.weight > 0.0F) row.add(entry.texel, mean * entry.weight);
      }
    }
  });
  return matrix;
}

std::vector<float> average_over_rows(const RenderingMatrix& matrix, std::span<const float> values,
                                     int channels) {
  check_range("channels", channels, 1, 1 << 16);
  const std::size_t c = static_cast<std::size_t>(channels);
  check_length("values", values.size(), matrix.sample_count * c, "samples × channels");
  std::vector<float> target(matrix.rows() * c);
  parallel_for(matrix.rows(), kRowsPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      for (std::size_t k = 0; k < c; ++k) {
        double sum = 0;
        for (std::uint64_t m = matrix.member_offsets[r]; m < matrix.member_offsets[r + 1]; ++m) {
          sum += static_cast<double>(values[matrix.members[m] * c + k]);
        }
        target[r * c + k] = static_cast<float>(sum / matrix.row_samples(r));
      }
    }
  });
  return target;
}

std::vector<float> multiply(const RenderingMatrix& matrix, std::span<const float> x, int channels) {
  check_range("channels", channels, 1, 1 << 16);
  const std::size_t c = static_cast<std::size_t>(channels);
  check_length("x", x.size(), matrix.columns * c, "columns × channels");
  std::vector<float> b(matrix.rows() * c);
  parallel_for(matrix.rows(), kRowsPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      for (std::uint64_t e = matrix.row_offsets[r]; e < matrix.row_offsets[r + 1]; ++e) {
        const float* texel = x.data() + matrix.texels[e] * c;
        for (std::size_t k = 0; k < c; ++k) b[r * c + k] += matrix.weights[e] * texel[k];
      }
    }
  });
  return b;
}

std::vector<float> display_row_weights(const RenderingMatrix& matrix, int samples_per_pixel,
                                       std::span<const float> target, int channels,
                                       std::span<const std::uint32_t> pixel_samples) {
  check_range("samples_per_pixel", samples_per_pixel, 1, 1 << 20);
  if (!pixel_samples.empty() && matrix.rows() > 0 && matrix.row_pixels.back() >= pixel_samples.size()) {
    throw InvalidArgument("pixel_samples", std::to_string(pixel_samples.size()) + " entries",
                          "one per pixel of the image");
  }
  const std::size_t c = static_cast<std::size_t>(channels);
  check_length("target", target.size(), matrix.rows() * c, "rows × channels");
  std::vector<float> weights(matrix.rows() * c);
  for (std::size_t r = 0; r < matrix.rows(); ++r) {
    const float* b = target.data() + r * c;
    // Luminance of Rec.709 primaries (ITU-R BT.709-6, §3.2).
    const float luminance = c >= 3 ? 0.2126F * b[0] + 0.7152F * b[1] + 0.0722F * b[2] : b[0];
    const float compression = 1.0F + std::max(luminance, 0.0F);
    const float samples = pixel_samples.empty() ? static_cast<float>(samples_per_pixel)
                                                : static_cast<float>(pixel_samples[matrix.row_pixels[r]]);
    const float weight = static_cast<float>(matrix.row_samples(r)) / (samples * compression * compression);
    std::fill_n(weights.begin() + static_cast<std::ptrdiff_t>(r * c), c, weight);
  }
  return weights;
}

}  // namespace mirrorbake
