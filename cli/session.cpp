#include "cli/session.h"

#include <cstdio>

#include "proto/json.h"

namespace lensd::cli {
namespace {

void Write(std::FILE* stream, std::string_view text) {
  std::fwrite(text.data(), 1, text.size(), stream);
  if (text.empty() || text.back() != '\n') std::fputc('\n', stream);
  std::fflush(stream);
}

}  // namespace

Exit StatusOf(Code code) {
  switch (code) {
    case Code::InvalidArgument:
    case Code::OutOfRange:
      return Exit::Usage;
    case Code::Timeout:
    case Code::Cancelled:
    case Code::Superseded:
    case Code::Busy:
      return Exit::TryAgain;
    case Code::Disconnected:
    case Code::Unsupported:
      return Exit::Unavailable;
    case Code::Protocol:
      return Exit::Protocol;
    case Code::BadData:
      return Exit::BadData;
    case Code::Io:
      return Exit::Io;
    case Code::Internal:
      break;
  }
  return Exit::Internal;
}

void Session::PrintJson(const nlohmann::json& value) {
  Write(stdout, proto::WriteJson(value));
}

void Session::PrintText(std::string_view text) {
  Write(stdout, text);
}

void Session::Remark(std::string_view line) {
  Write(stderr, line);
}

}  // namespace lensd::cli
