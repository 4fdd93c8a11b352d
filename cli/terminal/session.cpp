// How a command ends, and where its answer and its errors go.
#include "cli/terminal/session.h"

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "proto/errors_and_methods.h"
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
  const auto* found = std::ranges::find(proto::kExitWords, static_cast<int>(exit), &proto::ExitWord::status);
  return found == std::end(proto::kExitWords) ? "internal" : found->word;
}

Exit StatusOf(Code code) {
  // Offline there is no lens that has a range: the wish itself makes no sense.
  return code == Code::OutOfRange ? Exit::Usage : Exit{proto::ErrorOf(code).exit_status};
}

Failure::Failure(const Error& error) : status(StatusOf(error.code)), message(error.message) {
  if (!error.facts) return;
  nlohmann::json known = nlohmann::json::object();
  for (const auto& [name, text] :
       {std::pair("axis", &error.facts->axis), std::pair("parameter", &error.facts->parameter),
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
