// The page, compiled in: no path of a request ever names a file of this machine.
#pragma once

#include <string_view>

namespace lensd::web {

struct PageFile {
  std::string_view path;  ///< "/page.js"
  std::string_view type;
  std::string_view bytes;
};

/// Null: there is no such file.
const PageFile* FindPageFile(std::string_view path);

}  // namespace lensd::web
