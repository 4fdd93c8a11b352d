// plan, for a lens of the daemon.
#pragma once

#include <string>

#include "cli/merge/merge_files.h"
#include "cli/plan/options.h"
#include "cli/terminal/session.h"

namespace lensd::cli {

/// Lets the daemon plan for its lens (empty: the only one), which alone knows it, and prints the answer. Control-C
/// stops what --apply moves.
Outcome RunPlanOnline(const PlanText& text, const std::string& lens, bool apply, Session& session);

/// Plans the fewest shots that keep every sharp limit of `text`, moves the lens to each and saves what its camera sees
/// as FOLDER/shot-1.png and so on, from far to near. Merges them where `merge` asks for it.
Outcome RunStackOnline(PlanText text, const MergeText& merge, const std::string& lens, const std::string& folder,
                       Session& session);

}  // namespace lensd::cli
