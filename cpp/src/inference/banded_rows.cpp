#include "banded_rows.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/isa.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "row_kernels.hpp"

namespace mirrorbake {
namespace {

// Entries of a band. The texels that so many read, and what is given back to them, stay in a core's own
// cache; with fewer, more texels are read by two bands.
constexpr std::size_t kBandEntries = std::size_t{1} << 15;
constexpr std::size_t kNarrow = std::size_t{1} << 16;
// Bands that are worked on one after the other, with one table of the texels.
constexpr std::size_t kBandsPerTable = 16;

// Rows of many views that follow each other lie far apart in memory, which is asked for them so far ahead.
constexpr std::size_t kRowsAhead = 6;
template <typename T>
void ask_for(std::span<const T> values) {
  for (std::size_t i = 0; i < values.size(); i += 64 / sizeof(T)) __builtin_prefetch(&values[i]);
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

const SolverLoops& solver_loops() {
#ifdef MIRRORBAKE_HAS_X86_LEVELS
  switch (active_isa()) {
    case Isa::avx512: return avx512::kSolverLoops;
    case Isa::avx2: return avx2::kSolverLoops;
    case Isa::sse42: return sse42::kSolverLoops;
    case Isa::baseline: break;
  }
#endif
  return baseline::kSolverLoops;
}

BandedRows::BandedRows(std::span<const SolverView> views, std::span<const TexelTopology> maps, int nodes)
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
      order.push_back({views[view].matrix, view, row});
    }
    cut(group, first_row, order);
  }
  find_reads(order);
  number(nodes);
  pair_entries(order);
  find_parts();
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

// A bit for each texel sorts them.
void BandedRows::find_reads(std::span<const RowOfView> order) {
  parallel_for(bands_.size(), kBandsPerTable, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint64_t> bits(texels_per_node_ / 64 + 1);
    for (std::size_t b = begin; b < end; ++b) {
      Band& band = bands_[b];
      std::size_t lowest = bits.size(), highest = 0, count = 0;
      for (std::size_t r = band.begin; r < band.end; ++r) {
        if (r + kRowsAhead < band.end) ask_for(order[r + kRowsAhead].texels());
        for (const std::uint32_t texel : order[r].texels()) {
          const std::size_t word = texel / 64;
          const std::uint64_t bit = std::uint64_t{1} << (texel % 64);
          count += (bits[word] & bit) == 0 ? 1 : 0;
          bits[word] |= bit;
          lowest = std::min(lowest, word);
          highest = std::max(highest, word);
        }
      }
      band.reads.reserve(count);
      for (std::size_t word = lowest; word <= highest && word < bits.size(); ++word) {
        for (std::uint64_t left = bits[word]; left != 0; left &= left - 1) {
          band.reads.push_back(static_cast<std::uint32_t>(64 * word) +
                               static_cast<std::uint32_t>(std::countr_zero(left)));
        }
        bits[word] = 0;
      }
    }
  });
}

void BandedRows::number(int nodes) {
  std::size_t most = 0;
  for (const Band& band : bands_) most += band.reads.size() * (seen_by(band).size() + 1) + 1;
  if (most >= std::numeric_limits<std::uint32_t>::max() / 2) {
    throw InvalidArgument("views", std::to_string(most) + " texels of bands of rows", "below 2^31");
  }
  std::vector<std::uint32_t> number_of(texels_per_node_ * static_cast<std::size_t>(nodes), kNoTexel);
  for (Band& band : bands_) number(band, number_of);
}

void BandedRows::number(Band& band, std::vector<std::uint32_t>& number_of) {
  const std::vector<NodeWeight>& seen = seen_by(band);
  band.reads_own = sees_one(seen);
  band.first = texels_.size();
  for (const NodeWeight& node : seen) {
    for (const std::uint32_t read : band.reads) {
      const std::size_t texel = texels_per_node_ * static_cast<std::size_t>(node.node) + read;
      if (number_of[texel] != kNoTexel) continue;
      number_of[texel] = static_cast<std::uint32_t>(texels_.size());
      texels_.push_back(static_cast<std::uint32_t>(texel));
    }
  }
  band.own = texels_.size() - band.first;
  band.first_other = others_;
  band.first_read = reads_.size();
  for (const std::uint32_t read : band.reads) {
    const std::size_t first = texels_per_node_ * static_cast<std::size_t>(seen.front().node) + read;
    if (band.reads_own && number_of[first] >= band.first) continue;
    for (const NodeWeight& node : seen) {
      reads_.push_back(number_of[texels_per_node_ * static_cast<std::size_t>(node.node) + read]);
    }
    ++band.others;
  }
  others_ += band.others;
}

void BandedRows::pair_entries(std::span<const RowOfView> order) {
  parallel_for(bands_.size(), kBandsPerTable, [&](std::size_t begin, std::size_t end) {
    // Whatever a band looks up in it, it has put there.
    const auto number_of = std::make_unique_for_overwrite<std::uint32_t[]>(texels_per_node_);
    for (std::size_t b = begin; b < end; ++b) {
      number_reads(bands_[b], number_of.get());
      pair_entries(bands_[b], order, number_of.get());
      bands_[b].reads = {};
    }
  });
}

void BandedRows::pair_entries(Band& band, std::span<const RowOfView> order, const std::uint32_t* number_of) {
  const std::span rows = order.subspan(band.begin, band.end - band.begin);
  // Of all entries, with one number that follows none behind those of every row.
  std::vector<std::uint32_t> numbers(band.entries + rows.size());
  std::vector<std::uint32_t> first_number(rows.size()), pairs(rows.size());
  std::uint32_t most = 0;
  std::size_t all = 0;
  std::uint32_t* next = numbers.data();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    first_number[i] = static_cast<std::uint32_t>(next - numbers.data());
    std::uint32_t single = kNoTexel;  // the number that would make a pair of the last one
    if (i + kRowsAhead < rows.size()) ask_for(rows[i + kRowsAhead].texels());
    for (const std::uint32_t texel : rows[i].texels()) {
      const std::uint32_t number = number_of[texel];
      *next++ = number;
      const bool second = number == single;
      pairs[i] += second ? 0 : 1;
      single = second ? kNoTexel : number + 1;
    }
    *next++ = kNoTexel;
    most = std::max(most, pairs[i]);
    all += pairs[i];
  }
  // Rows of as many pairs follow each other, or a processor guesses wrong at the end of almost every one.
  std::vector<std::uint32_t> place(most + 2);
  for (const std::uint32_t count : pairs) ++place[count + 1];
  for (std::size_t count = 1; count < place.size(); ++count) place[count] += place[count - 1];
  std::vector<std::uint32_t> sorted(rows.size());
  for (std::uint32_t i = 0; i < rows.size(); ++i) sorted[place[pairs[i]]++] = i;

  for (std::size_t i = 0; i < rows.size(); ++i) {
    const RowOfView& row = rows[sorted[i]];
    counts_[band.begin + i] = pairs[sorted[i]];
    places_[first_place_[row.view] + row.row] = static_cast<std::uint32_t>(band.begin + i);
  }
  band.weights.resize(2 * all);
  const auto put = [&](auto* to) {
    float* weights = band.weights.data();
    for (std::size_t i = 0; i < sorted.size(); ++i) {
      if (i + kRowsAhead < sorted.size()) ask_for(rows[sorted[i + kRowsAhead]].weights());
      const std::uint32_t* number = numbers.data() + first_number[sorted[i]];
      const std::span weight = rows[sorted[i]].weights();
      for (std::size_t e = 0; e < weight.size(); ++e) {
        *to++ = static_cast<std::remove_pointer_t<decltype(to)>>(number[e]);
        *weights++ = weight[e];
        // Without a branch, which a processor would guess wrong at every other pair.
        const bool second = number[e + 1] == number[e] + 1;
        e += second ? 1 : 0;
        *weights++ = second ? weight[e] : 0.0F;
      }
    }
  };
  if (band.entries > kNarrow) {
    band.wide.resize(all);
    put(band.wide.data());
  } else {
    band.narrow.resize(all);
    put(band.narrow.data());
  }
}

void BandedRows::number_reads(const Band& band, std::uint32_t* number_of) const {
  const std::size_t node = texels_per_node_ * static_cast<std::size_t>(seen_by(band).front().node);
  std::uint32_t own = 0, other = band.reads_own ? static_cast<std::uint32_t>(band.own) : 0;
  for (const std::uint32_t read : band.reads) {
    // Own unknowns are in the order of the reads.
    const bool is_own = band.reads_own && own < band.own && texels_[band.first + own] == node + read;
    number_of[read] = is_own ? own++ : other++;
  }
}

// Sorts the shares in what other bands own by the owner.
void BandedRows::find_parts() {
  const auto owner_of = [&](std::uint32_t unknown, std::size_t likely) {
    const Band& guess = bands_[likely];
    if (unknown >= guess.first && unknown < guess.first + guess.own) return likely;
    // Bands that own nothing begin where the next one does.
    const auto after = std::ranges::upper_bound(bands_, std::size_t{unknown}, {}, &Band::first);
    return static_cast<std::size_t>(after - bands_.begin()) - 1;
  };
  std::vector<std::uint32_t> owners(reads_.size());
  for (std::size_t i = 0; i < reads_.size(); ++i) {
    owners[i] = static_cast<std::uint32_t>(owner_of(reads_[i], i > 0 ? owners[i - 1] : 0));
    ++bands_[owners[i]].end_part;
  }
  std::size_t next = 0;
  for (Band& band : bands_) {
    band.first_part = next;
    next += band.end_part;
    band.end_part = band.first_part;
  }
  parts_.resize(next);
  for (const Band& band : bands_) {
    std::size_t read = band.first_read;
    for (std::size_t i = 0; i < band.others; ++i) {
      const auto share = static_cast<std::uint32_t>(texels_.size() + band.first_other + i);
      for (const NodeWeight& node : seen_by(band)) {
        parts_[bands_[owners[read]].end_part++] = {reads_[read], share, node.weight};
        ++read;
      }
    }
  }
}

template <typename Row>
void BandedRows::for_rows(const Band& band, const Row& row) const {
  const auto go = [&](const auto* numbers) {
    const float* weights = band.weights.data();
    for (std::size_t r = band.begin; r < band.end; ++r) {
      row(r, numbers, weights, std::size_t{counts_[r]});
      numbers += counts_[r];
      weights += 2 * std::size_t{counts_[r]};
    }
  };
  if (band.wide.empty()) {
    go(band.narrow.data());
  } else {
    go(band.wide.data());
  }
}

const Channels* BandedRows::collect(const Band& band, const TexelVector& x) const {
  Vector& to = local().texels;
  const std::size_t own = band.reads_own ? band.own : 0;
  // One more, which the last pair may begin before.
  if (to.size() < own + band.others + 1) to.resize(own + band.others + 1);
  to[own + band.others] = Channels{};
  const SolverLoops& loops = solver_loops();
  if (own > 0) loops.widen(own, x.stride(), x.at(band.first), floats(to.data()));
  const std::vector<NodeWeight>& seen = seen_by(band);
  const std::uint32_t* unknown = reads_.data() + band.first_read;
  Channels* other = to.data() + own;
  if (band.reads_own) {
    loops.gather(band.others, x.stride(), x.data(), unknown, floats(other));
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
  local().shares.assign(band.own + band.others + 1, Channels{});
  return local().shares.data();
}

void BandedRows::put(const Band& band, const Channels* made, TexelVector& shares) const {
  const SolverLoops& loops = solver_loops();
  loops.narrow(band.own, shares.stride(), floats(made), shares.at(band.first));
  loops.narrow(band.others, shares.stride(), floats(made + band.own),
               shares.at(texels_.size() + band.first_other));
}

void BandedRows::add_parts(const Band& band, TexelVector& shares) const {
  solver_loops().add(band.end_part - band.first_part, shares.stride(), parts_.data() + band.first_part,
                     shares.data());
}

void BandedRows::multiply(const TexelVector& x, Vector& b) const {
  for_bands([&](const Band& band) {
    const Channels* texels = collect(band, x);
    for_rows(band, [&](std::size_t r, const auto* numbers, const float* weights, std::size_t pairs) {
      Channels sum{};
      for (std::size_t p = 0; p < pairs; ++p) {
        sum += broadcast(weights[2 * p]) * texels[numbers[p]];
        sum += broadcast(weights[2 * p + 1]) * texels[numbers[p] + 1U];
      }
      b[r] = sum;
    });
  });
}

Channels* BandedRows::go_through(const Band& band, const Vector& weights, const Channels* target,
                                 const TexelVector& x, ChannelSums& squares) const {
  const bool at_zero = target != nullptr && x.size() == 0;
  const Channels* texels = at_zero ? nullptr : collect(band, x);
  Channels* made = clear(band);
  const PairedRows rows{band.end - band.begin, counts_.data() + band.begin,
                        band.wide.empty() ? band.narrow.data() : nullptr, band.wide.data(),
                        band.weights.data()};
  solver_loops().rows(rows, floats(weights.data() + band.begin),
                      target == nullptr ? nullptr : floats(target + band.begin),
                      at_zero ? nullptr : floats(texels), floats(numbered(band, made)), squares.data());
  return made;
}

}  // namespace mirrorbake
