// Checksums of kept files: every change of one byte is seen, and the standard's own check value comes out.
#include "io/checked_file.h"

#include <gtest/gtest.h>

#include <string>

namespace lensd::io {
namespace {

/// "123456789" has the CRC-32 cbf43926 (ISO-HDLC).
TEST(CheckedFile, UsesTheStandardChecksum) {
  EXPECT_EQ(SignedLines("123456789"), "123456789# crc32 cbf43926\n");
}

TEST(CheckedFile, SeesEveryChangedByte) {
  const std::string lines = SignedLines("version = 1\n[[focus]]\nstep = 3\n");
  const std::string object = SignedObject(R"({"axes":{"focus":{"position":12.5}},"version":1})");
  EXPECT_EQ(IntegrityOfLines(lines), Integrity::Whole);
  EXPECT_EQ(IntegrityOfObject(object), Integrity::Whole);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    std::string changed = lines;
    changed[i] = static_cast<char>(changed[i] ^ 1);
    EXPECT_NE(IntegrityOfLines(changed), Integrity::Whole) << i;
  }
  for (std::size_t i = 0; i < object.size(); ++i) {
    std::string changed = object;
    changed[i] = static_cast<char>(changed[i] ^ 1);
    EXPECT_NE(IntegrityOfObject(changed), Integrity::Whole) << i;
    EXPECT_NE(IntegrityOfObject(object.substr(0, i)), Integrity::Whole) << i;
  }
}

TEST(CheckedFile, WhatHasNoneIsUnsigned) {
  EXPECT_EQ(IntegrityOfLines("version = 1\n"), Integrity::Unsigned);
  EXPECT_EQ(IntegrityOfLines(""), Integrity::Unsigned);
  EXPECT_EQ(IntegrityOfObject(R"({"version":1})"), Integrity::Unsigned);
  EXPECT_EQ(IntegrityOfLines(SignedLines("a = 1\n") + "b = 2\n"), Integrity::Changed);
}

}  // namespace
}  // namespace lensd::io
