// What a lens and a camera of one device share: the open transport, the controls and the automatics.
#pragma once

#include <memory>
#include <string>

#include "automatics.h"
#include "controls.h"
#include "descriptors.h"
#include "drivers/api/thread_barrier.h"

namespace lensd::drivers::uvc {

struct Identity {
  std::string model;
  std::string serial;
};

/// Destroying it restores the camera's automatics and gives the interfaces back.
class Session {
 public:
  /// `the_clock` must outlive it.
  Session(std::shared_ptr<Transport> transport, const Clock& the_clock, VideoFunction its_function,
          CameraTerminal its_terminal, Identity its_identity, ControlOptions options)
      : function(std::move(its_function)),
        terminal(its_terminal),
        identity(std::move(its_identity)),
        clock(the_clock),
        controls(transport, clock, function.interface, options),
        automatics(controls, terminal, function.interface),
        transport_(std::move(transport)) {}
  ~Session() {
    Contain([this] {
      transport_->BeginCall();
      if (!transport_->Gone()) automatics.Restore();
    });
  }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  ControlAddress At(const UnitControl& control) const { return {control.selector, terminal.id, function.interface}; }
  Transport& transport() { return *transport_; }

  const VideoFunction function;
  const CameraTerminal terminal;  ///< id 0: this function has none
  const Identity identity;
  const Clock& clock;
  Controls controls;
  Automatics automatics;

 private:
  const std::shared_ptr<Transport> transport_;
};

}  // namespace lensd::drivers::uvc
