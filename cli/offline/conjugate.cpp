// lensctl conjugate: where the thin lens images a point.

#include <CLI/CLI.hpp>
#include <array>
#include <memory>

#include "cli/commands.h"
#include "cli/exact_lens.h"
#include "cli/lens_options.h"
#include "cli/text.h"
#include "proto/json.h"

namespace lensd::cli {
namespace {

struct ConjugateText {
  std::string focal_length;
  std::string point;
};

using ExactPoint = std::array<Decimal, 4>;

std::vector<std::string> SplitAtCommas(const std::string& text) {
  std::vector<std::string> parts(1);
  for (const char character : text) {
    if (character == ',') {
      parts.emplace_back();
    } else {
      parts.back() += character;
    }
  }
  return parts;
}

/// `X,Y,Z` as lengths, Z may be inf; or `X,Y,Z,W` as plain numbers in metres.
Result<ExactPoint> ParsePoint(const std::string& text) {
  const auto parts = SplitAtCommas(text);
  if (parts.size() != 3 && parts.size() != 4) {
    return Fail(Code::InvalidArgument,
                "--point '" + text + "': write three lengths X,Y,Z such as 0mm,10mm,2m, or four plain numbers X,Y,Z,W");
  }
  ExactPoint point{Decimal(), Decimal(), Decimal(), Decimal(1, 0)};
  const bool at_infinity = parts.size() == 3 && parts[2] == "inf";
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (at_infinity && i == 2) continue;
    auto number = parts.size() == 4 ? ParseNumber(parts[i], "--point") : ParseExactLength(parts[i], "--point");
    if (!number) return PassOn(std::move(number));
    point[i] = *std::move(number);
  }
  // From infinity a finite X and Y make no difference: the direction is along the axis.
  if (at_infinity) return ExactPoint{Decimal(), Decimal(), Decimal(1, 0), Decimal()};
  if (point[0].IsZero() && point[1].IsZero() && point[2].IsZero() && point[3].IsZero()) {
    return Fail(Code::InvalidArgument, "--point '" + text + "': 0,0,0,0 is no point");
  }
  return point;
}

Outcome RunConjugate(const ConjugateText& text, Session& session) {
  const auto f = ParseFocalLength(text.focal_length);
  if (!f) return Refuse(f);
  const auto object = ParsePoint(text.point);
  if (!object) return Refuse(object);
  if (session.globals().from.value_or(From::Lens) != From::Lens) {
    return Refuse(Exit::Usage, "conjugate works with points from the lens centre; leave --from out");
  }
  // M p, each entry exact before it is rounded.
  const auto& [x, y, z, w] = *object;
  const ExactPoint image{*f * x, *f * y, *f * z, z - *f * w};
  std::array<double, 4> point{};
  std::array<double, 3> image_mm{};
  const bool finite = !image[3].IsZero();
  for (std::size_t i = 0; i < 4; ++i) {
    const auto value = Ratio{image[i]}.Value();
    if (!value) return Refuse(value);
    point[i] = *value;
    if (i == 3 || !finite) continue;
    const auto millimetres = Ratio{image[i] * Decimal(1, 3), image[3]}.Value();
    if (!millimetres) return Refuse(millimetres);
    image_mm[i] = *millimetres;
  }
  if (session.json()) {
    session.PrintJson({{"point", point}, {"imageMm", finite ? proto::Json(image_mm) : proto::Json(nullptr)}});
    return Exit::Done;
  }
  if (!finite) {
    session.PrintText("image at infinity, in direction (" + Short(point[0]) + ", " + Short(point[1]) + ", " +
                      Short(point[2]) + ")");
    return Exit::Done;
  }
  session.PrintText((image_mm[2] < 0.0 ? "virtual image at (" : "image at (") + Short(image_mm[0], 6) + ", " +
                    Short(image_mm[1], 6) + ", " + Short(image_mm[2], 6) +
                    ") mm behind the lens centre, axes opposite to the object's");
  return Exit::Done;
}

}  // namespace

void AddConjugate(CLI::App& root, Run& run) {
  auto text = std::make_shared<ConjugateText>();
  CLI::App* command = root.add_subcommand("conjugate", "where a thin lens images a point")->group(kOffline);
  command->add_option("--focal-length", text->focal_length, "focal length, such as 50mm")->required()->type_name("F");
  command
      ->add_option("--point", text->point,
                   "X,Y,Z as lengths from the lens centre (Z may be inf), or X,Y,Z,W as plain numbers in metres")
      ->required()
      ->type_name("POINT");
  command->callback([text, &run] { run = [text](Session& session) { return RunConjugate(*text, session); }; });
}

}  // namespace lensd::cli
