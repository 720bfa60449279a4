#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake {

/// What one shell of a reflector's environment holds ([PEM] §4: "this method easily generalizes to more than
/// two environmental shells"): the things that a reflected ray meets first, as the first rule says that they
/// match. The last rule of a list takes all that the others leave, and the background.
struct ShellRule {
  static constexpr int kItself = -1;  ///< the reflector, as an entry of `objects`

  std::string name;          ///< letters, digits, _ and −
  std::vector<int> objects;  ///< numbers of objects, or kItself; empty: any, and lights
  float nearer_than = std::numeric_limits<float>::infinity();  ///< along the reflected ray, metres, > 0

  bool operator==(const ShellRule&) const = default;

  /// Whether it holds what a ray meets at a distance: an object's number, any other for a light.
  bool holds(int object, float distance, int reflector) const {
    const auto is_object = [=](int own) { return own == object || (own == kItself && object == reflector); };
    return distance < nearer_than &&
           (objects.empty() || (object >= 0 && std::any_of(objects.begin(), objects.end(), is_object)));
  }
  /// Whether it holds some of the places of its things alone, so that those may be met again behind.
  bool has_limits() const { return nearer_than < std::numeric_limits<float>::infinity(); }
  /// The distance before which it holds whatever there is.
  float holds_all_before() const { return objects.empty() ? nearer_than : 0.0F; }
  /// Throws InvalidArgument, whose argument begins with `where`, for limits between which nothing lies.
  void check_limits(const std::string& where) const {
    if (nearer_than > 0.0F) return;
    throw InvalidArgument(where + ".nearer_than", text_of(nearer_than), "more than 0");
  }
};

inline constexpr std::size_t kMostShells = 8;

/// [PEM] §4: `local`, the reflector itself, and `distant`, the rest.
std::vector<ShellRule> default_shell_rules();

/// Throws InvalidArgument unless a list of rules is usable in a scene of so many objects.
void check_shells(std::span<const ShellRule> shells, std::size_t objects);

/// `holds` of many things, 1 or 0, with arrays of one length.
std::vector<std::uint8_t> held(const ShellRule& rule, std::span<const std::int32_t> objects,
                               std::span<const float> distances, int reflector);

}  // namespace mirrorbake
