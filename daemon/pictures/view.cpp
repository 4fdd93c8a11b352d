// A frame's way to one viewer, and where it may be dropped: each place holds a bounded number.
#include "daemon/pictures/view.h"

#include <utility>

#include "base/guarded.h"
#include "daemon/lens/served_lens.h"
#include "daemon/pictures/picture_transfer.h"
#include "daemon/wire/lens_json.h"
#include "daemon/wire/refusal.h"

namespace lensd::daemon {
namespace {

using varlink::Json;

Json AboutPicture(const rig::LensedFrame& frame, const Picture& picture, std::int64_t dropped) {
  const LightSummary light = Summarise(frame.frame, picture.window);
  Json about = PictureJson(picture);
  about["histogram"] = light.histogram;
  about["sharpness"] = light.sharpness ? varlink::NumberOrNull(*light.sharpness) : Json(nullptr);
  return {{"frame", FrameJson(frame)}, {"picture", std::move(about)}, {"dropped", dropped}};
}

}  // namespace

View::View(const Surroundings& surroundings, ExchangePointer exchange, PictureWish wish, PictureWay way)
    : surroundings_(surroundings),
      exchange_(std::move(exchange)),
      way_(way),
      borrower_(surroundings.loans.NewBorrower()),
      maker_(wish) {}

void View::Begin() {
  exchange_->OnGone([self = weak_from_this()] {
    if (const auto view = self.lock()) view->ended_ = true;
  });
  exchange_->OnDrained([self = weak_from_this()] {
    const auto view = self.lock();
    if (!view) return;
    view->outgoing_.sending = false;
    view->SendNext();
  });
}

bool View::Full() {
  return way_ == PictureWay::File ? surroundings_.loans.Full(borrower_) : inline_ >= kMostInline;
}

void View::Abandon() {
  const std::lock_guard lock(waiting_.mutex);
  ended_ = true;
}

bool View::Offer(const Result<rig::LensedFrame>& frame) {
  if (ended_) return false;
  if (!frame) {
    surroundings_.loop.Post([self = shared_from_this(), error = frame.error()] { self->End(error); });
    return false;
  }
  const std::lock_guard lock(waiting_.mutex);
  if (ended_) return false;
  MakeRoom();
  waiting_.frames.push_back(*frame);
  GoOn();
  return true;
}

/// For one more frame. Under the mutex.
void View::MakeRoom() {
  auto& frames = waiting_.frames;
  const auto has_room = [&] {
    if (way_ != PictureWay::InlineAll || frames.empty()) return frames.empty();
    return (frames.size() + 1) * frames.back().frame.samples->size() <= kMostSamples;
  };
  while (!has_room()) {
    frames.pop_front();
    ++waiting_.dropped;
  }
}

/// Has the next picture made, if one can be. Under the mutex.
void View::GoOn() {
  auto& frames = waiting_.frames;
  if (waiting_.working || frames.empty()) return;
  waiting_.working = !ended_ && !Full() && surroundings_.pictures.Submit([self = shared_from_this()] { self->Work(); });
  if (waiting_.working || way_ == PictureWay::InlineAll) return;
  frames.clear();
  ++waiting_.dropped;
}

/// Makes one picture, then leaves its thread to the other views before the next.
void View::Work() {
  std::unique_lock lock(waiting_.mutex);
  const rig::LensedFrame frame = std::move(waiting_.frames.front());
  waiting_.frames.pop_front();
  const std::int64_t dropped = waiting_.dropped;
  lock.unlock();
  const auto thrown = Guarded("a view", [&] { MakeOne(frame, dropped); });
  if (thrown) surroundings_.loop.Post([self = shared_from_this(), error = *thrown] { self->End(error); });
  lock.lock();
  waiting_.working = false;
  GoOn();
}

void View::MakeOne(const rig::LensedFrame& frame, std::int64_t dropped) {
  auto picture = maker_.Make(frame.frame);
  Result<Descriptor> file;
  if (picture && way_ == PictureWay::File) file = surroundings_.loans.Lend(borrower_, picture->bytes());
  if (!picture || !file) {
    const Error error = picture ? file.error() : picture.error();
    return surroundings_.loop.Post([self = shared_from_this(), error] { self->End(error); });
  }
  Json about = AboutPicture(frame, *picture, dropped);
  if (way_ != PictureWay::File) {
    ++inline_;
    return surroundings_.loop.Post(
        [self = shared_from_this(), pieces = PiecesOf(*picture, std::move(about))]() mutable {
          self->SendInline(std::move(pieces));
        });
  }
  about["fd"] = 0;
  about["offset"] = 0;
  about["size"] = picture->bytes().size();
  surroundings_.loop.Post(
      [self = shared_from_this(), reply = varlink::WriteJson(about), file = *std::move(file)]() mutable {
        if (!self->ended_) self->exchange_->Continue(reply, std::move(file));
      });
}

void View::SendInline(std::deque<std::string> pieces) {
  if (ended_) return;
  outgoing_.pictures.push_back(std::move(pieces));
  SendNext();
}

void View::SendNext() {
  if (ended_ || outgoing_.pictures.empty() || outgoing_.sending || outgoing_.waits) return;
  if (!outgoing_.begun && exchange_->unread() > kFewUnread) {
    outgoing_.waits = true;
    return surroundings_.loop.After(kAgain, [self = shared_from_this()] {
      self->outgoing_.waits = false;
      self->SendNext();
    });
  }
  auto& pieces = outgoing_.pictures.front();
  const std::string piece = std::move(pieces.front());
  pieces.pop_front();
  outgoing_.begun = !pieces.empty();
  if (pieces.empty()) {
    outgoing_.pictures.pop_front();
    --inline_;
    const std::lock_guard lock(waiting_.mutex);
    GoOn();
  }
  outgoing_.sending = true;
  exchange_->Continue(piece);
}

void View::End(const Error& error) {
  if (!ended_.exchange(true)) Refuse(exchange_, error);
}

}  // namespace lensd::daemon
