// The bytes of every request (fact sheet uvc_camera_terminal, section 8 and the tables it refers to).
#include "bytes_fixture.h"

namespace lensd::drivers::uvc {
namespace {

TEST_F(UvcBytes, Section8FocusAutoOffThenMaximumThenFocus500ThenAutoRestored) {
  Begin(kFocusBits);
  wire_->ExpectIn("A1 81 00 08 00 01 01 00", "01");
  wire_->ExpectOut("21 01 00 08 00 01 01 00", "00");  // "focus auto off"
  ExpectFocusRange();                                 // with "get focus max"
  auto lens = OpenLens();
  ASSERT_TRUE(lens.has_value()) << lens.error().message;
  const auto& focus = *(*lens)->capabilities().axes[Axis::Focus];
  EXPECT_EQ(focus.maximum, Native{1023.0});
  EXPECT_EQ(focus.feedback, Feedback::Echo);
  EXPECT_FALSE(focus.direction) << "millimetres by the class, something else in most cameras";
  wire_->ExpectOut("21 01 00 06 00 01 02 00", "F4 01");  // "set focus 500"
  EXPECT_TRUE((*lens)->StartMove(Axis::Focus, Native{500.0}).has_value());
  wire_->ExpectIn("A1 81 00 06 00 01 02 00", "F4 01");
  const auto state = (*lens)->Read();
  ASSERT_TRUE(state.has_value());
  EXPECT_EQ(state->axes[Axis::Focus]->position, Native{500.0});
  EXPECT_FALSE(state->axes[Axis::Focus]->moving);
  wire_->ExpectOut("21 01 00 08 00 01 01 00", "01");
  lens->reset();
  session_.reset();
  EXPECT_TRUE(wire_->done());
}

TEST_F(UvcBytes, AutoFocusThatIsOffIsLeftAlone) {
  Begin(kFocusBits);
  wire_->ExpectIn("A1 81 00 08 00 01 01 00", "00");
  ExpectFocusRange();
  ASSERT_TRUE(OpenLens().has_value());
  session_.reset();
}

TEST_F(UvcBytes, Section8FocusNearSpeed3AndStop) {
  Begin(1u << 6);
  LensConfig config;
  config.focus_travel = std::chrono::seconds(2);
  config.focus_speed = 3;
  auto lens = OpenLens(config);
  ASSERT_TRUE(lens.has_value()) << lens.error().message;
  EXPECT_EQ((*lens)->StartMove(Axis::Focus, Native{100.0}).error().code, Code::NotHomed);
  const auto& direction = (*lens)->capabilities().axes[Axis::Focus]->direction;
  ASSERT_TRUE(direction);
  EXPECT_EQ(direction->direction, Direction::NearPositive) << "positions are travel toward near, by the class";
  // To the far end, and a quarter more.
  wire_->ExpectOut("21 01 00 07 00 01 02 00", "FF 03");
  ASSERT_TRUE((*lens)->StartHome(Axis::Focus).has_value());
  clock_.Advance(std::chrono::milliseconds(2499));
  EXPECT_TRUE((*lens)->Read()->axes[Axis::Focus]->moving);
  clock_.Advance(std::chrono::milliseconds(1));
  wire_->ExpectOut("21 01 00 07 00 01 02 00", "00 00");
  EXPECT_TRUE((*lens)->Read()->axes[Axis::Focus]->homed);
  clock_.Advance(std::chrono::seconds(1));
  wire_->ExpectOut("21 01 00 07 00 01 02 00", "01 03");  // "focus near, speed 3"
  ASSERT_TRUE((*lens)->StartMove(Axis::Focus, Native{600.0}).has_value());
  clock_.Advance(std::chrono::milliseconds(600));
  wire_->ExpectOut("21 01 00 07 00 01 02 00", "00 00");  // "focus stop"
  const auto state = (*lens)->Read();
  ASSERT_TRUE(state.has_value());
  EXPECT_EQ(state->axes[Axis::Focus]->position, Native{600.0});
  EXPECT_FALSE(state->axes[Axis::Focus]->moving);
}

TEST_F(UvcBytes, RelativeFocusRunsBackWhatItRanTooFar) {
  Begin(1u << 6);
  LensConfig config;
  config.focus_travel = std::chrono::seconds(2);
  auto lens = OpenLens(config);
  ASSERT_TRUE(lens.has_value());
  wire_->ExpectOut("21 01 00 07 00 01 02 00", "FF 01");
  ASSERT_TRUE((*lens)->StartHome(Axis::Focus).has_value());
  clock_.Advance(std::chrono::seconds(3));
  wire_->ExpectOut("21 01 00 07 00 01 02 00", "00 00");
  ASSERT_TRUE((*lens)->Read().has_value());
  clock_.Advance(std::chrono::seconds(1));
  wire_->ExpectOut("21 01 00 07 00 01 02 00", "01 01");
  ASSERT_TRUE((*lens)->StartMove(Axis::Focus, Native{500.0}).has_value());
  // The rig does not look for 800 ms.
  clock_.Advance(std::chrono::milliseconds(800));
  wire_->ExpectOut("21 01 00 07 00 01 02 00", "00 00");
  wire_->ExpectOut("21 01 00 07 00 01 02 00", "FF 01");
  auto state = (*lens)->Read();
  ASSERT_TRUE(state.has_value());
  EXPECT_TRUE(state->axes[Axis::Focus]->moving);
  clock_.Advance(std::chrono::milliseconds(300));
  wire_->ExpectOut("21 01 00 07 00 01 02 00", "00 00");
  state = (*lens)->Read();
  ASSERT_TRUE(state.has_value());
  EXPECT_FALSE(state->axes[Axis::Focus]->moving);
  EXPECT_NEAR(state->axes[Axis::Focus]->position.value, 500.0, 1e-6);
}

TEST_F(UvcBytes, Section8IrisF56AndSection2AeModes) {
  Begin(1u << 7 | 1u << 1);
  // Automatic; all four modes are there: aperture priority leaves the exposure to the camera.
  wire_->ExpectIn("A1 81 00 02 00 01 01 00", "02");
  wire_->ExpectIn("A1 84 00 02 00 01 01 00", "0F");
  wire_->ExpectOut("21 01 00 02 00 01 01 00", "08");
  wire_->ExpectIn("A1 86 00 09 00 01 01 00", "03");
  wire_->ExpectIn("A1 82 00 09 00 01 02 00", "8C 00");  // f/1.4
  wire_->ExpectIn("A1 83 00 09 00 01 02 00", "40 06");  // f/16
  wire_->ExpectIn("A1 84 00 09 00 01 02 00", "01 00");
  wire_->ExpectIn("A1 81 00 09 00 01 02 00", "8C 00");
  auto lens = OpenLens();
  ASSERT_TRUE(lens.has_value()) << lens.error().message;
  const auto& iris = *(*lens)->capabilities().axes[Axis::Iris];
  EXPECT_EQ(iris.unit, NativeUnit::FNumber);
  EXPECT_DOUBLE_EQ(iris.minimum.value, 1.4);
  EXPECT_DOUBLE_EQ(iris.maximum.value, 16.0);
  wire_->ExpectOut("21 01 00 09 00 01 02 00", "30 02");  // "iris f/5.6"
  EXPECT_TRUE((*lens)->StartMove(Axis::Iris, Native{5.6}).has_value());
  wire_->ExpectOut("21 01 00 02 00 01 01 00", "02");
  lens->reset();
  session_.reset();
}

TEST_F(UvcBytes, Section2ZoomAbsolute) {
  Begin(1u << 9);
  wire_->ExpectIn("A1 86 00 0B 00 01 01 00", "03");
  wire_->ExpectIn("A1 82 00 0B 00 01 02 00", "64 00");
  wire_->ExpectIn("A1 83 00 0B 00 01 02 00", "F4 01");
  wire_->ExpectIn("A1 84 00 0B 00 01 02 00", "0A 00");
  wire_->ExpectIn("A1 81 00 0B 00 01 02 00", "64 00");
  auto lens = OpenLens();
  ASSERT_TRUE(lens.has_value());
  // To the resolution's grid from the minimum.
  wire_->ExpectOut("21 01 00 0B 00 01 02 00", "FA 00");
  EXPECT_TRUE((*lens)->StartMove(Axis::Zoom, Native{253.0}).has_value());
}

TEST_F(UvcBytes, Section4StallIsExplainedByTheErrorCodeControlOnce) {
  const std::pair<const char*, Code> cases[] = {
      {"01", Code::Busy},        {"02", Code::Busy},        {"03", Code::Protocol},    {"04", Code::OutOfRange},
      {"05", Code::Unsupported}, {"06", Code::Unsupported}, {"07", Code::Unsupported}, {"08", Code::OutOfRange},
      {"FF", Code::Protocol},    {"00", Code::Protocol}};
  Begin(1u << 5);
  ExpectFocusRange();
  auto lens = OpenLens();
  ASSERT_TRUE(lens.has_value());
  for (const auto& [error, code] : cases) {
    const bool wrong_state = std::string(error) == "02";
    wire_->ExpectFailing("21 01 00 06 00 01 02 00", "F4 01", Reply::Outcome::Stalled);
    wire_->ExpectIn("A1 81 00 02 00 00 01 00", error);  // "error code"
    if (wrong_state) {
      // Tried once more, once the automatics (here: none) are off.
      wire_->ExpectFailing("21 01 00 06 00 01 02 00", "F4 01", Reply::Outcome::Stalled);
      wire_->ExpectIn("A1 81 00 02 00 00 01 00", error);
    }
    const auto moved = (*lens)->StartMove(Axis::Focus, Native{500.0});
    ASSERT_FALSE(moved.has_value());
    EXPECT_EQ(moved.error().code, code) << error << ": " << moved.error().message;
    clock_.Advance(std::chrono::seconds(1));
  }
  // An answer to the question why that is itself refused is not asked about again.
  wire_->ExpectFailing("21 01 00 06 00 01 02 00", "F4 01", Reply::Outcome::Stalled);
  wire_->ExpectFailing("A1 81 00 02 00 00 01 00", "", Reply::Outcome::Stalled);
  EXPECT_EQ((*lens)->StartMove(Axis::Focus, Native{500.0}).error().code, Code::Protocol);
}

TEST_F(UvcBytes, WrongStateSwitchesTheAutomaticOffAgainAndRepeats) {
  Begin(kFocusBits);
  wire_->ExpectIn("A1 81 00 08 00 01 01 00", "00");
  ExpectFocusRange();
  auto lens = OpenLens();
  ASSERT_TRUE(lens.has_value());
  wire_->ExpectFailing("21 01 00 06 00 01 02 00", "F4 01", Reply::Outcome::Stalled);
  wire_->ExpectIn("A1 81 00 02 00 00 01 00", "02");
  wire_->ExpectIn("A1 81 00 08 00 01 01 00", "01");
  wire_->ExpectOut("21 01 00 08 00 01 01 00", "00");
  wire_->ExpectOut("21 01 00 06 00 01 02 00", "F4 01");
  EXPECT_TRUE((*lens)->StartMove(Axis::Focus, Native{500.0}).has_value());
  // The user had it on: it is on again when we leave.
  wire_->ExpectOut("21 01 00 08 00 01 01 00", "01");
  lens->reset();
  session_.reset();
}

TEST_F(UvcBytes, Section8ProbeFallsBackWhereTheDeviceWillNotTell) {
  Begin(1u << 5);
  wire_->ExpectFailing("A1 86 00 06 00 01 01 00", "", Reply::Outcome::Stalled);
  wire_->ExpectIn("A1 82 00 06 00 01 02 00", "00 00");
  wire_->ExpectIn("A1 83 00 06 00 01 02 00", "FF 00");
  wire_->ExpectIn("A1 84 00 06 00 01 02 00", "00 00");  // resolution 0 reads as 1
  wire_->ExpectIn("A1 81 00 06 00 01 02 00", "00 00");
  auto lens = OpenLens();
  ASSERT_TRUE(lens.has_value());
  EXPECT_EQ((*lens)->capabilities().axes[Axis::Focus]->resolution, 1.0);
}

TEST_F(UvcBytes, Section8EmptyRangeIsRefused) {
  Begin(1u << 5);
  wire_->ExpectIn("A1 86 00 06 00 01 01 00", "03");
  wire_->ExpectIn("A1 82 00 06 00 01 02 00", "10 00");
  wire_->ExpectIn("A1 83 00 06 00 01 02 00", "05 00");
  wire_->ExpectIn("A1 84 00 06 00 01 02 00", "01 00");
  wire_->ExpectIn("A1 81 00 06 00 01 02 00", "05 00");
  const auto lens = OpenLens();
  ASSERT_TRUE(lens.has_value()) << lens.error().message;
  EXPECT_EQ(*lens, nullptr);
  ASSERT_NE(findings_.Of("focus"), nullptr);
  EXPECT_EQ(findings_.Of("focus")->code, Code::Unsupported);
}

TEST_F(UvcBytes, Section4SettingsKeepTheirDistance) {
  Begin(1u << 5);
  ExpectFocusRange();
  auto lens = OpenLens();
  ASSERT_TRUE(lens.has_value());
  const Instant before = clock_.Now();
  for (int i = 0; i < 3; ++i) {
    wire_->ExpectOut("21 01 00 06 00 01 02 00", "F4 01");
    ASSERT_TRUE((*lens)->StartMove(Axis::Focus, Native{500.0}).has_value());
  }
  EXPECT_EQ(clock_.Now() - before, std::chrono::milliseconds(100));
}

TEST_F(UvcBytes, Section7ShortReadIsAProtocolError) {
  Begin(1u << 5);
  ExpectFocusRange();
  auto lens = OpenLens();
  ASSERT_TRUE(lens.has_value());
  wire_->ExpectIn("A1 81 00 06 00 01 02 00", "F4");
  EXPECT_EQ((*lens)->Read().error().code, Code::Protocol);
}

TEST_F(UvcBytes, Section5AsynchronousMoveEndsWithItsStatusEvent) {
  VideoFunction function;
  function.status_endpoint = 0x83;
  Begin(1u << 5, function);
  ExpectFocusRange("1B");
  auto lens = OpenLens();
  ASSERT_TRUE(lens.has_value());
  wire_->ExpectOut("21 01 00 06 00 01 02 00", "F4 01");
  ASSERT_TRUE((*lens)->StartMove(Axis::Focus, Native{500.0}).has_value());
  const auto moving_after = [&](const char* packet) {
    if (*packet != '\0') wire_->QueueStatus(packet);
    wire_->ExpectIn("A1 81 00 06 00 01 02 00", "F4 01");
    return (*lens)->Read()->axes[Axis::Focus]->moving;
  };
  EXPECT_TRUE(moving_after(""));
  EXPECT_TRUE(moving_after("01 02 00 06 00 F4 01"));  // another entity
  EXPECT_TRUE(moving_after("01 01 00 09 00 F4 01"));  // another control
  EXPECT_TRUE(moving_after("02 01 00 06 00 F4 01"));  // a streaming interface
  EXPECT_TRUE(moving_after("01 01 00 06 00 2C 01"));  // the end of an earlier move
  EXPECT_TRUE(moving_after("01 01"));                 // cut short
  EXPECT_TRUE(moving_after("01 01 00 06 00"));        // without the value
  EXPECT_TRUE(moving_after("01 01 00 06 00 F4"));     // half of it
  EXPECT_FALSE(moving_after("01 01 00 06 00 F4 01"));
  clock_.Advance(std::chrono::seconds(1));
  wire_->ExpectOut("21 01 00 06 00 01 02 00", "58 02");
  ASSERT_TRUE((*lens)->StartMove(Axis::Focus, Native{600.0}).has_value());
  wire_->QueueStatus("01 01 00 06 02 01");
  wire_->ExpectIn("A1 81 00 06 00 01 02 00", "58 02");
  const auto state = (*lens)->Read();
  EXPECT_TRUE(state->axes[Axis::Focus]->moving) << "a failed move has not arrived";
  EXPECT_NE(state->axes[Axis::Focus]->fault, "");
}

TEST_F(UvcBytes, ProbeAndCommitAndTheNarrowestSettingThatIsWideEnough) {
  VideoFunction function;
  StreamInterface stream{1, {{1, PixelFormat::Yuyv, 1, 0, {{2, 64, 48, 333333, {333333, 666666}, false}}}}, {}};
  stream.settings = {{1, 0x81, true, 512}, {2, 0x81, true, 3072}, {3, 0x81, true, 1024}};
  function.streams.push_back(stream);
  Begin(0, function);
  const auto choice = Choose(session_->function, {});
  ASSERT_TRUE(choice.has_value()) << choice.error().message;
  const std::string head = "01 00 01 02 15 16 05 00 00 00 00 00 00 00 00 00 00 00 ";
  const std::string zeros = "00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00";
  const std::string agreed = head + "00 18 00 00 84 03 00 00 00 00 00 00 00 00 00 00";  // payloads of 900 bytes
  wire_->ExpectOut("21 01 00 01 01 00 22 00", head + zeros);
  wire_->ExpectIn("A1 81 00 01 01 00 22 00", agreed);
  wire_->ExpectOut("21 01 00 02 01 00 22 00", agreed);
  const auto pipe = Negotiate(*session_, *choice);
  ASSERT_TRUE(pipe.has_value()) << pipe.error().message;
  EXPECT_EQ(pipe->alternate, 3);
  EXPECT_EQ(pipe->transfer_bytes, 1024u);
  EXPECT_TRUE(pipe->isochronous);
}

TEST_F(UvcBytes, ProbeLengthFollowsTheVersionOfTheClass) {
  for (const auto& [version, length] : {std::pair{0x0100, 26}, {0x0110, 34}, {0x0150, 48}}) {
    VideoFunction function;
    function.version = static_cast<std::uint16_t>(version);
    StreamInterface stream{
        1, {{1, PixelFormat::Mjpeg, 1, 0, {{1, 64, 48, 333333, {}, false}}}}, {{0, 0x81, false, 512}}};
    function.streams.push_back(stream);
    auto wire = std::make_shared<ScriptedTransport>(clock_);
    Session session(wire, clock_, function, {}, {}, {});
    const auto choice = Choose(function, {});
    ASSERT_TRUE(choice.has_value());
    char setup[32];
    std::snprintf(setup, sizeof setup, "21 01 00 01 01 00 %02X 00", length);
    std::string data = "01 00 01 01 15 16 05 00";
    for (int i = 8; i < length; ++i) data += " 00";
    wire->ExpectFailing(setup, data, Reply::Outcome::TimedOut);
    EXPECT_EQ(Negotiate(session, *choice).error().code, Code::Timeout);
  }
}

TEST_F(UvcBytes, OfSeveralStreamsTheFirstThatHasWhatIsWantedIsTaken) {
  VideoFunction function;
  StreamInterface small;
  small.number = 1;
  small.formats.push_back({1, PixelFormat::Yuyv, 1, 0, {{1, 320, 240, 333333, {333333}, false}}});
  StreamInterface large;
  large.number = 2;
  large.formats.push_back({1, PixelFormat::Mjpeg, 1, 0, {{1, 1920, 1080, 333333, {333333}, false}}});
  function.streams = {StreamInterface{}, small, large};  // the first has formats that this driver cannot read
  const auto chosen = [&](const CameraConfig& config) {
    const auto choice = Choose(function, config);
    return choice ? int{choice->interface} : -1;
  };
  EXPECT_EQ(chosen({}), 1);
  CameraConfig wanted;
  wanted.format = PixelFormat::Mjpeg;
  EXPECT_EQ(chosen(wanted), 2);
  wanted = {};
  wanted.width = 1920;
  wanted.height = 1080;
  EXPECT_EQ(chosen(wanted), 2);
  wanted.format = PixelFormat::Yuyv;
  const auto none = Choose(function, wanted);
  ASSERT_FALSE(none.has_value());
  EXPECT_EQ(none.error().code, Code::Unsupported);
  EXPECT_NE(none.error().message.find("yuyv 320x240; mjpeg 1920x1080"), std::string::npos) << none.error().message;
}

TEST_F(UvcBytes, TransportOutcomesKeepTheirNames) {
  Begin(1u << 5);
  ExpectFocusRange();
  auto lens = OpenLens();
  ASSERT_TRUE(lens.has_value());
  const std::pair<Reply::Outcome, Code> cases[] = {{Reply::Outcome::TimedOut, Code::Timeout},
                                                   {Reply::Outcome::Cancelled, Code::Cancelled},
                                                   {Reply::Outcome::Failed, Code::Protocol},
                                                   {Reply::Outcome::Gone, Code::Disconnected}};
  for (const auto& [outcome, code] : cases) {
    wire_->ExpectFailing("A1 81 00 06 00 01 02 00", "", outcome);
    EXPECT_EQ((*lens)->Read().error().code, code);
  }
}

}  // namespace
}  // namespace lensd::drivers::uvc
