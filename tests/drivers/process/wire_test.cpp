// What is written agrees with the interface and reads back to what it was; what is wrong is refused.
#include <limits>
#include <random>

#include "drivers/wire/wire.h"
#include "odd_device.h"
#include "proto/driver_interface.h"
#include "test_level.h"
#include "varlink/interface_definition.h"

namespace lensd::drivers::wire {
namespace {

/// Draws what a driver may say of a device.
class Drawn {
 public:
  explicit Drawn(unsigned seed) : random_(seed) {}

  bool Flag() { return Below(2) == 1; }
  int Below(int end) { return std::uniform_int_distribution(0, end - 1)(random_); }
  double Number() {
    constexpr double kOdd[] = {0.0, 1.0, -1.0, 0.1, 1e-9, 1e9, 123456.789};
    return Flag() ? kOdd[Below(7)] : std::uniform_real_distribution(-1e6, 1e6)(random_);
  }
  std::string Text() {
    constexpr const char* kOdd[] = {"a", "Größe", "\"quoted\" \\ / ~", "tab\tand newline\n", "x/y~z"};
    return kOdd[Below(5)];
  }

  Settings Tree(int depth) {
    const Location where{.file = "a:b.toml", .line = Below(5)};
    switch (depth > 0 ? Below(6) : 2 + Below(4)) {
      case 0: {
        Settings::Table table;
        for (int i = Below(4); i >= 0; --i) table.emplace(Text() + std::to_string(i), Tree(depth - 1));
        return Settings(Settings::Value(std::in_place_type<Settings::Table>, std::move(table)), where);
      }
      case 1: {
        Settings::Array array;
        for (int i = Below(4); i > 0; --i) array.push_back(Tree(depth - 1));
        return Settings(Settings::Value(std::in_place_type<Settings::Array>, std::move(array)), where);
      }
      case 2:
        return Settings(Flag(), where);
      case 3:
        return Settings(std::int64_t{Below(2) - 1} * std::numeric_limits<std::int64_t>::max() + Below(9), where);
      case 4:
        return Settings(Number(), where);
      default:
        return Settings(Text(), where);
    }
  }

  AxisCapabilities Axis(bool focus) {
    AxisCapabilities can;
    can.unit = static_cast<NativeUnit>(Below(5));
    can.minimum = Native{Number()};
    can.maximum = can.minimum + Native{1.0 + std::abs(Number())};
    can.resolution = 0.25;
    if (Flag()) can.counts = {can.minimum - Native{5.0}, can.maximum + Native{5.0}};
    can.feedback = static_cast<Feedback>(Below(4));
    can.can_home = Flag();
    can.needs_home = can.can_home && Flag();
    can.can_stop = Flag();
    if (Flag()) can.speed = std::abs(Number());
    if (Flag()) can.settle = std::chrono::microseconds(Below(1'000'000));
    if (Flag()) can.backlash = std::abs(Number());
    if (Flag()) can.lost_travel = 0.5;
    if (focus && Flag()) can.direction = KnownDirection{static_cast<Direction>(Below(2)), "the maker"};
    return can;
  }

  Capabilities Lens() {
    Capabilities can{.driver = "odd", .model = Text(), .serial = Flag() ? Text() : "", .axes = {}};
    for (const drivers::Axis axis : kAxes) {
      if (Flag()) can.axes[axis] = Axis(axis == drivers::Axis::Focus);
    }
    return can;
  }

  LensState State(const Capabilities& can, Instant now) {
    LensState state;
    state.sampled_at = now - std::chrono::nanoseconds(Below(1'000'000));
    for (const drivers::Axis axis : kAxes) {
      if (!can.axes[axis]) continue;
      state.axes[axis] = AxisState{.position = Native{Number()},
                                   .moving = Flag(),
                                   .homed = Flag(),
                                   .assumed = Flag(),
                                   .waiting = Flag(),
                                   .fault = Flag() ? Text() : ""};
    }
    if (Flag()) state.temperature = Celsius{20.25};
    return state;
  }

 private:
  std::mt19937 random_;
};

void ExpectEqual(const Settings& one, const Settings& other) {
  ASSERT_EQ(one.value().index(), other.value().index());
  EXPECT_EQ(one.where().Text(), other.where().Text());
  if (const auto* table = one.AsTable()) {
    ASSERT_EQ(table->size(), other.AsTable()->size());
    for (const auto& [key, value] : *table) {
      ASSERT_TRUE(other.AsTable()->contains(key));
      ExpectEqual(value, other.AsTable()->at(key));
    }
  } else if (const auto* array = one.AsArray()) {
    ASSERT_EQ(array->size(), other.AsArray()->size());
    for (std::size_t i = 0; i < array->size(); ++i) ExpectEqual((*array)[i], (*other.AsArray())[i]);
  } else if (const auto* number = std::get_if<double>(&one.value())) {
    EXPECT_EQ(*number, std::get<double>(other.value()));
  } else if (const auto* whole = std::get_if<std::int64_t>(&one.value())) {
    EXPECT_EQ(*whole, std::get<std::int64_t>(other.value()));
  } else if (const auto* text = std::get_if<std::string>(&one.value())) {
    EXPECT_EQ(*text, std::get<std::string>(other.value()));
  } else {
    EXPECT_EQ(std::get<bool>(one.value()), std::get<bool>(other.value()));
  }
}

class Bare final : public drivers::Lens {
 public:
  explicit Bare(Capabilities can) : Lens(std::move(can)) {}

 private:
  Result<void> DoStartHome(Axis) override { return {}; }
  Result<void> DoStartMove(Axis, Native) override { return {}; }
  Result<LensState> DoRead() override { return LensState{}; }
  Result<void> DoStop(Axis) override { return {}; }
};

/// As it comes out of the other end of a connection.
Json Sent(const Json& json) {
  return *varlink::ParseJson(varlink::WriteJson(json));
}

std::string WrongIn(const Json& json, const char* method) {
  static const auto definition = *varlink::InterfaceDefinition::Parse(proto::DriverInterfaceText());
  const auto document = *varlink::Document::Parse(varlink::WriteJson(json));
  return definition.FirstWrong(*definition.methods().at(method).output, document.root()).value_or("");
}

long Draws() {
  return testing::ByLevel(200, 1000, 1'000'000);
}

}  // namespace

TEST(Wire, TheInterfaceIsOne) {
  const auto definition = varlink::InterfaceDefinition::Parse(proto::DriverInterfaceText());
  ASSERT_TRUE(definition.has_value()) << definition.error().message;
  EXPECT_EQ(definition->name(), proto::kDriverInterface);
}

TEST(Wire, SettingsKeepValuesKindsAndPlaces) {
  for (long i = 0; i < Draws(); ++i) {
    Drawn drawn(static_cast<unsigned>(i));
    Settings::Table table;
    for (int k = drawn.Below(5); k > 0; --k) table.emplace("key" + std::to_string(k), drawn.Tree(4));
    const Settings settings(Settings::Value(std::in_place_type<Settings::Table>, std::move(table)), {"a.toml", 3});
    const auto json = SettingsJson(settings);
    ASSERT_TRUE(json.has_value());
    const auto back = SettingsFrom(Sent(json->values), Sent(json->places));
    ASSERT_TRUE(back.has_value()) << back.error().message;
    ASSERT_NO_FATAL_FAILURE(ExpectEqual(settings, *back));
  }
  const Settings infinite(std::numeric_limits<double>::infinity(), {"a.toml", 3});
  EXPECT_EQ(SettingsJson(infinite).error().message, "a.toml:3: this number must be finite");
}

TEST(Wire, DescriptionsAndReadingsReadBackToWhatTheyWere) {
  for (long i = 0; i < Draws(); ++i) {
    Drawn drawn(static_cast<unsigned>(i));
    const Capabilities can = drawn.Lens();
    Device device;
    device.lens = std::make_unique<Bare>(can);
    const Json json = Sent(DescriptionJson(device));
    ASSERT_EQ(WrongIn(json, "Describe"), "") << json.dump();
    const auto back = DescriptionFrom(json, "odd");
    ASSERT_TRUE(back.has_value()) << back.error().message << json.dump();
    Device again;
    again.lens = std::make_unique<Bare>(*back->lens);
    ASSERT_EQ(Sent(DescriptionJson(again)), json);
    EXPECT_EQ(back->lens->model, can.model);
    for (const Axis axis : kAxes) {
      ASSERT_EQ(back->lens->axes[axis].has_value(), can.axes[axis].has_value());
      if (can.axes[axis]) {
        EXPECT_EQ(back->lens->axes[axis]->settle, can.axes[axis]->settle);
      }
    }
    const Instant now{std::chrono::hours(5000)};
    const LensState state = drawn.State(can, now);
    const Json reading = Sent(StateJson(state));
    ASSERT_EQ(WrongIn(reading, "Read"), "") << reading.dump();
    const auto read = StateFrom(reading, can, now);
    ASSERT_TRUE(read.has_value()) << read.error().message;
    EXPECT_EQ(read->sampled_at, state.sampled_at);
    EXPECT_EQ(read->temperature, state.temperature);
    EXPECT_EQ(Sent(StateJson(*read)), reading);
  }
}

TEST(Wire, NoReadingIsOfTheFutureOrLacksAnAxis) {
  Capabilities can;
  can.axes[Axis::Focus] = AxisCapabilities{.maximum = Native{10.0}};
  const Instant now{std::chrono::seconds(10)};
  const Json focus{{"axis", "focus"}, {"position", 1.5}, {"moving", false}};
  const auto late = StateFrom({{"sampledAtNs", 99'000'000'000}, {"axes", {focus}}}, can, now);
  ASSERT_TRUE(late.has_value()) << late.error().message;
  EXPECT_EQ(late->sampled_at, now);
  EXPECT_EQ(StateFrom({{"axes", Json::array({focus})}}, can, now)->sampled_at, now);
  EXPECT_EQ(StateFrom({{"axes", Json::array()}}, can, now).error().code, Code::Protocol);
  EXPECT_EQ(StateFrom(Json::object(), can, now).error().code, Code::Protocol);
}

/// Whatever a driver says: what is taken keeps what drivers/api promises.
TEST(Wire, ChangedDescriptionsAreRefusedOrHoldAllTheSame) {
  const Json odd[] = {nullptr, true, -1, 0, 1e300, -1e300, 65536, "focus", "", Json::array(), Json::object(), 0.5};
  for (long i = 0; i < Draws(); ++i) {
    Drawn drawn(static_cast<unsigned>(i));
    Device device;
    device.lens = std::make_unique<Bare>(drawn.Lens());
    Json json = Sent(DescriptionJson(device));
    json["camera"] = {{"model", "c"},
                      {"widthPx", 640},
                      {"heightPx", 480},
                      {"bits", 12},
                      {"gain", {{"lowest", 0}, {"highest", 24}, {"unit", "decibels"}}},
                      {"focusRegion", {{"x", 0.25}, {"y", 0.25}, {"width", 0.5}, {"height", 0.5}}}};
    json = json.flatten();
    for (int changes = 1 + drawn.Below(3); changes > 0; --changes) {
      auto at = json.begin();
      std::advance(at, drawn.Below(static_cast<int>(json.size())));
      const Json& value = odd[drawn.Below(12)];
      if (value.is_primitive()) *at = value;
    }
    const auto read = DescriptionFrom(json.unflatten(), "odd");
    if (!read) {
      EXPECT_EQ(read.error().code, Code::Protocol);
      continue;
    }
    for (const Axis axis : kAxes) {
      if (!read->lens || !read->lens->axes[axis]) continue;
      const AxisCapabilities& can = *read->lens->axes[axis];
      EXPECT_TRUE(std::isfinite(can.minimum.value) && can.minimum < can.maximum && can.resolution > 0.0);
      EXPECT_TRUE(can.lowest_count() < can.highest_count() && can.speed >= 0.0 && can.settle >= Duration::zero());
      EXPECT_TRUE(can.can_home || !can.needs_home);
    }
    if (!read->camera) continue;
    const CameraCapabilities& can = *read->camera;
    EXPECT_TRUE(can.width > 0 && can.width < 65536 && can.height > 0 && can.height < 65536);
    EXPECT_TRUE(can.bits >= 8 && can.bits <= 16);
    EXPECT_TRUE(!can.gain || can.gain->lowest <= can.gain->highest);
    const Region& region = can.focus_region;
    EXPECT_TRUE(region.x >= 0.0 && region.width > 0.0 && region.x + region.width <= 1.0);
    EXPECT_TRUE(region.y >= 0.0 && region.height > 0.0 && region.y + region.height <= 1.0);
  }
}

TEST(Wire, FramesAreOfTheSizeThatWasDescribed) {
  const CameraCapabilities can{
      .driver = "odd", .model = "c", .serial = {}, .width = 64, .height = 48, .bits = 10, .focus_region = {}};
  const Instant now{std::chrono::seconds(10)};
  const Json good{{"widthPx", 64}, {"heightPx", 48},         {"bits", 10},
                  {"sequence", 5}, {"exposureStartNs", 100}, {"exposureEndNs", 20'000'000'000}};
  const auto frame = FrameFrom(good, can, now);
  ASSERT_TRUE(frame.has_value()) << frame.error().message;
  EXPECT_EQ(frame->exposure_end, now);
  for (const char* field : {"widthPx", "heightPx", "bits", "sequence", "exposureStartNs", "exposureEndNs"}) {
    for (const Json& wrong : {Json(-1), Json(65), Json(nullptr), Json("64"), Json(64.5)}) {
      Json bad = good;
      bad[field] = wrong;
      const bool counts = std::string(field) == "sequence" || std::string(field) == "exposureStartNs";
      if (wrong == 65 && counts) continue;
      EXPECT_FALSE(FrameFrom(bad, can, now).has_value()) << bad.dump();
    }
  }
}

}  // namespace lensd::drivers::wire
