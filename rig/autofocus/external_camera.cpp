// One run's dealings with a camera that a client drives. A frame counts if its exposure began after the lens had
// come to stand where it was wanted, and a later reading still finds it standing.
#include "rig/autofocus/external_camera.h"

#include <algorithm>
#include <string>
#include <utility>

namespace lensd::rig {

void ExternalCamera::Want(Instant since, ObservationCallback done) {
  done_ = std::move(done);
  since_ = since;
  announced_ = false;
}

Instant ExternalCamera::Announce(Instant steady_since) {
  announced_ = true;
  return since_ = std::max(since_, steady_since);
}

Result<void> ExternalCamera::Check(const SubmittedFrame& frame) const {
  const bool is_score = frame.score.has_value();
  if (size_ && !is_score && *size_ != std::pair(frame.frame.width, frame.frame.height)) {
    return Fail(Code::InvalidArgument, "every frame of an autofocus must have the same size");
  }
  if (camera_.scores_only && !is_score) {
    return Fail(Code::InvalidArgument, "this autofocus was begun to be given scores, not pictures");
  }
  if (!camera_.scores_only && is_score) {
    return Fail(Code::InvalidArgument, "this autofocus was begun to be given pictures, not scores");
  }
  if (submitted_) return Fail(Code::InvalidArgument, "a frame is being judged already");
  if (!done_ || !announced_) {
    return Fail(Code::InvalidArgument, "no frame is wanted now: wait for the answer that names the next setting");
  }
  return {};
}

std::optional<Error> ExternalCamera::WhatIsWrong(std::optional<Instant> steady_since) const {
  const drivers::Frame& frame = submitted_->frame;
  if (!steady_since) {
    return Error{Code::InvalidArgument, "the lens was moved meanwhile: wait until it stands and take another frame"};
  }
  const Instant from = std::max(since_, *steady_since);
  if (frame.exposure_start < from) {
    const auto early = std::chrono::duration_cast<std::chrono::microseconds>(from - frame.exposure_start);
    return Fail(Code::InvalidArgument,
                "the exposure began " + std::to_string(early.count()) +
                    " us before the lens stood where this frame is wanted: take a newer one",
                {.parameter = "exposureStartNs",
                 .minimum = static_cast<double>(from.time_since_epoch().count()),
                 .unit = "ns"})
        .error();
  }
  return std::nullopt;
}

std::pair<SubmittedFrame, ObservationCallback> ExternalCamera::Accept() {
  if (!submitted_->score) size_ = std::pair(submitted_->frame.width, submitted_->frame.height);
  SubmittedFrame frame = *std::move(submitted_);
  submitted_.reset();
  return {std::move(frame), std::exchange(done_, nullptr)};
}

StopCallback ExternalCamera::Refuse() {
  StopCallback taken = std::move(submitted_->taken);
  submitted_.reset();
  return taken;
}

}  // namespace lensd::rig
