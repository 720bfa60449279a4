#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

/// Sampling of tabulated distributions.
namespace mirrorbake::tracing {

/// Interval of a cumulative distribution that holds u, and u's place in that interval, in [0,1).
struct CdfSample {
  int index;
  float place;
};

/// `cdf` has count + 1 entries.
inline CdfSample sample_cdf(const float* cdf, int count, float u) {
  // The last entry that is not above u, without a branch that could not be foreseen.
  const float* start = cdf;
  for (int n = count; n > 1; n -= n / 2) start += n / 2 * static_cast<int>(start[n / 2] <= u);
  const int i = static_cast<int>(start - cdf);
  const float width = cdf[i + 1] - cdf[i];
  const float place = width > 0.0F ? (u - cdf[i]) / width : 0.5F;
  return {i, std::clamp(place, 0.0F, std::nextafter(1.0F, 0.0F))};
}

/// Sums up in double and scales to end at exactly 1. Returns the sum; the distribution is uniform if it is 0.
inline double normalise_cdf(float* cdf, const double* values, int count) {
  double sum = 0.0;
  for (int i = 0; i < count; ++i) sum += values[i];
  double running = 0.0;
  cdf[0] = 0.0F;
  for (int i = 0; i < count; ++i) {
    running += sum > 0.0 ? values[i] / sum : 1.0 / count;
    cdf[i + 1] = static_cast<float>(std::min(running, 1.0));
  }
  cdf[count] = 1.0F;
  return sum;
}

/// Probability of an interval as it was rounded.
inline double interval_width(const float* cdf, std::size_t index) {
  return static_cast<double>(cdf[index + 1]) - static_cast<double>(cdf[index]);
}

}  // namespace mirrorbake::tracing
