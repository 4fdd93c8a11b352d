// Exact numbers of the command line, and distances from where they were measured.
#include "cli/lens_options.h"

#include "cli/text/text.h"
#include "optics/conjugates.h"

namespace lensd::cli {
namespace {

Result<Depth> AsDepth(const Result<optics::ObjectDepth>& place) {
  if (!place) return PassOn(place);
  const auto distance = place->distance();
  return distance ? Depth::Distance(distance->value) : Depth{};
}

}  // namespace

Place PlaceOf(const Depth& depth) {
  const Rational exact = depth.exact.ToRational();
  return depth.IsDistance() ? Place{exact, 1} : Place{1, exact};
}

Result<double> Rounded(const Rational& exact) {
  const auto nearest = optics::Nearest(exact);
  if (!nearest) return Fail(Code::OutOfRange, "the answer is too large or too small to represent");
  return *nearest;
}

optics::FocusScale ScaleOf(std::optional<From> from, Metres principal_gap) {
  optics::FocusScale scale;
  scale.principal_gap = principal_gap;
  if (from == From::Sensor) scale.from = optics::DistanceFrom::Sensor;
  if (from == From::Front) scale.from = optics::DistanceFrom::Front;
  return scale;
}

Result<Decimal> ParseFocalLength(const std::string& text) {
  return ParsePositiveLength(text, "--focal-length");
}

Result<Depth> FocusFromCentre(const Decimal& focal_length, const Depth& focus, const optics::FocusScale& scale,
                              std::optional<Metres> longest_extension) {
  const Metres f{focal_length.Nearest().value()};
  Depth centred = focus;
  if (focus.IsDistance() && scale.from != optics::DistanceFrom::Lens) {
    auto place = AsDepth(optics::DepthInFocus(scale, f, Metres{focus.value}));
    if (!place) return place;
    centred = *place;
  }
  if (optics::thin_lens::BeyondFocalPoint(focal_length.ToRational(), PlaceOf(centred)) > 0) return centred;
  const auto closest = longest_extension ? optics::FocalPlaneDistance(f, *longest_extension) : std::nullopt;
  return Fail(Code::OutOfRange, "cannot focus at " + DepthText(centred.Vergence()) +
                                    ", at or inside the focal length: the closest focus is " +
                                    (closest ? LengthText(*closest, 6) : "just beyond " + LengthText(f, 6)) +
                                    " from the lens centre");
}

Result<Depth> ObjectFromCentre(const Decimal& focal_length, Metres extension, const Depth& object,
                               const optics::FocusScale& scale) {
  if (!object.IsDistance() || scale.from == optics::DistanceFrom::Lens) return object;
  const Metres f{focal_length.Nearest().value()};
  return AsDepth(optics::DepthAt(scale, f, extension, Metres{object.value}));
}

}  // namespace lensd::cli
