#pragma once

#include <cstddef>
#include <cstdint>

/// The inner loops of the solver, one set per instruction set (mirrorbake_add_isa_sources). Rows and the
/// texels of a band have four channels; vectors of all unknowns have `stride` ones, three or four.
namespace mirrorbake {

/// Rows of a band whose entries are taken two at a time: a pair is an entry and one of the texel with the
/// next number, of weight 0 where the row does not read that one.
struct PairedRows {
  std::size_t rows;
  const std::uint32_t* counts;  ///< pairs of each row
  const std::uint16_t* narrow;  ///< the first texel's number of each pair; null if `wide` has them
  const std::uint32_t* wide;
  const float* weights;  ///< two of each pair
};

/// A band's share in what another one owns, and the node's weight in what its view sees.
struct SharedPart {
  std::uint32_t unknown, share;
  float weight;
};

/// The upper half of a float: a preconditioner needs no more digits.
using HalfFloat = std::uint16_t;

struct SolverLoops {
  /// With t = target − A x, or A x if there is no target, or the target if there is no x: y += AᵀW t.
  /// squares[4] += Σ w t².
  void (*rows)(const PairedRows& rows, const float* weights, const float* target, const float* x, float* y,
               double* squares);
  /// Texels of a vector of unknowns, one after the other, made ones of a band; the fourth channel of three is
  /// some finite number.
  void (*widen)(std::size_t count, std::size_t stride, const float* from, float* to);
  /// The same of texels that are listed.
  void (*gather)(std::size_t count, std::size_t stride, const float* from, const std::uint32_t* list,
                 float* to);
  /// And back.
  void (*narrow)(std::size_t count, std::size_t stride, const float* from, float* to);
  /// shares[unknown] += weight · shares[share] of each part.
  void (*add)(std::size_t count, std::size_t stride, const SharedPart* parts, float* shares);
  /// What a round begins with. Holds what lies on its bound, −base or upper − base, from which s does not
  /// lead inside: inverse = 0 there, `free` elsewhere; step = inverse s; gamma[stride] += Σ s · step, per
  /// channel.
  void (*begin)(std::size_t count, std::size_t stride, const HalfFloat* free, const float* base,
                const float* upper, const float* x, const float* s, HalfFloat* inverse, float* step,
                double* gamma);
  /// s −= a · normal; gamma[stride] += Σ s · inverse s, per channel.
  void (*gradient)(std::size_t count, std::size_t stride, const float* a, const float* normal,
                   const HalfFloat* inverse, float* s, double* gamma);
  /// x += a · step; step = inverse s + b · step.
  void (*step)(std::size_t count, std::size_t stride, const float* a, const float* b,
               const HalfFloat* inverse, const float* s, float* x, float* step);
};

/// Those of the instruction set in use.
const SolverLoops& solver_loops();

namespace baseline {
extern const SolverLoops kSolverLoops;
}
namespace sse42 {
extern const SolverLoops kSolverLoops;
}
namespace avx2 {
extern const SolverLoops kSolverLoops;
}
namespace avx512 {
extern const SolverLoops kSolverLoops;
}

}  // namespace mirrorbake
