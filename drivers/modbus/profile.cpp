// Profiles of drive families read from TOML: registers, word orders, sequences, alarms. Everything is checked here, so
// that the drive code may follow them blindly.
#include "profile.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <sstream>
#include <string_view>
#include <utility>

#include "base/settings_problems.h"

namespace lensd::drivers::modbus {
namespace {

constexpr Range kAddress{0, 0xFFFF};
constexpr std::array<std::pair<std::string_view, NumberType>, 4> kTypes = {
    {{"u16", NumberType::U16}, {"s16", NumberType::S16}, {"u32", NumberType::U32}, {"s32", NumberType::S32}}};

/// What no reader tells, of a place of the profile.
std::unexpected<Error> Wrong(const Settings& at, const std::string& why) {
  const std::string message = at.where().Text() + ": " + why;
  if (auto* problems = SettingsProblems::Current()) problems->Add(message);
  return Fail(Code::BadData, message);
}

/// For a check that wants every mistake the readers tell: all parts are read, and the first that failed is what is
/// answered.
template <class T>
void Keep(const Result<T>& read, Result<void>& first) {
  if (!read && first) first = PassOn(read);
}

std::optional<NumberType> TypeFromName(std::string_view name) {
  const auto found = std::ranges::find(kTypes, name, &std::pair<std::string_view, NumberType>::first);
  if (found == kTypes.end()) return std::nullopt;
  return found->second;
}

/// Decimal, or hexadecimal after 0x.
std::optional<std::int64_t> WholeNumber(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative) text.remove_prefix(1);
  const bool hexadecimal = text.starts_with("0x") || text.starts_with("0X");
  if (hexadecimal) text.remove_prefix(2);
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, hexadecimal ? 16 : 10);
  if (error != std::errc() || end != text.data() + text.size() || text.empty() || text[0] == '-') return std::nullopt;
  return negative ? -number : number;
}

NumberType ReadType(SettingsReader& read, NumberType fallback) {
  const auto name = read.OptionalText("type");
  if (!name) return fallback;
  const auto type = TypeFromName(*name);
  if (!type) read.Reject("type", "must be u16, s16, u32 or s32, not \"" + *name + "\"");
  return type.value_or(fallback);
}

std::uint16_t ReadAddress(SettingsReader& read) {
  if (!read.Has("address")) read.Reject("address", "is missing");
  return static_cast<std::uint16_t>(read.Integer("address", 0, kAddress));
}

Result<Place> ReadPlace(SettingsReader& read, NumberType fallback) {
  Place place;
  place.address = ReadAddress(read);
  place.type = ReadType(read, fallback);
  return place;
}

/// An integer is one register; "TYPE NUMBER" or "TYPE NAME" is a number of that type.
Result<Field> ReadField(const Settings& value, const Profile& profile) {
  const auto wrong = [&](const std::string& why) {
    return Wrong(value, "a value is a number of one register or \"TYPE WHAT\" such as \"s32 target\": " + why);
  };
  if (const auto* integer = std::get_if<std::int64_t>(&value.value())) {
    if (!Fits(NumberType::U16, *integer)) return wrong(std::to_string(*integer) + " does not fit");
    return Field{NumberType::U16, "", *integer};
  }
  const auto* text = std::get_if<std::string>(&value.value());
  const auto space = text == nullptr ? std::string::npos : text->find(' ');
  if (space == std::string::npos) return wrong("this is neither");
  const auto type = TypeFromName(std::string_view(*text).substr(0, space));
  if (!type) return wrong("types are u16, s16, u32 and s32");
  const std::string what = text->substr(space + 1);
  if (const auto number = WholeNumber(what)) {
    if (!Fits(*type, *number)) return wrong(what + " does not fit");
    return Field{*type, "", *number};
  }
  if (what == "target" || profile.parameters.contains(what)) return Field{*type, what, 0};
  return wrong("\"" + what + "\" is neither a number nor target nor one of [parameters]");
}

Result<WriteStep> ReadStep(const Settings& table, const std::string& what, const Profile& profile) {
  SettingsReader read(table, what);
  WriteStep step;
  step.address = ReadAddress(read);
  const Settings* values = read.Any("values");
  const auto* array = values == nullptr ? nullptr : values->AsArray();
  if (array == nullptr || array->empty()) read.Reject("values", "must be an array of what is written");
  const bool one_integer =
      array != nullptr && array->size() == 1 && std::holds_alternative<std::int64_t>(array->front().value());
  step.function = static_cast<int>(read.Integer("function", one_integer ? 6 : 16));
  if (step.function != 6 && step.function != 16) read.Reject("function", "must be 6 or 16");
  Result<void> first = read.Finish();
  int registers = 0;
  for (const Settings& value : array == nullptr ? Settings::Array() : *array) {
    auto field = ReadField(value, profile);
    Keep(field, first);
    if (!field) continue;
    registers += modbus::RegistersOf(field->type);
    step.fields.push_back(*std::move(field));
  }
  if (registers > (step.function == 6 ? 1 : 123)) {
    Keep(Result<void>(Wrong(table, what + " writes more registers than its function can")), first);
  }
  if (!first) return PassOn(first);
  return step;
}

Result<Sequence> ReadSequence(SettingsReader& read, std::string_view key, const Profile& profile) {
  Sequence sequence;
  Result<void> first;
  for (const Settings* table : read.Tables(key)) {
    auto step = ReadStep(*table, "[[" + std::string(key) + "]]", profile);
    Keep(step, first);
    if (step) sequence.push_back(*std::move(step));
  }
  if (!first) return PassOn(first);
  return sequence;
}

/// A bit of the status number, or { address, bit } of a register of its own.
Result<std::optional<Flag>> ReadFlag(SettingsReader& read, std::string_view key, std::optional<Place> status) {
  const Settings* value = read.Any(key);
  if (value == nullptr) return std::optional<Flag>();
  Flag flag;
  if (value->AsTable() != nullptr) {
    SettingsReader own(*value, "[status] " + std::string(key));
    auto place = status && !own.Has("address") ? Result<Place>(*status) : ReadPlace(own, NumberType::U16);
    flag.place = *place;
    const double bits = 16 * modbus::RegistersOf(flag.place.type);
    flag.bit = static_cast<int>(own.Integer("bit", 0, {0, bits - 1}));
    flag.inverted = own.Boolean("inverted", false);
    if (auto done = own.Finish(); !done) return PassOn(done);
    return std::optional(flag);
  }
  if (!status) read.Reject(key, "is a bit of a status number whose address is missing");
  flag.place = status.value_or(Place{});
  flag.bit = static_cast<int>(read.Integer(key, 0, {0, 16.0 * modbus::RegistersOf(flag.place.type) - 1}));
  return std::optional(flag);
}

Result<void> ReadStatus(const Settings& table, Profile& profile) {
  SettingsReader read(table, "[status]");
  std::optional<Place> status;
  if (read.Any("address") != nullptr) status = *ReadPlace(read, NumberType::U16);
  const std::pair<std::string_view, std::optional<Flag> Profile::*> flags[] = {
      {"moving", &Profile::moving}, {"ready", &Profile::ready}, {"in_position", &Profile::in_position},
      {"fault", &Profile::fault},   {"homed", &Profile::homed}, {"homing", &Profile::homing}};
  Result<void> first;
  for (const auto& [key, member] : flags) {
    auto flag = ReadFlag(read, key, status);
    Keep(flag, first);
    if (flag) profile.*member = *std::move(flag);
  }
  if (!read.Has("moving") && !read.Has("in_position")) read.Reject("moving", "is missing, and so is in_position");
  Keep(read.Finish(), first);
  return first;
}

Result<void> ReadAlarm(const Settings& table, Profile& profile) {
  SettingsReader read(table, "[alarm]");
  profile.alarm = *ReadPlace(read, NumberType::U16);
  profile.alarm_is_bits = read.Choice("kind", {"code", "bits"}, 0) == 1;
  profile.alarm_mask = read.Integer("mask", 0xFFFFFFFF, {0, 4294967295.0});
  if (read.Any("not_homed") != nullptr) profile.alarm_not_homed = read.Integer("not_homed", 0, {1, 4294967295.0});
  if (profile.alarm_not_homed && profile.alarm_is_bits) read.Reject("not_homed", "is for codes, and these are bits");
  const Settings* names = read.Table("names");
  Result<void> first = read.Finish();
  if (names == nullptr) return first;
  for (const auto& [key, value] : *names->AsTable()) {
    const auto code = WholeNumber(key);
    const auto* text = std::get_if<std::string>(&value.value());
    if (code && text != nullptr) {
      profile.alarm_names[*code] = *text;
    } else {
      Keep(Result<void>(Wrong(value, "[alarm.names] has lines such as 0x30 = \"overload\"")), first);
    }
  }
  return first;
}

Result<void> ReadParameters(const Settings& table, Profile& profile) {
  Result<void> first;
  for (const auto& [key, value] : *table.AsTable()) {
    const auto* number = std::get_if<std::int64_t>(&value.value());
    // Its name is known all the same: what refers to it is no second mistake.
    profile.parameters[key] = number == nullptr ? 0 : *number;
    if (number != nullptr && key != "target") continue;
    Keep(Result<void>(Wrong(value, "[parameters] has names and whole numbers, and none is target")), first);
  }
  return first;
}

Result<void> ReadSpeed(const Settings& table, Profile& profile) {
  SettingsReader read(table, "[speed]");
  profile.speed_parameter = read.RequiredText("parameter");
  profile.speed_counts_per_s = read.Number("counts_per_s", 0.0, kNonNegative);
  profile.speed_revolutions_per_s = read.Number("revolutions_per_s", 0.0, kNonNegative);
  if (!profile.parameters.contains(profile.speed_parameter)) read.Reject("parameter", "is not one of [parameters]");
  return read.Finish();
}

Result<void> ReadProbe(const Settings& table, Profile& profile) {
  SettingsReader read(table, "[probe]");
  profile.probe = Place{ReadAddress(read), NumberType::U16};
  profile.probe_count = static_cast<int>(read.Integer("count", 1, {1, 125}));
  profile.probe_step = static_cast<int>(read.Integer("step", 1, {1, 125}));
  return read.Finish();
}

Result<void> ReadPosition(const Settings& table, Profile& profile) {
  SettingsReader read(table, "[position]");
  profile.position = *ReadPlace(read, NumberType::S32);
  profile.position_scale = read.Number("scale", 1.0);
  if (profile.position_scale == 0.0) read.Reject("scale", "must not be 0");
  profile.feedback = ReadFeedback(read, profile.feedback);
  return read.Finish();
}

/// The parts that have a table each, in an order in which each finds what it refers to.
Result<void> ReadTables(SettingsReader& read, Profile& profile) {
  using Part = Result<void> (*)(const Settings&, Profile&);
  const std::pair<std::string_view, Part> parts[] = {{"parameters", ReadParameters}, {"status", ReadStatus},
                                                     {"position", ReadPosition},     {"alarm", ReadAlarm},
                                                     {"speed", ReadSpeed},           {"probe", ReadProbe}};
  Result<void> first;
  for (const auto& [key, part] : parts) {
    if (const Settings* table = read.Table(key)) Keep(part(*table, profile), first);
  }
  const std::pair<std::string_view, Sequence Profile::*> sequences[] = {
      {"move", &Profile::move},  {"rearm", &Profile::rearm},
      {"home", &Profile::home},  {"after_home", &Profile::after_home},
      {"stop", &Profile::stop},  {"release", &Profile::release},
      {"reset", &Profile::reset}};
  for (const auto& [key, member] : sequences) {
    auto sequence = ReadSequence(read, key, profile);
    Keep(sequence, first);
    if (sequence) profile.*member = *std::move(sequence);
  }
  return first;
}

}  // namespace

Feedback ReadFeedback(SettingsReader& read, Feedback fallback) {
  const std::vector<std::string_view> names(kFeedbackNames.begin(), kFeedbackNames.end());
  return static_cast<Feedback>(read.Choice("feedback", names, static_cast<std::size_t>(fallback)));
}

Result<Profile> ReadProfile(const Settings& table) {
  SettingsReader read(table, "the profile");
  Profile profile;
  if (read.Integer("version", 0) != 1) read.Reject("version", "must be 1");
  profile.name = read.RequiredText("name");
  profile.word_order =
      read.Choice("word_order", {"high-first", "low-first"}, 0) == 0 ? WordOrder::HighFirst : WordOrder::LowFirst;
  if (read.Any("parity") != nullptr) profile.parity = "NEO"[read.Choice("parity", {"none", "even", "odd"}, 0)];
  profile.gap = std::chrono::microseconds(std::llround(1e3 * read.Number("gap_ms", 0.0, {0.0, 100.0})));
  profile.read_function = static_cast<int>(read.Integer("read_function", 3, {3, 4}));
  profile.stop_to_retarget = read.Choice("retarget", {"stop-first", "direct"}, 0) == 0;
  profile.arrival_counts = read.Integer("arrival_counts", 2, {0, 1e6});
  profile.homing_required = read.Choice("homing", {"not-needed", "required"}, 0) == 1;
  Result<void> first = ReadTables(read, profile);
  for (const std::string_view needed : {"position", "status", "move"}) {
    if (!read.Has(needed)) read.Reject(needed, "is missing");
  }
  if (profile.homing_required && !read.Has("home")) read.Reject("homing", "is required, and [[home]] is missing");
  Keep(read.Finish(), first);
  if (!first) return PassOn(first);
  return profile;
}

Result<std::vector<std::uint16_t>> RegistersOf(const WriteStep& step, const Profile& profile, std::int64_t target) {
  std::vector<std::uint16_t> registers;
  for (const Field& field : step.fields) {
    std::int64_t number = field.number;
    if (field.name == "target") {
      number = target;
    } else if (!field.name.empty()) {
      number = profile.parameters.at(field.name);
    }
    if (!Fits(field.type, number)) {
      return Fail(Code::OutOfRange, field.name + " " + std::to_string(number) + " does not fit into its registers");
    }
    AppendNumber(registers, field.type, profile.word_order, number);
  }
  return registers;
}

std::string AlarmText(const Profile& profile, std::int64_t alarm) {
  alarm &= profile.alarm_mask;
  if (alarm == 0) return "";
  const auto name = [&](std::int64_t key) {
    const auto found = profile.alarm_names.find(key);
    return found == profile.alarm_names.end() ? std::string() : found->second;
  };
  std::ostringstream text;
  text << "alarm 0x" << std::hex << std::uppercase << alarm;
  if (!profile.alarm_is_bits) {
    const std::string known = name(alarm);
    text << ": " << (known.empty() ? "not in the profile, see the drive's manual" : known);
    return text.str();
  }
  text << std::dec;
  const char* between = ": ";
  for (int bit = 0; bit < 32; ++bit) {
    if ((alarm >> bit & 1) == 0) continue;
    const std::string known = name(bit);
    text << std::exchange(between, ", ") << (known.empty() ? "bit " + std::to_string(bit) : known);
  }
  return text.str();
}

}  // namespace lensd::drivers::modbus
