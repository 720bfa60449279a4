#include "banded_rows.hpp"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"

namespace mirrorbake {
namespace {

// Entries of a band. The texels that so many read, and what is given back to them, stay in a core's own
// cache; with fewer, more texels are read by two bands.
constexpr std::size_t kBandEntries = std::size_t{1} << 15;
constexpr std::size_t kNarrow = std::size_t{1} << 16;
// Bands that are numbered one after the other, with one table of the texels.
constexpr std::size_t kBandsPerTable = 16;

template <typename Number>
Channels read(const Number* numbers, const float* weights, std::size_t count, const Channels* x) {
  // Two sums: one would wait for itself.
  Channels even{}, odd{};
  std::size_t e = 0;
  for (; e + 1 < count; e += 2) {
    even += broadcast(weights[e]) * x[numbers[e]];
    odd += broadcast(weights[e + 1]) * x[numbers[e + 1]];
  }
  if (e < count) even += broadcast(weights[e]) * x[numbers[e]];
  return even + odd;
}

template <typename Number>
void give(const Number* numbers, const float* weights, std::size_t count, Channels t, Channels* y) {
  for (std::size_t e = 0; e < count; ++e) y[numbers[e]] += broadcast(weights[e]) * t;
}

// What a thread copies a band's texels to, and where it makes its shares.
struct Local {
  Vector texels, shares;
};
Local& local() {
  static thread_local Local memory;
  return memory;
}

// A band that sees one node as it is can own unknowns.
bool sees_one(const SolverView& view) { return view.nodes.size() == 1 && view.nodes.front().weight == 1.0F; }

}  // namespace

BandedRows::BandedRows(std::span<const SolverView> views, std::size_t texels_per_node)
    : views_(views.begin(), views.end()), texels_per_node_(texels_per_node), first_row_{0} {
  for (std::size_t v = 0; v < views_.size(); ++v) {
    cut(v);
    first_row_.push_back(first_row_.back() + views_[v].matrix->rows());
  }
  std::size_t narrow = 0, wide = 0;
  for (Band& band : bands_) {
    const std::vector<std::uint64_t>& offsets = views_[band.view].matrix->row_offsets;
    const std::size_t entries = offsets[band.end] - offsets[band.begin];
    band.wide = entries > kNarrow;
    std::size_t& next = band.wide ? wide : narrow;
    band.first_number = next;
    next += entries;
  }
  narrow_.resize(narrow);
  wide_.resize(wide);
  parallel_for(bands_.size(), kBandsPerTable, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> number_of(texels_per_node_, kNoTexel);
    for (std::size_t b = begin; b < end; ++b) find_texels(bands_[b], number_of);
  });
}

void BandedRows::cut(std::size_t view) {
  const RenderingMatrix& matrix = *views_[view].matrix;
  for (std::size_t begin = 0; begin < matrix.rows();) {
    std::size_t end = begin + 1;
    while (end < matrix.rows() && matrix.row_offsets[end + 1] - matrix.row_offsets[begin] <= kBandEntries) {
      ++end;
    }
    bands_.push_back({view, begin, end, 0, {}});
    begin = end;
  }
}

void BandedRows::find_texels(Band& band, std::vector<std::uint32_t>& number_of) {
  const RenderingMatrix& matrix = *views_[band.view].matrix;
  const std::size_t first = matrix.row_offsets[band.begin];
  const std::size_t entries = matrix.row_offsets[band.end] - first;
  for (std::size_t e = 0; e < entries; ++e) {
    const std::uint32_t texel = matrix.texels[first + e];
    if (number_of[texel] == kNoTexel) {
      number_of[texel] = static_cast<std::uint32_t>(band.texels.size());
      band.texels.push_back(texel);
    }
    if (band.wide) {
      wide_[band.first_number + e] = number_of[texel];
    } else {
      narrow_[band.first_number + e] = static_cast<std::uint16_t>(number_of[texel]);
    }
  }
  for (const std::uint32_t texel : band.texels) number_of[texel] = kNoTexel;
}

std::vector<std::uint32_t> BandedRows::number(int nodes) {
  std::size_t reads = 0;
  for (const Band& band : bands_) reads += band.texels.size() * views_[band.view].nodes.size();
  if (reads >= std::numeric_limits<std::uint32_t>::max() / 2) {
    throw InvalidArgument("views", std::to_string(reads) + " texels of bands of rows", "below 2^31");
  }
  std::vector<std::uint32_t> number_of(texels_per_node_ * static_cast<std::size_t>(nodes), kNoTexel);
  std::vector<std::uint32_t> numbered;
  for (Band& band : bands_) number(band, number_of, numbered);
  unknowns_ = numbered.size();
  for_bands([&](const Band& band, std::size_t) {
    // From the order in which rows meet them to first the own, then the others; `texels` holds the place.
    const std::vector<std::uint64_t>& offsets = views_[band.view].matrix->row_offsets;
    const std::size_t end = band.first_number + offsets[band.end] - offsets[band.begin];
    for (std::size_t e = band.first_number; e < end; ++e) {
      if (band.wide) {
        wide_[e] = band.texels[wide_[e]];
      } else {
        narrow_[e] = static_cast<std::uint16_t>(band.texels[narrow_[e]]);
      }
    }
  });
  for (Band& band : bands_) band.texels = {};
  find_parts();
  return numbered;
}

void BandedRows::number(Band& band, std::vector<std::uint32_t>& number_of,
                        std::vector<std::uint32_t>& numbered) {
  const std::vector<NodeWeight>& nodes = views_[band.view].nodes;
  const auto numbered_now = [&](std::size_t texel) {
    if (number_of[texel] == kNoTexel) {
      number_of[texel] = static_cast<std::uint32_t>(numbered.size());
      numbered.push_back(static_cast<std::uint32_t>(texel));
    }
    return number_of[texel];
  };
  band.first_own = numbered.size();
  band.first_other = others_;
  band.first_read = reads_.size();
  std::vector<std::uint32_t> places;
  places.reserve(band.texels.size());
  constexpr std::uint32_t kOther = 0x80000000U;
  for (const std::uint32_t texel : band.texels) {
    const std::size_t first = texels_per_node_ * static_cast<std::size_t>(nodes.front().node) + texel;
    if (sees_one(views_[band.view]) && number_of[first] == kNoTexel) {
      numbered_now(first);
      places.push_back(static_cast<std::uint32_t>(band.own++));
      continue;
    }
    for (const NodeWeight& node : nodes) {
      reads_.push_back(numbered_now(texels_per_node_ * static_cast<std::size_t>(node.node) + texel));
    }
    places.push_back(kOther | static_cast<std::uint32_t>(band.others++));
  }
  others_ += band.others;
  for (std::uint32_t& place : places) {
    if ((place & kOther) != 0) place = static_cast<std::uint32_t>(band.own) + (place & ~kOther);
  }
  band.texels = std::move(places);
}

// Sorts the shares in what other bands own by unknown.
void BandedRows::find_parts() {
  first_part_.assign(unknowns_ + 2, 0);
  for (const std::uint32_t unknown : reads_) ++first_part_[unknown + 2];
  for (std::size_t i = 2; i < first_part_.size(); ++i) first_part_[i] += first_part_[i - 1];
  parts_.resize(reads_.size());
  for (const Band& band : bands_) {
    const std::uint32_t* unknown = reads_.data() + band.first_read;
    for (std::size_t i = 0; i < band.others; ++i) {
      const auto share = static_cast<std::uint32_t>(unknowns_ + band.first_other + i);
      for (const NodeWeight& node : views_[band.view].nodes) {
        parts_[first_part_[*unknown++ + 1]++] = {share, node.weight};
      }
    }
  }
  first_part_.pop_back();
}

template <typename Body>
void BandedRows::for_bands(const Body& body) const {
  parallel_for(bands_.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) body(bands_[b], b);
  });
}

template <typename Row>
void BandedRows::for_rows(const Band& band, const Row& row) const {
  const RenderingMatrix& matrix = *views_[band.view].matrix;
  const std::size_t first = matrix.row_offsets[band.begin];
  for (std::size_t r = band.begin; r < band.end; ++r) {
    const std::size_t entry = matrix.row_offsets[r];
    const std::size_t count = matrix.row_offsets[r + 1] - entry;
    const std::size_t number = band.first_number + entry - first;
    const std::size_t through = first_row_[band.view] + r;
    if (band.wide) {
      row(through, wide_.data() + number, matrix.weights.data() + entry, count);
    } else {
      row(through, narrow_.data() + number, matrix.weights.data() + entry, count);
    }
  }
}

const Channels* BandedRows::collect(const Band& band, const Vector& x) const {
  Vector& to = local().texels;
  if (to.size() < band.own + band.others) to.resize(band.own + band.others);
  std::copy_n(x.begin() + static_cast<std::ptrdiff_t>(band.first_own), band.own, to.begin());
  const std::vector<NodeWeight>& nodes = views_[band.view].nodes;
  const std::uint32_t* unknown = reads_.data() + band.first_read;
  Channels* other = to.data() + band.own;
  if (sees_one(views_[band.view])) {
    for (std::size_t i = 0; i < band.others; ++i) other[i] = x[unknown[i]];
  } else {
    for (std::size_t i = 0; i < band.others; ++i) {
      Channels sum{};
      for (const NodeWeight& node : nodes) sum += broadcast(node.weight) * x[*unknown++];
      other[i] = sum;
    }
  }
  return to.data();
}

Channels* BandedRows::clear(const Band& band) {
  local().shares.assign(band.own + band.others, Channels{});
  return local().shares.data();
}

void BandedRows::put(const Band& band, const Channels* made, Vector& shares) const {
  std::copy_n(made, band.own, shares.begin() + static_cast<std::ptrdiff_t>(band.first_own));
  std::copy_n(made + band.own, band.others,
              shares.begin() + static_cast<std::ptrdiff_t>(unknowns_ + band.first_other));
}

void BandedRows::multiply(const Vector& x, Vector& b) const {
  for_bands([&](const Band& band, std::size_t) {
    const Channels* texels = collect(band, x);
    for_rows(band, [&](std::size_t r, const auto* numbers, const float* entries, std::size_t count) {
      b[r] = read(numbers, entries, count, texels);
    });
  });
}

ChannelSums BandedRows::residual(const Vector& weights, const Vector& target, const Vector& x,
                                 Vector& shares) const {
  std::vector<ChannelSums> of_bands(bands_.size());
  for_bands([&](const Band& band, std::size_t number) {
    const Channels* texels = collect(band, x);
    Channels* made = clear(band);
    ChannelDoubles squares{};
    for_rows(band, [&](std::size_t r, const auto* numbers, const float* entries, std::size_t count) {
      const Channels t = target[r] - read(numbers, entries, count, texels);
      const Channels weighted = weights[r] * t;
      add_product(squares, weighted, t);
      give(numbers, entries, count, weighted, made);
    });
    put(band, made, shares);
    of_bands[number] = to_sums(squares);
  });
  ChannelSums sums{};
  for (const ChannelSums& of_band : of_bands) {
    for (std::size_t k = 0; k < 4; ++k) sums[k] += of_band[k];
  }
  return sums;
}

void BandedRows::normal(const Vector& weights, const Vector& x, Vector& shares) const {
  for_bands([&](const Band& band, std::size_t) {
    const Channels* texels = collect(band, x);
    Channels* made = clear(band);
    for_rows(band, [&](std::size_t r, const auto* numbers, const float* entries, std::size_t count) {
      give(numbers, entries, count, weights[r] * read(numbers, entries, count, texels), made);
    });
    put(band, made, shares);
  });
}

void BandedRows::transposed(const Vector& weights, const Vector& t, Vector& shares) const {
  for_bands([&](const Band& band, std::size_t) {
    Channels* made = clear(band);
    for_rows(band, [&](std::size_t r, const auto* numbers, const float* entries, std::size_t count) {
      give(numbers, entries, count, weights[r] * t[r], made);
    });
    put(band, made, shares);
  });
}

void BandedRows::diagonal(const Vector& weights, Vector& shares) const {
  for_bands([&](const Band& band, std::size_t) {
    Channels* made = clear(band);
    for_rows(band, [&](std::size_t r, const auto* numbers, const float* entries, std::size_t count) {
      for (std::size_t e = 0; e < count; ++e) {
        made[numbers[e]] += broadcast(entries[e] * entries[e]) * weights[r];
      }
    });
    put(band, made, shares);
  });
}

}  // namespace mirrorbake
