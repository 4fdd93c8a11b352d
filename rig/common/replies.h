// Answers that wait for the end of a step.
#pragma once

#include <deque>
#include <functional>
#include <utility>

#include "base/result.h"

namespace lensd::rig {

/// In order. Nothing that the rig does itself is under way while one is given, so it may command the rig anew.
class Replies {
 public:
  void Add(std::move_only_function<void()> reply) { waiting_.push_back(std::move(reply)); }
  /// An empty `done`: no caller wants an answer.
  template <class T>
  void Add(std::move_only_function<void(Result<T>)> done, Result<T> answer) {
    if (!done) return;
    Add([done = std::move(done), answer = std::move(answer)]() mutable { done(std::move(answer)); });
  }
  /// Those that wait now are not to wait for a reading too.
  void Hurry() { in_a_hurry_ = true; }
  bool TakeHurry() { return std::exchange(in_a_hurry_, false); }
  bool empty() const { return waiting_.empty(); }
  /// The oldest of them. There must be one.
  std::move_only_function<void()> Take() {
    auto reply = std::move(waiting_.front());
    waiting_.pop_front();
    return reply;
  }

 private:
  std::deque<std::move_only_function<void()>> waiting_;
  bool in_a_hurry_ = false;
};

}  // namespace lensd::rig
