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

// Every other bit, from the lowest.
std::uint64_t spread(std::uint64_t bits) {
  bits = (bits | bits << 8) & 0x00ff00ffU;
  bits = (bits | bits << 4) & 0x0f0f0f0fU;
  bits = (bits | bits << 2) & 0x33333333U;
  return (bits | bits << 1) & 0x55555555U;
}

// A texel's place among those of all maps of a node along a curve that keeps near what is near on a face
// (Morton 1966), whatever its level.
std::uint64_t along_curve(std::span<const TexelTopology> maps, std::uint32_t texel) {
  std::uint64_t map = 0;
  while (texel >= maps[map].texels()) texel -= static_cast<std::uint32_t>(maps[map++].texels());
  const TexelPlace place = maps[map].place(texel);
  // Its centre in halves of the finest texels.
  const auto at = [&](int line) { return (2 * static_cast<std::uint64_t>(line) + 1) << place.level; };
  const auto face = static_cast<std::uint64_t>(place.face);
  return map << 40 | face << 32 | spread(at(place.row)) << 1 | spread(at(place.column));
}

struct Sorted {
  std::uint64_t key;
  std::uint32_t view, row;
  auto operator<=>(const Sorted&) const = default;
};

// The rows of all views that see those nodes, by the place of the first texel that each reads, one of its
// finest. Pixels in the order of an image would make bands that are wide and low, which share two to four
// times as many texels.
std::vector<Sorted> sorted_rows(std::span<const SolverView> views, const std::vector<NodeWeight>& nodes,
                                std::span<const TexelTopology> maps) {
  std::vector<Sorted> rows;
  for (std::uint32_t v = 0; v < views.size(); ++v) {
    if (views[v].nodes != nodes) continue;
    const RenderingMatrix& matrix = *views[v].matrix;
    for (std::uint32_t r = 0; r < matrix.rows(); ++r) {
      const std::size_t entry = matrix.row_offsets[r];
      const bool empty = entry == matrix.row_offsets[r + 1];
      rows.push_back({empty ? 0 : along_curve(maps, matrix.texels[entry]), v, r});
    }
  }
  std::ranges::sort(rows);
  return rows;
}

// A band that sees one node as it is can own unknowns.
bool sees_one(const std::vector<NodeWeight>& nodes) {
  return nodes.size() == 1 && nodes.front().weight == 1.0F;
}

}  // namespace

BandedRows::BandedRows(std::span<const SolverView> views, std::span<const TexelTopology> maps)
    : first_place_{0} {
  for (const TexelTopology& map : maps) texels_per_node_ += map.texels();
  for (const SolverView& view : views) {
    first_place_.push_back(first_place_.back() + view.matrix->rows());
    if (std::ranges::find(groups_, view.nodes) == groups_.end()) groups_.push_back(view.nodes);
  }
  places_.resize(first_place_.back());
  counts_.resize(places_.size());
  std::vector<RowOfView> order;
  order.reserve(places_.size());
  for (std::size_t group = 0; group < groups_.size(); ++group) {
    const std::size_t first_row = order.size();
    for (const auto& [key, view, row] : sorted_rows(views, groups_[group], maps)) {
      places_[first_place_[view] + row] = static_cast<std::uint32_t>(order.size());
      order.push_back({views[view].matrix, row});
    }
    cut(group, first_row, order);
  }
  std::size_t narrow = 0, wide = 0;
  for (Band& band : bands_) {
    band.first_entry = narrow + wide;
    band.wide = band.entries > kNarrow;
    std::size_t& next = band.wide ? wide : narrow;
    band.first_number = next;
    next += band.entries;
  }
  narrow_.resize(narrow);
  wide_.resize(wide);
  weights_.resize(narrow + wide);
  parallel_for(bands_.size(), kBandsPerTable, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> number_of(texels_per_node_, kNoTexel);
    for (std::size_t b = begin; b < end; ++b) take_entries(bands_[b], order, number_of);
  });
}

void BandedRows::cut(std::size_t group, std::size_t first_row, std::span<const RowOfView> order) {
  for (std::size_t begin = first_row; begin < order.size();) {
    std::size_t entries = order[begin].entries();
    std::size_t end = begin + 1;
    while (end < order.size() && entries + order[end].entries() <= kBandEntries) {
      entries += order[end++].entries();
    }
    bands_.push_back({group, begin, end, entries});
    begin = end;
  }
}

void BandedRows::take_entries(Band& band, std::span<const RowOfView> order,
                              std::vector<std::uint32_t>& number_of) {
  std::size_t next = 0;
  for (std::size_t r = band.begin; r < band.end; ++r) {
    const RenderingMatrix& matrix = *order[r].matrix;
    const std::size_t first = matrix.row_offsets[order[r].row];
    counts_[r] = static_cast<std::uint32_t>(order[r].entries());
    for (std::size_t e = first; e < first + counts_[r]; ++e, ++next) {
      const std::uint32_t texel = matrix.texels[e];
      if (number_of[texel] == kNoTexel) {
        number_of[texel] = static_cast<std::uint32_t>(band.texels.size());
        band.texels.push_back(texel);
      }
      if (band.wide) {
        wide_[band.first_number + next] = number_of[texel];
      } else {
        narrow_[band.first_number + next] = static_cast<std::uint16_t>(number_of[texel]);
      }
      weights_[band.first_entry + next] = matrix.weights[e];
    }
  }
  for (const std::uint32_t texel : band.texels) number_of[texel] = kNoTexel;
}

std::vector<std::uint32_t> BandedRows::number(int nodes) {
  std::size_t reads = 0;
  for (const Band& band : bands_) reads += band.texels.size() * seen_by(band).size();
  if (reads >= std::numeric_limits<std::uint32_t>::max() / 2) {
    throw InvalidArgument("views", std::to_string(reads) + " texels of bands of rows", "below 2^31");
  }
  std::vector<std::uint32_t> number_of(texels_per_node_ * static_cast<std::size_t>(nodes), kNoTexel);
  std::vector<std::uint32_t> numbered;
  for (Band& band : bands_) number(band, number_of, numbered);
  unknowns_ = numbered.size();
  for_bands([&](const Band& band) {
    // From the order in which rows meet them to first the own, then the others; `texels` holds the place.
    const std::size_t end = band.first_number + band.entries;
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
  const std::vector<NodeWeight>& seen = seen_by(band);
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
    const std::size_t first = texels_per_node_ * static_cast<std::size_t>(seen.front().node) + texel;
    if (sees_one(seen_by(band)) && number_of[first] == kNoTexel) {
      numbered_now(first);
      places.push_back(static_cast<std::uint32_t>(band.own++));
      continue;
    }
    for (const NodeWeight& node : seen) {
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
      for (const NodeWeight& node : seen_by(band)) {
        parts_[first_part_[*unknown++ + 1]++] = {share, node.weight};
      }
    }
  }
  first_part_.pop_back();
}

template <typename Body>
void BandedRows::for_bands(const Body& body) const {
  parallel_for(bands_.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) body(bands_[b]);
  });
}

template <typename Body>
ChannelSums BandedRows::sum_over_bands(const Body& body) const {
  std::vector<ChannelSums> of_bands(bands_.size());
  for_bands(
      [&](const Band& band) { of_bands[static_cast<std::size_t>(&band - bands_.data())] = body(band); });
  ChannelSums sums{};
  for (const ChannelSums& of_band : of_bands) add(sums, of_band);
  return sums;
}

template <typename Row>
void BandedRows::for_rows(const Band& band, const Row& row) const {
  const auto go = [&](const auto* numbers) {
    const float* weights = weights_.data() + band.first_entry;
    for (std::size_t r = band.begin; r < band.end; ++r) {
      row(r, numbers, weights, std::size_t{counts_[r]});
      numbers += counts_[r];
      weights += counts_[r];
    }
  };
  if (band.wide) {
    go(wide_.data() + band.first_number);
  } else {
    go(narrow_.data() + band.first_number);
  }
}

const Channels* BandedRows::collect(const Band& band, const Vector& x) const {
  Vector& to = local().texels;
  if (to.size() < band.own + band.others) to.resize(band.own + band.others);
  std::copy_n(x.begin() + static_cast<std::ptrdiff_t>(band.first_own), band.own, to.begin());
  const std::vector<NodeWeight>& seen = seen_by(band);
  const std::uint32_t* unknown = reads_.data() + band.first_read;
  Channels* other = to.data() + band.own;
  if (sees_one(seen_by(band))) {
    for (std::size_t i = 0; i < band.others; ++i) other[i] = x[unknown[i]];
  } else {
    for (std::size_t i = 0; i < band.others; ++i) {
      Channels sum{};
      for (const NodeWeight& node : seen) sum += broadcast(node.weight) * x[*unknown++];
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
  for_bands([&](const Band& band) {
    const Channels* texels = collect(band, x);
    for_rows(band, [&](std::size_t r, const auto* numbers, const float* entries, std::size_t count) {
      b[r] = read(numbers, entries, count, texels);
    });
  });
}

ChannelSums BandedRows::residual(const Vector& weights, const Vector& target, const Vector& x,
                                 Vector& shares) const {
  return sum_over_bands([&](const Band& band) {
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
    return to_sums(squares);
  });
}

ChannelSums BandedRows::normal(const Vector& weights, const Vector& x, Vector& shares) const {
  return sum_over_bands([&](const Band& band) {
    const Channels* texels = collect(band, x);
    Channels* made = clear(band);
    ChannelDoubles squares{};
    for_rows(band, [&](std::size_t r, const auto* numbers, const float* entries, std::size_t count) {
      const Channels t = read(numbers, entries, count, texels);
      const Channels weighted = weights[r] * t;
      add_product(squares, weighted, t);
      give(numbers, entries, count, weighted, made);
    });
    put(band, made, shares);
    return to_sums(squares);
  });
}

void BandedRows::transposed(const Vector& weights, const Vector& t, Vector& shares) const {
  for_bands([&](const Band& band) {
    Channels* made = clear(band);
    for_rows(band, [&](std::size_t r, const auto* numbers, const float* entries, std::size_t count) {
      give(numbers, entries, count, weights[r] * t[r], made);
    });
    put(band, made, shares);
  });
}

void BandedRows::diagonal(const Vector& weights, Vector& shares) const {
  for_bands([&](const Band& band) {
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
