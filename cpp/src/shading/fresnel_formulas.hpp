#pragma once

#include <cmath>
#include <cstddef>

/// The Fresnel equations in forms that do not cancel, written once for float and double, and compiled once
/// per instruction set: everything lives in the namespace MIRRORBAKE_ISA and has internal linkage. Where
/// nothing else is said, `c` has been through clamp_cosine. Conditions are written so that they become
/// selections, and so that a NaN cosine comes out as NaN.
#ifndef MIRRORBAKE_ISA
#define MIRRORBAKE_ISA baseline
#endif

namespace mirrorbake::MIRRORBAKE_ISA {
namespace {

// The bits of floating-point numbers ≥ 0 are in the order of the numbers, and integers have a minimum and a
// maximum. In comparisons of floats GCC follows c = 0 and c = 1 as separate paths through the whole formula.
template <typename T, typename Bits>
inline T clamp_cosine_bits(T c, Bits one, Bits infinity, Bits all_but_sign) {
  const Bits bits = __builtin_bit_cast(Bits, c);
  const Bits from_zero = bits > 0 ? bits : 0;
  const Bits clamped = from_zero < one ? from_zero : one;
  return __builtin_bit_cast(T, (bits & all_but_sign) > infinity ? bits : clamped);  // NaN stays
}
inline float clamp_cosine(float c) {
  return clamp_cosine_bits<float, int>(c, 0x3F800000, 0x7F800000, 0x7FFFFFFF);
}
inline double clamp_cosine(double c) {
  return clamp_cosine_bits<double, long long>(c, 0x3FF0000000000000, 0x7FF0000000000000, 0x7FFFFFFFFFFFFFFF);
}

template <typename T>
inline T at_most_one(T f) {
  return T(1) < f ? T(1) : f;
}

/// F1.
template <typename T>
inline T schlick(T c, T r0) {
  const T m = T(1) - c;
  const T m2 = m * m;
  return at_most_one(r0 + (T(1) - r0) * (m2 * m2 * m));
}

/// An unevaluated sum high + low with |low| ≤ ulp(high)/2.
struct Double2 {
  double high = 0;
  double low = 0;
};

/// a + b without error (Knuth).
inline Double2 two_sum(double a, double b) {
  const double sum = a + b;
  const double part = sum - a;
  return {sum, (a - (sum - part)) + (b - part)};
}

/// a² without error (Dekker 1971, Veltkamp's splitting); |a| < 1e300. An FMA would give the same low part,
/// but not every instruction set has one.
inline Double2 two_square(double a) {
  const double t = 134217729.0 * a;  // 2²⁷ + 1
  const double high = t - (t - a);
  const double low = a - high;
  const double square = a * a;
  return {square, ((high * high - square) + 2.0 * high * low) + low * low};
}

// F2. With k = n² − 1, g = √(k + c²) (n times the cosine on the other side), s = g + c and q = sin²θ =
// (1−c)(1+c):
//
//   r_s = (c − g)/(c + g)                 = −k/s²              since (g − c)(g + c) = k
//   r_p = (n²c − g)/(n²c + g)             = r_s (q − cg)/(q + cg)
//         because n² = g² + q gives n²c ± g = (q ± cg)(c ± g)·(±1)
//   F   = ½(r_s² + r_p²)                  = r_s² (c²g² + q²)/(cg + q)²
//
// in which every sum has terms of one sign. What can cancel is left in one place: g² = n² − 1 + c², near the
// critical angle of a medium with n < 1.

/// In float, where no more digits are to be had: n from 1.05 to 1e9. Of the two forms of r_s², the first
/// keeps the relative accuracy of small values and the second has fewer roundings near 1:
///
///   r_s² = (g − c)²/(S + X) = (S − X)/(S + X),   S = g² + c²,   X = 2cg
///
/// and (c²g² + q²)/(cg + q)² = M/(M + Xq), M = c²g² + q², since the rounding of M then cancels.
inline float dielectric_in_float(float c, float k) {
  const float c2 = c * c;
  const float g2 = k + c2;
  const float g = std::sqrt(g2);
  const float q = (1.0F - c) * (1.0F + c);
  const float d = g - c;
  const float s = g2 + c2;
  const float x = 2.0F * c * g;
  const float numerator = x + x < s ? s - x : d * d;
  const float m = c2 * g2 + q * q;
  return at_most_one(numerator * m / ((s + x) * (m + x * q)));
}

/// n² − 1 − κ² to twice the digits, and nκ.
struct Medium {
  Double2 a;
  double nk = 0;
};

inline Medium make_medium(double n, double kappa) {
  const Double2 n2 = two_square(n);
  const Double2 k2 = two_square(kappa);
  const Double2 difference = two_sum(n2.high, -k2.high);
  const Double2 less_one = two_sum(difference.high, -1.0);
  const double low = less_one.low + difference.low + (n2.low - k2.low);
  return {two_sum(less_one.high, low), n * kappa};
}

/// a + c², correctly rounded but for a few units in the last place *of the result*.
inline double plus_square(Double2 a, double c) {
  const Double2 c2 = two_square(c);
  const Double2 sum = two_sum(a.high, c2.high);
  return sum.high + (sum.low + (a.low + c2.low));
}

/// For any n > 0 (1e-100 to 1e100), near the critical angle too. n = 1 is no interface at all: 0.
inline double dielectric_any(double c, Double2 a) {
  const double g2 = plus_square(a, c);
  const double g = std::sqrt(0.0 < g2 ? g2 : 0.0);
  const double q = (1.0 - c) * (1.0 + c);
  const double cg = c * g;
  const double s2 = g2 + (c * c + 2.0 * cg);  // s², and exactly k at c = 0
  const double denominator = s2 * (cg + q);
  const double h = (a.high + a.low) / denominator;
  const double f = at_most_one(h * h * (cg * cg + q * q));
  const double answered = denominator == 0.0 ? 0.0 : f;
  return g2 < 0.0 ? 1.0 : answered;
}

/// 1 − F without the subtraction: T = 2cg/s² · (1 + n²/(cg + q)²).
inline double dielectric_transmittance(double c, double n) {
  if (n == 1.0) return 1.0;
  const double g2 = plus_square(make_medium(n, 0.0).a, c);
  if (g2 <= 0.0) return 0.0;
  const double g = std::sqrt(g2);
  const double s = g + c;
  const double q = (1.0 - c) * (1.0 + c);
  const double ratio = n / (c * g + q);
  return at_most_one(2.0 * (c / s) * (g / s) * (1.0 + ratio * ratio));
}

// F3. The transmitted g = a + ib has g² = (n + iκ)² − q, so with t = n² − κ² − q
//
//   a² + b² = |g²| = √(t² + 4n²κ²) = m,   a² − b² = t,   ab = nκ
//   R_s     = ((a − c)² + b²)/((a + c)² + b²)
//   R_p/R_s = ((ac − q)² + b²c²)/((ac + q)² + b²c²)
//   F       = ½(R_s + R_p) = R_s · M/(M + 2acq),   M = mc² + q²
//
// (Born & Wolf, Principles of Optics, §14.2, with the tangents multiplied out.) The larger of a, b is
// r = √((m + |t|)/2), the other one nκ/r. Multiplying numerator and denominator by powers of r leaves one
// division.

inline double conductor_any(double c, Medium medium) {
  const double t = plus_square(medium.a, c);
  const double nk = medium.nk;
  const double q = (1.0 - c) * (1.0 + c);
  const double m = std::sqrt(t * t + 4.0 * nk * nk);
  const double r2 = 0.5 * (m + (t < 0.0 ? -t : t));
  const double r = std::sqrt(r2);
  const double ar = t < 0.0 ? nk : r2;
  const double br = t < 0.0 ? r2 : nk;
  const double less = ar - c * r;
  const double more = ar + c * r;
  const double p = (m * (c * c) + q * q) * r;
  return at_most_one((less * less + br * br) * p / ((more * more + br * br) * (p + 2.0 * ar * c * q)));
}

// In float, R_s = (m + c² − 2ac)/(m + c² + 2ac) has fewer roundings, as long as it is not small. And t = a +
// c² must not cancel, or be small beside nκ.

/// The tail of both forms below: `sum` = (m + c²)r, `twice` = 2acr, `p` = Mr, for any r > 0.
inline float conductor_from(float sum, float twice, float p, float q) {
  return at_most_one((sum - twice) * p / ((sum + twice) * (p + twice * q)));
}

inline float conductor_in_float(float c, float a, float nk) {
  const float c2 = c * c;
  const float t = a + c2;
  const float q = (1.0F - c) * (1.0F + c);
  const float m = std::sqrt(t * t + 4.0F * nk * nk);
  const float r2 = 0.5F * (m + (t < 0.0F ? -t : t));
  const float r = std::sqrt(r2);
  const float ar = t < 0.0F ? nk : r2;
  return conductor_from((m + c2) * r, 2.0F * c * ar, (m * c2 + q * q) * r, q);
}

/// Degree of the polynomials below.
constexpr int kSeriesDegree = 5;

/// The same with a and m given as polynomials in y = 2c² − 1: the square roots are two thirds of the time.
/// Both are analytic in c² but for a branch point at 1 − (n ± iκ)², which for a metal is far from [0,1].
inline float conductor_series(float c, const float* a_coefficients, const float* m_coefficients) {
  const float c2 = c * c;
  const float y = 2.0F * c2 - 1.0F;
  const float q = (1.0F - c) * (1.0F + c);
  float a = a_coefficients[kSeriesDegree];
  float m = m_coefficients[kSeriesDegree];
  for (int i = kSeriesDegree - 1; i >= 0; --i) {
    a = a * y + a_coefficients[i];
    m = m * y + m_coefficients[i];
  }
  return conductor_from(m + c2, 2.0F * a * c, m * c2 + q * q, q);
}

/// Two neighbours of a table in one load: vectorised, half the gathered elements.
using FloatPair [[gnu::aligned(4), gnu::may_alias]] = unsigned long long;

/// F4: linear interpolation between last + 1 values at equal distances in c, the first at 0, the last at 1.
template <typename T>
inline T interpolate(T c, const float* values, int last) {
  const T x = (c == c ? c : T(0)) * static_cast<T>(last);  // a NaN reads entry 0, and is put back below
  int i = static_cast<int>(x);
  i = i < last - 1 ? i : last - 1;
  const unsigned long long pair = *reinterpret_cast<const FloatPair*>(values + i);
  const auto lower = __builtin_bit_cast(float, static_cast<unsigned>(pair));
  const auto upper = __builtin_bit_cast(float, static_cast<unsigned>(pair >> 32));
  constexpr bool little_endian = __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__;
  const T low = static_cast<T>(little_endian ? lower : upper);
  const T high = static_cast<T>(little_endian ? upper : lower);
  const T f = low + (x - static_cast<T>(i)) * (high - low);
  return c == c ? f : c;
}

}  // namespace
}  // namespace mirrorbake::MIRRORBAKE_ISA
