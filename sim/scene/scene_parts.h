// The parts of a scene file, one function a table.
#pragma once

#include <vector>

#include "base/result.h"
#include "base/settings.h"
#include "sim/scene.h"

namespace lensd::sim {

/// `table` may be null: then all defaults. Errors: Code::BadData, "file:line: what is wrong".
Result<CameraSettings> ReadCamera(const Settings* table);
Result<LensSettings> ReadLens(const Settings* table);
Result<Surface> ReadSurface(const Settings& table);
Result<LightPoint> ReadLight(const Settings& table);
Result<Fault> ReadFault(const Settings& table);
Result<PreparedFrame> ReadPreparedFrame(const Settings& table, const CameraSettings& camera);

/// A rectangle of fractions from an array [x, y, w, h]; rejects one that is empty or leaves the frame.
Region ReadRegion(SettingsReader& read, std::string_view key, Region fallback);

/// A depth in metres from 1 mm to 1e9 m, or TOML's inf.
double ReadDistance(SettingsReader& read, std::string_view key);

}  // namespace lensd::sim
