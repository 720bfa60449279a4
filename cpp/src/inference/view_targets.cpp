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
  first_.resize(pixels, kNone);
  reflected_.resize(pixels);
  diffuse_.resize(pixels);
}

std::uint32_t ViewTargets::find(std::size_t pixel, int part) const {
  std::uint32_t entry = first_[pixel];
  while (entry != kNone && entries_[entry].part != part) entry = entries_[entry].next;
  return entry;
}

std::uint32_t ViewTargets::find_or_add(std::size_t pixel, int part) {
  const std::uint32_t known = find(pixel, part);
  if (known != kNone) return known;
  const auto entry = static_cast<std::uint32_t>(entries_.size());
  entries_.push_back({first_[pixel], 0, part});
  first_[pixel] = entry;
  radiance_.resize(radiance_.size() + static_cast<std::size_t>(shells_), glm::dvec4(0.0));
  light_from_.resize(radiance_.size(), glm::dvec3(0.0));
  return entry;
}

void ViewTargets::add_shells(std::uint32_t entry, std::span<const glm::vec4> layers, std::uint32_t count) {
  const int* own =
      own_shell_.data() + static_cast<std::size_t>(entries_[entry].part) * static_cast<std::size_t>(shells_);
  glm::vec3 behind(0.0F);
  glm::vec4 stacked(0.0F);
  for (int k = shells_ - 1; k >= 0; --k) {
    const glm::vec4 layer = layers[static_cast<std::size_t>(k)];
    behind = glm::vec3(layer) + (1.0F - layer.a) * behind;
    const bool is_last = k == shells_ - 1 || own[k + 1] != own[k];
    stacked = is_last ? layer : layer + (1.0F - layer.a) * stacked;
    if (k > 0 && own[k - 1] == own[k]) continue;
    radiance_[at(entry, own[k])] += static_cast<double>(count) * glm::dvec4(stacked);
    light_from_[at(entry, own[k])] += static_cast<double>(count) * glm::dvec3(behind);
  }
}

void ViewTargets::add_means(std::size_t pixel, const PixelMeans& means) {
  check_range("pixel", pixel, std::size_t{0}, first_.size() - 1);
  check_range("part", means.part, 0, parts_ - 1);
  check_above("coverage", static_cast<double>(means.coverage), 0.0, 1.0);
  check_length("shells", means.shells.size(), static_cast<std::size_t>(shells_), "those of the targets");
  bool finite = is_finite(means.reflected) && is_finite(means.diffuse);
  for (const glm::vec4& shell : means.shells) {
    finite = finite && is_finite(glm::vec3(shell)) && std::isfinite(shell.a);
  }
  if (!finite) {
    ++rejected_;
    return;
  }
  const auto count = std::max(static_cast<std::uint32_t>(means.coverage * kWhole + 0.5F), 1U);
  const std::uint32_t entry = find_or_add(pixel, means.part);
  entries_[entry].count += count;
  traced_[pixel] += kWhole;
  reflected_[pixel] += static_cast<double>(count) * glm::dvec3(means.reflected);
  diffuse_[pixel] += static_cast<double>(count) * glm::dvec3(means.diffuse);
  add_shells(entry, means.shells, count);
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
  std::vector<glm::vec4> layers(static_cast<std::size_t>(shells_));
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
    const std::uint32_t entry = find_or_add(pixel, samples.part[i]);
    ++entries_[entry].count;
    reflected_[pixel] += glm::dvec3(light);
    diffuse_[pixel] += glm::dvec3(samples.diffuse[i]);
    for (std::size_t k = 0; k < layers.size(); ++k) layers[k] = samples.shells[k].radiance[i];
    add_shells(entry, layers, 1);
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
  for (std::uint32_t e = first_[pixel]; e != kNone; e = entries_[e].next) sum += entries_[e].count;
  return sum;
}

glm::vec3 ViewTargets::reflected(std::size_t pixel) const {
  return glm::vec3(reflected_[pixel] / static_cast<double>(std::max(count(pixel), 1U)));
}

glm::vec3 ViewTargets::diffuse(std::size_t pixel) const {
  return glm::vec3(diffuse_[pixel] / static_cast<double>(std::max(count(pixel), 1U)));
}

glm::vec4 ViewTargets::shell(std::size_t pixel, int part, int shell) const {
  const std::uint32_t entry = find(pixel, part);
  if (entry == kNone) return glm::vec4(0.0F);
  return glm::vec4(radiance_[at(entry, shell)] / static_cast<double>(std::max(entries_[entry].count, 1U)));
}

glm::vec3 ViewTargets::light_from(std::size_t pixel, int part, int shell) const {
  const std::uint32_t entry = find(pixel, part);
  if (entry == kNone) return glm::vec3(0.0F);
  return glm::vec3(light_from_[at(entry, shell)] / static_cast<double>(std::max(entries_[entry].count, 1U)));
}

}  // namespace mirrorbake
