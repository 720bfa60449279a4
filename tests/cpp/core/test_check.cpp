#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <glm/mat3x3.hpp>

#include "mirrorbake/core/check.hpp"

namespace mirrorbake {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

template <typename Check>
std::string message_of(Check check) {
  try {
    check();
  } catch (const InvalidArgument& error) {
    return error.what();
  }
  return "";
}

TEST(Check, SaysNothingOfWhatIsRight) {
  EXPECT_NO_THROW(check_length("x", 3, 3));
  EXPECT_NO_THROW(check_finite("x", 1.0F));
  EXPECT_NO_THROW(check_finite("x", std::vector<glm::vec3>{{1, 2, 3}}));
  EXPECT_NO_THROW(check_at_least("x", 0.0, 0.0));
  EXPECT_NO_THROW(check_above("x", 1.0, 0.0, 1.0));
  EXPECT_NO_THROW(check_range("x", 4, 4, 4));
  EXPECT_NO_THROW(check_orthonormal("x", glm::mat3(-1.0F)));
  EXPECT_NO_THROW(check_triangles(std::vector<glm::uvec3>{{0, 1, 2}}, 3));
}

TEST(Check, NamesTheArgumentItsValueAndWhatWasExpected) {
  using testing::AllOf;
  using testing::HasSubstr;
  EXPECT_THAT(message_of([] { check_length("x", 2, 3, "texels × channels"); }),
              AllOf(HasSubstr("x"), HasSubstr("2 elements"), HasSubstr("3, texels × channels")));
  EXPECT_THAT(message_of([] { check_finite("x", kNan); }), AllOf(HasSubstr("x"), HasSubstr("nan")));
  EXPECT_THAT(message_of([] {
                check_finite("p", std::vector<glm::vec3>{{1, 2, 3}, {1, kNan, 3}});
              }),
              AllOf(HasSubstr("p[1]"), HasSubstr("(1, nan, 3)")));
  EXPECT_THAT(message_of([] {
                check_finite("x", std::vector<float>{1, kNan, kNan});
              }),
              HasSubstr("2 values"));
  EXPECT_THAT(message_of([] { check_at_least("x", -1.0, 0.0); }), AllOf(HasSubstr("-1"), HasSubstr("≥ 0")));
  EXPECT_THAT(message_of([] { check_above("x", 0.0, 0.0, 2.0); }), HasSubstr("(0, 2]"));
  EXPECT_THAT(message_of([] { check_range("x", 9, 1, 8, " texels"); }), HasSubstr("1 to 8 texels"));
  EXPECT_THAT(message_of([] { check_orthonormal("m", glm::mat3(1.01F)); }),
              AllOf(HasSubstr("m"), HasSubstr("1.01"), HasSubstr("orthonormal")));
  EXPECT_THAT(message_of([] {
                check_triangles(std::vector<glm::uvec3>{{0, 1, 2}, {0, 5, 1}}, 3);
              }),
              AllOf(HasSubstr("triangles[1]"), HasSubstr("5"), HasSubstr("below 3")));
}

TEST(Check, TakesNoInfinityForANumber) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_THROW(check_at_least("x", kInfinity, 0.0), InvalidArgument);
  EXPECT_THROW(check_above("x", kInfinity, 0.0, 1.0), InvalidArgument);
  EXPECT_THROW(check_orthonormal("m", glm::mat3(kNan)), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
