// The parts of the autofocus command.
#pragma once

#include <string>
#include <vector>

#include "cli/online/daemon_client.h"

namespace lensd::cli {

struct AutofocusOptions {
  std::string name;
  std::vector<std::string> regions;
  std::string policy;
  std::string method;
  std::string deadline;  ///< these three as written; empty: the daemon's
  std::string range;
  std::string step;
  bool track = false;
  std::string frames_from;  ///< a shell command; empty: the lens' own camera
  std::string pixel;        ///< of its pictures
};

/// One line on stderr that rewrites itself, on a terminal only; gone when this ends.
class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;
  void Show(const std::string& text);
  void Clear();

 private:
  bool on_terminal_;
  bool shown_ = false;
};

/// Prints every answer as it comes, until Control-C.
Outcome TrackSubject(Session& session, DaemonClient& link, varlink::Json parameters);
/// Both return AutofocusResult; `parameters` are those that Autofocus and AutofocusBegin share.
std::expected<varlink::Json, Failure> FocusByOwnCamera(DaemonClient& link, varlink::Json parameters);
std::expected<varlink::Json, Failure> FocusByCommand(DaemonClient& link, varlink::Json parameters,
                                                     const AutofocusOptions& options);

}  // namespace lensd::cli
