#include "cli/offline/lens_options.h"

#include "cli/text.h"
#include "optics/focus_scale.h"

namespace lensd::cli {
namespace {

optics::FocusScale ScaleFrom(From from) {
  optics::FocusScale scale;
  if (from == From::Sensor) scale.from = optics::DistanceFrom::Sensor;
  if (from == From::Front) scale.from = optics::DistanceFrom::Front;
  return scale;
}

Result<Depth> AsDepth(const Result<optics::ObjectDepth>& place) {
  if (!place) return std::unexpected(place.error());
  const auto distance = place->distance();
  return distance ? Depth::Distance(distance->value) : Depth{};
}

}  // namespace

Result<Decimal> ParseFocalLength(const std::string& text) {
  return ParsePositiveLength(text, "--focal-length");
}

Result<Depth> FocusFromCentre(const Decimal& focal_length, const Depth& focus, std::optional<From> from) {
  const Metres f{focal_length.Nearest().value()};
  Depth centred = focus;
  if (focus.IsDistance() && from.value_or(From::Lens) != From::Lens) {
    auto place = AsDepth(optics::DepthInFocus(ScaleFrom(*from), f, Metres{focus.value}));
    if (!place) return place;
    centred = *place;
  }
  if (ExtensionFocusedAt(focal_length, centred)) return centred;
  return Fail(Code::OutOfRange, "cannot focus at " + DepthText(centred.Vergence()) +
                                    ", at or inside the focal length: the closest focus is just beyond " +
                                    LengthText(f) + " from the lens centre");
}

Result<Depth> ObjectFromCentre(const Decimal& focal_length, Metres extension, const Depth& object,
                               std::optional<From> from) {
  if (!object.IsDistance() || from.value_or(From::Lens) == From::Lens) return object;
  const Metres f{focal_length.Nearest().value()};
  return AsDepth(optics::DepthAt(ScaleFrom(*from), f, extension, Metres{object.value}));
}

}  // namespace lensd::cli
