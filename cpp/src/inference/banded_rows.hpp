#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mirrorbake/envmap/texel_topology.hpp"
#include "mirrorbake/inference/map_solver.hpp"
#include "texel_vector.hpp"

namespace mirrorbake {

/// The rows of all views of a system, cut into bands. Rows that read texels near each other follow each
/// other, of whatever view among those that see the same nodes, so a band reads few texels: it has numbers of
/// its own for them, of 16 bits, and copies them together before it goes through its rows. One pass over an
/// entry is enough for a product with AᵀWA: what a row reads is given back to its texels while they are in
/// the cache. What the bands give to an unknown, their shares, is added up afterwards in the order of the
/// bands, so that the sums do not depend on the number of threads.
///
/// A row's number is its place in the order of the bands. Nothing of the views' matrices is kept.
class BandedRows {
 public:
  /// `maps`: of a node; their texels are the columns of every matrix.
  BandedRows(std::span<const SolverView> views, std::span<const TexelTopology> maps);

  /// Numbers the texels of all nodes that a row sees, and returns them: unknown i is texel i of the result,
  /// counted through all nodes. Their order is that in which the bands meet them: those that a band is the
  /// first to meet, its own, lie together, and so do its shares in them. To be called once.
  std::vector<std::uint32_t> number(int nodes);

  std::size_t views() const { return first_place_.size() - 1; }
  std::size_t rows() const { return places_.size(); }
  /// Number of each row of a view.
  std::span<const std::uint32_t> places(std::size_t view) const {
    return std::span(places_).subspan(first_place_[view], first_place_[view + 1] - first_place_[view]);
  }
  /// Length of `shares` below, which have to be 0 before their first use.
  std::size_t shares() const { return unknowns_ + others_; }

  /// b = A x.
  void multiply(const Vector& x, Vector& b) const;
  /// Shares of AᵀW (target − A x). Returns Σ w |target − A x|² per channel.
  ChannelSums residual(const Vector& weights, const Vector& target, const Vector& x, Vector& shares) const;
  /// Shares of AᵀW A x. Returns xᵀAᵀW A x per channel.
  ChannelSums normal(const Vector& weights, const Vector& x, Vector& shares) const;
  /// Shares of AᵀW t.
  void transposed(const Vector& weights, const Vector& t, Vector& shares) const;
  /// Shares of the diagonal of AᵀWA, for `sum_of_squares`.
  void diagonal(const Vector& weights, Vector& shares) const;

  /// What an unknown gets of all bands.
  Channels sum(const Vector& shares, std::size_t unknown) const {
    Channels total = shares[unknown];
    for (std::uint32_t i = first_part_[unknown]; i < first_part_[unknown + 1]; ++i) {
      total += broadcast(parts_[i].weight) * shares[parts_[i].share];
    }
    return total;
  }
  /// The same with squared weights of the nodes.
  Channels sum_of_squares(const Vector& shares, std::size_t unknown) const {
    Channels total = shares[unknown];
    for (std::uint32_t i = first_part_[unknown]; i < first_part_[unknown + 1]; ++i) {
      total += broadcast(parts_[i].weight * parts_[i].weight) * shares[parts_[i].share];
    }
    return total;
  }

 private:
  struct Band {
    std::size_t group;       // whose nodes it sees
    std::size_t begin, end;  // rows
    std::size_t entries;
    std::size_t first_entry = 0;              // in weights_
    std::size_t first_number = 0;             // in narrow_ or wide_
    bool wide = false;                        // 16 bits are too few
    std::vector<std::uint32_t> texels = {};   // in the order in which rows meet them; dropped once numbered
    std::size_t first_own = 0, own = 0;       // unknowns
    std::size_t first_other = 0, others = 0;  // shares in what other bands own, after those of the unknowns
    std::size_t first_read = 0;  // in reads_: the unknown of each other texel, of every node in turn
  };
  struct RowOfView {
    const RenderingMatrix* matrix;
    std::size_t row;
    std::size_t entries() const { return matrix->row_offsets[row + 1] - matrix->row_offsets[row]; }
  };
  /// A share in what another band owns, and the node's weight in what its view sees.
  struct Part {
    std::uint32_t share;
    float weight;
  };

  void cut(std::size_t group, std::size_t first_row, std::span<const RowOfView> order);
  const std::vector<NodeWeight>& seen_by(const Band& band) const { return groups_[band.group]; }
  void take_entries(Band& band, std::span<const RowOfView> order, std::vector<std::uint32_t>& number_of);
  /// Finds out which texels are a band's own, and numbers those.
  void number(Band& band, std::vector<std::uint32_t>& number_of, std::vector<std::uint32_t>& numbered);
  void find_parts();
  /// Copies together what a band reads.
  const Channels* collect(const Band& band, const Vector& x) const;
  /// Where a band's shares are made, all 0.
  static Channels* clear(const Band& band);
  void put(const Band& band, const Channels* made, Vector& shares) const;
  /// `row(r, numbers, weights, count)` for every row of a band, r counted through all views.
  template <typename Row>
  void for_rows(const Band& band, const Row& row) const;
  /// `body(band)` for all bands, in parallel.
  template <typename Body>
  void for_bands(const Body& body) const;
  /// Sum of `body(band)` over all bands, in their order.
  template <typename Body>
  ChannelSums sum_over_bands(const Body& body) const;

  std::size_t texels_per_node_ = 0;
  std::vector<std::vector<NodeWeight>> groups_;  // the nodes that views see, each list once
  std::vector<std::size_t> first_place_;         // of each view
  std::vector<std::uint32_t> places_;
  std::vector<std::uint32_t> counts_;  // entries of each row
  std::vector<Band> bands_;
  std::vector<float> weights_;
  std::vector<std::uint16_t> narrow_;
  std::vector<std::uint32_t> wide_;
  std::vector<std::uint32_t> reads_;
  std::size_t unknowns_ = 0, others_ = 0;
  std::vector<std::uint32_t> first_part_;
  std::vector<Part> parts_;
};

}  // namespace mirrorbake
