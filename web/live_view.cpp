// One picture is held, the newest. A viewer that has sent its last one takes it, and a slow one misses those between:
// there is never a queue. Pictures come as files beside the replies, without base64, and are read once for all viewers.
#include "web/live_view.h"

#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <utility>

#include "varlink/json.h"

namespace lensd::web {
namespace {

using varlink::Json;
constexpr std::size_t kLongestPicture = std::size_t{256} << 20;
// A day: lensd ends a view long before, when its camera goes.
constexpr Duration kViewAtMost = std::chrono::hours(24);
constexpr double kFastestHz = 120, kUsualHz = 30;

std::string_view TypeOf(std::string_view encoding) {
  if (encoding == "jpeg") return "image/jpeg";
  if (encoding == "png") return "image/png";
  return "application/octet-stream";
}

/// The picture as one part of multipart/x-mixed-replace. Its header tells what View told of it, so that scripts know
/// the size of raw pixels and the state of the lens.
Result<std::string> PartOf(std::string_view encoding, const Json& told, const File& file) {
  const auto size = told.value("size", std::size_t{0});
  if (size == 0 || size > kLongestPicture || file.get() < 0) {
    return Fail(Code::Protocol, "lensd sent a picture without its file");
  }
  Json about = told;
  for (const char* member : {"fd", "size", "offset"}) about.erase(member);
  std::string part = "--f\r\nContent-Type: " + std::string(TypeOf(encoding)) +
                     "\r\nContent-Length: " + std::to_string(size) + "\r\nX-Picture: " + varlink::WriteJson(about) +
                     "\r\n\r\n";
  const std::size_t head = part.size();
  part.resize(head + size + 2);
  const ssize_t count = pread(file.get(), part.data() + head, size, 0);
  if (count != static_cast<ssize_t>(size)) return Fail(Code::Io, "a picture of lensd cannot be read");
  part.replace(head + size, 2, "\r\n");
  return part;
}

Result<std::optional<double>> NumberOf(const Exchange& exchange, const char* name) {
  const std::string_view text = exchange.Query(name);
  if (text.empty()) return std::nullopt;
  double value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
  if (read.ec == std::errc{} && read.ptr == text.data() + text.size()) return value;
  return Fail(Code::InvalidArgument, std::string(name) + " must be a number");
}

}  // namespace

/// One client who looks: a stream once there is a picture. Held by its exchange.
class Viewer : public std::enable_shared_from_this<Viewer> {
 public:
  Viewer(LiveViews& views, Exchange& exchange) : views_(views), exchange_(exchange) {}
  ~Viewer();
  void Join(std::shared_ptr<LiveView> view);
  void HasNew();
  void Ended(const Answer& why);
  std::optional<std::size_t> Read(char* to, std::size_t size);

 private:
  LiveViews& views_;
  Exchange& exchange_;
  std::shared_ptr<LiveView> view_;
  std::shared_ptr<const std::string> part_;  // that is being sent
  std::size_t sent_ = 0;                     // of it
  std::uint64_t number_ = 0;                 // of it
};

/// One View of lensd.
class LiveView {
 public:
  LiveView(const LensdLink& link, LiveViews& views, const ViewKey& key);

  void Add(Viewer& viewer) { viewers_.insert(&viewer); }
  void Remove(Viewer& viewer) { viewers_.erase(&viewer); }
  const std::shared_ptr<const std::string>& newest() const { return newest_; }
  std::uint64_t number() const { return number_; }
  bool ended() const { return ended_; }

 private:
  void Take(const varlink::Reply& reply, const File& file);
  void End(const Answer& why);

  LiveViews& views_;
  const std::string encoding_;
  std::unique_ptr<UpstreamCall> call_;
  std::set<Viewer*> viewers_;
  std::shared_ptr<const std::string> newest_;
  std::uint64_t number_ = 0;  // of the newest, from 1
  bool ended_ = false;
};

LiveView::LiveView(const LensdLink& link, LiveViews& views, const ViewKey& key)
    : views_(views), encoding_(key.encoding) {
  Json parameters{{"encoding", key.encoding}, {"maxRateHz", key.rate_hz}, {"fd", true}};
  if (!key.lens.empty()) parameters["lens"] = key.lens;
  if (!key.scale_to.is_null()) parameters["scaleTo"] = key.scale_to;
  if (!key.region.is_null()) parameters["region"] = key.region;
  call_ = link.Begin("View", std::move(parameters), /*more=*/true, kViewAtMost,
                     {.reply = [this](const varlink::Reply& reply, const File& file) { Take(reply, file); },
                      .failed = [this](const Error& why) { End(AnswerOf(why)); }});
}

void LiveView::Take(const varlink::Reply& reply, const File& file) {
  if (!reply.error.empty()) return End(AnswerOf(reply));
  auto part = PartOf(encoding_, reply.parameters, file);
  if (!part) return End(AnswerOf(part.error()));
  newest_ = std::make_shared<const std::string>(std::move(*part));
  ++number_;
  ++views_.frames;
  for (Viewer* viewer : std::set(viewers_)) viewer->HasNew();
}

void LiveView::End(const Answer& why) {
  ended_ = true;
  for (Viewer* viewer : std::set(viewers_)) viewer->Ended(why);
}

Viewer::~Viewer() {
  if (view_) view_->Remove(*this);
}

void Viewer::Join(std::shared_ptr<LiveView> view) {
  view_ = std::move(view);
  view_->Add(*this);
  if (view_->newest()) HasNew();
}

void Viewer::HasNew() {
  class Body final : public Stream {
   public:
    explicit Body(std::shared_ptr<Viewer> viewer) : viewer_(std::move(viewer)) {}
    std::optional<std::size_t> Read(char* to, std::size_t size) override { return viewer_->Read(to, size); }

   private:
    const std::shared_ptr<Viewer> viewer_;
  };
  if (exchange_.replied()) return exchange_.Wake();
  exchange_.Reply("multipart/x-mixed-replace; boundary=f", std::make_unique<Body>(shared_from_this()));
}

void Viewer::Ended(const Answer& why) {
  exchange_.Reply(AsWished(exchange_, why));  // where no picture has come yet
  exchange_.Wake();
}

std::optional<std::size_t> Viewer::Read(char* to, std::size_t size) {
  if (!part_ && view_->number() == number_) {
    if (view_->ended()) return std::nullopt;
    return 0;
  }
  if (!part_) {
    if (number_ != 0) views_.dropped += view_->number() - number_ - 1;
    part_ = view_->newest();
    number_ = view_->number();
    sent_ = 0;
  }
  const std::size_t count = std::min(size, part_->size() - sent_);
  std::copy_n(part_->data() + sent_, count, to);
  sent_ += count;
  if (sent_ == part_->size()) part_ = nullptr;
  return count;
}

bool ViewKey::operator<(const ViewKey& other) const {
  return std::tie(lens, encoding, scale_to, region, rate_hz) <
         std::tie(other.lens, other.encoding, other.scale_to, other.region, other.rate_hz);
}

Result<ViewKey> ReadViewKey(const Exchange& exchange) {
  ViewKey key{.lens = std::string(exchange.Query("lens")), .encoding = "jpeg", .scale_to = {}, .region = {}};
  if (!exchange.Query("encoding").empty()) key.encoding = exchange.Query("encoding");
  const auto rate = NumberOf(exchange, "rate"), width = NumberOf(exchange, "width"),
             height = NumberOf(exchange, "height");
  for (const auto* number : {&rate, &width, &height}) {
    if (!*number) return PassOn(*number);
    if (*number && **number && !(***number > 0 && ***number <= 65536)) {
      return Fail(Code::InvalidArgument, "rate, width and height are above 0, to 65536");
    }
  }
  key.rate_hz = std::min(rate->value_or(kUsualHz), kFastestHz);
  constexpr double kAnySide = 65536;
  if (*width || *height) {
    key.scale_to = {{"widthPx", static_cast<int>(width->value_or(kAnySide))},
                    {"heightPx", static_cast<int>(height->value_or(kAnySide))}};
  }
  if (exchange.Query("w").empty()) return key;
  for (const char* side : {"x", "y", "w", "h"}) {
    const auto value = NumberOf(exchange, side);
    if (!value) return PassOn(value);
    key.region[side] = value->value_or(0);
  }
  return key;
}

void LiveViews::Show(Exchange& exchange, const ViewKey& key) {
  std::erase_if(views_, [](const auto& entry) { return entry.second.expired() || entry.second.lock()->ended(); });
  auto view = views_[key].lock();
  if (!view) {
    view = std::make_shared<LiveView>(link_, *this, key);
    views_[key] = view;
  }
  auto viewer = std::make_shared<Viewer>(*this, exchange);
  exchange.Hold(viewer);
  viewer->Join(std::move(view));
}

std::size_t LiveViews::open() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(views_, [](const auto& entry) { return !entry.second.expired(); }));
}

}  // namespace lensd::web
