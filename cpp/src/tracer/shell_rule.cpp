#include "mirrorbake/tracer/shell_rule.hpp"

#include "mirrorbake/core/check.hpp"

namespace mirrorbake {
namespace {

void check_rule(const ShellRule& rule, const std::string& where, int objects) {
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  if (rule.name.empty() || !std::all_of(rule.name.begin(), rule.name.end(), is_plain)) {
    throw InvalidArgument(where + ".name", "'" + rule.name + "'", "letters, digits, _ or -");
  }
  for (const int object : rule.objects) {
    if (object == ShellRule::kItself || (object >= 0 && object < objects)) continue;
    throw InvalidArgument(where + ".objects", std::to_string(object),
                          "object numbers below " + std::to_string(objects) + ", or -1 for the reflector");
  }
  rule.check_limits(where);
}

}  // namespace

std::vector<ShellRule> default_shell_rules() { return {{"local", {ShellRule::kItself}}, {"distant", {}}}; }

void check_shells(std::span<const ShellRule> shells, std::size_t objects) {
  check_range("shells", static_cast<int>(shells.size()), 1, static_cast<int>(kMostShells));
  for (std::size_t k = 0; k < shells.size(); ++k) {
    const std::string where = "shells[" + std::to_string(k) + "]";
    check_rule(shells[k], where, static_cast<int>(objects));
    for (std::size_t other = 0; other < k; ++other) {
      if (shells[other].name != shells[k].name) continue;
      throw InvalidArgument(where + ".name", "'" + shells[k].name + "' again", "different names");
    }
  }
  if (!shells.back().objects.empty() || shells.back().has_limits()) {
    throw InvalidArgument("shells", "'" + shells.back().name + "' last, with a rule",
                          "a last one without a rule, which takes the rest");
  }
}

std::vector<std::uint8_t> held(const ShellRule& rule, std::span<const std::int32_t> objects,
                               std::span<const float> distances, int reflector) {
  check_length("distances", distances.size(), objects.size(), "as many as objects");
  std::vector<std::uint8_t> result(objects.size());
  for (std::size_t i = 0; i < objects.size(); ++i) {
    result[i] = rule.holds(objects[i], distances[i], reflector) ? 1 : 0;
  }
  return result;
}

}  // namespace mirrorbake
