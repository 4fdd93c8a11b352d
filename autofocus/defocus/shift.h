// How far the picture moved sideways between two frames.
#pragma once

#include "autofocus/defocus/rings.h"

namespace lensd::autofocus::defocus {

struct Shift {
  double x = 0.0;  ///< px that `second` must be moved by to lie on `first`
  double y = 0.0;
  bool clear = false;   ///< they fit clearly better so than unmoved
  bool lost = false;    ///< whatever fits best lies at the edge of what was searched, or is `unlike`
  bool unlike = false;  ///< no shift makes them alike: it is another picture
};

/// The plain cross-correlation's peak within kSearched px. Blur that differs between the frames leaves it where it is,
/// which is not so once the spectra are whitened: a disk's response changes sign. Where that has turned round all there
/// is (one period alone), no shift is told. The tiles are the same.
Shift ShiftBetween(const Tiles& first, const Tiles& second);

/// `tiles` as if the picture had been moved by `shift`.
void Move(Tiles& tiles, const Shift& shift);

}  // namespace lensd::autofocus::defocus
