#include "mirrorbake/surface/shells.hpp"

#include <gtest/gtest.h>

namespace mirrorbake {
namespace {

// L = L₀ + (1 − α₀)(L₁ + (1 − α₁) L₂), written the other way round.
TEST(Shells, CompositeOfThreeLayersIsTheNestedFormula) {
  const glm::vec4 a(0.25F, 0.5F, 0.125F, 0.5F), b(0.5F, 0.25F, 1.0F, 0.75F), c(4.0F, 8.0F, 2.0F, 1.0F);
  const std::vector<ShellLight> shells{{"near", {a}, {}}, {"middle", {b}, {}}, {"far", {c}, {}}};
  const glm::vec3 behind = glm::vec3(b) + (1.0F - b.a) * glm::vec3(c);
  EXPECT_EQ(incident_light(shells, 0), glm::vec3(a) + (1.0F - a.a) * behind);
}

TEST(Shells, TransmittanceIsWhatIsLeftForTheNextLayer) {
  ShellComposite composite;
  EXPECT_EQ(composite.transmittance(), 1.0F);
  composite.add(glm::vec4(0.0F, 0.0F, 0.0F, 0.25F));
  composite.add(glm::vec4(0.0F, 0.0F, 0.0F, 0.5F));
  EXPECT_EQ(composite.transmittance(), 0.375F);
}

}  // namespace
}  // namespace mirrorbake
