#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mirrorbake/envmap/texel_topology.hpp"
#include "mirrorbake/inference/map_solver.hpp"
#include "row_kernels.hpp"
#include "texel_vector.hpp"

namespace mirrorbake {

/// The rows of all views of a system, cut into bands. Rows that read texels near each other follow each
/// other, of whatever view among those that see the same nodes, so a band reads few texels: it has numbers of
/// its own for them, of 16 bits, and copies them together before it goes through its rows. Numbers of texels
/// that lie beside each other follow each other, so that a row reads two at a time. One pass over an entry is
/// enough for a product with AᵀWA: what a row reads is given back to its texels while they are in the cache.
/// What the bands give to an unknown, their shares, is added up afterwards in the order of the bands, so that
/// the sums do not depend on the number of threads.
///
/// A row's number is its place in the order of the bands. Nothing of the views' matrices is kept.
class BandedRows {
 public:
  /// `maps`: of a node; their texels are the columns of every matrix.
  BandedRows(std::span<const SolverView> views, std::span<const TexelTopology> maps, int nodes);

  std::size_t views() const { return first_place_.size() - 1; }
  std::size_t rows() const { return places_.size(); }
  /// Number of each row of a view.
  std::span<const std::uint32_t> places(std::size_t view) const {
    return std::span(places_).subspan(first_place_[view], first_place_[view + 1] - first_place_[view]);
  }
  std::size_t unknowns() const { return texels_.size(); }
  /// Of each unknown, counted through all nodes. Their order is that in which the bands meet them: those that
  /// a band is the first to meet, its own, lie together, and so do its shares in them.
  const std::vector<std::uint32_t>& texels() const { return texels_; }
  /// Length of `shares` below.
  std::size_t shares() const { return texels_.size() + others_; }

  struct Band {
    std::size_t group;       // whose nodes it sees
    std::size_t begin, end;  // rows
    std::size_t entries;
    std::vector<std::uint32_t> reads = {};   // texels of a node in rising order; dropped once numbered
    std::vector<std::uint16_t> narrow = {};  // first numbers of pairs
    std::vector<std::uint32_t> wide = {};    // instead, where 16 bits are too few
    std::vector<float> weights = {};         // two of each pair
    std::size_t first = 0, own = 0;          // unknowns
    // Texels that other bands own, or that nodes show together, and the first one's share.
    std::size_t first_other = 0, others = 0;
    std::size_t first_read = 0;  // in reads_: the unknown of each of those, of every node in turn
    bool reads_own = true;       // number 0 is the first own unknown, else the first other
    std::size_t first_part = 0, end_part = 0;  // in parts_: other bands' shares in the own unknowns
  };

  std::size_t bands() const { return bands_.size(); }
  std::size_t number_of(const Band& band) const { return static_cast<std::size_t>(&band - bands_.data()); }
  /// `body(band)` for all bands, in parallel.
  template <typename Body>
  void for_bands(const Body& body) const {
    parallel_for(bands_.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) body(bands_[b]);
    });
  }
  /// Sum of `body(band)` over all bands, in their order.
  template <typename Body>
  ChannelSums sum_over_bands(const Body& body) const {
    std::vector<ChannelSums> of_bands(bands_.size());
    parallel_for(bands_.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) of_bands[b] = body(bands_[b]);
    });
    ChannelSums sums{};
    for (const ChannelSums& of_band : of_bands) add(sums, of_band);
    return sums;
  }

  /// b = A x.
  void multiply(const TexelVector& x, Vector& b) const;
  /// A band's shares of AᵀW (target − A x), to be changed and then to be `put` before the thread makes
  /// others: of the own unknowns, then of the others. Adds Σ w |target − A x|² of its rows to `squares`, per
  /// channel. An empty x is 0.
  Channels* residual(const Band& band, const Vector& weights, const Vector& target, const TexelVector& x,
                     ChannelSums& squares) const {
    return go_through(band, weights, target.data(), x, squares);
  }
  /// The same of AᵀW A x; to `squares` its part of xᵀAᵀW A x.
  Channels* normal(const Band& band, const Vector& weights, const TexelVector& x,
                   ChannelSums& squares) const {
    return go_through(band, weights, nullptr, x, squares);
  }
  void put(const Band& band, const Channels* made, TexelVector& shares) const;
  /// Adds to a band's own unknowns what the others gave to them, once all have.
  void add_parts(const Band& band, TexelVector& shares) const;

 private:
  struct RowOfView {
    const RenderingMatrix* matrix;
    std::size_t view, row;
    std::size_t first() const { return matrix->row_offsets[row]; }
    std::size_t entries() const { return matrix->row_offsets[row + 1] - matrix->row_offsets[row]; }
    std::span<const std::uint32_t> texels() const {
      return std::span(matrix->texels).subspan(first(), entries());
    }
    std::span<const float> weights() const { return std::span(matrix->weights).subspan(first(), entries()); }
  };
  void cut(std::size_t group, std::size_t first_row, std::span<const RowOfView> order);
  const std::vector<NodeWeight>& seen_by(const Band& band) const { return groups_[band.group]; }
  void find_reads(std::span<const RowOfView> order);
  /// Finds out which texels are each band's own, and numbers them.
  void number(int nodes);
  void number(Band& band, std::vector<std::uint32_t>& number_of);
  void find_parts();
  /// The number of each texel of a node that a band reads.
  void number_reads(const Band& band, std::uint32_t* number_of) const;
  void pair_entries(std::span<const RowOfView> order);
  void pair_entries(Band& band, std::span<const RowOfView> order, const std::uint32_t* number_of);
  Channels* go_through(const Band& band, const Vector& weights, const Channels* target, const TexelVector& x,
                       ChannelSums& squares) const;
  /// Copies together what a band reads; number 0 comes first.
  const Channels* collect(const Band& band, const TexelVector& x) const;
  /// Where a band's shares are made, all 0.
  static Channels* clear(const Band& band);
  /// Where among them number 0 is.
  static Channels* numbered(const Band& band, Channels* made) {
    return band.reads_own ? made : made + band.own;
  }
  /// `row(r, numbers, weights, pairs)` for every row of a band, r counted through all views.
  template <typename Row>
  void for_rows(const Band& band, const Row& row) const;

  std::size_t texels_per_node_ = 0;
  std::vector<std::vector<NodeWeight>> groups_;  // the nodes that views see, each list once
  std::vector<std::size_t> first_place_;         // of each view
  std::vector<std::uint32_t> places_;
  std::vector<std::uint32_t> counts_;  // pairs of each row
  std::vector<Band> bands_;
  std::vector<std::uint32_t> reads_;
  std::size_t others_ = 0;
  std::vector<std::uint32_t> texels_;
  std::vector<SharedPart> parts_;
};

}  // namespace mirrorbake
