// lensctl dof: depth of field and hyperfocal distance.

#include <CLI/CLI.hpp>
#include <memory>

#include "cli/commands.h"
#include "cli/lens_options.h"
#include "cli/text.h"
#include "varlink/json.h"

namespace lensd::cli {
namespace {

struct DofText {
  std::string focal_length, f_number, focus, blur_limit, pixel;
};

struct DofInput {
  Decimal focal_length, f_number, blur_limit;
  Depth focus;
};

Result<DofInput> Parse(const DofText& text, std::optional<From> from) {
  DofInput input;
  auto f = ParseFocalLength(text.focal_length);
  if (!f) return PassOn(f);
  auto n = ParseFNumber(text.f_number, "--f-number");
  if (!n) return PassOn(n);
  std::optional<Decimal> pixel;
  if (!text.pixel.empty()) {
    auto pitch = ParsePositiveLength(text.pixel, "--pixel");
    if (!pitch) return PassOn(pitch);
    pixel = *pitch;
  }
  auto limit = ParseBlurLimit(text.blur_limit, pixel, "--blur-limit");
  if (!limit) return PassOn(limit);
  const auto focus = ParseDepth(text.focus, "--focus");
  if (!focus) return PassOn(focus);
  if (focus->value < 0.0) {
    return Fail(Code::InvalidArgument,
                "--focus '" + text.focus + "': past infinity nothing real is in focus; write inf");
  }
  auto centred = FocusFromCentre(*f, *focus, ScaleOf(from));
  if (!centred) return PassOn(centred);
  return DofInput{*f, *n, *limit, *centred};
}

Outcome RunDof(const DofText& text, Session& session) {
  const auto input = Parse(text, session.globals().from);
  if (!input) return PassOn(input);
  const Rational f = input->focal_length.ToRational(), n = input->f_number.ToRational();
  const Rational limit = input->blur_limit.ToRational();
  const auto sharp = optics::thin_lens::DepthOfField(f, n, limit, PlaceOf(input->focus));
  const auto hyperfocal = Rounded(optics::thin_lens::Hyperfocal(f, n, limit));
  const bool to_infinity = !(sharp.far > 0);
  const auto near_d = Rounded(sharp.near), near_m = Rounded(1 / sharp.near);
  const auto far_d = to_infinity ? Result<double>(0.0) : Rounded(sharp.far);
  const auto far_m = to_infinity ? Result<double>(0.0) : Rounded(1 / sharp.far);
  for (const auto* value : {&hyperfocal, &near_d, &near_m, &far_d, &far_m}) {
    if (!*value) return PassOn(*value);
  }
  if (session.json()) {
    session.PrintJson({{"nearM", *near_m},
                       {"farM", to_infinity ? varlink::Json(nullptr) : varlink::Json(*far_m)},
                       {"nearD", *near_d},
                       {"farD", *far_d},
                       {"hyperfocalM", *hyperfocal}});
    return Exit::Done;
  }
  session.PrintText(TableText({{"sharp from", DepthText({*near_d})},
                               {"to", DepthText({*far_d})},
                               {"hyperfocal", DistanceText({*hyperfocal})}}));
  return Exit::Done;
}

}  // namespace

void AddDof(CLI::App& root, Run& run) {
  auto text = std::make_shared<DofText>();
  CLI::App* command = root.add_subcommand("dof", "depth of field and hyperfocal distance")->group(kOffline);
  command->add_option("--focal-length", text->focal_length, "focal length, such as 50mm")->required()->type_name("F");
  command->add_option("--f-number", text->f_number, "f-number, such as 2.8 or f/2.8")->required()->type_name("N");
  command->add_option("--focus", text->focus, "distance or vergence in focus: 2m, 0.5D, inf")
      ->required()
      ->type_name("D");
  command->add_option("--blur-limit", text->blur_limit, "blur diameter that still counts as sharp: 8um, or 1px")
      ->required()
      ->type_name("C");
  command->add_option("--pixel", text->pixel, "size of a pixel, for a limit in px")->type_name("LENGTH");
  command->callback([text, &run] { run = [text](Session& session) { return RunDof(*text, session); }; });
}

}  // namespace lensd::cli
