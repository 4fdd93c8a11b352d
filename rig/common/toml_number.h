// Numbers as the files of a rig hold them.
#pragma once

#include <charconv>
#include <string>

namespace lensd::rig {

/// The shortest decimal that reads back as the same number; always a float of TOML.
inline std::string NumberText(double number) {
  char text[40];
  std::string written(text, std::to_chars(text, text + sizeof text, number).ptr);
  if (written.find_first_of(".en") == std::string::npos) written += ".0";
  return written;
}

}  // namespace lensd::rig
