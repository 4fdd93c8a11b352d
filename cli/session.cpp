// How a command ends, and where its answer and its errors go.
#include "cli/session.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "varlink/json.h"

namespace lensd::cli {
namespace {

void Write(std::FILE* stream, std::string_view text) {
  std::fwrite(text.data(), 1, text.size(), stream);
  if (text.empty() || text.back() != '\n') std::fputc('\n', stream);
  std::fflush(stream);
}

}  // namespace

std::string_view NameOf(Exit exit) {
  struct Named {
    Exit exit;
    std::string_view name;
  };
  static constexpr Named kNames[] = {
      {Exit::Done, "done"},
      {Exit::No, "no"},
      {Exit::Stopped, "stopped"},
      {Exit::Superseded, "superseded"},
      {Exit::Busy, "busy"},
      {Exit::Timeout, "timeout"},
      {Exit::OutOfRange, "out-of-range"},
      {Exit::NotHomed, "not-homed"},
      {Exit::Unsupported, "unsupported"},
      {Exit::Leased, "leased"},
      {Exit::Usage, "usage"},
      {Exit::BadData, "bad-data"},
      {Exit::NoInput, "no-input"},
      {Exit::NotFound, "not-found"},
      {Exit::Unavailable, "unavailable"},
      {Exit::Internal, "internal"},
      {Exit::CannotWrite, "cannot-write"},
      {Exit::Io, "io"},
      {Exit::Protocol, "protocol"},
      {Exit::NotPermitted, "not-permitted"},
      {Exit::Config, "configuration"},
      {Exit::Interrupted, "interrupted"},
  };
  const auto* found = std::ranges::find(kNames, exit, &Named::exit);
  return found == std::end(kNames) ? "internal" : found->name;
}

Exit StatusOf(Code code) {
  switch (code) {
    case Code::InvalidArgument:
    case Code::OutOfRange:  // offline there is no lens that has a range: the wish itself makes no sense
      return Exit::Usage;
    case Code::Timeout:
      return Exit::Timeout;
    case Code::Cancelled:
      return Exit::Stopped;
    case Code::Superseded:
      return Exit::Superseded;
    case Code::Busy:
      return Exit::Busy;
    case Code::Leased:
      return Exit::Leased;
    case Code::NotHomed:
      return Exit::NotHomed;
    case Code::Disconnected:
    case Code::WrongDevice:
      return Exit::Unavailable;
    case Code::Unsupported:
      return Exit::Unsupported;
    case Code::Protocol:
      return Exit::Protocol;
    case Code::BadData:
      return Exit::BadData;
    case Code::Io:
      return Exit::Io;
    case Code::NotKept:
      return Exit::CannotWrite;
    case Code::Internal:
      break;
  }
  return Exit::Internal;
}

Failure::Failure(const Error& error) : status(StatusOf(error.code)), message(error.message) {
  if (!error.facts) return;
  nlohmann::json known = nlohmann::json::object();
  for (const auto& [name, text] : {std::pair("axis", &error.facts->axis), std::pair("parameter", &error.facts->parameter),
                                   std::pair("unit", &error.facts->unit)}) {
    if (!text->empty()) known[name] = *text;
  }
  if (error.facts->minimum) known["minimum"] = *error.facts->minimum;
  if (error.facts->maximum) known["maximum"] = *error.facts->maximum;
  details = std::make_shared<const nlohmann::json>(std::move(known));
}

void Session::Explain(const Failure& failure) {
  std::string line = failure.message;
  std::ranges::replace(line, '\n', ' ');
  if (json()) {
    nlohmann::json answer = failure.details ? *failure.details : nlohmann::json::object();
    answer["error"] = NameOf(failure.status);
    answer["message"] = line;
    PrintJson(answer);
  }
  Remark("lensctl: " + line);
}

void Session::PrintJson(const nlohmann::json& value) {
  Write(stdout, varlink::WriteJson(value));
}

void Session::PrintText(std::string_view text) {
  Write(stdout, text);
}

void Session::Remark(std::string_view line) {
  Write(stderr, line);
}

}  // namespace lensd::cli
