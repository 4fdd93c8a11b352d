// Messages are cut the same way however the bytes arrive; base64 and a client's refusals besides.
#include "varlink/frame.h"

#include <gtest/gtest.h>

#include <random>

#include "varlink/base64.h"
#include "varlink/client.h"

namespace lensd::varlink {
namespace {

TEST(FrameReader, CutsTheSameMessagesHoweverTheReadsFall) {
  const std::vector<std::string> messages = {"{}", "", std::string(5000, 'x'), "{\"method\":\"a.B\"}", "y"};
  std::string stream;
  for (const std::string& message : messages) stream += message + '\0';
  std::mt19937 random(7);
  for (int round = 0; round < 300; ++round) {
    FrameReader reader;
    std::vector<std::string> got;
    std::uniform_int_distribution<std::size_t> length(1, round % 2 ? 7 : 4000);
    for (std::size_t at = 0; at < stream.size();) {
      const std::string piece = stream.substr(at, length(random));
      at += piece.size();
      reader.Append(piece);
      for (auto next = reader.Next(); next && *next; next = reader.Next()) got.emplace_back(**next);
    }
    ASSERT_EQ(got, messages);
    EXPECT_EQ(reader.pending(), 0u);
  }
}

TEST(FrameReader, RefusesMoreThanOneMebibyteWithOrWithoutAnEnd) {
  FrameReader exact;
  exact.Append(std::string(kMaxMessageBytes, 'x'));
  EXPECT_FALSE(exact.Next().value().has_value());
  exact.Append(std::string(1, '\0'));
  EXPECT_EQ(exact.Next().value()->size(), kMaxMessageBytes);
  FrameReader endless;
  endless.Append(std::string(kMaxMessageBytes + 1, 'x'));
  EXPECT_EQ(endless.Next().error().code, Code::Protocol);
  FrameReader ended;
  ended.Append(std::string(kMaxMessageBytes + 1, 'x') + '\0');
  EXPECT_EQ(ended.Next().error().code, Code::Protocol);
}

TEST(FrameReader, OfRepliesTakesLongerOnes) {
  FrameReader replies(kMaxReplyBytes);
  replies.Append(std::string(3 * kMaxMessageBytes, 'x') + '\0');
  EXPECT_EQ(replies.Next().value()->size(), 3 * kMaxMessageBytes);
}

TEST(Base64, MeetsTheExamplesOfItsStandard) {
  const std::pair<std::string, std::string> examples[] = {{"", ""},
                                                          {"f", "Zg=="},
                                                          {"fo", "Zm8="},
                                                          {"foo", "Zm9v"},
                                                          {"foob", "Zm9vYg=="},
                                                          {"fooba", "Zm9vYmE="},
                                                          {"foobar", "Zm9vYmFy"}};
  for (const auto& [plain, text] : examples) {
    const std::vector<std::uint8_t> bytes(plain.begin(), plain.end());
    EXPECT_EQ(EncodeBase64(bytes), text);
    EXPECT_EQ(DecodeBase64(text).value(), bytes);
  }
  for (const char* wrong : {"Zg=", "Z===", "Zg==Zg==", "Zm9v!AAA", "=AAA"}) {
    EXPECT_FALSE(DecodeBase64(wrong).has_value()) << wrong;
  }
}

TEST(Client, SaysWhyItCannotConnect) {
  EXPECT_EQ(Client::Connect("/no/such/socket").error().code, Code::Disconnected);
  EXPECT_EQ(Client::Connect("").error().code, Code::InvalidArgument);
  EXPECT_EQ(Client::Connect(std::string(200, 'x')).error().code, Code::InvalidArgument);
}

}  // namespace
}  // namespace lensd::varlink
