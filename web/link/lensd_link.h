// How lensd is reached, and what its errors are in HTTP.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "base/clock.h"
#include "loop/web_event_loop.h"
#include "web/exchange.h"
#include "web/link/upstream.h"

namespace lensd::web {

/// Where lensd listens, and the loop its answers come in.
class LensdLink {
 public:
  LensdLink(EventLoop& loop, std::string path) : loop_(loop), path_(std::move(path)) {}

  EventLoop& loop() const { return loop_; }
  /// Begins "io.lensd.Lens.METHOD", or a method of another interface by its whole name.
  std::unique_ptr<UpstreamCall> Begin(std::string_view method, varlink::Json parameters, bool more, Duration limit,
                                      UpstreamCall::Listener listener) const;

 private:
  EventLoop& loop_;
  const std::string path_;
};

/// An error that lensd answered with: {"error", "parameters"} with the status that fits.
Answer AnswerOf(const varlink::Reply& error);
/// lensd did not answer: 503, or 504 where it did not in time.
Answer AnswerOf(const Error& why);
/// With `?errors=body` an error of lensd's is an answer as any other: a browser writes every status from 400 on into
/// its console, where a displaced move, or a lens that is away, is no error of the page.
Answer AsWished(const Exchange& exchange, Answer answer);

}  // namespace lensd::web
