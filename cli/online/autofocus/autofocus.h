// The parts of the autofocus command.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/charts/chart_file.h"
#include "cli/link/daemon_client.h"
#include "cli/online/autofocus/autofocus_record.h"

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

/// How long and where to search, as written (empty: the daemon's), as parameters that all searches share.
Result<void> AddLimits(const Session& session, const std::string& deadline, const std::string& range,
                       varlink::Json& parameters);
/// Prints every answer as it comes, until Control-C.
Outcome TrackSubject(Session& session, DaemonClient& link, varlink::Json parameters);
/// Both return AutofocusResult; `parameters` are those that Autofocus and AutofocusBegin share. `recording`, where not
/// nullptr, is given every frame.
std::expected<varlink::Json, Failure> FocusByOwnCamera(Session& session, DaemonClient& link, varlink::Json parameters);
/// One call of a method that searches with the lens' own camera: its last reply. Progress is shown; Control-C and
/// --timeout stop the lens and say where it stands.
std::expected<varlink::Json, Failure> FollowSearch(Session& session, DaemonClient& link, std::string_view method,
                                                   varlink::Json parameters);
std::expected<varlink::Json, Failure> FocusByCommand(Session& session, DaemonClient& link, varlink::Json parameters,
                                                     const AutofocusOptions& options, Recording* recording);

}  // namespace lensd::cli
