// Escape sequences of ECMA-48, which every terminal emulator of today knows; terminfo would be asked for nothing else.
#include "cli/terminal/terminal.h"

#include <sys/ioctl.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>
#include <utility>

namespace lensd::cli {
namespace {

void WriteAll(std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = write(STDOUT_FILENO, text.data(), text.size());
    if (written <= 0) return;  // the terminal is gone
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

std::string_view Begin(Style style) {
  switch (style) {
    case Style::Title:
      return "\x1b[1m";
    case Style::Good:
      return "\x1b[32m";
    case Style::Busy:
      return "\x1b[33m";
    case Style::Bad:
      return "\x1b[31m";
    case Style::Faint:
      return "\x1b[2m";
    case Style::Plain:
      break;
  }
  return "";
}

constexpr std::string_view kOwnScreen = "\x1b[?1049h\x1b[?25l";  // the alternate screen, no cursor
constexpr std::string_view kBack = "\x1b[?25h\x1b[?1049l";

}  // namespace

TerminalScreen::TerminalScreen() {
  const char* const plain = std::getenv("NO_COLOR");
  coloured_ = plain == nullptr || *plain == 0;
  sigset_t watched;
  sigemptyset(&watched);
  for (const int each : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGTSTP, SIGWINCH}) sigaddset(&watched, each);
  pthread_sigmask(SIG_BLOCK, &watched, &mask_before_);
  signals_ = signalfd(-1, &watched, SFD_CLOEXEC | SFD_NONBLOCK);
  tcgetattr(STDIN_FILENO, &before_);
  Enter();
}

TerminalScreen::~TerminalScreen() {
  Leave();
  while (TakeSignal() != 0) continue;  // or it would strike when unblocked
  close(signals_);
  pthread_sigmask(SIG_SETMASK, &mask_before_, nullptr);
}

void TerminalScreen::Enter() {
  termios raw = before_;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  raw.c_cc[VMIN] = 0;
  raw.c_cc[VTIME] = 0;
  tcsetattr(STDIN_FILENO, TCSADRAIN, &raw);
  WriteAll(kOwnScreen);
}

void TerminalScreen::Leave() {
  WriteAll(kBack);
  tcsetattr(STDIN_FILENO, TCSADRAIN, &before_);
}

int TerminalScreen::TakeSignal() {
  signalfd_siginfo taken;
  if (read(signals_, &taken, sizeof taken) != sizeof taken) return 0;
  const int number = static_cast<int>(taken.ssi_signo);
  if (number != SIGTSTP) return number;
  Leave();
  kill(getpid(), SIGSTOP);  // returns when the shell brings us to the front again
  Enter();
  return number;
}

TerminalScreen::Size TerminalScreen::size() const {
  winsize told{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &told) != 0 || told.ws_col == 0 || told.ws_row == 0) return {};
  return {told.ws_col, told.ws_row};
}

void TerminalScreen::Draw(const std::vector<StyledLine>& lines) {
  const auto [columns, rows] = size();
  std::string text = "\x1b[H";
  for (std::size_t i = 0; i < lines.size() && std::cmp_less(i, rows); ++i) {
    const std::string_view begin = coloured_ ? Begin(lines[i].style) : "";
    text += i == 0 ? "" : "\r\n";
    text += begin;
    text += lines[i].text.substr(0, static_cast<std::size_t>(columns));
    text += begin.empty() ? "" : "\x1b[0m";
    text += "\x1b[K";
  }
  WriteAll(text + "\x1b[J");
}

std::vector<std::string> KeysIn(const std::string& typed) {
  static constexpr std::pair<std::string_view, std::string_view> kArrows[] = {
      {"\x1b[A", "up"}, {"\x1b[B", "down"}, {"\x1b[C", "right"}, {"\x1b[D", "left"},
      {"\x1bOA", "up"}, {"\x1bOB", "down"}, {"\x1bOC", "right"}, {"\x1bOD", "left"}};
  std::vector<std::string> keys;
  for (std::string_view rest = typed; !rest.empty();) {
    const auto* const arrow =
        std::ranges::find_if(kArrows, [&](const auto& each) { return rest.starts_with(each.first); });
    const bool known = arrow != std::end(kArrows);
    keys.emplace_back(known ? arrow->second : rest.substr(0, 1));
    rest.remove_prefix(known ? arrow->first.size() : 1);
  }
  return keys;
}

}  // namespace lensd::cli
