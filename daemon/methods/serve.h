// The methods of io.lensd.Lens, each file's rows of the one table.
#pragma once

#include "daemon/server/method_table.h"
#include "daemon/wire/refusal.h"

namespace lensd::daemon {

class LensService;

MethodTable StatusMethods(LensService& service);       ///< serve_status.cpp
MethodTable DeviceMethods(LensService& service);       ///< serve_devices.cpp
MethodTable MotionMethods(LensService& service);       ///< serve_motion.cpp
MethodTable LeaseMethods(LensService& service);        ///< serve_lease.cpp
MethodTable HoldMethods(LensService& service);         ///< serve_hold.cpp
MethodTable PlanMethods(LensService& service);         ///< serve_plan.cpp
MethodTable AutofocusMethods(LensService& service);    ///< serve_autofocus.cpp
MethodTable FocusAtMethods(LensService& service);      ///< serve_focus_at.cpp
MethodTable LearnedMethods(LensService& service);      ///< serve_learned.cpp
MethodTable RefocusMethods(LensService& service);      ///< serve_refocus.cpp
MethodTable FocusMapMethods(LensService& service);     ///< serve_focus_map.cpp
MethodTable SessionMethods(LensService& service);      ///< serve_autofocus_session.cpp
MethodTable PictureMethods(LensService& service);      ///< serve_pictures.cpp
MethodTable ExposureMethods(LensService& service);     ///< serve_exposure.cpp
MethodTable CalibrationMethods(LensService& service);  ///< serve_calibration.cpp
MethodTable FocusShiftMethods(LensService& service);   ///< serve_focus_shift.cpp
MethodTable PresetMethods(LensService& service);       ///< serve_presets.cpp
MethodTable ReloadMethods(LensService& service);       ///< serve_reload.cpp

/// Whether a stop or a lease keeps the caller from moving or changing the lens it names. False: it has been told.
bool MayDrive(LensService& service, const Method& method, const ExchangePointer& exchange);

}  // namespace lensd::daemon
