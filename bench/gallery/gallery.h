// The command `gallery`: the lecture's optics as charts, and rendered frames that show the same.
#pragma once

namespace lensd::bench {

int RunGallery(int argc, char** argv);

}  // namespace lensd::bench
