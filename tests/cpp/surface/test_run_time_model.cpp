#include "mirrorbake/surface/run_time_model.hpp"

#include <gtest/gtest.h>

#include <set>

#include "mirrorbake/core/error.hpp"

namespace mirrorbake {
namespace {

TEST(RunTimeModel, NamedModelsAreValidAndFoundByTheirName) {
  for (const RunTimeModel& model : {web_run_time(), web1_run_time(), reference_run_time()}) {
    EXPECT_NO_THROW(validate(model));
    EXPECT_EQ(run_time_model(model.name), model);
  }
  EXPECT_THROW(run_time_model("web2"), InvalidArgument);
}

// A rotated grid is one in which no two lookups share a row or a column, and whose mean is the pixel's
// centre.
TEST(RunTimeModel, WebHasOneLookupInEveryRowAndColumn) {
  std::set<float> columns, rows;
  glm::vec2 sum(0.0F);
  for (const glm::vec2 p : web_run_time().places) {
    columns.insert(p.x);
    rows.insert(p.y);
    sum += p;
  }
  EXPECT_EQ(columns.size(), 4U);
  EXPECT_EQ(rows.size(), 4U);
  EXPECT_EQ(sum, glm::vec2(2.0F));
}

TEST(RunTimeModel, ValuesOutOfRangeAreRefused) {
  const auto refused = [](auto change) {
    RunTimeModel model = web_run_time();
    change(model);
    EXPECT_THROW(validate(model), InvalidArgument);
  };
  refused([](RunTimeModel& m) { m.places.clear(); });
  refused([](RunTimeModel& m) { m.places[1].x = 1.0F; });
  refused([](RunTimeModel& m) { m.footprint_scale = 0.0F; });
  refused([](RunTimeModel& m) { m.max_taps = 17; });
  refused([](RunTimeModel& m) { m.max_taps = 3; });
}

}  // namespace
}  // namespace mirrorbake
