// Settings are read in full or refused with the line and the key that is wrong.
#include "base/settings.h"

#include <gtest/gtest.h>

#include "io/toml.h"

namespace lensd {
namespace {

Settings Parse(std::string_view text) {
  auto parsed = io::ParseToml(text, "dir/a.toml");
  EXPECT_TRUE(parsed.has_value()) << (parsed ? "" : parsed.error().message);
  return parsed ? *parsed : Settings();
}

TEST(SettingsReader, ReadsEveryKind) {
  const Settings table = Parse("n = 2\nx = 1.5\nflag = true\nname = \"a\"\npair = [1, 2.5]\nfile = \"b.png\"\n");
  SettingsReader read(table, "the file");
  EXPECT_EQ(read.Integer("n", 0), 2);
  EXPECT_EQ(read.Number("x", 0.0), 1.5);
  EXPECT_TRUE(read.Boolean("flag", false));
  EXPECT_EQ(read.RequiredText("name"), "a");
  EXPECT_EQ(read.OptionalNumbers("pair", 2), (std::vector<double>{1.0, 2.5}));
  EXPECT_EQ(read.OptionalPath("file"), "dir/b.png");
  EXPECT_FALSE(read.OptionalNumber("absent").has_value());
  EXPECT_TRUE(read.Finish().has_value());
}

TEST(SettingsReader, NamesAnUnknownKeyWithItsLine) {
  const Settings table = Parse("known = 1\n\nspeed = 2\n");
  SettingsReader read(table, "[lens]");
  read.Integer("known", 0);
  const auto done = read.Finish();
  ASSERT_FALSE(done.has_value());
  EXPECT_EQ(done.error().code, Code::BadData);
  EXPECT_EQ(done.error().message, "dir/a.toml:3: unknown key \"speed\" in [lens]");
}

TEST(SettingsReader, NamesWhatAnUnknownKeyMayMean) {
  const Settings table = Parse("speed = 1\ndrivr = \"sim\"\n");
  SettingsReader read(table, "[lens]");
  read.Integer("speed", 0);
  read.RequiredText("driver");
  const auto done = read.Finish();
  ASSERT_FALSE(done.has_value());
  EXPECT_EQ(done.error().message, "dir/a.toml:2: unknown key \"drivr\" in [lens]; did you mean \"driver\"?");
}

TEST(SettingsReader, WhatIsMissingAndNowhereMistypedIsMissing) {
  const Settings table = Parse("speed = 1\n");
  SettingsReader read(table, "[lens]");
  read.Integer("speed", 0);
  read.RequiredText("driver");
  const auto done = read.Finish();
  ASSERT_FALSE(done.has_value());
  EXPECT_EQ(done.error().message, "dir/a.toml:1: [lens] driver is missing: write driver = ...");
}

TEST(SettingsReader, ReportsTheFirstWrongValue) {
  const Settings table = Parse("speed = -1.0\nsteps = \"many\"\n");
  SettingsReader read(table, "[lens]");
  EXPECT_EQ(read.Number("speed", 5.0, kPositive), 5.0);
  EXPECT_EQ(read.Integer("steps", 7), 7);
  const auto done = read.Finish();
  ASSERT_FALSE(done.has_value());
  EXPECT_EQ(done.error().message, "dir/a.toml:1: [lens] speed must be above 0, not -1");
}

TEST(SettingsReader, ReportsAMissingKeyAtItsTable) {
  const Settings table = Parse("a = 1\n[lens]\nb = 2\n");
  SettingsReader read(table.AsTable()->at("lens"), "[lens]");
  read.RequiredText("model");
  const auto done = read.Finish();
  ASSERT_FALSE(done.has_value());
  EXPECT_EQ(done.error().message, "dir/a.toml:2: [lens] model is missing: write model = ...");
}

TEST(Toml, NamesTheLineOfASyntaxError) {
  const auto parsed = io::ParseToml("a = 1\nb = = 2\n", "x.toml");
  ASSERT_FALSE(parsed.has_value());
  EXPECT_EQ(parsed.error().code, Code::BadData);
  EXPECT_EQ(parsed.error().message.substr(0, 9), "x.toml:2:");
}

TEST(Toml, RefusesATableNameThatIsNone) {
  for (const char* header : {"[/", "[[=]]", "[\\]"}) {
    const auto bad = io::ParseToml(header, "x.toml");
    ASSERT_FALSE(bad.has_value()) << header;
    EXPECT_EQ(bad.error().message.substr(0, 9), "x.toml:1:");
  }
}

TEST(Toml, KeepsLettersBeyondAsciiToStringsAndComments) {
  const auto good = io::ParseToml("a = \"\u00e9\" # \u00e9\nb = \'\'\'x\n\u00e9\'\'\'\nc = \"\\\"\u00e9\"\n", "x.toml");
  ASSERT_TRUE(good.has_value()) << good.error().message;
  for (const char* stray : {"\u00e9 = 1", "a = 1\n\u00e9", "a = '\\'\n\ufbef]", "a = \"x\" \u0400"}) {
    const auto bad = io::ParseToml(stray, "x.toml");
    ASSERT_FALSE(bad.has_value()) << stray;
    EXPECT_EQ(bad.error().code, Code::BadData);
  }
}

TEST(Toml, SaysWhenAFileIsNotThere) {
  const auto read = io::ReadTomlFile("/nonexistent/a.toml");
  ASSERT_FALSE(read.has_value());
  EXPECT_EQ(read.error().code, Code::Io);
}

}  // namespace
}  // namespace lensd
