// Lenses whose data sheets lensd brings: `optics = "MODEL"` in place of focal length, f-numbers and closest distance.
#pragma once

#include "base/result.h"
#include "base/settings.h"

namespace lensd::daemon {

/// A [[lens]] with the optics of the model that it names (`optics = "MODEL"`, or `model = "MODEL"` in [lens.optics],
/// whose other keys then take precedence) in place of the name; unchanged where it names none. A model is a file of the
/// folder share/lensd/lenses of this installation, or any file whose name ends in .toml, relative to the configuration.
/// BadData: there is no such model, or its file is wrong. Reads a file: not in the event loop.
Result<Settings> WithLensModel(const Settings& lens);

}  // namespace lensd::daemon
