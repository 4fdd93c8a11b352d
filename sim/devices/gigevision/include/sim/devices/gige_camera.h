// A GigE Vision camera with a motorised lens, on the network of this machine: the server side of the protocol is
// Aravis' fake camera, what its registers do and what its pictures show is the simulator's.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "base/clock.h"
#include "base/result.h"

namespace lensd::sim {

/// What the lens' position features read.
enum class GigePosition {
  Live,  ///< where it is
  Echo,  ///< the target, as soon as it is written
  AtEnd  ///< where it was, until it stands
};

/// Which end of its travel the focus feature counts from.
enum class GigeFocusZero {
  Near,  ///< as SFNC has FocusStepper: 0 is the closest focus
  Far
};

struct GigeOptions {
  std::string scene{};  ///< scene file
  std::string serial = "GV01";
  std::string interface = "127.0.0.1";  ///< an address of this machine; one camera an address
  double lost_packets = 0.0;            ///< part of the stream's packets never sent, 0..1
  std::string names = "sfnc";  ///< of the lens' features: sfnc, sfnc-abort (nothing beside it), basler, allied-vision,
                               ///< imaging-source, none
  bool needs_initialize = false;  ///< the lens says NotInitialized until told to initialize
  GigePosition position = GigePosition::Live;
  GigeFocusZero focus_zero = GigeFocusZero::Near;  ///< of steps; a focus in dioptres grows toward near by its unit
  Duration echo{};                                 ///< so long after a write positions read the target
  Duration stale{};                                ///< so long they read the place from before
  Duration busy_late{};                            ///< from the beginning of a motion until its status says Busy
  std::uint64_t seed = 1;                          ///< of the noise
  std::function<std::string(std::string)> edit_description{};  ///< what the camera serves in place of its description
};

/// The camera is there from Start() until it is destroyed. Registers follow the simulated lens within about a
/// millisecond; each picture shows the lens as it was during the exposure its time stamp names. The camera's clock is
/// not the host's.
class GigeCamera {
 public:
  /// BadData, Io: the scene. Busy: the address has a camera already. InvalidArgument: an option; an address this
  /// machine does not have.
  static Result<std::unique_ptr<GigeCamera>> Start(const GigeOptions& options, const Clock& clock);
  ~GigeCamera();
  GigeCamera(const GigeCamera&) = delete;
  GigeCamera& operator=(const GigeCamera&) = delete;

  /// Sends the simulated lens' focus motor to `steps`, counted from far, as if something else turned it. Any thread.
  void PlaceFocus(double steps);
  /// While frozen, registers show what they showed then, and commands are obeyed all the same. Any thread.
  void Freeze(bool frozen);
  /// Where the focus mechanism really is, in steps from its far end, whatever its feature counts. Any thread.
  double TrueFocus() const;
  /// The GenICam description a client downloads.
  const std::string& description() const;

 private:
  struct Body;
  explicit GigeCamera(std::unique_ptr<Body> body);
  std::unique_ptr<Body> body_;
};

}  // namespace lensd::sim
