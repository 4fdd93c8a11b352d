// The check of a camera's GenICam description, with Aravis itself as the judge: what is accepted must do it no harm.
#include "description_check.h"

#include <arv.h>
#include <gtest/gtest.h>
#include <sys/mman.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <limits>
#include <optional>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "aravis_camera.h"
#include "aravis_lens.h"
#include "drawn_description.h"
#include "genicam_text.h"
#include "gobject_handles.h"
#include "test_level.h"
#include "watched_process.h"

// Aravis' simulated camera ends the process where it is asked for an address that it does not have. In its place here:
// a camera with every address, whose registers hold small numbers, all ones, or anything.
extern "C" gboolean arv_fake_camera_read_memory(ArvFakeCamera*, guint32 address, guint32 size, void* buffer) {
  for (guint32 i = 0; i < size; ++i) {
    const guint32 word = (address + i) / 4 * 2654435761U, byte = (address + i) % 4;
    constexpr guint32 kSmall = 0, kOnes = 1;
    const guint32 kind = word >> 30;
    const guint32 value = kind == kSmall ? (byte == 3 ? word >> 26 : 0U) : kind == kOnes ? 255U : word >> (8 * byte);
    static_cast<unsigned char*>(buffer)[i] = static_cast<unsigned char>(value);
  }
  return 1;
}
extern "C" gboolean arv_fake_camera_write_memory(ArvFakeCamera*, guint32, guint32, const void*) {
  return 1;
}
extern "C" gboolean arv_fake_camera_read_register(ArvFakeCamera* camera, guint32 address, guint32* value) {
  return arv_fake_camera_read_memory(camera, address, sizeof *value, value);
}
extern "C" gboolean arv_fake_camera_write_register(ArvFakeCamera*, guint32, guint32) {
  return 1;
}

namespace lensd {
namespace {

using drivers::aravis::CheckDescription;
using drivers::aravis::Handle;

std::string Whole(const std::string& nodes) {
  return "<?xml version=\"1.0\"?>\n<RegisterDescription><Port Name=\"Device\"/>\n" + nodes + "</RegisterDescription>\n";
}

std::string SimulatedCamera(const std::string& names = "sfnc") {
  sim::GenicamOptions options;
  options.names = names;
  options.width = 640;
  options.height = 480;
  options.focus = {.minimum = 0.0, .maximum = 4000.0};
  options.iris = {.minimum = 1.4, .maximum = 16.0, .per_count = 0.01, .zero = 1.4};
  options.zoom = {.minimum = 0.0, .maximum = 1000.0};
  return sim::GenicamText(options);
}

/// What Aravis' own simulated camera has.
std::string FakeCamera() {
  std::size_t size = 0;
  const Handle<ArvDevice> device(arv_fake_device_new("fake", nullptr));
  const char* text = arv_device_get_genicam_xml(device.get(), &size);
  return {text, size};
}

std::vector<std::string> GoodDescriptions() {
  std::vector<std::string> good = {FakeCamera()};
  for (const char* names : {"sfnc", "sfnc-abort", "basler", "allied-vision", "imaging-source", "none"}) {
    good.push_back(SimulatedCamera(names));
  }
  return good;
}

std::string WhyNot(const std::string& text) {
  const auto checked = CheckDescription(text);
  return checked ? "" : checked.error().message;
}

std::string InPlaceOf(std::string text, const std::string& what, const std::string& other) {
  const std::size_t place = text.find(what);
  if (place == std::string::npos) throw std::runtime_error("no " + what);
  return text.replace(place, what.size(), other);
}

TEST(GenicamDescription, CamerasThatAreWellAreAccepted) {
  drivers::aravis::TameGlib();
  for (const std::string& text : GoodDescriptions()) {
    ASSERT_GT(text.size(), 1000U);
    EXPECT_EQ(WhyNot(text), "");
    EXPECT_EQ(WhyNot(text + std::string(100, '\0')), "") << "cameras fill up their memory";
    EXPECT_EQ(WhyNot(text + "more of something"), "");
  }
}

/// Each of these is common in cameras, and nothing that Aravis does goes round it.
TEST(GenicamDescription, CirclesThatNobodyFollowsAreAccepted) {
  drivers::aravis::TameGlib();
  const std::string sizes =
      "<Integer Name=\"Width\"><Value>10</Value><Min>1</Min><pMax>WidthMax</pMax></Integer>"
      "<IntSwissKnife Name=\"WidthMax\"><pVariable Name=\"O\">OffsetX</pVariable><Formula>640 - "
      "O</Formula></IntSwissKnife>"
      "<Integer Name=\"OffsetX\"><Value>0</Value><Min>0</Min><pMax>OffsetMax</pMax></Integer>"
      "<IntSwissKnife Name=\"OffsetMax\"><pVariable Name=\"W\">Width</pVariable><Formula>640 - "
      "W</Formula></IntSwissKnife>";
  EXPECT_EQ(WhyNot(Whole(sizes)), "");
  for (const char* kind : {"pSelected", "pInvalidator", "pFeature", "pIsAvailable", "pIsImplemented", "pIsLocked",
                           "pMin", "pMax", "pInc"}) {
    const auto refer = [&](const std::string& to) { return "<" + std::string(kind) + ">" + to + "</" + kind + ">"; };
    EXPECT_EQ(WhyNot(Whole("<Integer Name=\"A\"><Value>1</Value>" + refer("B") + "</Integer>" +
                           "<Integer Name=\"B\"><Value>1</Value>" + refer("A") + refer("B") + "</Integer>")),
              "")
        << kind;
  }
  EXPECT_EQ(WhyNot(Whole("<StructReg><Address>0x100</Address><Length>4</Length><pPort>Device</pPort>"
                         "<StructEntry Name=\"A\"><Bit>1</Bit></StructEntry>"
                         "<StructEntry Name=\"B\"><Bit>2</Bit></StructEntry></StructReg>")),
            "");
  EXPECT_EQ(WhyNot(Whole("<Register Name=\"Table\"><Address>0</Address><Length>0x100000</Length></Register>")), "");
}

const std::string kExpressions =
    "<IntSwissKnife Name=\"CycM\"><pVariable Name=\"A\">CycN</pVariable><Formula>A</Formula></IntSwissKnife>"
    "<IntSwissKnife Name=\"CycN\"><pVariable Name=\"A\">CycM</pVariable><Formula>A</Formula></IntSwissKnife>";
const std::string kFocus = "<Integer Name=\"FocusStepper\" NameSpace=\"Standard\">";
const std::string kGain = "<Integer Name=\"GainRaw\" NameSpace=\"Standard\">";
const std::string kWidth = "<Integer Name=\"Width\" NameSpace=\"Standard\">";
const std::string kEnd = "</RegisterDescription>";

TEST(GenicamDescription, EveryPlaceOfACircleIsRefusedWithItsNodes) {
  drivers::aravis::TameGlib();
  const struct {
    std::string at, reference;
  } places[] = {{kFocus, "<pMax>CycM</pMax>"},
                {kFocus, "<pMin>CycM</pMin>"},
                {kFocus, "<pInc>CycM</pInc>"},
                {kFocus, "<pIsAvailable>CycM</pIsAvailable>"},
                {kGain, "<pIsAvailable>CycM</pIsAvailable>"},
                {kWidth, "<pMax>CycM</pMax>"}};
  const std::string good = SimulatedCamera();
  for (const auto& [at, reference] : places) {
    const std::string text = InPlaceOf(InPlaceOf(good, kEnd, kExpressions + kEnd), at, at + reference);
    EXPECT_NE(WhyNot(text).find("CycM -> CycN -> CycM"), std::string::npos) << reference << ": " << WhyNot(text);
  }
  const std::string itself =
      "<IntSwissKnife Name=\"CycM\"><pVariable Name=\"A\">CycM</pVariable><Formula>A</Formula></IntSwissKnife>";
  EXPECT_NE(WhyNot(InPlaceOf(good, kEnd, itself + kEnd)).find(": CycM -> CycM"), std::string::npos);
  const std::string value = InPlaceOf(good, "<pValue>FocusConverter</pValue>", "<pValue>FocusOther</pValue>");
  EXPECT_NE(
      WhyNot(InPlaceOf(value, kEnd, "<Integer Name=\"FocusOther\"><pValue>FocusStepper</pValue></Integer>" + kEnd))
          .find("FocusStepper -> FocusOther -> FocusStepper"),
      std::string::npos);
}

TEST(GenicamDescription, EveryOtherReasonHasItsWords) {
  drivers::aravis::TameGlib();
  std::ostringstream chain, ladder, converters;
  for (int i = 0; i < 200; ++i) {
    const int next = i + 1;
    chain << "<Integer Name=\"N" << i << "\"><pValue>N" << next << "</pValue></Integer>";
    if (i >= 40) continue;
    ladder << "<IntSwissKnife Name=\"N" << i << "\"><pVariable Name=\"A\">N" << next
           << "</pVariable><pVariable Name=\"B\">N" << next << "</pVariable><Formula>A + B</Formula></IntSwissKnife>";
    converters << "<Converter Name=\"N" << i << "\"><FormulaTo>FROM</FormulaTo><FormulaFrom>TO</FormulaFrom><pValue>N"
               << next << "</pValue></Converter>";
  }
  const auto reg = [](const std::string& length) {
    return "<StringReg Name=\"S\"><Address>0</Address>" + length + "<pPort>Device</pPort></StringReg>";
  };
  std::string many;
  for (int i = 0; i < 60'000; ++i) many += "<Port/>";
  const struct {
    std::string text, words;
  } cases[] = {{"", "is empty"},
               {"<Other/>", "is no GenICam description"},
               {"<RegisterDescription><Integer", "is no valid XML: "},
               {Whole(chain.str()), "more than 100 references that follow one another, beginning with \"N0\""},
               {Whole(ladder.str()), "branch out too far"},
               {Whole(converters.str()), "branch out too far"},
               {Whole(std::string(40, ' ') + many), "more than 50000 nodes"},
               {std::string(17 << 20, ' '), "more than lensd accepts (16 MiB)"},
               {Whole("<IntSwissKnife Name=\"K\"><Formula>1" + std::string(20'000, '1') + "</Formula></IntSwissKnife>"),
                "formulas of 20001 characters at \"K\""},
               {Whole(reg("<Length>-1</Length>")), "\"S\" has -1 bytes"},
               {Whole(reg("<Length>0x7fffffffffff</Length>")), "\"S\" has 140737488355327 bytes"},
               {Whole(reg("<pLength>L</pLength>") + "<IntReg Name=\"L\"/>"), "which is no constant"},
               {Whole("<Integer Name=\"ArvGevSCDA\"><Value>1</Value></Integer>"), "a name that Aravis has"}};
  for (const auto& [text, words] : cases) {
    EXPECT_NE(WhyNot(text).find(words), std::string::npos) << words << ": " << WhyNot(text);
  }
  EXPECT_EQ(WhyNot(Whole(reg("<pLength>L</pLength>") + "<Integer Name=\"L\"><Value>64</Value></Integer>")), "");
}

// ---- divisions ----

/// One formula, as Aravis computes it in a node of integers; nothing where it says that the division is by 0.
std::optional<std::int64_t> Computed(ArvEvaluator* formula, std::int64_t a, std::int64_t b) {
  arv_evaluator_set_int64_variable(formula, "A", a);
  arv_evaluator_set_int64_variable(formula, "B", b);
  drivers::aravis::CallError error;
  const gint64 value = arv_evaluator_evaluate_as_int64(formula, error.out());
  if (error) return std::nullopt;
  return value;
}

/// -2^63 / -1 and its remainder ended the process. The truth is counted in 128 bits, of which the lower 64 are left.
TEST(GenicamDivision, EveryDivisionHasAResultOrSaysThatItIsByZero) {
  drivers::aravis::TameGlib();
  std::mt19937_64 random(20261127);
  constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();
  constexpr std::int64_t kEnds[] = {kLeast, kLeast + 1, -2, -1, 0, 1, 2, std::numeric_limits<std::int64_t>::max()};
  const auto draw = [&] { return random() % 2 == 0 ? kEnds[random() % 8] : static_cast<std::int64_t>(random()); };
  const Handle<ArvEvaluator> quotient(arv_evaluator_new("A / B")), remainder(arv_evaluator_new("A % B"));
  const int count = testing::ByLevel(2'000, 10'000, 1'000'000);
  int overflowed = 0;
  for (int i = 0; i < count; ++i) {
    const std::int64_t a = draw(), b = draw();
    std::optional<std::int64_t> whole, rest;
    if (b != 0) {
      __extension__ using Wide = __int128;
      const Wide wide_a = a, wide_b = b;
      whole = static_cast<std::int64_t>(static_cast<std::uint64_t>(wide_a / wide_b));
      rest = static_cast<std::int64_t>(wide_a % wide_b);
    }
    overflowed += a == kLeast && b == -1 ? 1 : 0;
    ASSERT_EQ(Computed(quotient.get(), a, b), whole) << a << " / " << b;
    ASSERT_EQ(Computed(remainder.get(), a, b), rest) << a << " % " << b;
  }
  std::cout << count << " divisions, " << overflowed << " of them -2^63 by -1\n";
  EXPECT_GT(overflowed, 0);
}

/// Only Aravis' divisions have a result.
TEST(GenicamDivision, OtherDivisionsThatFailEndTheProcess) {
#if defined(__x86_64__)
  drivers::aravis::TameGlib();
  const auto divide = [](std::int64_t divisor) {
    std::int64_t quotient = std::numeric_limits<std::int64_t>::min(), rest = -1;
    asm volatile("idivq %2" : "+a"(quotient), "+d"(rest) : "r"(divisor));
  };
  EXPECT_DEATH(divide(-1), "");
  EXPECT_DEATH(divide(0), "");
#endif
}

// ---- Aravis as the judge
// ---------------------------------------------------------------------------------------------

/// One call of Aravis', whose error is of no interest.
template <class Function, class... Arguments>
void Ask(Function function, Arguments... arguments) {
  drivers::aravis::CallError ignored;
  function(arguments..., ignored.out());
}

/// All that can be asked of one node, and what was read is written.
void AskNode(ArvDomNode* node) {
  ArvGcFeatureNode* feature = ARV_GC_FEATURE_NODE(node);
  for (const auto is :
       {arv_gc_feature_node_is_available, arv_gc_feature_node_is_implemented, arv_gc_feature_node_is_locked}) {
    Ask(is, feature);
  }
  arv_gc_feature_node_get_actual_access_mode(feature);
  drivers::aravis::CallError error;
  if (ARV_IS_GC_ENUMERATION(node)) {
    ArvGcEnumeration* entries = ARV_GC_ENUMERATION(node);
    guint count = 0;
    g_free(arv_gc_enumeration_dup_available_int_values(entries, &count, nullptr));
    if (const char* entry = arv_gc_enumeration_get_string_value(entries, error.out())) {
      Ask(arv_gc_enumeration_set_string_value, entries, entry);
    }
  } else if (ARV_IS_GC_INTEGER(node)) {
    ArvGcInteger* number = ARV_GC_INTEGER(node);
    for (const auto limit : {arv_gc_integer_get_min, arv_gc_integer_get_max, arv_gc_integer_get_inc})
      Ask(limit, number);
    Ask(arv_gc_integer_set_value, number, arv_gc_integer_get_value(number, error.out()));
  }
  if (ARV_IS_GC_FLOAT(node)) {
    drivers::aravis::CallError float_error;
    ArvGcFloat* number = ARV_GC_FLOAT(node);
    for (const auto limit : {arv_gc_float_get_min, arv_gc_float_get_max, arv_gc_float_get_inc}) Ask(limit, number);
    Ask(arv_gc_float_set_value, number, arv_gc_float_get_value(number, float_error.out()));
  }
  if (ARV_IS_GC_STRING(node)) Ask(arv_gc_string_get_value, ARV_GC_STRING(node));
  if (ARV_IS_GC_BOOLEAN(node)) Ask(arv_gc_boolean_get_value, ARV_GC_BOOLEAN(node));
  if (ARV_IS_GC_COMMAND(node)) Ask(arv_gc_command_execute, ARV_GC_COMMAND(node));
  if (ARV_IS_GC_SELECTOR(node)) arv_gc_selector_get_selected_features(ARV_GC_SELECTOR(node));
}

void AskNodes(ArvDomNode* node) {
  for (; node != nullptr; node = arv_dom_node_get_next_sibling(node)) {
    if (ARV_IS_GC_FEATURE_NODE(node)) AskNode(node);
    AskNodes(arv_dom_node_get_first_child(node));
  }
}

/// A camera with that description on which everything is done that the driver does, and then everything there is.
void UseCamera(const std::string& text) {
  static const int file = memfd_create("description", MFD_CLOEXEC);
  if (ftruncate(file, 0) != 0 || pwrite(file, text.data(), text.size(), 0) != static_cast<ssize_t>(text.size()))
    _exit(9);
  arv_set_fake_camera_genicam_filename(("/proc/self/fd/" + std::to_string(file)).c_str());
  drivers::aravis::CallError device_error, camera_error;
  const Handle<ArvDevice> device(arv_fake_device_new("drawn", device_error.out()));
  if (!device) return;
  const Handle<ArvCamera> camera(arv_camera_new_with_device(device.get(), camera_error.out()));
  if (!camera) return;
  arv_device_set_range_check_policy(device.get(), ARV_RANGE_CHECK_POLICY_ENABLE);
  arv_device_set_access_check_policy(device.get(), ARV_ACCESS_CHECK_POLICY_ENABLE);
  arv_device_set_register_cache_policy(device.get(), ARV_REGISTER_CACHE_POLICY_DISABLE);
  const auto facts = drivers::aravis::SetUpCamera(camera.get(), {});
  const auto lens = drivers::aravis::FindLens(camera.get(), {});
  AskNodes(arv_dom_node_get_first_child(ARV_DOM_NODE(arv_device_get_genicam(device.get()))));
}

/// Descriptions drawn over every kind of reference: Aravis neither ends nor spins on one that is accepted, and the
/// check itself takes no longer. The bounds on how many are accepted hold back a check that refuses, or accepts, them
/// all.
TEST(GenicamDescription, WhatIsAcceptedDoesNoHarmAndMuchIs) {
  drivers::aravis::TameGlib();
  const std::vector<std::string> good = GoodDescriptions();
  const auto count = static_cast<std::uint64_t>(testing::ByLevel(200, 600, 100'000));
  constexpr double kLimit_s = 2.0;
  unsigned long part = 0, parts = 1;
  if (const char* which = std::getenv("LENSD_TEST_PART")) {
    ASSERT_EQ(std::sscanf(which, "%lu/%lu", &part, &parts), 2);
  }
  const std::uint64_t first = count * part / parts, end = count * (part + 1) / parts;
  const auto watched = testing::WatchWork(
      first, end, kLimit_s, 10, [&](std::uint64_t seed) { return testing::DrawDescription(good, seed); },
      [](const std::string& text) {
        if (!CheckDescription(text)) return false;
        UseCamera(text);
        return true;
      });
  std::cout << watched.done << " descriptions, " << watched.counted << " accepted, the longest took "
            << watched.longest_s << " s of processor time\n";
  for (const auto& [seed, what] : watched.bad) {
    const std::string path = ::testing::TempDir() + "genicam-" + std::to_string(seed) + ".xml";
    std::ofstream(path) << testing::DrawDescription(good, seed);
    ADD_FAILURE() << "seed " << seed << ": " << what << ", " << path;
  }
  EXPECT_GT(watched.counted * 10, (end - first) * 3);
  EXPECT_LT(watched.counted * 10, (end - first) * 8);
}

}  // namespace
}  // namespace lensd
