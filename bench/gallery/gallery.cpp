// The command `gallery`.
#include "bench/gallery/gallery.h"

#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <string>

#include "bench/command.h"
#include "bench/gallery/frames.h"
#include "bench/gallery/lessons.h"
#include "io/atomic_file.h"
#include "io/svg_colours.h"

namespace lensd::bench {
namespace {

namespace fs = std::filesystem;

struct GalleryOptions {
  std::string directory;
  std::string scenes = "scenes";
  std::string theme = "viewer";
};

int Complain(const Error& error) {
  std::cerr << "lens-bench gallery: " << error.message << "\n";
  return error.code == Code::BadData ? EX_DATAERR : error.code == Code::Io ? EX_IOERR : EX_SOFTWARE;
}

Result<void> DrawAll(const GalleryOptions& options) {
  const io::Theme theme = options.theme == "light"  ? io::Theme::Light
                          : options.theme == "dark" ? io::Theme::Dark
                                                    : io::Theme::Viewer;
  const fs::path directory = options.directory;
  std::error_code ignored;  // writing into it says why not
  fs::create_directories(directory, ignored);
  for (const Lesson& lesson : Lessons()) {
    const fs::path path = directory / (lesson.name + ".svg");
    const std::string svg = io::InTheme(SvgOf(lesson), theme);
    if (auto written = io::WriteFileAtomically(path.string(), svg); !written) return written;
    std::cout << path.string() << ": " << lesson.topic << "\n";
  }
  const auto frames = Frames(options.scenes);
  if (!frames) return PassOn(frames);
  for (const GalleryFrame& frame : *frames) {
    const fs::path path = directory / (frame.name + ".png");
    if (auto written = io::WritePng(path.string(), frame.image); !written) return written;
    std::cout << path.string() << ": " << frame.says << "\n";
  }
  return {};
}

}  // namespace

int RunGallery(int argc, char** argv) {
  CLI::App app(
      "Draws the lecture's optics: eight charts as SVG, and frames of one scene through a pinhole, a hole, a lens and "
      "the\n"
      "lens stopped down, as PNG. Every number is computed by lensd's own formulas. docs/gallery.md shows them.");
  GalleryOptions options;
  app.add_option("-o,--output", options.directory, "folder, made where it is missing")->required()->type_name("FOLDER");
  app.add_option("--scenes", options.scenes, "the sources' folder of that name")->capture_default_str();
  app.add_option("--theme", options.theme, "light, dark or viewer: as whoever shows the charts prefers")
      ->check(CLI::IsMember({"light", "dark", "viewer"}))
      ->capture_default_str();
  return ParseThen(app, argc, argv, [&] {
    const auto drawn = DrawAll(options);
    return drawn ? EX_OK : Complain(drawn.error());
  });
}

}  // namespace lensd::bench
