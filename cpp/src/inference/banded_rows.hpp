#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mirrorbake/inference/map_solver.hpp"
#include "texel_vector.hpp"

namespace mirrorbake {

/// The rows of all views of a system, one view after the other, cut into bands. Neighbouring pixels read
/// neighbouring texels, so a band reads few of them: it has numbers of its own for them, of 16 bits, and
/// copies them together before it goes through its rows. One pass over an entry is enough for a product with
/// AᵀWA: what a row reads is given back to its texels while they are in the cache. What the bands give to an
/// unknown, their shares, is added up afterwards in the order of the bands, so that the sums do not depend
/// on the number of threads.
///
/// Weights stay where they are, in the matrices of the views, which have to outlive this.
class BandedRows {
 public:
  /// `texels_per_node`: columns of every matrix.
  BandedRows(std::span<const SolverView> views, std::size_t texels_per_node);

  /// Numbers the texels of all nodes that a row sees, and returns them: unknown i is texel i of the result,
  /// counted through all nodes. Their order is that in which the bands meet them: those that a band is the
  /// first to meet, its own, lie together, and so do its shares in them. To be called once.
  std::vector<std::uint32_t> number(int nodes);

  std::size_t views() const { return views_.size(); }
  std::size_t rows() const { return first_row_.back(); }
  std::size_t first_row(std::size_t view) const { return first_row_[view]; }
  /// Length of `shares` below, which have to be 0 before their first use.
  std::size_t shares() const { return unknowns_ + others_; }

  /// b = A x.
  void multiply(const Vector& x, Vector& b) const;
  /// Shares of AᵀW (target − A x). Returns Σ w |target − A x|² per channel.
  ChannelSums residual(const Vector& weights, const Vector& target, const Vector& x, Vector& shares) const;
  /// Shares of AᵀW A x.
  void normal(const Vector& weights, const Vector& x, Vector& shares) const;
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
    std::size_t view;
    std::size_t begin, end;                   // rows of the view
    std::size_t first_number;                 // of its entries, in narrow_ or wide_
    std::vector<std::uint32_t> texels;        // in the order in which rows meet them; dropped once numbered
    std::size_t first_own = 0, own = 0;       // unknowns
    std::size_t first_other = 0, others = 0;  // shares in what other bands own, after those of the unknowns
    std::size_t first_read = 0;  // in reads_: the unknown of each other texel, of every node in turn
    bool wide = false;           // 16 bits are too few
  };
  /// A share in what another band owns, and the node's weight in what its view sees.
  struct Part {
    std::uint32_t share;
    float weight;
  };

  void cut(std::size_t view);
  void find_texels(Band& band, std::vector<std::uint32_t>& number_of);
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
  /// `body(band, number of the band)` for all bands, in parallel.
  template <typename Body>
  void for_bands(const Body& body) const;

  std::vector<SolverView> views_;
  std::size_t texels_per_node_;
  std::vector<std::size_t> first_row_;
  std::vector<Band> bands_;
  std::vector<std::uint16_t> narrow_;
  std::vector<std::uint32_t> wide_;
  std::vector<std::uint32_t> reads_;
  std::size_t unknowns_ = 0, others_ = 0;
  std::vector<std::uint32_t> first_part_;
  std::vector<Part> parts_;
};

}  // namespace mirrorbake
