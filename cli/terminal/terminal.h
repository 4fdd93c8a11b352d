// The terminal as a screen: taken over while it is drawn on, and given back as it was.
#pragma once

#include <signal.h>
#include <termios.h>

#include <string>
#include <vector>

namespace lensd::cli {

/// How a line looks; plain where NO_COLOR is set.
enum class Style { Plain, Title, Good, Busy, Bad, Faint };
struct StyledLine {
  std::string text;  ///< ASCII
  Style style = Style::Plain;
};

/// Stdin and stdout, as another screen without line buffering and echo, from the constructor to the destructor. The
/// signals that would end or suspend the program come through signals() meanwhile, so that nothing leaves the terminal
/// as it is.
class TerminalScreen {
 public:
  TerminalScreen();
  ~TerminalScreen();
  TerminalScreen(const TerminalScreen&) = delete;
  TerminalScreen& operator=(const TerminalScreen&) = delete;

  /// Readable when a signal has come.
  int signals() const { return signals_; }
  /// The signal that came, 0: none. One that suspends has done so, and the screen is back, when this returns.
  int TakeSignal();
  struct Size {
    int columns = 80;
    int rows = 24;
  };
  Size size() const;
  /// Replaces what is shown; what does not fit is left out.
  void Draw(const std::vector<StyledLine>& lines);

 private:
  void Enter();
  void Leave();

  termios before_{};
  sigset_t mask_before_{};
  int signals_ = -1;
  bool coloured_ = true;
};

/// What was typed, one key each: a letter, or "up", "down", "left", "right".
std::vector<std::string> KeysIn(const std::string& typed);

}  // namespace lensd::cli
