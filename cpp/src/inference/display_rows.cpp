#include "display_rows.hpp"

#include <algorithm>

#include "mirrorbake/surface/lookup.hpp"
#include "row_builder.hpp"

namespace mirrorbake {
namespace {

// The lookups of every pixel that traced samples see, too: [begin, end) of the view's lookups, which are in
// the order of pixels.
struct PixelLookups {
  std::uint32_t pixel;
  std::size_t begin, end;
};

std::vector<PixelLookups> pixels_of(const DisplayView& view) {
  std::vector<PixelLookups> result;
  const std::vector<std::uint32_t>& pixel = view.lookups->pixel;
  for (std::size_t begin = 0; begin < pixel.size();) {
    std::size_t end = begin;
    while (end < pixel.size() && pixel[end] == pixel[begin]) ++end;
    if (view.targets->count(pixel[begin]) > 0) result.push_back({pixel[begin], begin, end});
    begin = end;
  }
  return result;
}

bool covers(const FitShell& shell, const SurfaceSamples& lookups, std::size_t i) {
  return shell.triangles.empty() || shell.triangles[lookups.triangle[i]] != 0;
}

float mean_of(glm::vec3 v) { return (v.x + v.y + v.z) / 3.0F; }

}  // namespace

LayerRows build_layer_rows(const FitModel& model, const DisplayView& view) {
  struct Row {
    PixelLookups pixel;
    int part, shell;
  };
  const SurfaceSamples& lookups = *view.lookups;
  std::vector<Row> rows;
  for (const PixelLookups& pixel : pixels_of(view)) {
    for (std::size_t p = 0; p < model.parts.size(); ++p) {
      const int part = static_cast<int>(p);
      if (view.targets->count(pixel.pixel, part) == 0) continue;
      for (std::size_t k = 0; k < model.parts[p].size(); ++k) {
        bool seen = false;
        for (std::size_t i = pixel.begin; i < pixel.end && !seen; ++i) {
          seen = lookups.part[i] == part && covers(model.parts[p][k], lookups, i);
        }
        if (seen) rows.push_back({pixel, part, static_cast<int>(k)});
      }
    }
  }
  LayerRows result;
  result.matrix.columns = model.texels();
  result.target.resize(rows.size());
  result.fresnel.resize(rows.size());
  result.coverage.resize(rows.size());
  for (const Row& row : rows) result.matrix.row_pixels.push_back(row.pixel.pixel);
  build_rows(result.matrix, rows.size(), [&](std::size_t r, RowAccumulator& accumulator) {
    const Row& row = rows[r];
    const FitShell& shell =
        model.parts[static_cast<std::size_t>(row.part)][static_cast<std::size_t>(row.shell)];
    const auto map = static_cast<std::size_t>(shell.map);
    std::size_t count = 0;
    glm::vec3 fresnel(0.0F);
    for (std::size_t i = row.pixel.begin; i < row.pixel.end; ++i) {
      if (lookups.part[i] != row.part || !covers(shell, lookups, i)) continue;
      ++count;
      fresnel += lookups.fresnel[i];
    }
    const float mean = 1.0F / static_cast<float>(count);
    for (std::size_t i = row.pixel.begin; i < row.pixel.end; ++i) {
      if (lookups.part[i] != row.part || !covers(shell, lookups, i)) continue;
      for (const TexelWeight& entry : lookup(lookups, i, shell.proxy, model.maps[map], *model.run_time)) {
        if (entry.weight > 0.0F) {
          accumulator.add(static_cast<std::uint32_t>(model.first_texel[map]) + entry.texel,
                          mean * entry.weight);
        }
      }
    }
    const bool last =
        static_cast<std::size_t>(row.shell) + 1 == model.parts[static_cast<std::size_t>(row.part)].size();
    result.target[r] = last ? glm::vec4(view.targets->light_from(row.pixel.pixel, row.part, row.shell), 1.0F)
                            : view.targets->shell(row.pixel.pixel, row.part, row.shell);
    result.fresnel[r] = mean * fresnel;
    result.coverage[r] = view.targets->coverage(row.pixel.pixel, row.part);
  });
  return result;
}

DisplayRows build_display_rows(const FitModel& model, const DisplayView& view, std::span<const float> alpha) {
  const SurfaceSamples& lookups = *view.lookups;
  const std::vector<PixelLookups> rows = pixels_of(view);
  DisplayRows result;
  result.matrix.columns = model.texels();
  result.target.resize(rows.size());
  result.fresnel.resize(rows.size());
  result.diffuse.resize(rows.size());
  result.coverage.resize(rows.size());
  for (const PixelLookups& row : rows) result.matrix.row_pixels.push_back(row.pixel);
  build_rows(result.matrix, rows.size(), [&](std::size_t r, RowAccumulator& accumulator) {
    const PixelLookups& row = rows[r];
    const float count = static_cast<float>(row.end - row.begin);
    glm::vec3 fresnel(0.0F);
    for (std::size_t i = row.begin; i < row.end; ++i) fresnel += lookups.fresnel[i];
    fresnel /= count;
    const float whole = std::max(mean_of(fresnel), 1e-12F);
    for (std::size_t i = row.begin; i < row.end; ++i) {
      float share = mean_of(lookups.fresnel[i]) / (whole * count);
      for (const FitShell& shell : model.parts[lookups.part[i]]) {
        if (!covers(shell, lookups, i)) continue;
        const auto map = static_cast<std::size_t>(shell.map);
        const std::size_t first = model.first_texel[map];
        float opacity = 0.0F;
        for (const TexelWeight& entry : lookup(lookups, i, shell.proxy, model.maps[map], *model.run_time)) {
          if (entry.weight <= 0.0F) continue;
          opacity += entry.weight * alpha[first + entry.texel];
          if (share > 0.0F)
            accumulator.add(static_cast<std::uint32_t>(first) + entry.texel, share * entry.weight);
        }
        share *= std::clamp(1.0F - opacity, 0.0F, 1.0F);
      }
    }
    const glm::vec3 reflected = view.targets->reflected(row.pixel);
    for (int k = 0; k < 3; ++k) result.target[r][k] = fresnel[k] > 0.0F ? reflected[k] / fresnel[k] : 0.0F;
    result.fresnel[r] = fresnel;
    result.diffuse[r] = view.targets->diffuse(row.pixel);
    result.coverage[r] = view.targets->coverage(row.pixel);
  });
  return result;
}

}  // namespace mirrorbake
