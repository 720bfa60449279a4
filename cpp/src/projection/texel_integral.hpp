#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

/// Integrals of a smooth function over a texel, and over the part of it that lies in the unit disc.
namespace mirrorbake {

struct Rectangle {
  double x0, x1, y0, y1;
};

inline Rectangle texel_rectangle(int width, int height, int column, int row) {
  return {2.0 * column / width - 1.0, 2.0 * (column + 1) / width - 1.0, 1.0 - 2.0 * (row + 1) / height,
          1.0 - 2.0 * row / height};
}

// Gauss-Legendre nodes and weights on [−1,1] (Abramowitz & Stegun, table 25.4).
inline constexpr std::array<double, 5> kGaussNodes = {0.0, -0.5384693101056831, 0.5384693101056831,
                                                      -0.9061798459386640, 0.9061798459386640};
inline constexpr std::array<double, 5> kGaussWeights = {
    0.5688888888888889, 0.4786286704993665, 0.4786286704993665, 0.2369268850561891, 0.2369268850561891};

template <typename F>
double integrate_interval(double a, double b, F&& f) {
  double sum = 0.0;
  for (std::size_t i = 0; i < kGaussNodes.size(); ++i) {
    sum += kGaussWeights[i] * f(0.5 * (a + b) + 0.5 * (b - a) * kGaussNodes[i]);
  }
  return 0.5 * (b - a) * sum;
}

template <typename F>
double integrate_rectangle(const Rectangle& r, F&& f) {
  return integrate_interval(r.y0, r.y1, [&](double y) {
    return integrate_interval(r.x0, r.x1, [&](double x) { return f(x, y); });
  });
}

/// ∫∫ density(x² + y²) over the rectangle within the unit disc. The density must be smooth on a scale of 1;
/// then the error is that of rounding, since rectangles larger than 1/16 are halved first.
template <typename Density>
double integrate_in_disc(Rectangle r, Density&& density) {
  constexpr double kLargest = 1.0 / 16.0;
  if (r.x0 < 0.0 && r.x1 > 0.0) {
    return integrate_in_disc(Rectangle{0.0, -r.x0, r.y0, r.y1}, density) +
           integrate_in_disc(Rectangle{0.0, r.x1, r.y0, r.y1}, density);
  }
  if (r.y0 < 0.0 && r.y1 > 0.0) {
    return integrate_in_disc(Rectangle{r.x0, r.x1, 0.0, -r.y0}, density) +
           integrate_in_disc(Rectangle{r.x0, r.x1, 0.0, r.y1}, density);
  }
  // Into the first quadrant, by symmetry.
  if (r.x1 <= 0.0) r = {-r.x1, -r.x0, r.y0, r.y1};
  if (r.y1 <= 0.0) r = {r.x0, r.x1, -r.y1, -r.y0};
  if (r.x0 * r.x0 + r.y0 * r.y0 >= 1.0) return 0.0;
  if (r.x1 - r.x0 > kLargest) {
    const double middle = 0.5 * (r.x0 + r.x1);
    return integrate_in_disc(Rectangle{r.x0, middle, r.y0, r.y1}, density) +
           integrate_in_disc(Rectangle{middle, r.x1, r.y0, r.y1}, density);
  }
  if (r.y1 - r.y0 > kLargest) {
    const double middle = 0.5 * (r.y0 + r.y1);
    return integrate_in_disc(Rectangle{r.x0, r.x1, r.y0, middle}, density) +
           integrate_in_disc(Rectangle{r.x0, r.x1, middle, r.y1}, density);
  }
  const auto value = [&](double x, double y) { return density(x * x + y * y); };
  if (r.x1 * r.x1 + r.y1 * r.y1 <= 1.0) return integrate_rectangle(r, value);
  // The rim crosses the rectangle. With the smaller coordinate as x it is a graph y(x) of slope below about
  // 1, full height left of where it leaves through the top, empty right of where it leaves through the
  // bottom.
  if (r.x0 + r.x1 > r.y0 + r.y1) r = {r.y0, r.y1, r.x0, r.x1};
  const auto rim = [](double t) { return std::sqrt(std::max(0.0, (1.0 - t) * (1.0 + t))); };
  const double full_end = std::clamp(rim(r.y1), r.x0, r.x1);
  const double partial_end = std::clamp(rim(r.y0), r.x0, r.x1);
  return integrate_rectangle({r.x0, full_end, r.y0, r.y1}, value) +
         integrate_interval(full_end, partial_end, [&](double x) {
           return integrate_interval(r.y0, rim(x), [&](double y) { return value(x, y); });
         });
}

}  // namespace mirrorbake
