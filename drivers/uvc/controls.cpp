// Control requests, and why a stalled one was refused: the camera is asked for its error code once a refusal.
#include "controls.h"

#include <utility>

namespace lensd::drivers::uvc {
namespace {

struct Meaning {
  Refusal refusal;
  Code code;
  const char* text;
};
constexpr Meaning kMeanings[] = {
    {Refusal::NotReady, Code::Busy, "it is not ready"},
    {Refusal::WrongState, Code::Busy, "it is in the wrong state for that, most likely set to automatic"},
    {Refusal::Power, Code::Protocol, "its power mode does not allow it"},
    {Refusal::OutOfRange, Code::OutOfRange, "the value is out of range"},
    {Refusal::InvalidUnit, Code::Unsupported, "it has no such unit"},
    {Refusal::InvalidControl, Code::Unsupported, "it has no such control"},
    {Refusal::InvalidRequest, Code::Unsupported, "the control does not take this request"},
    {Refusal::InvalidValue, Code::OutOfRange, "the value is within range but not allowed"},
};

}  // namespace

Error ErrorOf(Reply::Outcome outcome, const std::string& what) {
  switch (outcome) {
    case Reply::Outcome::TimedOut:
      return {Code::Timeout, what + ": the camera did not answer in time"};
    case Reply::Outcome::Cancelled:
    case Reply::Outcome::NotSent:
      return {Code::Cancelled, what + ": interrupted"};
    case Reply::Outcome::Gone:
      return {Code::Disconnected, "the camera is unplugged"};
    case Reply::Outcome::Stalled:
      return {Code::Protocol, what + ": the camera refused"};
    case Reply::Outcome::Done:
    case Reply::Outcome::Failed:
      break;
  }
  return {Code::Protocol, what + ": the transfer to the camera failed; check cable and power"};
}

Reply Controls::Run(std::uint8_t type, std::uint8_t request, ControlAddress at, std::uint16_t length,
                    std::span<const std::uint8_t> out) {
  Setup setup;
  setup.request_type = type;
  setup.request = request;
  setup.value = static_cast<std::uint16_t>(at.selector << 8);
  setup.index = static_cast<std::uint16_t>(at.entity << 8 | at.interface);
  setup.length = length;
  return transport_->Control(setup, out, options_.timeout);
}

/// Once and never again for the same refusal: a refusal to tell is an answer as well.
Refusal Controls::AskWhy() {
  if (!options_.read_error_code) return Refusal::Unknown;
  const Reply reply = Run(kGetInterface, kGetCur, {kRequestErrorCode, 0, interface_}, 1, {});
  if (reply.outcome != Reply::Outcome::Done || reply.data.size() != 1) return Refusal::Unknown;
  return static_cast<Refusal>(reply.data[0]);
}

Error Controls::Explain(Reply::Outcome outcome, const std::string& what) {
  Error error = ErrorOf(outcome, what);
  if (outcome != Reply::Outcome::Stalled) return error;
  last_refusal_ = AskWhy();
  for (const Meaning& meaning : kMeanings) {
    if (meaning.refusal == last_refusal_) return {meaning.code, error.message + ": " + meaning.text};
  }
  error.message += " and did not say why";
  return error;
}

Result<std::vector<std::uint8_t>> Controls::Get(std::uint8_t request, ControlAddress at, std::uint16_t length,
                                                const std::string& what) {
  Reply reply = Run(kGetInterface, request, at, length, {});
  if (reply.outcome != Reply::Outcome::Done) return PassOn(Explain(reply.outcome, what));
  if (reply.data.size() != length) {
    return Fail(Code::Protocol, what + ": the camera sent " + std::to_string(reply.data.size()) + " bytes where " +
                                    std::to_string(length) + " were due");
  }
  return std::move(reply.data);
}

Result<std::optional<std::vector<std::uint8_t>>> Controls::TryGet(std::uint8_t request, ControlAddress at,
                                                                  std::uint16_t length, const std::string& what) {
  Reply reply = Run(kGetInterface, request, at, length, {});
  if (reply.outcome == Reply::Outcome::Stalled) return std::nullopt;
  if (reply.outcome != Reply::Outcome::Done) return PassOn(ErrorOf(reply.outcome, what));
  if (reply.data.size() != length) return std::nullopt;
  return std::move(reply.data);
}

Result<void> Controls::Set(ControlAddress at, std::span<const std::uint8_t> bytes, const std::string& what) {
  if (last_set_ && clock_.Now() < *last_set_ + options_.interval) transport_->WaitUntil(*last_set_ + options_.interval);
  const Reply reply = Run(kSetInterface, kSetCur, at, static_cast<std::uint16_t>(bytes.size()), bytes);
  const Reply::Outcome outcome = reply.outcome;
  set_without_effect_ = outcome == Reply::Outcome::NotSent || outcome == Reply::Outcome::Stalled;
  if (outcome != Reply::Outcome::NotSent) last_set_ = clock_.Now();
  if (reply.outcome == Reply::Outcome::Done) return {};
  return PassOn(Explain(reply.outcome, what));
}

}  // namespace lensd::drivers::uvc
