// The parts of the autofocus command.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/chart_file.h"
#include "cli/online/autofocus_record.h"
#include "cli/online/daemon_client.h"

namespace lensd::cli {

/// Conditions of a search as written; empty: as the lens stands.
struct ConditionTexts {
  std::string exposure;
  std::string gain;
  std::string f_number;
  std::string filter;
  bool given() const { return !exposure.empty() || !gain.empty() || !f_number.empty() || !filter.empty(); }
};
void AddConditionOptions(CLI::App& command, ConditionTexts& texts);
/// SearchConditions.
Result<varlink::Json> ConditionsOf(const ConditionTexts& texts);

struct AutofocusOptions {
  std::string name;
  std::vector<std::string> regions;
  std::string policy;
  std::string method;
  std::string deadline;  ///< these three as written; empty: the daemon's
  std::string range;
  std::string step;
  bool track = false;
  std::string frames_from;      ///< a shell command; empty: the lens' own camera
  std::string pixel;            ///< of its pictures
  std::optional<double> gamma;  ///< of its pictures: sample = light^(1/gamma)
  ConditionTexts conditions;
  PlotText plot;
  std::string record;  ///< a folder to write; empty: none
};

/// Prints every answer as it comes, until Control-C.
Outcome TrackSubject(Session& session, DaemonClient& link, varlink::Json parameters);
/// Both return AutofocusResult; `parameters` are those that Autofocus and AutofocusBegin share. `recording`, where not
/// nullptr, is given every frame.
std::expected<varlink::Json, Failure> FocusByOwnCamera(Session& session, DaemonClient& link, varlink::Json parameters);
std::expected<varlink::Json, Failure> FocusByCommand(Session& session, DaemonClient& link, varlink::Json parameters,
                                                     const AutofocusOptions& options, Recording* recording);

}  // namespace lensd::cli
