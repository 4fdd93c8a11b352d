#include "outside.h"

#include <algorithm>
#include <string>
#include <utility>

namespace lensd::rig {

void Outside::Want(Instant since, SeenCallback seen) {
  seen_ = std::move(seen);
  since_ = since;
  announced_ = false;
}

void Outside::Announce(Instant now, std::optional<Instant> steady_since, FrameWanted wanted) {
  if (!unannounced() || !steady_since || *steady_since > now) return;
  announced_ = true;
  since_ = std::max(since_, *steady_since);
  wanted.since = since_;
  if (camera_.wanted) camera_.wanted(wanted);
}

Result<void> Outside::Take(Given given, StopCallback& refused) {
  const char* wrong = nullptr;
  if (!seen_ || !announced_) wrong = "no frame is wanted now: wait for the answer that names the next setting";
  if (given_) wrong = "a frame is being judged already";
  const bool is_score = given.score.has_value();
  if (camera_.scores_only && !is_score) wrong = "this autofocus was begun to be given scores, not pictures";
  if (!camera_.scores_only && is_score) wrong = "this autofocus was begun to be given pictures, not scores";
  if (size_ && !is_score && *size_ != std::pair(given.frame.width, given.frame.height)) {
    wrong = "every frame of an autofocus must have the same size";
  }
  if (wrong != nullptr) {
    refused = std::move(given.taken);
    return Fail(Code::InvalidArgument, wrong);
  }
  given_ = std::move(given);
  return {};
}

std::optional<std::string> Outside::WhatIsWrong(std::optional<Instant> steady_since) const {
  const drivers::Frame& frame = given_->frame;
  if (!steady_since) return "the lens was moved meanwhile: wait until it stands and take another frame";
  const Instant from = std::max(since_, *steady_since);
  if (frame.exposure_start < from) {
    const auto early = std::chrono::duration_cast<std::chrono::microseconds>(from - frame.exposure_start);
    return "the exposure began " + std::to_string(early.count()) +
           " us before the lens stood where this frame is wanted: take a newer one";
  }
  return std::nullopt;
}

std::pair<Given, SeenCallback> Outside::Accept() {
  if (!given_->score) size_ = std::pair(given_->frame.width, given_->frame.height);
  Given given = *std::move(given_);
  given_.reset();
  return {std::move(given), std::exchange(seen_, nullptr)};
}

StopCallback Outside::Refuse(bool announce_again) {
  if (announce_again) announced_ = false;
  StopCallback taken = std::move(given_->taken);
  given_.reset();
  return taken;
}

}  // namespace lensd::rig
