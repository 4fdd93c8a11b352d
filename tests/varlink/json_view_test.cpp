// JSON as it was parsed says what the other parser says, and refuses what that refuses.
#include "varlink/json_view.h"

#include <gtest/gtest.h>

#include <charconv>
#include <cmath>
#include <cstring>
#include <random>
#include <string>

#include "test_level.h"

namespace lensd::varlink {
namespace {

TEST(Document, SaysWhatTheOtherParserSays) {
  for (const char* text :
       {R"(null)", R"([])", R"({})", R"( {"a":[1,-2,2.5,true,false,null,"x"],"b":{"c":{}}} )",
        R"({"n":9223372036854775807,"m":-9223372036854775808,"u":18446744073709551615,"big":18446744073709551616})",
        R"({"same":1,"other":2,"same":3})", R"({"e":1e2,"f":1E-300,"g":-0.0,"h":0})",
        R"({"\u00e4\n":"\ud83d\ude00 \\ \" \/","":""})", "[\"\xc3\xa4\"]"}) {
    const auto parsed = Document::Parse(text);
    ASSERT_TRUE(parsed) << text;
    const Json expected = Json::parse(text);
    EXPECT_EQ(parsed->root().ToJson(), expected) << text;
    EXPECT_EQ(parsed->root().ToJson().dump(), expected.dump()) << text;
  }
}

TEST(Document, TakesIntegersBeyondSixtyFourBitsAsTheNumbersTheyAre) {
  const auto parsed =
      Document::Parse(R"({"a":100000000000000000000,"12345678901234567890123":"\\\"1e5 100000000000000000000",
                                          "b":[-98765432109876543210]})")
          .value();
  const Json json = parsed.root().ToJson();
  EXPECT_EQ(json["a"], 1e20);
  EXPECT_EQ(json["b"][0], -98765432109876543210.0);
  EXPECT_EQ(json["12345678901234567890123"], "\\\"1e5 100000000000000000000");
  EXPECT_FALSE(parsed.root().Find("a")->is_integer());
}

TEST(Document, RefusesWhatIsNotJson) {
  using namespace std::string_view_literals;
  for (const std::string_view text : {""sv,
                                      " "sv,
                                      "nul"sv,
                                      "[1,]"sv,
                                      "{\"a\":1,}"sv,
                                      "{a:1}"sv,
                                      "[01]"sv,
                                      "[+1]"sv,
                                      "[.5]"sv,
                                      "[1.]"sv,
                                      "[NaN]"sv,
                                      "[Infinity]"sv,
                                      "[1e999]"sv,
                                      "[-1e999]"sv,
                                      "[1] x"sv,
                                      "[1]\0"sv,
                                      "[1]\0x"sv,
                                      "[\"\x01\"]"sv,
                                      "[\"\xff\"]"sv,
                                      "[\"\xed\xa0\x80\"]"sv,
                                      "[\"\\ud800\"]"sv,
                                      "[\"\\x\"]"sv,
                                      "['a']"sv,
                                      "[1]/**/"sv}) {
    EXPECT_FALSE(Document::Parse(text)) << text;
    const bool ends_early = text.find('\0') != std::string_view::npos;  // for the other parser too
    EXPECT_TRUE(Json::parse(text, nullptr, false).is_discarded() || ends_early) << text;
  }
}

TEST(Document, ReadsEveryDoubleToTheLastBit) {
  const long count = testing::ByLevel(2000, 20000, 1000000);
  std::mt19937_64 random(11);
  for (long i = 0; i < count; ++i) {
    const std::uint64_t bits = random();
    double value = 0.0;
    std::memcpy(&value, &bits, sizeof value);
    if (!std::isfinite(value)) continue;
    char text[64] = "[";
    *std::to_chars(text + 1, text + 60, value, std::chars_format::scientific).ptr = ']';
    const auto parsed = Document::Parse(text);
    ASSERT_TRUE(parsed) << text;
    ASSERT_EQ((*parsed->root().elements().begin()).number(), value) << text;
  }
}

TEST(Document, TellsNullFromAbsentOnlyWhereAsked) {
  const auto parsed = Document::Parse(R"({"there":1,"null":null,"twice":1,"twice":2})").value();
  const JsonView root = parsed.root();
  EXPECT_TRUE(root.Given("there"));
  EXPECT_FALSE(root.Given("null"));
  EXPECT_TRUE(root.Find("null"));
  EXPECT_FALSE(root.Find("absent"));
  EXPECT_EQ(root.Find("twice")->number(), 2.0);
  EXPECT_EQ(EmptyObject().ToJson(), Json::object());
}

}  // namespace
}  // namespace lensd::varlink
