#include "text_lines.hpp"

#include <algorithm>

namespace mirrorbake {
namespace {

constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";

// Without the backslash that joins it to the next line, if it ends with one.
bool take_continuation(std::string_view& line) {
  const std::size_t last = line.find_last_not_of(" \t");
  if (last == std::string_view::npos || line[last] != '\\') return false;
  line = line.substr(0, last);
  return true;
}

}  // namespace

TextLines::TextLines(std::string_view text) : rest_(text) {
  if (rest_.starts_with(kByteOrderMark)) rest_.remove_prefix(kByteOrderMark.size());
}

std::string_view TextLines::take() {
  const std::size_t end = std::min(rest_.find_first_of("\r\n"), rest_.size());
  const std::string_view line = rest_.substr(0, end);
  rest_.remove_prefix(std::min(end + (rest_.substr(end, 2) == "\r\n" ? 2 : 1), rest_.size()));
  ++next_number_;
  return line;
}

bool TextLines::next() {
  if (rest_.empty()) return false;
  number_ = next_number_;
  line_ = take();
  if (!take_continuation(line_)) return true;
  joined_ = line_;
  for (bool goes_on = true; goes_on && !rest_.empty();) {
    std::string_view more = take();
    goes_on = take_continuation(more);
    joined_ += ' ';
    joined_ += more;
  }
  line_ = joined_;
  return true;
}

}  // namespace mirrorbake
