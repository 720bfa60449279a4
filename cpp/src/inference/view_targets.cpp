#include "mirrorbake/inference/view_targets.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/surface/shells.hpp"

namespace mirrorbake {

namespace {

std::vector<int> own_shells(const ViewTargets::Stacks& stacks, int parts, int shells) {
  std::vector<int> result;
  if (!stacks.empty()) check_length("stacks", stacks.size(), static_cast<std::size_t>(parts), "one per part");
  for (int part = 0; part < parts; ++part) {
    int own = 0;
    for (int shell = 0; shell < shells; ++shell) {
      result.push_back(own);
      if (stacks.empty() || shell == stacks[static_cast<std::size_t>(part)][static_cast<std::size_t>(own)])
        ++own;
    }
  }
  return result;
}

void check_stacks(const ViewTargets::Stacks& stacks, int shells) {
  for (std::size_t part = 0; part < stacks.size(); ++part) {
    const std::vector<int>& ends = stacks[part];
    bool rises = !ends.empty() && ends.front() >= 0 && ends.back() == shells - 1;
    for (std::size_t k = 1; k < ends.size(); ++k) rises = rises && ends[k - 1] < ends[k];
    if (rises) continue;
    std::string given;
    for (const int end : ends) given += (given.empty() ? "" : ", ") + std::to_string(end);
    throw InvalidArgument("stacks[" + std::to_string(part) + "]", "[" + given + "]",
                          "rising numbers of shells that end with " + std::to_string(shells - 1));
  }
}

}  // namespace

ViewTargets::ViewTargets(int width, int height, int parts, int shells, const Stacks& stacks)
    : width_(width), height_(height), parts_(parts), shells_(shells) {
  check_range("width", width, 1, 16384);
  check_range("height", height, 1, 16384);
  check_range("parts", parts, 1, 65536);
  check_range("shells", shells, 1, 64);
  check_stacks(stacks, shells);
  own_shell_ = own_shells(stacks, parts, shells);
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  traced_.resize(pixels);
  counts_.resize(pixels * static_cast<std::size_t>(parts));
  reflected_.resize(pixels);
  diffuse_.resize(pixels);
  radiance_.resize(counts_.size() * static_cast<std::size_t>(shells));
  light_from_.resize(radiance_.size());
}

void ViewTargets::add(const SurfaceSamples& samples, int x, int y) {
  if (x < 0 || y < 0 || samples.width > width_ - x || samples.height > height_ - y) {
    throw InvalidArgument("samples",
                          std::to_string(samples.width) + "x" + std::to_string(samples.height) +
                              " pixels at " + std::to_string(x) + ", " + std::to_string(y),
                          "inside of " + std::to_string(width_) + "x" + std::to_string(height_));
  }
  const std::size_t n = samples.size();
  check_length("samples.shells", samples.shells.size(), static_cast<std::size_t>(shells_),
               "those of the targets");
  check_length("samples.diffuse", samples.diffuse.size(), n, "as many as samples.pixel");
  for (std::size_t i = 0; i < n; ++i) {
    check_range("samples.part", static_cast<int>(samples.part[i]), 0, parts_ - 1);
    const glm::vec3 light = samples.fresnel[i] * incident_light(samples.shells, i);
    const bool finite = is_finite(light) && is_finite(samples.diffuse[i]);
    const std::uint32_t column = samples.pixel[i] % static_cast<std::uint32_t>(samples.width);
    const std::uint32_t row = samples.pixel[i] / static_cast<std::uint32_t>(samples.width);
    const std::size_t pixel = (static_cast<std::size_t>(y) + row) * static_cast<std::size_t>(width_) +
                              static_cast<std::size_t>(x) + column;
    if (!finite) {
      // As if it had not been traced: the count of the pixel's samples is added below.
      --traced_[pixel];
      ++rejected_;
      continue;
    }
    ++counts_[at(pixel, samples.part[i])];
    reflected_[pixel] += glm::dvec3(light);
    diffuse_[pixel] += glm::dvec3(samples.diffuse[i]);
    const int* own = own_shell_.data() + std::size_t{samples.part[i]} * static_cast<std::size_t>(shells_);
    glm::vec3 behind(0.0F);
    glm::vec4 stacked(0.0F);
    for (int k = shells_ - 1; k >= 0; --k) {
      const glm::vec4 layer = samples.shells[static_cast<std::size_t>(k)].radiance[i];
      behind = glm::vec3(layer) + (1.0F - layer.a) * behind;
      const bool is_last = k == shells_ - 1 || own[k + 1] != own[k];
      stacked = is_last ? layer : layer + (1.0F - layer.a) * stacked;
      if (k > 0 && own[k - 1] == own[k]) continue;
      radiance_[at(pixel, samples.part[i], own[k])] += glm::dvec4(stacked);
      light_from_[at(pixel, samples.part[i], own[k])] += glm::dvec3(behind);
    }
  }
  for (int row = 0; row < samples.height; ++row) {
    for (int column = 0; column < samples.width; ++column) {
      const auto from = static_cast<std::size_t>(row) * static_cast<std::size_t>(samples.width) +
                        static_cast<std::size_t>(column);
      const auto to =
          (static_cast<std::size_t>(y) + static_cast<std::size_t>(row)) * static_cast<std::size_t>(width_) +
          static_cast<std::size_t>(x) + static_cast<std::size_t>(column);
      traced_[to] += samples.samples_in(from);
    }
  }
}

std::uint32_t ViewTargets::count(std::size_t pixel) const {
  std::uint32_t sum = 0;
  for (int part = 0; part < parts_; ++part) sum += count(pixel, part);
  return sum;
}

glm::vec3 ViewTargets::reflected(std::size_t pixel) const {
  return glm::vec3(reflected_[pixel] / static_cast<double>(std::max(count(pixel), 1U)));
}

glm::vec3 ViewTargets::diffuse(std::size_t pixel) const {
  return glm::vec3(diffuse_[pixel] / static_cast<double>(std::max(count(pixel), 1U)));
}

glm::vec4 ViewTargets::shell(std::size_t pixel, int part, int shell) const {
  return glm::vec4(radiance_[at(pixel, part, shell)] / static_cast<double>(std::max(count(pixel, part), 1U)));
}

glm::vec3 ViewTargets::light_from(std::size_t pixel, int part, int shell) const {
  return glm::vec3(light_from_[at(pixel, part, shell)] /
                   static_cast<double>(std::max(count(pixel, part), 1U)));
}

}  // namespace mirrorbake
