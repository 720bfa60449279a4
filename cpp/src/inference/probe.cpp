#include "mirrorbake/inference/probe.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <random>
#include <string>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "row_builder.hpp"

namespace mirrorbake {
namespace {

constexpr std::size_t kRowsPerChunk = 256;
// A pixel reads within this many standard deviations of its mean direction: uniform weights on a line, taps
// of a long footprint, end at 1.7; the tent of a bilinear read, at 2.5.
constexpr float kDeviations = 3.0F;
// … and this many texels further, the reach of a bilinear read into sheared texels near a corner of a cube.
constexpr float kReach = 2.0F;
// With steps in the picture the covariance of small footprints drowns in them.
constexpr float kSteppedReach = 4.5F;
// Rounding of floats between 0 and 1 that the renderer has added up.
constexpr float kRounding = 2e-7F;
// Pictures of random texels at the end. One channel notices a weight that is given to the wrong texel with a
// chance of a half, all of them miss it once in 500 times.
constexpr int kTests = 3;
constexpr std::uint16_t kNoColour = 0xffff;

// Calls the renderer and looks at what comes back.
class Pictures {
 public:
  explicit Pictures(const TestRenderer& render) : render_(render) {}

  // `value(texel, channel)` is what the map's texels show.
  template <typename Value>
  std::vector<float> draw(std::size_t texels, const Value& value) {
    std::vector<float> map(3 * texels);
    parallel_for(texels, 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) {
        for (std::size_t c = 0; c < 3; ++c) map[3 * t + c] = value(t, c);
      }
    });
    std::vector<float> picture = render_(map);
    if (drawn_ == 0) length_ = picture.size();
    if (length_ == 0 || length_ % 3 != 0) {
      throw InvalidArgument("render", std::to_string(length_) + " values", "pixels × 3 of them");
    }
    check_length("render", picture.size(), length_, "what it returned before");
    check_finite("render", picture);
    ++drawn_;
    return picture;
  }

  int drawn() const { return drawn_; }
  std::size_t pixels() const { return length_ / 3; }

 private:
  const TestRenderer& render_;
  std::size_t length_ = 0;
  int drawn_ = 0;
};

// What the pictures say relative to white and black.
struct Calibration {
  std::vector<float> black;           // pixels × 3
  std::vector<float> scales;          // rows × 3
  std::vector<std::uint32_t> pixels;  // of the rows

  float relative(std::span<const float> picture, std::size_t row, std::size_t channel) const {
    const std::size_t at = 3 * static_cast<std::size_t>(pixels[row]) + channel;
    return (picture[at] - black[at]) / scales[3 * row + channel];
  }
};

Calibration calibrate(const TexelTopology& topology, Pictures& pictures, float step) {
  Calibration found;
  found.black = pictures.draw(topology.texels(), [](std::size_t, std::size_t) { return 0.0F; });
  const std::vector<float> white =
      pictures.draw(topology.texels(), [](std::size_t, std::size_t) { return 1.0F; });
  for (std::size_t p = 0; p < pictures.pixels(); ++p) {
    glm::vec3 scale;
    for (std::size_t c = 0; c < 3; ++c) {
      scale[static_cast<int>(c)] = white[3 * p + c] - found.black[3 * p + c];
    }
    // Any weight is to be told from the picture's steps in all channels.
    if (std::min({scale.x, scale.y, scale.z}) <= std::max(1e-3F, 16.0F * step)) continue;
    found.pixels.push_back(static_cast<std::uint32_t>(p));
    found.scales.insert(found.scales.end(), {scale.x, scale.y, scale.z});
  }
  return found;
}

// Where the rows look.
struct Footprints {
  std::vector<glm::vec3> mean;
  std::vector<glm::mat3> covariance;
  std::vector<std::uint32_t> levels, faces;  // a bit for each that is read
};

Footprints measure_footprints(const TexelTopology& topology, Pictures& pictures,
                              const Calibration& calibration, std::span<const glm::vec3> centres,
                              float step) {
  const std::size_t rows = calibration.pixels.size();
  Footprints found{std::vector<glm::vec3>(rows), std::vector<glm::mat3>(rows, glm::mat3(0.0F)),
                   std::vector<std::uint32_t>(rows), std::vector<std::uint32_t>(rows)};
  const std::vector<float> directions = pictures.draw(centres.size(), [&](std::size_t t, std::size_t c) {
    return 0.5F + 0.5F * centres[t][static_cast<int>(c)];
  });
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t c = 0; c < 3; ++c) {
      found.mean[r][static_cast<int>(c)] = 2.0F * calibration.relative(directions, r, c) - 1.0F;
    }
  }

  const std::vector<float> squares = pictures.draw(centres.size(), [&](std::size_t t, std::size_t c) {
    return centres[t][static_cast<int>(c)] * centres[t][static_cast<int>(c)];
  });
  const std::vector<float> products = pictures.draw(centres.size(), [&](std::size_t t, std::size_t c) {
    const int i = static_cast<int>(c);
    return 0.5F + 0.5F * centres[t][i] * centres[t][(i + 1) % 3];
  });
  for (std::size_t r = 0; step == 0.0F && r < rows; ++r) {
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3;
      const glm::vec3& mean = found.mean[r];
      const auto channel = static_cast<std::size_t>(i);
      found.covariance[r][i][i] =
          std::max(calibration.relative(squares, r, channel) - mean[i] * mean[i], 0.0F);
      const float mixed = 2.0F * calibration.relative(products, r, channel) - 1.0F - mean[i] * mean[j];
      found.covariance[r][i][j] = found.covariance[r][j][i] = mixed;
    }
  }

  const float least = std::max(1e-6F, step);
  const auto see = [&](int groups, const auto& group_of, std::vector<std::uint32_t>& seen) {
    for (int first_group = 0; first_group < groups; first_group += 3) {
      const std::vector<float> lit = pictures.draw(centres.size(), [&](std::size_t t, std::size_t c) {
        const TexelPlace place = topology.place(static_cast<std::uint32_t>(t));
        return group_of(place) == first_group + static_cast<int>(c) ? 1.0F : 0.0F;
      });
      for (int group = first_group; group < std::min(first_group + 3, groups); ++group) {
        const auto channel = static_cast<std::size_t>(group - first_group);
        for (std::size_t r = 0; r < rows; ++r) {
          if (calibration.relative(lit, r, channel) > least) seen[r] |= 1U << group;
        }
      }
    }
  };
  see(
      topology.levels(), [](const TexelPlace& place) { return place.level; }, found.levels);
  see(
      topology.faces(), [](const TexelPlace& place) { return place.face; }, found.faces);
  return found;
}

// Collects the texels that a row may see, from the coarsest level down.
class CandidateSearch {
 public:
  CandidateSearch(const TexelTopology& topology, std::span<const glm::vec3> centres, float reach)
      : topology_(topology), centres_(centres), sides_(centres.size()), reach_(reach) {
    parallel_for(sides_.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) {
        for (const std::uint32_t next : topology_.neighbours(static_cast<std::uint32_t>(t))) {
          if (next != kNoTexel) sides_[t] = std::max(sides_[t], glm::distance(centres_[t], centres_[next]));
        }
        if (sides_[t] == 0.0F) sides_[t] = 2.0F;  // the only one of its face
      }
    });
  }

  void collect(const Footprints& footprints, std::size_t row, RowAccumulator& found) const {
    const auto finest = static_cast<int>(std::countr_zero(footprints.levels[row]));
    std::vector<std::uint32_t> open;
    for (std::size_t t = topology_.level_offset(topology_.levels() - 1); t < topology_.texels(); ++t) {
      open.push_back(static_cast<std::uint32_t>(t));
    }
    while (!open.empty()) {
      const std::uint32_t texel = open.back();
      open.pop_back();
      const TexelPlace place = topology_.place(texel);
      if ((footprints.faces[row] >> place.face & 1U) == 0) continue;
      // Half a diagonal of the texel itself holds all of its children's centres.
      if (place.level > finest && is_near(footprints, row, texel, reach_ * sides_[texel] + sides_[texel])) {
        for (const std::uint32_t child : topology_.children(texel)) {
          if (child != kNoTexel) open.push_back(child);
        }
      }
      if ((footprints.levels[row] >> place.level & 1U) != 0 &&
          is_near(footprints, row, texel, reach_ * sides_[texel])) {
        found.add(texel, 0.0F);
      }
    }
  }

 private:
  bool is_near(const Footprints& footprints, std::size_t row, std::uint32_t texel, float distance) const {
    const glm::vec3 offset = centres_[texel] - footprints.mean[row];
    const float own = distance / kDeviations;
    const glm::mat3 spread = footprints.covariance[row] + glm::mat3(own * own);
    return glm::dot(offset, glm::inverse(spread) * offset) <= kDeviations * kDeviations;
  }

  const TexelTopology& topology_;
  std::span<const glm::vec3> centres_;
  std::vector<float> sides_;
  float reach_;
};

// Columns of a matrix: the rows that may see a texel.
struct Columns {
  std::vector<std::uint64_t> offsets;
  std::vector<std::uint32_t> rows;
};

Columns columns_of(const RenderingMatrix& candidates) {
  Columns columns{std::vector<std::uint64_t>(candidates.columns + 1), {}};
  for (const std::uint32_t texel : candidates.texels) ++columns.offsets[texel + 1];
  std::partial_sum(columns.offsets.begin(), columns.offsets.end(), columns.offsets.begin());
  columns.rows.resize(candidates.nonzeros());
  std::vector<std::uint64_t> next(columns.offsets.begin(), columns.offsets.end() - 1);
  for (std::size_t r = 0; r < candidates.rows(); ++r) {
    for (std::uint64_t e = candidates.row_offsets[r]; e < candidates.row_offsets[r + 1]; ++e) {
      columns.rows[next[candidates.texels[e]]++] = static_cast<std::uint32_t>(r);
    }
  }
  return columns;
}

struct Colouring {
  std::vector<std::uint16_t> colours;  // of the texels
  std::vector<std::uint8_t> resolved;  // 1 for rows none of whose colours is there twice
  int count = 0;
};

// Greedy: rows with few candidates first, so that what colours are missing costs few rows; a texel takes the
// first colour that no row around it has.
Colouring colour_texels(const RenderingMatrix& candidates, int most) {
  const Columns columns = columns_of(candidates);
  const std::size_t words = (static_cast<std::size_t>(most) + 63) / 64;
  std::vector<std::uint64_t> taken(candidates.rows() * words);
  std::vector<std::uint64_t> around(words);
  Colouring found{std::vector<std::uint16_t>(candidates.columns, kNoColour),
                  std::vector<std::uint8_t>(candidates.rows()), 0};

  const auto length = [&](std::size_t r) {
    return candidates.row_offsets[r + 1] - candidates.row_offsets[r];
  };
  std::vector<std::uint32_t> order(candidates.rows());
  std::iota(order.begin(), order.end(), 0U);
  // Neighbours in the image stay together: what colours one of them used serves the next.
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(length(a) / 32, a) < std::pair(length(b) / 32, b);
  });
  for (const std::uint32_t row : order) {
    if (length(row) > static_cast<std::uint64_t>(most)) break;
    for (std::uint64_t e = candidates.row_offsets[row]; e < candidates.row_offsets[row + 1]; ++e) {
      const std::uint32_t texel = candidates.texels[e];
      if (found.colours[texel] != kNoColour) continue;
      std::fill(around.begin(), around.end(), 0);
      for (std::uint64_t k = columns.offsets[texel]; k < columns.offsets[texel + 1]; ++k) {
        for (std::size_t w = 0; w < words; ++w) around[w] |= taken[columns.rows[k] * words + w];
      }
      int colour = 0;
      while (colour < most && (around[static_cast<std::size_t>(colour) / 64] >> (colour % 64) & 1U) != 0) {
        ++colour;
      }
      if (colour == most) continue;
      found.colours[texel] = static_cast<std::uint16_t>(colour);
      found.count = std::max(found.count, colour + 1);
      for (std::uint64_t k = columns.offsets[texel]; k < columns.offsets[texel + 1]; ++k) {
        taken[columns.rows[k] * words + static_cast<std::size_t>(colour) / 64] |= std::uint64_t{1}
                                                                                  << (colour % 64);
      }
    }
  }
  // No two texels of a row have one colour by construction; a row fails only where one found none left.
  for (std::size_t r = 0; r < candidates.rows(); ++r) {
    found.resolved[r] =
        std::all_of(candidates.texels.begin() + static_cast<std::ptrdiff_t>(candidates.row_offsets[r]),
                    candidates.texels.begin() + static_cast<std::ptrdiff_t>(candidates.row_offsets[r + 1]),
                    [&](std::uint32_t texel) { return found.colours[texel] != kNoColour; });
  }
  return found;
}

// Every candidate's weight, from pictures that light three colours each.
void measure_weights(const Calibration& calibration, const Colouring& colouring, float step,
                     Pictures& pictures, RenderingMatrix& candidates) {
  for (int lit = 0; lit < colouring.count; lit += 3) {
    const std::vector<float> picture = pictures.draw(candidates.columns, [&](std::size_t t, std::size_t c) {
      return colouring.colours[t] == lit + static_cast<int>(c) ? 1.0F : 0.0F;
    });
    parallel_for(candidates.rows(), kRowsPerChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = begin; r < end; ++r) {
        if (colouring.resolved[r] == 0) continue;
        for (std::uint64_t e = candidates.row_offsets[r]; e < candidates.row_offsets[r + 1]; ++e) {
          const int channel = static_cast<int>(colouring.colours[candidates.texels[e]]) - lit;
          if (channel < 0 || channel > 2) continue;
          const float weight = calibration.relative(picture, r, static_cast<std::size_t>(channel));
          candidates.weights[e] = weight > std::max(kRounding, step) ? weight : 0.0F;
        }
      }
    });
  }
}

// Of every row, the largest error of its sum and of pictures of random texels; 1 for those unresolved.
std::vector<float> test_rows(const Calibration& calibration, const Colouring& colouring, Pictures& pictures,
                             const RenderingMatrix& candidates) {
  std::vector<float> errors(candidates.rows());
  for (std::size_t r = 0; r < candidates.rows(); ++r) {
    if (colouring.resolved[r] == 0) {
      errors[r] = 1.0F;
      continue;
    }
    double sum = 0;
    for (std::uint64_t e = candidates.row_offsets[r]; e < candidates.row_offsets[r + 1]; ++e) {
      sum += static_cast<double>(candidates.weights[e]);
    }
    errors[r] = static_cast<float>(std::abs(sum - 1.0));
  }

  std::mt19937 random(1);
  for (int test = 0; test < kTests; ++test) {
    // Black or white alone, which any format of texels holds exactly.
    std::vector<float> texels(3 * candidates.columns);
    for (float& value : texels) value = static_cast<float>(random() & 1U);
    const std::vector<float> picture =
        pictures.draw(candidates.columns, [&](std::size_t t, std::size_t c) { return texels[3 * t + c]; });
    const std::vector<float> expected = multiply(candidates, texels, 3);
    for (std::size_t r = 0; r < candidates.rows(); ++r) {
      for (std::size_t c = 0; c < 3; ++c) {
        const float difference = std::abs(expected[3 * r + c] - calibration.relative(picture, r, c));
        errors[r] = std::max(errors[r], difference);
      }
    }
  }
  return errors;
}

}  // namespace

ProbedMatrix probe_rendering_matrix(const TexelTopology& topology, const TestRenderer& render,
                                    const ProbeOptions& options) {
  check_range("most_renderings", options.most_renderings, 16, 1024);
  check_at_least("step", static_cast<double>(options.step), 0.0);
  if (options.step > 0.1F) throw InvalidArgument("step", std::to_string(options.step), "0 to 0.1");
  check_above("tolerance", static_cast<double>(options.tolerance), 0.0, 1.0);

  Pictures pictures(render);
  std::vector<glm::vec3> centres(topology.texels());
  parallel_for(centres.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) centres[t] = topology.centre(static_cast<std::uint32_t>(t));
  });
  const Calibration calibration = calibrate(topology, pictures, options.step);
  const std::size_t rows = calibration.pixels.size();
  const Footprints footprints = measure_footprints(topology, pictures, calibration, centres, options.step);

  RenderingMatrix candidates;
  candidates.columns = topology.texels();
  candidates.row_pixels = calibration.pixels;
  const CandidateSearch search(topology, centres, options.step > 0.0F ? kSteppedReach : kReach);
  build_rows(candidates, rows, [&](std::size_t r, RowAccumulator& row) {
    if (footprints.levels[r] != 0) search.collect(footprints, r, row);
  });

  const int colours = 3 * (options.most_renderings - pictures.drawn() - kTests);
  const Colouring colouring = colour_texels(candidates, colours);
  measure_weights(calibration, colouring, options.step, pictures, candidates);
  const std::vector<float> errors = test_rows(calibration, colouring, pictures, candidates);

  ProbedMatrix probed;
  probed.renderings = pictures.drawn();
  probed.colours = colouring.count;
  probed.matrix.columns = topology.texels();
  std::vector<std::size_t> kept;
  for (std::size_t r = 0; r < rows; ++r) {
    // A weight is off by half a step of its value and of black's and white's, and so is each of its row.
    const float* scale = calibration.scales.data() + 3 * r;
    const auto entries = static_cast<float>(candidates.row_offsets[r + 1] - candidates.row_offsets[r]);
    const float stepped = options.step * entries / std::min({scale[0], scale[1], scale[2]});
    if (errors[r] > options.tolerance + stepped) {
      probed.missing.push_back(calibration.pixels[r]);
      continue;
    }
    kept.push_back(r);
    probed.matrix.row_pixels.push_back(calibration.pixels[r]);
    probed.scales.insert(probed.scales.end(), scale, scale + 3);
    probed.errors.push_back(errors[r]);
  }
  build_rows(probed.matrix, kept.size(), [&](std::size_t i, RowAccumulator& row) {
    const std::size_t r = kept[i];
    double sum = 0;
    for (std::uint64_t e = candidates.row_offsets[r]; e < candidates.row_offsets[r + 1]; ++e) {
      sum += static_cast<double>(candidates.weights[e]);
    }
    for (std::uint64_t e = candidates.row_offsets[r]; e < candidates.row_offsets[r + 1]; ++e) {
      if (candidates.weights[e] == 0.0F) continue;
      row.add(candidates.texels[e], static_cast<float>(static_cast<double>(candidates.weights[e]) / sum));
    }
  });
  return probed;
}

}  // namespace mirrorbake
