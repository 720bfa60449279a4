#include "row_builder.hpp"

#include <algorithm>
#include <bit>

namespace mirrorbake {
namespace {

constexpr std::uint32_t kEmpty = 0xffffffffU;

}  // namespace

void RowAccumulator::start() {
  for (const std::uint32_t slot : used_) slots_[slot] = kEmpty;
  used_.clear();
  row_.clear();
}

std::size_t RowAccumulator::slot_of(std::uint32_t texel) const {
  // Fibonacci hashing (Knuth, TAOCP 3, §6.4) with linear probing.
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = (texel * 2654435769U) >> shift_;
  while (slots_[slot] != kEmpty && row_[slots_[slot]].texel != texel) slot = (slot + 1) & mask;
  return slot;
}

void RowAccumulator::grow() {
  slots_.assign(std::max<std::size_t>(256, 2 * slots_.size()), kEmpty);
  shift_ = 32 - std::countr_zero(slots_.size());
  used_.clear();
  for (std::size_t i = 0; i < row_.size(); ++i) {
    const std::size_t slot = slot_of(row_[i].texel);
    slots_[slot] = static_cast<std::uint32_t>(i);
    used_.push_back(static_cast<std::uint32_t>(slot));
  }
}

void RowAccumulator::add(std::uint32_t texel, float weight) {
  if (2 * row_.size() >= slots_.size()) grow();
  const std::size_t slot = slot_of(texel);
  if (slots_[slot] != kEmpty) {
    row_[slots_[slot]].weight += weight;
    return;
  }
  slots_[slot] = static_cast<std::uint32_t>(row_.size());
  used_.push_back(static_cast<std::uint32_t>(slot));
  row_.push_back({texel, weight});
}

const std::vector<TexelWeight>& RowAccumulator::finish() {
  std::sort(row_.begin(), row_.end(),
            [](const TexelWeight& a, const TexelWeight& b) { return a.texel < b.texel; });
  return row_;
}

}  // namespace mirrorbake
