#pragma once

#include <string>
#include <string_view>

namespace mirrorbake {

/// The text with every byte that is not part of valid UTF-8 replaced by U+FFFD. Names and messages that quote a file
/// pass through here: Python's strings, terminals and JSON accept nothing else.
std::string valid_utf8(std::string_view text);

}  // namespace mirrorbake
