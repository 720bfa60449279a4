#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace mirrorbake {

/// Lines of an OBJ or MTL file: they end with a line feed, a carriage return or both; a backslash at a line's
/// end joins the next one to it. A byte-order mark before the first is skipped.
class TextLines {
 public:
  explicit TextLines(std::string_view text);

  /// Moves to the next line; false at the end.
  bool next();
  /// Valid until next() is called.
  std::string_view line() const { return line_; }
  /// From 1; of joined lines the first's.
  std::size_t number() const { return number_; }

 private:
  std::string_view take();

  std::string_view rest_;
  std::string_view line_;
  std::string joined_;
  std::size_t number_ = 0;
  std::size_t next_number_ = 1;
};

}  // namespace mirrorbake
