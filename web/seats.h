// Something that is bounded in number, with a share for each token.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <vector>

namespace lensd::web {

/// Event loop thread only.
class Seats {
 public:
  /// `most` in all. With several owners each has its part of them, so that one who takes too many keeps none of the
  /// others out; where owners are many each has a few, and they may be taken by others all the same.
  Seats(std::size_t most, std::size_t owners)
      : share_(owners <= 1 ? most : std::max(kSmallestShare, most / owners)),
        taken_(std::make_shared<Taken>(Taken{0, std::vector<std::size_t>(std::max<std::size_t>(owners, 1))})),
        most_(most) {}

  /// One more, until destroyed.
  using Seat = std::shared_ptr<void>;
  enum class Outcome { Taken, AllTaken, ShareTaken };
  struct Answer {
    Outcome outcome = Outcome::Taken;
    Seat seat{};
  };
  Answer Take(std::size_t owner) {
    if (taken_->by.at(owner) >= share_) return {Outcome::ShareTaken};
    if (taken_->all >= most_) return {Outcome::AllTaken};
    ++taken_->all;
    ++taken_->by[owner];
    return {Outcome::Taken, Seat(taken_.get(), [taken = taken_, owner](const Taken*) {
              --taken->all;
              --taken->by[owner];
            })};
  }
  std::size_t taken() const { return taken_->all; }

 private:
  static constexpr std::size_t kSmallestShare = 4;
  struct Taken {
    std::size_t all = 0;
    std::vector<std::size_t> by;  // owner
  };
  std::size_t share_;
  std::shared_ptr<Taken> taken_;  // outlives this where seats do
  std::size_t most_;
};

}  // namespace lensd::web
