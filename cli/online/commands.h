// lensctl's commands that talk to the daemon, one function each for the table in cli/commands.h.
#pragma once

#include "cli/terminal/session.h"

namespace lensd::cli {

void AddDevices(CLI::App& root, Run& run);
void AddAdd(CLI::App& root, Run& run);
void AddSetup(CLI::App& root, Run& run);
void AddDoctor(CLI::App& root, Run& run);
void AddList(CLI::App& root, Run& run);
void AddStatus(CLI::App& root, Run& run);
void AddMonitor(CLI::App& root, Run& run);
void AddMetrics(CLI::App& root, Run& run);
void AddFocus(CLI::App& root, Run& run);
void AddAperture(CLI::App& root, Run& run);
void AddZoom(CLI::App& root, Run& run);
void AddFilter(CLI::App& root, Run& run);
void AddHome(CLI::App& root, Run& run);
void AddHere(CLI::App& root, Run& run);
void AddReload(CLI::App& root, Run& run);
void AddBackup(CLI::App& root, Run& run);
void AddRestore(CLI::App& root, Run& run);
void AddHold(CLI::App& root, Run& run);
void AddLease(CLI::App& root, Run& run);
void AddCalibrate(CLI::App& root, Run& run);
void AddBacklash(CLI::App& root, Run& run);
void AddFocusShift(CLI::App& root, Run& run);
void AddFocusAt(CLI::App& root, Run& run);
void AddRefocus(CLI::App& root, Run& run);
void AddLearned(CLI::App& root, Run& run);
void AddPreset(CLI::App& root, Run& run);
void AddUndo(CLI::App& root, Run& run);
void AddStop(CLI::App& root, Run& run);
void AddAutofocus(CLI::App& root, Run& run);
void AddFocusMap(CLI::App& root, Run& run);
void AddStack(CLI::App& root, Run& run);
void AddSnapshot(CLI::App& root, Run& run);
void AddExposure(CLI::App& root, Run& run);
void AddCall(CLI::App& root, Run& run);
void AddIntrospect(CLI::App& root, Run& run);
void AddCompletion(CLI::App& root, Run& run);
void AddWait(CLI::App& root, Run& run);
void AddReset(CLI::App& root, Run& run);
void AddLog(CLI::App& root, Run& run);

}  // namespace lensd::cli
