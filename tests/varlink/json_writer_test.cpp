// What is written by hand is read back by a parser written elsewhere.
#include "varlink/json_writer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "varlink/json.h"

namespace lensd::varlink {
namespace {

TEST(JsonWriter, WritesWhatAParserReads) {
  JsonWriter writer;
  writer.Begin();
  writer.Text("text", "a\"b\\c\n\x01 \xc3\xa4");
  writer.Flag("yes", true);
  writer.Number("third", 1.0 / 3.0);
  writer.Number("whole", 2.0);
  writer.Number("tiny", 5e-324);
  writer.Number("none", std::numeric_limits<double>::infinity());
  writer.BeginArray("list");
  writer.Element("a");
  writer.Element("b[{:");
  writer.EndArray();
  writer.BeginArray("objects");
  writer.Begin();
  writer.End();
  writer.Begin();
  writer.Value("raw", "[1,2]");
  writer.End();
  writer.EndArray();
  writer.BeginObject("inner");
  writer.Number("n", -0.0);
  writer.End();
  writer.End();
  const Json expected{{"text", "a\"b\\c\n\x01 \xc3\xa4"},
                      {"yes", true},
                      {"third", 1.0 / 3.0},
                      {"whole", 2.0},
                      {"tiny", 5e-324},
                      {"none", nullptr},
                      {"list", {"a", "b[{:"}},
                      {"objects", {Json::object(), {{"raw", {1, 2}}}}},
                      {"inner", {{"n", -0.0}}}};
  const Json read = Json::parse(writer.Take());
  EXPECT_EQ(read, expected);
  EXPECT_TRUE(read["whole"].is_number_float());
}

}  // namespace
}  // namespace lensd::varlink
