// What the options of `lensctl add` say, as lines of TOML.
#pragma once

#include <string>

#include "base/result.h"
#include "cli/terminal/session.h"

namespace lensd::cli {

/// A number as a file has it, to 12 digits.
std::string NumberTextOf(double value);

/// Keys of [lens.optics], each ending with a line break. InvalidArgument names the option.
Result<std::string> FocalLengthLine(const std::string& text);
Result<std::string> FNumberLine(const std::string& text);
/// `from`: lens, sensor or front; empty: lens.
Result<std::string> ClosestLine(const std::string& text, const std::string& from);

/// pixel_um of a camera.
Result<std::string> PixelLine(const std::string& text);

/// [lens.drives.AXIS] of `AXIS=UNIT,PROFILE,LOW..HIGH`. Usage.
std::expected<std::string, Failure> DriveTable(const std::string& text);
/// The line of `KEY=VALUE`: numbers, true, false, arrays and what is in quotes as they are, all else as a string. Where
/// every driver takes a string, as with serial, a number is one too. A file is named from here and not from the
/// configuration. Usage: no such pair, or a key that names a program.
std::expected<std::string, Failure> KeyLine(const std::string& text);

}  // namespace lensd::cli
