#include "probed_rows.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "row_builder.hpp"

namespace mirrorbake {
namespace {

constexpr std::uint32_t kNoRow = 0xffffffffU;

// Number of the row of every lookup.
std::vector<std::uint32_t> rows_by_lookup(const ProbedMatrix& probed, std::size_t lookups) {
  std::vector<std::uint32_t> rows(lookups, kNoRow);
  for (std::size_t r = 0; r < probed.matrix.rows(); ++r) {
    rows[probed.matrix.row_pixels[r]] = static_cast<std::uint32_t>(r);
  }
  return rows;
}

glm::vec3 scale_of(const ProbedMatrix& probed, std::size_t row) {
  return {probed.scales[3 * row], probed.scales[3 * row + 1], probed.scales[3 * row + 2]};
}

void add_row(const RenderingMatrix& matrix, std::size_t row, float share, std::size_t first_texel,
             RowAccumulator& to) {
  for (std::uint64_t e = matrix.row_offsets[row]; e < matrix.row_offsets[row + 1]; ++e) {
    to.add(static_cast<std::uint32_t>(first_texel) + matrix.texels[e], share * matrix.weights[e]);
  }
}

float mean_of(glm::vec3 v) { return (v.x + v.y + v.z) / 3.0F; }

}  // namespace

ProbedView::ProbedView(const FitModel& model, const DisplayView& view, const ProbeOptions& options)
    : model_(model),
      view_(view),
      options_(options),
      pixels_(static_cast<std::size_t>(view.targets->width()) *
              static_cast<std::size_t>(view.targets->height())),
      covered_(pixels_) {
  const std::vector<float> none(model.texels());
  std::size_t rows = 0, missing = 0;
  for (std::size_t m = 0; m < model.maps.size(); ++m) {
    maps_.push_back(probe(m, none));
    rows += maps_.back().matrix.rows();
    missing += maps_.back().missing.size();
  }
  // A silhouette that few lookups meet may be nowhere in the renderer's pictures.
  constexpr std::size_t kSurelySeen = 64;
  if (rows + missing == 0 && view.lookups->pixel.size() >= kSurelySeen) {
    throw InvalidArgument("render", "a renderer whose pictures are the same for all maps",
                          "the object, drawn from the maps that it is given");
  }
  if (missing > rows) {
    throw InvalidArgument("render",
                          "a renderer of which " + std::to_string(missing) + " of " +
                              std::to_string(rows + missing) + " pixels do not repeat what was probed",
                          "values that are linear in the maps' texels, without tone mapping");
  }
}

ProbedMatrix ProbedView::probe(std::size_t map, std::span<const float> alpha) {
  std::vector<float> texels(4 * model_.texels());
  for (std::size_t i = 0; i < alpha.size(); ++i) texels[4 * i + 3] = alpha[i];
  const std::size_t first = model_.first_texel[map];
  const TestRenderer render = [&](std::span<const float> lit) {
    for (std::size_t i = 0; 3 * i < lit.size(); ++i) {
      std::copy_n(lit.data() + 3 * i, 3, texels.data() + 4 * (first + i));
    }
    const std::vector<float> picture = view_.render(texels);
    if (lookups_ == 0) lookups_ = std::max<std::size_t>(picture.size() / (4 * pixels_), 1);
    check_length("render", picture.size(), 4 * pixels_ * lookups_, "lookups × height × width × 4");
    std::vector<float> light(3 * pixels_ * lookups_);
    std::fill(covered_.begin(), covered_.end(), 0.0F);
    for (std::size_t i = 0; i < pixels_ * lookups_; ++i) {
      std::copy_n(picture.data() + 4 * i, 3, light.data() + 3 * i);
      covered_[i % pixels_] += picture[4 * i + 3];
    }
    return light;
  };
  ProbedMatrix probed = probe_rendering_matrix(model_.maps[map], render, options_);
  report_.renderings += probed.renderings;
  report_.most_of_a_map = std::max(report_.most_of_a_map, probed.renderings);
  return probed;
}

bool ProbedView::is_last(std::size_t map) const {
  return std::any_of(model_.parts.begin(), model_.parts.end(), [&](const FitPart& shells) {
    return static_cast<std::size_t>(shells.back().map) == map;
  });
}

bool ProbedView::is_hidden(std::size_t map, std::span<const float> alpha) const {
  const auto is_clear = [&](const FitShell& shell) {
    const auto m = static_cast<std::size_t>(shell.map);
    const auto begin = alpha.begin() + static_cast<std::ptrdiff_t>(model_.first_texel[m]);
    const auto end = alpha.begin() + static_cast<std::ptrdiff_t>(model_.first_texel[m + 1]);
    return std::all_of(begin, end, [](float a) { return a == 0.0F; });
  };
  return std::any_of(model_.parts.begin(), model_.parts.end(), [&](const FitPart& shells) {
    const auto own = std::find_if(shells.begin(), shells.end(), [&](const FitShell& shell) {
      return static_cast<std::size_t>(shell.map) == map;
    });
    return own != shells.end() && !std::all_of(shells.begin(), own, is_clear);
  });
}

glm::vec4 ProbedView::layer_light(std::size_t map, std::size_t pixel, float& coverage) const {
  const ViewTargets& targets = *view_.targets;
  glm::vec4 sum(0.0F);
  coverage = 0.0F;
  for (std::size_t p = 0; p < model_.parts.size(); ++p) {
    const int part = static_cast<int>(p);
    if (targets.count(pixel, part) == 0) continue;
    const FitPart& shells = model_.parts[p];
    for (std::size_t k = 0; k < shells.size(); ++k) {
      if (static_cast<std::size_t>(shells[k].map) != map) continue;
      const float share = targets.coverage(pixel, part);
      const int shell = static_cast<int>(k);
      sum += share * (k + 1 == shells.size() ? glm::vec4(targets.light_from(pixel, part, shell), 1.0F)
                                             : targets.shell(pixel, part, shell));
      coverage += share;
    }
  }
  return coverage > 0.0F ? sum / coverage : sum;
}

LayerRows ProbedView::layer_rows() const {
  struct Row {
    std::size_t map;
    std::vector<std::uint32_t> lookups;
  };
  LayerRows result;
  result.matrix.columns = model_.texels();
  std::vector<Row> rows;
  for (std::size_t m = 0; m < maps_.size(); ++m) {
    const std::vector<std::uint32_t> row_of = rows_by_lookup(maps_[m], pixels_ * lookups_);
    for (std::size_t p = 0; p < pixels_; ++p) {
      Row row{m, {}};
      glm::vec3 fresnel(0.0F);
      for (std::size_t s = 0; s < lookups_; ++s) {
        const std::uint32_t r = row_of[s * pixels_ + p];
        if (r == kNoRow) continue;
        row.lookups.push_back(r);
        fresnel += scale_of(maps_[m], r);
      }
      float coverage = 0.0F;
      const glm::vec4 light = layer_light(m, p, coverage);
      if (row.lookups.empty() || coverage == 0.0F) continue;
      result.matrix.row_pixels.push_back(static_cast<std::uint32_t>(p));
      result.target.push_back(light);
      result.fresnel.push_back(fresnel / static_cast<float>(row.lookups.size()));
      result.coverage.push_back(coverage);
      rows.push_back(std::move(row));
    }
  }
  build_rows(result.matrix, rows.size(), [&](std::size_t i, RowAccumulator& accumulator) {
    const Row& row = rows[i];
    const float mean = 1.0F / static_cast<float>(row.lookups.size());
    for (const std::uint32_t r : row.lookups) {
      add_row(maps_[row.map].matrix, r, mean, model_.first_texel[row.map], accumulator);
    }
  });
  return result;
}

DisplayRows ProbedView::display_rows(std::span<const float> alpha) {
  const ViewTargets& targets = *view_.targets;
  std::vector<glm::vec3> fresnel(pixels_, glm::vec3(0.0F));
  std::vector<std::uint8_t> is_missing(pixels_);
  std::vector<std::vector<std::uint32_t>> row_of;
  const auto miss = [&](const ProbedMatrix& probed) {
    for (const std::uint32_t lookup : probed.missing) is_missing[lookup % pixels_] = 1;
  };
  for (std::size_t m = 0; m < maps_.size(); ++m) {
    // Without anything in front the last maps show all of F.
    for (std::size_t r = 0; is_last(m) && r < maps_[m].matrix.rows(); ++r) {
      fresnel[maps_[m].matrix.row_pixels[r] % pixels_] += scale_of(maps_[m], r);
    }
    miss(maps_[m]);
  }
  for (std::size_t m = 0; m < maps_.size(); ++m) {
    if (is_hidden(m, alpha)) {
      maps_[m] = probe(m, alpha);
      miss(maps_[m]);
    }
    row_of.push_back(rows_by_lookup(maps_[m], pixels_ * lookups_));
  }

  DisplayRows result;
  result.matrix.columns = model_.texels();
  for (std::size_t p = 0; p < pixels_; ++p) {
    if (targets.count(p) == 0) continue;
    if (is_missing[p] != 0) ++report_.unresolved;
    if (is_missing[p] != 0 || covered_[p] == 0.0F || fresnel[p] == glm::vec3(0.0F)) continue;
    result.matrix.row_pixels.push_back(static_cast<std::uint32_t>(p));
    const glm::vec3 f = fresnel[p] / covered_[p];
    const glm::vec3 reflected = targets.reflected(p);
    glm::vec3 target(0.0F);
    for (int k = 0; k < 3; ++k) target[k] = f[k] > 0.0F ? reflected[k] / f[k] : 0.0F;
    result.fresnel.push_back(f);
    result.target.push_back(target);
    result.diffuse.push_back(targets.diffuse(p));
    result.coverage.push_back(targets.coverage(p));
  }
  build_rows(result.matrix, result.target.size(), [&](std::size_t i, RowAccumulator& accumulator) {
    const std::uint32_t pixel = result.matrix.row_pixels[i];
    const float whole = covered_[pixel] * mean_of(result.fresnel[i]);
    for (std::size_t m = 0; m < maps_.size(); ++m) {
      for (std::size_t s = 0; s < lookups_; ++s) {
        const std::uint32_t row = row_of[m][s * pixels_ + pixel];
        if (row == kNoRow) continue;
        const float share = mean_of(scale_of(maps_[m], row)) / whole;
        add_row(maps_[m].matrix, row, share, model_.first_texel[m], accumulator);
      }
    }
  });
  return result;
}

}  // namespace mirrorbake
