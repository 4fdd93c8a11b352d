// View and Snapshot: pictures, of one frame or of all that come. They are made on threads of their own.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "daemon/methods/lens_service.h"
#include "daemon/methods/serve.h"
#include "daemon/pictures/picture_transfer.h"
#include "daemon/pictures/view.h"
#include "daemon/threads/task_thread.h"
#include "daemon/wire/lens_json.h"
#include "proto/interfaces.h"

namespace lensd::daemon {
namespace {

using varlink::Json;

constexpr double kHighestRateHz = 10e3;
constexpr double kLowestRateHz = 1e-3;

/// Event loop thread only, but for what it hands out.
class PictureDesk {
 public:
  /// More viewers than that would only take the processors from each other.
  static constexpr std::size_t kMostViews = 16;
  static constexpr std::size_t kMostThreads = 3;

  explicit PictureDesk(EventLoop& loop) : loop_(loop) {}
  PictureDesk(const PictureDesk&) = delete;
  PictureDesk& operator=(const PictureDesk&) = delete;
  /// Rigs may still offer frames to their viewers.
  ~PictureDesk() {
    for (const auto& one : views_) {
      if (const auto view = one.lock()) view->Abandon();
    }
  }
  TaskThread& snapshots() { return snapshots_; }

  /// Null: there are too many.
  std::shared_ptr<View> Open(const ExchangePointer& exchange, PictureWish wish, PictureWay way) {
    std::erase_if(views_, [](const std::weak_ptr<View>& one) {
      const auto view = one.lock();
      return !view || view->ended();
    });
    if (views_.size() >= kMostViews) return nullptr;
    // One processor is left to those who move lenses.
    const std::size_t processors = std::thread::hardware_concurrency();
    auto& thread = threads_[next_++ % (std::clamp<std::size_t>(processors, 2, kMostThreads + 1) - 1)];
    if (!thread) thread.emplace();
    auto view = std::make_shared<View>(View::Surroundings{loop_, *thread, loans_}, exchange, wish, way);
    view->Begin();
    views_.push_back(view);
    return view;
  }

 private:
  EventLoop& loop_;
  FrameLoans loans_;
  std::vector<std::weak_ptr<View>> views_;
  std::size_t next_ = 0;
  TaskThread snapshots_;
  std::array<std::optional<TaskThread>, kMostThreads> threads_;  // last: they use the others
};

bool Says(const ExchangePointer& exchange, std::string_view flag, bool unsaid) {
  const Json* said = Given(exchange->parameters(), flag);
  return said == nullptr ? unsaid : said->get<bool>();
}

rig::LensMotion MotionOf(const ExchangePointer& exchange, bool unsaid) {
  return Says(exchange, "inMotion", unsaid) ? rig::LensMotion::Any : rig::LensMotion::Standing;
}

/// A frame on its way to the client.
void StreamFrame(TaskThread& pictures, EventLoop& loop, const ExchangePointer& exchange, const PictureWish& wish,
                 const rig::LensedFrame& frame) {
  const bool taken = pictures.Submit([&loop, call = ExchangePointer(exchange), wish, frame]() mutable {
    auto picture = PictureMaker(wish).Make(frame.frame);
    // The call is let go of where calls live: nothing of it stays on this thread.
    if (!picture) return loop.Post([held = std::move(call), error = picture.error()] { Refuse(held, error); });
    auto pieces = PiecesOf(*picture, {{"frame", FrameJson(frame)}, {"picture", PictureJson(*picture)}});
    loop.Post([held = std::move(call), pieces = std::move(pieces)]() mutable { SendPieces(held, std::move(pieces)); });
  });
  if (!taken) Refuse(exchange, {Code::Busy, "too many pictures wait to be compressed; try again"});
}

void Snapshot(LensService& service, PictureDesk& desk, const ExchangePointer& exchange) {
  ServedLens* const lens = service.FindPresent(exchange);
  if (lens == nullptr) return;
  const auto wish = PictureWishOf(exchange->parameters());
  if (!wish) return Refuse(exchange, wish.error());
  const auto shoot = [frames = MotionOf(exchange, false)](rig::Rig& rig, rig::SnapshotCallback done) {
    rig.Snapshot(std::move(done), frames);
  };
  lens->Ask<rig::LensedFrame>(shoot, [&service, &desk, exchange, wish = *wish](const Result<rig::LensedFrame>& frame) {
    if (!frame) return Refuse(exchange, frame.error());
    StreamFrame(desk.snapshots(), service.loop(), exchange, wish, *frame);
  });
}

Result<Duration> PeriodOf(const ExchangePointer& exchange) {
  const Json* rate = Given(exchange->parameters(), "maxRateHz");
  if (rate == nullptr) return Duration::zero();
  const double hz = rate->get<double>();
  if (!(hz >= kLowestRateHz && hz <= kHighestRateHz)) {
    return PassOn(Wrong("maxRateHz is from 0.001 to 10000; leave it out for every frame",
                        {.parameter = "maxRateHz", .minimum = kLowestRateHz, .maximum = kHighestRateHz, .unit = "Hz"}));
  }
  return Duration(std::llround(1e9 / hz));
}

void ViewFrames(LensService& service, PictureDesk& desk, const ExchangePointer& exchange) {
  ServedLens* const lens = service.FindPresent(exchange);
  if (lens == nullptr) return;
  const auto wish = PictureWishOf(exchange->parameters());
  if (!wish) return Refuse(exchange, wish.error());
  const auto period = PeriodOf(exchange);
  if (!period) return Refuse(exchange, period.error());
  const bool all = Says(exchange, "keepFrames", false);
  const auto way = Says(exchange, "fd", false) ? PictureWay::File : all ? PictureWay::InlineAll : PictureWay::Inline;
  if (way == PictureWay::File && all) {
    return Refuse(exchange, Wrong("keepFrames is for pictures in replies: leave out keepFrames or fd",
                                  {.parameter = "keepFrames"}));
  }
  const auto view = desk.Open(exchange, *wish, way);
  if (!view) {
    return Refuse(exchange,
                  {Code::Busy, std::to_string(PictureDesk::kMostViews) + " views are open already; close one"});
  }
  const auto look = [view, period = *period, motion = MotionOf(exchange, true)](rig::Rig& rig, auto done) {
    done(rig.View({motion, period, [view](const Result<rig::LensedFrame>& frame) { return view->Offer(frame); }}));
  };
  lens->Ask<void>(look, [view](const Result<void>& begun) {
    if (!begun) view->End(begun.error());
  });
  lens->users().waiters.Add(view);
}

}  // namespace

MethodTable PictureMethods(LensService& service) {
  const auto desk = std::make_shared<PictureDesk>(service.loop());
  const auto served = [&service, desk](void (*serve)(LensService&, PictureDesk&, const ExchangePointer&)) {
    return service.ForPresent(
        [&service, desk, serve](const ExchangePointer& exchange) { serve(service, *desk, exchange); });
  };
  return {{"Snapshot", served(Snapshot)}, {"View", served(ViewFrames)}};
}

}  // namespace lensd::daemon
