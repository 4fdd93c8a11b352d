// Plans as JSON: what is sent is what arrives, decimal for decimal, and nothing that is not a number gets out.
#include "proto/plan_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace lensd::proto {
namespace {

using varlink::Document;
using varlink::Json;
using varlink::WriteJson;

using optics::Number;
using optics::PlanDepth;
using optics::PlanRequest;
using ::testing::HasSubstr;

/// A decimal of `digits` digits as a person would type it, and its nearest double.
Number Typed(std::mt19937_64& random, int digits, int exponent) {
  std::string text = std::to_string(random() % 9 + 1) + ".";
  for (int i = 1; i < digits; ++i) text += static_cast<char>('0' + random() % 10);
  text += "e" + std::to_string(exponent);
  return {std::stod(text), text};
}

/// The decimal a reader of the far side works with: the shortest one, as its double.
void ExpectSame(const Number& sent, const Number& arrived, const char* what) {
  EXPECT_EQ(sent.value, arrived.value) << what;
  const double from_decimal = arrived.decimal.empty() ? arrived.value : std::stod(arrived.decimal);
  EXPECT_EQ(sent.value, from_decimal) << what << " " << arrived.decimal;
}

PlanRequest RandomRequest(std::mt19937_64& random) {
  constexpr int kDigits = 14;
  PlanRequest request;
  request.focal_length = Typed(random, kDigits, -2);
  request.f_numbers = {Typed(random, kDigits, 0), Typed(random, kDigits, 1)};
  request.extensions = {Typed(random, kDigits, -4), Typed(random, kDigits, -3)};
  request.apertures_are_diameters = random() % 2 == 0;
  request.stops = {Typed(random, kDigits, 0), Typed(random, kDigits, 0)};
  request.focus = random() % 2 == 0 ? PlanDepth::Distance(Typed(random, kDigits, 0))
                                    : PlanDepth::Vergence(Typed(random, kDigits, -1));
  request.sensor_tolerance = Typed(random, kDigits, -6);
  request.f_number_tolerance = Typed(random, kDigits, -2);
  request.wavelength = Typed(random, kDigits, -7);
  request.diffraction = optics::DiffractionConvention::Mtf50;
  request.pupil_factor = Typed(random, kDigits, 0);
  request.objective = optics::Objective::Depth;
  request.depth_limit = Typed(random, kDigits, -6);
  request.pixel = Metres{3.45e-6};
  request.model_tolerance = Metres{1.25e-7};
  request.limits.push_back({.name = "face",
                            .kind = optics::LimitKind::Sharp,
                            .depths = {{PlanDepth::Distance(Typed(random, kDigits, 0)), PlanDepth::Vergence(0.0)}},
                            .limit = Typed(random, kDigits, -6)});
  request.limits.push_back({.name = "wall",
                            .kind = optics::LimitKind::Blurred,
                            .depths = {{PlanDepth::Vergence(0.2), PlanDepth::Vergence(0.1)},
                                       {PlanDepth::Vergence(Typed(random, kDigits, 0)), PlanDepth::Vergence(1.0)}},
                            .limit = Typed(random, kDigits, -5),
                            .side = optics::Side::Front});
  return request;
}

TEST(PlanRequestJson, ArrivesAsItLeft) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 500; ++i) {
    const PlanRequest sent = RandomRequest(random);
    const Document text = Document::Parse(WriteJson(PlanRequestJson(sent))).value();
    const auto arrived = PlanRequestFromJson(text.root(), PlanRequest{});
    ASSERT_TRUE(arrived) << arrived.error().message;
    ExpectSame(sent.focal_length, arrived->focal_length, "focal length");
    ExpectSame(sent.f_numbers.low, arrived->f_numbers.low, "f-number");
    ExpectSame(sent.f_numbers.high, arrived->f_numbers.high, "f-number");
    ExpectSame(sent.extensions.low, arrived->extensions.low, "extension");
    ExpectSame(sent.extensions.high, arrived->extensions.high, "extension");
    EXPECT_EQ(sent.apertures_are_diameters, arrived->apertures_are_diameters);
    ASSERT_EQ(sent.stops.size(), arrived->stops.size());
    ExpectSame(sent.stops[1], arrived->stops[1], "stop");
    EXPECT_EQ(sent.focus->is_vergence, arrived->focus->is_vergence);
    ExpectSame(sent.focus->number, arrived->focus->number, "focus");
    ExpectSame(sent.sensor_tolerance, arrived->sensor_tolerance, "sensor tolerance");
    ExpectSame(sent.f_number_tolerance, arrived->f_number_tolerance, "f-number tolerance");
    ExpectSame(*sent.wavelength, *arrived->wavelength, "wavelength");
    EXPECT_EQ(sent.diffraction, arrived->diffraction);
    ExpectSame(sent.pupil_factor, arrived->pupil_factor, "pupil factor");
    EXPECT_EQ(sent.objective, arrived->objective);
    ExpectSame(*sent.depth_limit, *arrived->depth_limit, "depth limit");
    EXPECT_EQ(sent.pixel, arrived->pixel);
    EXPECT_EQ(sent.model_tolerance, arrived->model_tolerance);
    ASSERT_EQ(arrived->limits.size(), 2u);
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_EQ(sent.limits[k].name, arrived->limits[k].name);
      EXPECT_EQ(sent.limits[k].kind, arrived->limits[k].kind);
      EXPECT_EQ(sent.limits[k].side, arrived->limits[k].side);
      ExpectSame(sent.limits[k].limit, arrived->limits[k].limit, "limit");
      ASSERT_EQ(sent.limits[k].depths.size(), arrived->limits[k].depths.size());
      ExpectSame(sent.limits[k].depths.back().one_end.number, arrived->limits[k].depths.back().one_end.number, "depth");
      EXPECT_EQ(sent.limits[k].depths[0].one_end.is_vergence, arrived->limits[k].depths[0].one_end.is_vergence);
    }
  }
}

TEST(PlanRequestJson, WhatIsLeftOutComesFromTheLens) {
  PlanRequest lens;
  lens.focal_length = 0.05;
  lens.f_numbers = {1.4, 22.0};
  lens.extensions = {0.0, 0.008};
  lens.sensor_tolerance = 2e-6;
  lens.limits.push_back({.name = "of the defaults", .depths = {}, .limit = 1.0});
  const Document text = Document::Parse(R"({"apertureMin": 2.8, "focus": null})").value();
  const auto request = PlanRequestFromJson(text.root(), lens);
  ASSERT_TRUE(request);
  EXPECT_EQ(request->focal_length.value, 0.05);
  EXPECT_EQ(request->f_numbers.low.value, 2.8);
  EXPECT_EQ(request->f_numbers.high.value, 22.0);
  EXPECT_EQ(request->sensor_tolerance.value, 2e-6);
  EXPECT_FALSE(request->focus);
  EXPECT_TRUE(request->limits.empty());
}

TEST(PlanRequestJson, NamesTheFieldThatIsWrong) {
  const auto complaint = [](const char* json) {
    const Document text = Document::Parse(json).value();
    const auto request = PlanRequestFromJson(text.root(), PlanRequest{});
    return request ? "accepted" : request.error().message;
  };
  EXPECT_THAT(complaint("[]"), HasSubstr("object"));
  EXPECT_THAT(complaint(R"({"focalLengthMm": "50"})"), HasSubstr("focalLengthMm"));
  EXPECT_THAT(complaint(R"({"objective": "best"})"), HasSubstr("light, sharp, depth"));
  EXPECT_THAT(complaint(R"({"focus": {}})"), HasSubstr("either distanceM or vergenceD"));
  EXPECT_THAT(complaint(R"({"focus": {"distanceM": 1, "vergenceD": 1}})"), HasSubstr("either"));
  EXPECT_THAT(complaint(R"({"limits": {}})"), HasSubstr("limits"));
  EXPECT_THAT(complaint(R"({"limits": [3]})"), HasSubstr("limits[0]"));
  EXPECT_THAT(complaint(R"({"limits": [{"kind": "sharp", "limitUm": 1}]})"), HasSubstr("limits[0]: needs depths"));
  EXPECT_THAT(complaint(R"({"limits": [{"kind": "sharp", "limitUm": 1, "depths": [{}]}]})"),
              HasSubstr("limits[0].depths[0]"));
  EXPECT_THAT(complaint(R"({"stops": 3})"), HasSubstr("stops"));
}

TEST(PlanAnswerJson, HasNoNumberThatIsNone) {
  optics::PlanAnswer answer;
  answer.feasible = true;
  answer.f_number = FNumber{2.0};
  answer.focal_plane = Dioptres{-0.1};
  answer.model_error = Metres{std::numeric_limits<double>::infinity()};
  answer.worst_ratio = std::nan("");
  const Json json = PlanAnswerJson({}, answer);
  EXPECT_EQ(json["focalPlaneD"], -0.1);
  for (const char* field : {"focalPlaneM", "focusFromSensorM", "modelErrorUm", "worstRatio"}) {
    EXPECT_TRUE(json[field].is_null()) << field;
  }
  EXPECT_FALSE(json.contains("conflict"));
  answer.feasible = false;
  answer.conflict = {"focus", "extension"};
  const Json infeasible = PlanAnswerJson({}, answer);
  EXPECT_EQ(infeasible.size(), 4u);
  EXPECT_TRUE(infeasible["causes"].empty());
  EXPECT_EQ(infeasible["conflict"].size(), 2u);
  EXPECT_TRUE(infeasible["relax"].is_null());
}

}  // namespace
}  // namespace lensd::proto
