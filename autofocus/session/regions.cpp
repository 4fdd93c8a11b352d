// One session at a time sees new frames; the next one is first shown those there are, as far as its method can use
// them. The policy picks among the answers once every region has one or has refused.
#include "autofocus/regions.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace lensd::autofocus {
namespace {

constexpr std::size_t kKeptFrames = 3;
constexpr double kSigmas = 3.0;

std::string Ordinal(std::size_t index) {
  return "region " + std::to_string(index + 1);
}

}  // namespace

Result<Policy> PolicyFromName(std::string_view name) {
  if (name == "nearest") return Policy::Nearest;
  if (name == "farthest") return Policy::Farthest;
  if (name == "widest") return Policy::Widest;
  return Fail(Code::InvalidArgument,
              "there is no policy '" + std::string(name) + "' for several regions: say nearest, farthest or widest");
}

Result<Regions> Regions::Create(std::string_view method, const Setup& setup, std::vector<drivers::Region> regions,
                                Policy policy) {
  if (regions.size() > kMost) {
    return Fail(Code::InvalidArgument, "autofocus looks at no more than " + std::to_string(kMost) + " regions",
                {.parameter = "regions", .maximum = static_cast<double>(kMost)});
  }
  auto first = Session::Create(method, setup);
  if (!first) return PassOn(first);
  return Regions(method, setup, std::move(regions), policy, *std::move(first));
}

Regions::Regions(std::string_view method, const Setup& setup, std::vector<drivers::Region> regions, Policy policy,
                 Session first)
    : method_(method), setup_(setup), regions_(std::move(regions)), policy_(policy) {
  sessions_.push_back(std::move(first));
  shown_.emplace_back();
}

int Regions::frames_expected() const {
  const int left = static_cast<int>(regions_.size() - sessions_.size());
  return std::max(frames_ + sessions_.back().frames_expected() - sessions_.back().frames() + left, frames_);
}

Result<Advice> Regions::Next(const Place& place, const drivers::Frame& frame) {
  const Taken taken{place, frame, frames_++};
  if (chosen_) {
    auto checked = Show(chosen_region_, taken);
    if (!checked) return checked;
    if (std::holds_alternative<GoAndLook>(*checked)) return checked;
    auto verdict = std::get<Verdict>(*checked);
    if (!verdict.focused) return Advice(std::move(verdict));
    chosen_->position = verdict.position;  // a sharper place beside it, or where a moving subject was met
    return Advice(*chosen_);
  }
  if (regions_.size() > 1 && taken_.size() < kKeptFrames) taken_.push_back(taken);
  auto advice = Show(sessions_.size() - 1, taken);
  while (advice && std::holds_alternative<Verdict>(*advice)) {
    if (regions_.size() == 1) return advice;
    verdicts_.push_back(std::get<Verdict>(*std::move(advice)));
    if (sessions_.size() == regions_.size()) return Choose(place.position);
    advice = StartNext();
  }
  return advice;
}

Result<Advice> Regions::NextScore(double position, const Sharpness& sharpness) {
  if (regions_.size() != 1) return Fail(Code::InvalidArgument, "several regions need pictures, not their sharpness");
  shown_.back().push_back(frames_++);
  return sessions_.back().NextScore(position, sharpness);
}

Result<Advice> Regions::Show(std::size_t region, const Taken& taken) {
  auto advice = sessions_[region].Next(taken.place, taken.frame, regions_[region]);
  if (advice) shown_[region].push_back(taken.number);
  return advice;
}

std::vector<RegionSample> Regions::Curves() const {
  std::vector<RegionSample> seen;
  for (std::size_t region = 0; region < sessions_.size(); ++region) {
    const std::vector<CurvePoint> curve = sessions_[region].Curve();
    for (std::size_t i = 0; i < std::min(curve.size(), shown_[region].size()); ++i) {
      seen.push_back({shown_[region][i], static_cast<int>(region), curve[i].value, curve[i].sigma});
    }
  }
  return seen;
}

/// The next region begins with the frames there are, as long as its method can use frames of any position.
Result<Advice> Regions::StartNext() {
  auto session = Session::Create(method_, setup_);
  if (!session) return PassOn(session);
  sessions_.push_back(*std::move(session));
  shown_.emplace_back();
  const std::size_t region = sessions_.size() - 1;
  Result<Advice> advice = Show(region, taken_.front());
  for (std::size_t i = 1; i < taken_.size() && advice && std::holds_alternative<GoAndLook>(*advice); ++i) {
    if (sessions_.back().method() != "defocus") break;
    advice = Show(region, taken_[i]);
  }
  return advice;
}

std::vector<std::size_t> Regions::Agreeing(std::size_t with) const {
  std::vector<std::size_t> members;
  for (std::size_t i = 0; i < verdicts_.size(); ++i) {
    if (!verdicts_[i].focused) continue;
    const double apart = std::abs(verdicts_[i].position - verdicts_[with].position);
    const double noise = kSigmas * std::hypot(verdicts_[i].sigma, verdicts_[with].sigma);
    const double allowed = setup_.blur_px ? kHalfDepthOfFieldPx * *setup_.blur_px : noise;
    if (apart <= std::max(allowed, setup_.resolution)) members.push_back(i);
  }
  return members;
}

Verdict Regions::RefuseAll() const {
  Verdict verdict;
  const Cause first = verdicts_.front().cause;
  const bool alike = std::ranges::all_of(verdicts_, [&](const Verdict& one) { return one.cause == first; });
  verdict.cause = alike ? first : Cause::Unclear;
  verdict.reason = "no region could be focused";
  for (std::size_t i = 0; i < verdicts_.size(); ++i) verdict.reason += "; " + Ordinal(i) + ": " + verdicts_[i].reason;
  return verdict;
}

Advice Regions::Choose(double stands) {
  std::optional<std::size_t> best;
  std::size_t most = 0;
  for (std::size_t i = 0; i < verdicts_.size(); ++i) {
    if (!verdicts_[i].focused) continue;
    const double nearer =
        best ? (verdicts_[i].position - verdicts_[*best].position) * (setup_.near_is_high ? 1 : -1) : 0;
    const std::size_t agreeing = Agreeing(i).size();
    const bool better = !best || (policy_ == Policy::Nearest && nearer > 0) ||
                        (policy_ == Policy::Farthest && nearer < 0) || (policy_ == Policy::Widest && agreeing > most);
    if (!better) continue;
    best = i;
    most = agreeing;
  }
  if (!best) return RefuseAll();
  chosen_ = verdicts_[*best];
  chosen_region_ = *best;
  const std::string of = " of " + std::to_string(regions_.size()) + " regions";
  if (policy_ == Policy::Widest) {
    chosen_->reason = std::to_string(most) + of + " agree; " + Ordinal(*best) + ": " + chosen_->reason;
  } else {
    chosen_->reason =
        std::string(policy_ == Policy::Nearest ? "the nearest" : "the farthest") + of + ": " + chosen_->reason;
  }
  chosen_->candidates.clear();
  for (std::size_t i = 0; i < verdicts_.size(); ++i) {
    if (verdicts_[i].focused) {
      chosen_->candidates.push_back({verdicts_[i].position, verdicts_[i].sigma, static_cast<int>(i)});
    }
  }
  if (std::abs(stands - chosen_->position) < 0.5 * setup_.resolution) return *chosen_;
  return GoAndLook{chosen_->position};
}

}  // namespace lensd::autofocus
