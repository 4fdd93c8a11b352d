// Calls are taken exactly as the protocol allows, and JSON within its limits.
#include "varlink/message.h"

#include <gtest/gtest.h>

#include <limits>

namespace lensd::varlink {
namespace {

TEST(ReceiveCall, TakesWhatTheProtocolAllows) {
  const ReceivedCall plain = ReceiveCall(R"({"method":"a.b.C"})").value();
  EXPECT_EQ(plain.method, "a.b.C");
  EXPECT_EQ(plain.parameters.ToJson(), Json::object());
  EXPECT_FALSE(plain.oneway || plain.more || plain.upgrade);
  EXPECT_EQ(ReceiveCall(R"({"method":"a.b.C","parameters":null})").value().parameters.ToJson(), Json::object());
  EXPECT_TRUE(ReceiveCall(R"({"method":"a.b.C","more":true,"oneway":false})").value().more);
  EXPECT_TRUE(ReceiveCall(R"({"method":"a.b.C","com.example.hint":[1]})").has_value());
  EXPECT_EQ(
      ReceiveCall(R"({"method":"a.b.C","parameters":{"n":9223372036854775807}})").value().parameters.ToJson()["n"],
      std::numeric_limits<std::int64_t>::max());
}

TEST(ReceiveCall, RefusesEveryBreach) {
  for (const char* text : {"",
                           "x",
                           "[]",
                           "1",
                           "null",
                           "{}",
                           R"({"method":1})",
                           R"({"method":""})",
                           R"({"method":"a.B","more":1})",
                           R"({"method":"a.B","oneway":"true"})",
                           R"({"method":"a.B","upgrade":null})",
                           R"({"method":"a.B","more":true,"oneway":true})",
                           R"({"method":"a.B","more":true,"upgrade":true})",
                           R"({"method":"a.B","parameters":[]})",
                           R"({"method":"a.B","parameters":"x"})",
                           R"({"method":"a.B","extra":1})",
                           R"({"method":"a.B"} {})",
                           "{\"method\":\"\xff\"}",
                           R"({"method":"a.B","parameters":{"x":1e999}})",
                           R"({"method":"a.B","parameters":{"x":NaN}})"}) {
    const auto parsed = ReceiveCall(text);
    ASSERT_FALSE(parsed.has_value()) << text;
    EXPECT_EQ(parsed.error().code, Code::Protocol) << text;
  }
}

TEST(ParseJson, LimitsDepthToSixtyFour) {
  const auto nested = [](int depth) { return std::string(depth, '[') + std::string(depth, ']'); };
  EXPECT_TRUE(ParseJson(nested(64)).has_value());
  EXPECT_FALSE(ParseJson(nested(65)).has_value());
  EXPECT_FALSE(ParseJson(nested(200000)).has_value());
  EXPECT_FALSE(ParseJson(std::string(200000, '[')).has_value());
  EXPECT_TRUE(ParseJson("\"" + std::string(1000, '[') + "\"").has_value());
}

TEST(WriteJson, ReplacesWhatIsNotUtf8AndKeepsDoubles) {
  EXPECT_EQ(WriteJson("a\xffz"), "\"a\xef\xbf\xbdz\"");
  for (const double value : {0.1, 1.0 / 3.0, 1e-300, 123456789.123456789, -0.0}) {
    EXPECT_EQ(ParseJson(WriteJson(value)).value().get<double>(), value);
  }
  EXPECT_TRUE(NumberOrNull(std::numeric_limits<double>::infinity()).is_null());
  EXPECT_TRUE(NumberOrNull(std::numeric_limits<double>::quiet_NaN()).is_null());
}

TEST(Encode, EndsWithOneNulAndReadsBack) {
  Call call;
  call.method = "a.B";
  call.parameters = {{"x", 1}};
  call.more = true;
  const std::string text = EncodeCall(call);
  EXPECT_EQ(text.find('\0'), text.size() - 1);
  const ReceivedCall back = ReceiveCall(text.substr(0, text.size() - 1)).value();
  EXPECT_EQ(back.parameters.ToJson(), call.parameters);
  EXPECT_TRUE(back.more && !back.oneway);

  const std::string streamed = EncodeReply("{\"y\":2}", true);
  const Reply reply = ParseReply(streamed.substr(0, streamed.size() - 1)).value();
  EXPECT_TRUE(reply.continues && reply.error.empty());
  EXPECT_EQ(reply.parameters, Json({{"y", 2}}));
  EXPECT_EQ(ParseReply(R"({"error":"a.E","parameters":null,"later":1})").value().error, "a.E");
  EXPECT_FALSE(ParseReply(R"({"error":1})").has_value());
}

}  // namespace
}  // namespace lensd::varlink
