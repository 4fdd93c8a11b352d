// Indices, mostly of one stretch or few, rising.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace lensd::optics {

class IndexStretches {
 public:
  /// From `first` to before `end`, neither empty nor below what was added before.
  void Add(std::size_t first, std::size_t end) {
    size_ += end - first;
    if (!stretches_.empty() && stretches_.back().second == first) {
      stretches_.back().second = end;
    } else {
      stretches_.emplace_back(first, end);
    }
  }

  bool empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }
  std::size_t front() const { return stretches_.front().first; }
  std::size_t operator[](std::size_t at) const {
    auto stretch = stretches_.begin();
    for (; at >= stretch->second - stretch->first; ++stretch) at -= stretch->second - stretch->first;
    return stretch->first + at;
  }
  bool Contains(std::size_t index) const { return AnyOf(index, index + 1); }
  /// Any index from `first` to before `end`.
  bool AnyOf(std::size_t first, std::size_t end) const {
    const auto next = std::ranges::upper_bound(stretches_, first, {}, &std::pair<std::size_t, std::size_t>::second);
    return next != stretches_.end() && next->first < end;
  }
  std::vector<std::size_t> All() const {
    std::vector<std::size_t> all;
    for (const auto& [first, end] : stretches_) {
      for (std::size_t index = first; index < end; ++index) all.push_back(index);
    }
    return all;
  }

 private:
  std::vector<std::pair<std::size_t, std::size_t>> stretches_;
  std::size_t size_ = 0;
};

}  // namespace lensd::optics
