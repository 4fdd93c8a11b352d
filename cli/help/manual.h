// The manual page lensctl(1), made from the commands themselves.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace lensd::cli {

/// In the macros of man(7).
std::string ManualPage(const CLI::App& root);

}  // namespace lensd::cli
