// The explicit table of lensctl's commands, in the order of `lensctl --help`. A new command is one declaration and one
// line in kCommands.
#pragma once

#include <initializer_list>

#include "cli/help/help.h"
#include "cli/online/commands.h"
#include "cli/terminal/session.h"

namespace lensd::cli {

void AddPlan(CLI::App& root, Run& run);
void AddBlur(CLI::App& root, Run& run);
void AddDof(CLI::App& root, Run& run);
void AddConjugate(CLI::App& root, Run& run);
void AddProject(CLI::App& root, Run& run);
void AddLight(CLI::App& root, Run& run);
void AddMerge(CLI::App& root, Run& run);
void AddVerify(CLI::App& root, Run& run);

inline constexpr std::initializer_list<AddCommand> kCommands = {
    AddPlan,       AddBlur,      AddDof,        AddConjugate, AddProject,  AddLight,      AddDevices, AddList,
    AddStatus,     AddFocus,     AddAperture,   AddZoom,      AddFilter,   AddHome,       AddStop,    AddReset,
    AddWait,       AddAutofocus, AddFocusMap,   AddCalibrate, AddBacklash, AddFocusShift, AddFocusAt, AddRefocus,
    AddPreset,     AddUndo,      AddSnapshot,   AddExposure,  AddStack,    AddMonitor,    AddMetrics, AddLog,
    AddLease,      AddHold,      AddReload,     AddBackup,    AddRestore,  AddSetup,      AddDoctor,  AddCall,
    AddIntrospect, AddHelp,      AddCompletion, AddMerge,     AddVerify,   AddLearned,    AddHere,    AddAdd,
};

}  // namespace lensd::cli
