// Pixel formats that this driver turns into luminance.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/pixels/luma.h"

namespace lensd::drivers::v4l2 {

/// How the samples of a V4L2 pixel format lie; none: not known.
std::optional<drivers::pixels::RawFormat> RawFormatOf(std::uint32_t code);
/// The first of `offered` that is known, the best for measuring first: many bits before few, linear light before video.
std::optional<std::uint32_t> BestOf(const std::vector<std::uint32_t>& offered);
/// Of what the device offers, what can be read, for people; a device may offer fifty more.
std::string WhatFits(const std::vector<std::uint32_t>& offered);
/// "YUYV" and back; shorter names are filled with blanks.
std::string NameOfFormat(std::uint32_t code);
std::uint32_t FormatNamed(const std::string& name);
/// Samples are light itself, not a picture for eyes.
bool IsLinear(const drivers::pixels::RawFormat& format);

}  // namespace lensd::drivers::v4l2
