#pragma once

#include <span>
#include <string>
#include <string_view>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace mirrorbake {

/// The text with every byte that is not part of valid UTF-8 replaced by U+FFFD. Names and messages that quote
/// a file pass through here: Python's strings, terminals and JSON accept nothing else.
std::string valid_utf8(std::string_view text);

/// "a, b or c"; of one the text itself.
std::string listed(std::span<const std::string> choices);

/// Shortest text that reads back as the same number, for messages: "0.5", "1e-12", "nan", "-inf".
std::string text_of(float number);
std::string text_of(double number);
/// "(1, 0.5, -3)".
std::string text_of(glm::vec2 v);
std::string text_of(glm::vec3 v);
std::string text_of(const glm::dvec3& v);

}  // namespace mirrorbake
