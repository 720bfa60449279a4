#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake {
namespace {

constexpr const char* kReplacement = "\xEF\xBF\xBD";

TEST(Text, ValidUtf8IsKept) {
  // The first and last code points of each length, and those beside the surrogates.
  for (const std::string text :
       {"", "plain", "\x7F", "\xC2\x80", "\xDF\xBF", "\xE0\xA0\x80", "\xED\x9F\xBF", "\xEE\x80\x80",
        "\xEF\xBF\xBF", "\xF0\x90\x80\x80", "\xF4\x8F\xBF\xBF", "Kännchen ☕"}) {
    EXPECT_EQ(valid_utf8(text), text);
  }
}

TEST(Text, EveryOtherByteIsReplaced) {
  const auto times = [](int count) {
    std::string text;
    for (int i = 0; i < count; ++i) text += kReplacement;
    return text;
  };
  EXPECT_EQ(valid_utf8("a\xFF"
                       "b"),
            "a" + times(1) + "b");
  EXPECT_EQ(valid_utf8("K\xE4nnchen"), "K" + times(1) + "nnchen");  // Latin-1
  EXPECT_EQ(valid_utf8("\x80"), times(1));
  EXPECT_EQ(valid_utf8("\xC0\xAF"), times(2));          // overlong
  EXPECT_EQ(valid_utf8("\xE0\x9F\xBF"), times(3));      // overlong
  EXPECT_EQ(valid_utf8("\xED\xA0\x80"), times(3));      // surrogate
  EXPECT_EQ(valid_utf8("\xF4\x90\x80\x80"), times(4));  // beyond U+10FFFF
  EXPECT_EQ(valid_utf8("\xF5\x80\x80\x80"), times(4));
  EXPECT_EQ(valid_utf8("\xE2\x98"), times(2));  // cut off
}

TEST(Text, MessagesOfErrorsAreValid) {
  EXPECT_EQ(std::string(FileError("a.obj", "has 'K\xE4'").what()),
            std::string("a.obj: has 'K") + kReplacement + "'");
  EXPECT_EQ(std::string(InvalidArgument("name", "\xE4", "text").what()),
            std::string("name is ") + kReplacement + ", expected text");
}

TEST(Text, OfNumbersIsTheShortestThatReadsBack) {
  EXPECT_EQ(text_of(0.1F), "0.1");
  EXPECT_EQ(text_of(1e-12), "1e-12");
  EXPECT_EQ(text_of(static_cast<double>(0.1F)), "0.10000000149011612");
  EXPECT_EQ(text_of(std::numeric_limits<float>::denorm_min()), "1e-45");
  EXPECT_EQ(text_of(-std::numeric_limits<float>::infinity()), "-inf");
  EXPECT_EQ(text_of(std::numeric_limits<double>::quiet_NaN()), "nan");
  EXPECT_EQ(text_of(-std::numeric_limits<double>::max()), "-1.7976931348623157e+308");
  EXPECT_EQ(text_of(glm::vec2(1.0F, -0.5F)), "(1, -0.5)");
  EXPECT_EQ(text_of(glm::vec3(0.0F, 1e30F, 0.3F)), "(0, 1e+30, 0.3)");
  EXPECT_EQ(text_of(glm::dvec3(0.0, 0.1, -2.0)), "(0, 0.1, -2)");
}

TEST(Text, ChoicesAreListedInWords) {
  using Choices = std::vector<std::string>;
  EXPECT_EQ(listed(Choices{"a"}), "a");
  EXPECT_EQ(listed(Choices{"a", "b"}), "a or b");
  EXPECT_EQ(listed(Choices{"a", "b", "c"}), "a, b or c");
}

}  // namespace
}  // namespace mirrorbake
