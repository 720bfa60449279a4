#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "mirrorbake/shading/fresnel.hpp"

/// Reflectance as a one-dimensional table with linear interpolation (spec F4), as [PEM] §5 keeps it in a
/// texture.
namespace mirrorbake {

/// Reflectance at c = 0, 1/(size − 1), …, 1.
struct FresnelTable {
  std::vector<float> values;  ///< at least 2, in [0,1]
  double max_error = 0;       ///< largest |interpolated − exact| over [0,1]
};

/// Reflectance as a function of the cosine; called with values in [0,1].
using ReflectanceFunction = std::function<double(double)>;

/// One channel (0 to 2) of a material, in double. Throws InvalidArgument for another channel.
ReflectanceFunction reflectance_function(const Fresnel& fresnel, int channel);

/// Table of `size` entries. Throws InvalidArgument unless size is in [2, 65536] and all values are in [0,1].
FresnelTable make_table(const ReflectanceFunction& reflectance, std::size_t size);

/// The smallest table (to the last entry, where the error falls with the size) whose error is at most
/// `max_error`, from 1e-6 to 1. Throws InvalidArgument outside that, NumericalError if 65536 entries do not
/// do: total internal reflection starts with a vertical tangent that no such table follows closely.
FresnelTable table_for_error(const ReflectanceFunction& reflectance, double max_error);

/// Interpolated values; `c` and errors as in fresnel.hpp.
float evaluate(const FresnelTable& table, float c);
double evaluate(const FresnelTable& table, double c);
void evaluate(const FresnelTable& table, std::span<const float> c, std::span<float> f);
void evaluate(const FresnelTable& table, std::span<const double> c, std::span<double> f);

}  // namespace mirrorbake
