// Whether the bytes of a picture are as many as its rows take, and what they look like where they are not.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

namespace lensd::drivers::pixels {

/// Rows of one plane, or of a picture with what follows its first plane.
struct Rows {
  int width = 0;           ///< px, >= 1
  int height = 0;          ///< px, >= 1
  std::size_t row = 0;     ///< bytes of a row of pixels, >= 1
  std::size_t stride = 0;  ///< bytes from row to row, >= row
  std::size_t after = 0;   ///< bytes that may follow: planes of colour, or padding
};

/// Why so many bytes cannot be these rows, in words for whoever sent them: "the frame has 9216 bytes where 64 x 48
/// pixels take 3072: three bytes a pixel: this looks like RGB". Nothing: they can. The last row may lack its padding.
std::optional<std::string> WhyNotRows(std::size_t bytes, const Rows& rows);

}  // namespace lensd::drivers::pixels
