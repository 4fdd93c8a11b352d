// Words as people mistype them.
#include "base/nearest_word.h"

#include <gtest/gtest.h>

#include <vector>

namespace lensd {
namespace {

const std::vector<std::string> kWords = {"aperture", "autofocus", "blur", "calibrate", "dof",
                                         "focus",    "focus-map", "home", "list"};

std::string Meant(std::string_view typed) {
  return NearestWord(typed, kWords).value_or("");
}

TEST(NearestWord, OfOneLetterLeftOutAddedExchangedOrSwapped) {
  EXPECT_EQ(Meant("apertre"), "aperture");
  EXPECT_EQ(Meant("focuss"), "focus");
  EXPECT_EQ(Meant("blor"), "blur");
  EXPECT_EQ(Meant("fcous"), "focus");
  EXPECT_EQ(Meant("lits"), "list");
}

TEST(NearestWord, OfMoreInLongWords) {
  EXPECT_EQ(Meant("apretur"), "aperture");
  EXPECT_EQ(Meant("autofokuss"), "autofocus");
}

TEST(NearestWord, TheOnlyOneThatIsBegun) {
  EXPECT_EQ(Meant("auto"), "autofocus");
  EXPECT_EQ(Meant("cal"), "calibrate");
  EXPECT_EQ(Meant("foc"), "");  // two begin so
}

TEST(NearestWord, NoneThatIsFarOrOneOfTwo) {
  EXPECT_EQ(Meant("xyz"), "");
  EXPECT_EQ(Meant(""), "");
  EXPECT_EQ(Meant("stop"), "");
  EXPECT_EQ(NearestWord("ab", std::vector<std::string>{"ac", "ad"}), std::nullopt);
  EXPECT_EQ(NearestWord("ab", std::vector<std::string>{}), std::nullopt);
}

}  // namespace
}  // namespace lensd
