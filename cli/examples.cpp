// A table; its order within one command is that of the help.
#include "cli/examples.h"

#include <array>

namespace lensd::cli {
namespace {

struct OfCommand {
  std::string_view command;
  Example example;
};

constexpr auto kExamples = std::to_array<OfCommand>({
    {"lensctl", {"lensctl list", "which lenses there are"}},
    {"lensctl", {"lensctl focus 0.8m", "focus at 0.8 m from the lens centre"}},
    {"lensctl", {"lensctl autofocus", "focus on the middle of the picture"}},
    {"lensctl", {"lensctl help plan", "all about one command"}},
    {"lensctl plan",
     {"lensctl plan --focal-length 50mm --f-number 1.4..16 --extension 0mm..3mm --pixel 5um --sharp 2m..2.2m:2px",
      "of any lens: the widest aperture that keeps 2 m to 2.2 m sharp"}},
    {"lensctl plan",
     {"lensctl plan cam --sharp part=0.8m..0.82m:2px --blurred wall=2m..inf:3px --apply",
      "of the lens cam: find it, move there, and say what was reached"}},
    {"lensctl blur",
     {"lensctl blur --focal-length 50mm --f-number 2.8 --focus 2m --at 1.5m --at 4m", "blur at two distances"}},
    {"lensctl blur",
     {"lensctl blur --focal-length 50mm --f-number 8 --focus hyperfocal --blur-limit 20um --at 4m..40m",
      "from here to there, focused at the hyperfocal distance"}},
    {"lensctl dof",
     {"lensctl dof --focal-length 50mm --f-number 2.8 --focus 6ft --blur-limit 20um", "depth of field, in feet"}},
    {"lensctl dof",
     {"lensctl dof --focal-length 50mm --f-number 4 --blur-limit 2px --pixel 3.45um --wavelength 550nm",
      "hyperfocal distance, diffraction counted"}},
    {"lensctl conjugate",
     {"lensctl conjugate --focal-length 50mm --point 0.1m,0m,2m", "where a point at 2 m is imaged"}},
    {"lensctl project",
     {"lensctl project --focal-length 50mm --f-number 2.8 --focus 2m --point 0.1m,0m,3m",
      "what a point behind the focus lights on the sensor"}},
    {"lensctl light", {"lensctl light --focal-length 50mm --f-number 2.8 --focus 0.3m", "light lost close up"}},
    {"lensctl merge", {"lensctl merge shots -o sharp.png --depth depth.png", "of what lensctl stack put into shots"}},
    {"lensctl merge", {"lensctl merge shots -o sharp.png --prefer near", "rims of things belong to what is near"}},
    {"lensctl devices", {"lensctl devices", "what is plugged in"}},
    {"lensctl devices", {"lensctl devices --write-config lensd.toml", "a configuration to begin with"}},
    {"lensctl list", {"lensctl list", "lenses, their motors and optics"}},
    {"lensctl status", {"lensctl status", "where every lens stands"}},
    {"lensctl status", {"lensctl status cam --watch", "a live screen, until q or Control-C"}},
    {"lensctl focus", {"lensctl focus 0.8m", "0.8 m from the lens centre"}},
    {"lensctl focus", {"lensctl focus cam inf --from sensor", "distances from the sensor"}},
    {"lensctl focus", {"lensctl focus cam hyperfocal --blur-limit 2px", "as much as possible sharp to infinity"}},
    {"lensctl focus", {"lensctl focus near:20", "20 steps nearer, however the motor counts"}},
    {"lensctl aperture", {"lensctl aperture 2.8", "f/2.8"}},
    {"lensctl aperture", {"lensctl aperture f/8 --keep-brightness", "the exposure follows"}},
    {"lensctl zoom", {"lensctl zoom 35mm", "what is sharp stays sharp"}},
    {"lensctl filter", {"lensctl filter 2", "the second place of the wheel"}},
    {"lensctl home", {"lensctl home focus", "find the reference of focus again"}},
    {"lensctl here", {"lensctl here @1200", "focus has no reference: it stands at 1200, and counts from there"}},
    {"lensctl here", {"lensctl here cam zoom @300", "another axis of the lens cam"}},
    {"lensctl stop", {"lensctl stop", "every lens, at once"}},
    {"lensctl stop", {"lensctl stop cam", "this one alone"}},
    {"lensctl reset", {"lensctl reset cam", "let it move again after a latched stop or a fault"}},
    {"lensctl wait", {"lensctl wait cam idle --timeout 10s", "until nothing moves"}},
    {"lensctl autofocus", {"lensctl autofocus", "on the middle of the picture"}},
    {"lensctl autofocus",
     {"lensctl autofocus cam --roi 0.4,0.4,0.2,0.2 --range 0.7m..2m", "on a region, within a range"}},
    {"lensctl autofocus",
     {"lensctl autofocus --f-number 2.8 --exposure 5ms", "search wide open, then back, and on by the measured shift"}},
    {"lensctl focus-map", {"lensctl focus-map", "is the sensor square to the lens and to a flat target?"}},
    {"lensctl focus-map",
     {"lensctl focus-map cam --grid 7x5 --range 0.7m..2m --plot map.svg",
      "more regions, a part of the range, a drawing"}},
    {"lensctl calibrate", {"lensctl calibrate cam --show", "what positions mean today"}},
    {"lensctl calibrate",
     {"lensctl calibrate cam --point 0=inf --point 2000=1m --data-sheet --error 20um",
      "from two stops of a data sheet"}},
    {"lensctl calibrate", {"lensctl calibrate cam --remove", "back to the nominal figures"}},
    {"lensctl backlash", {"lensctl backlash cam --steps 12", "it is 12 steps: nothing is measured"}},
    {"lensctl focus-shift",
     {"lensctl focus-shift measure cam --filter 2", "from filter 2 to the one it works through"}},
    {"lensctl focus-shift", {"lensctl focus-shift list", "what is known"}},
    {"lensctl focus-shift",
     {"lensctl focus-shift remove cam --from 2 --to 1", "forget it; f/2.8 and f/8 for f-numbers"}},
    {"lensctl focus-at", {"lensctl focus-at add cam x=12mm y=3mm", "the newest autofocus was there"}},
    {"lensctl focus-at", {"lensctl focus-at add cam x=12mm y=3mm --position 1210 --sigma 2", "focus is at 1210 there"}},
    {"lensctl focus-at", {"lensctl focus-at show", "samples, outliers, and where the next one tells most"}},
    {"lensctl focus-at", {"lensctl focus-at go cam x=8mm y=5mm", "to where focus lies there"}},
    {"lensctl focus-at", {"lensctl focus-at forget cam --sample 3", "without --sample: all of it"}},
    {"lensctl refocus", {"lensctl refocus show cam", "whether focus is looked after, and what was learned"}},
    {"lensctl refocus", {"lensctl refocus forget cam --result 3", "without --result: all of it"}},
    {"lensctl learned", {"lensctl learned show cam", "how blur grows with focus, as autofocus has seen it"}},
    {"lensctl learned", {"lensctl learned forget cam", "another lens is mounted"}},
    {"lensctl preset", {"lensctl preset save wide", "keep this state"}},
    {"lensctl preset", {"lensctl preset recall wide", "come back to it"}},
    {"lensctl preset", {"lensctl preset list", "what is kept"}},
    {"lensctl preset", {"lensctl preset remove wide", "forget it"}},
    {"lensctl undo", {"lensctl undo", "where it was before the last command; once more: forth again"}},
    {"lensctl snapshot", {"lensctl snapshot -o frame.png", "one new frame"}},
    {"lensctl snapshot", {"lensctl snapshot cam -o part.jpg --region 0.4,0.4,0.2,0.2", "a part of it, for eyes"}},
    {"lensctl exposure", {"lensctl exposure", "how the camera exposes"}},
    {"lensctl exposure", {"lensctl exposure 8ms", "expose for 8 ms from now on"}},
    {"lensctl stack",
     {"lensctl stack cam --sharp 0.8m..1.2m:1.5px -o shots", "pictures that are sharp from here to there"}},
    {"lensctl stack",
     {"lensctl stack cam --sharp 0.8m..1.2m:1.5px -o shots --merge sharp.png --depth depth.png",
      "and one that is sharp all over, and how far away everything is"}},
    {"lensctl monitor", {"lensctl monitor", "what happens, until Control-C"}},
    {"lensctl metrics", {"lensctl metrics", "moves, misses, frames lost"}},
    {"lensctl log", {"lensctl log cam -n 20", "what the journal has of this lens"}},
    {"lensctl lease", {"lensctl lease take cam --for 10min", "prints the key: export LENSD_LEASE=KEY"}},
    {"lensctl lease", {"lensctl lease drop cam", "let others move it again"}},
    {"lensctl hold", {"lensctl hold cam --for 1s", "corrections wait for an exposure of another program"}},
    {"lensctl reload", {"lensctl reload", "after a change of lensd.toml"}},
    {"lensctl backup", {"lensctl backup rig.lensd", "to take it to another host"}},
    {"lensctl restore", {"lensctl restore rig.lensd", "there, while lensd does not run"}},
    {"lensctl setup", {"lensctl setup", "how its axes move, and what a reversal loses"}},
    {"lensctl setup",
     {"lensctl setup cam --at 1.2m --roi 0.4,0.4,0.2,0.2",
      "with a subject at 1.2 m there: direction and nominal curve too"}},
    {"lensctl doctor", {"lensctl doctor", "what keeps lenses from working, and what to do"}},
    {"lensctl call", {"lensctl call Status", "any method of the interface"}},
    {"lensctl call", {"lensctl call Move '{\"axis\": \"focus\", \"target\": {\"relative\": 5}}'", "with parameters"}},
    {"lensctl introspect", {"lensctl introspect", "the interface as the daemon defines it"}},
    {"lensctl help", {"lensctl help focus", "all about one command"}},
    {"lensctl completion", {"lensctl completion bash", "source <(lensctl completion bash) turns it on"}},
});

}  // namespace

std::vector<Example> ExamplesOf(std::string_view name) {
  std::vector<Example> examples;
  for (const OfCommand& each : kExamples) {
    if (each.command == name) examples.push_back(each.example);
  }
  return examples;
}

}  // namespace lensd::cli
