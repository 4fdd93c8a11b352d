// A lens whose every call is a call of its process. Stop goes by a connection of its own.
#include <utility>

#include "parts.h"

namespace lensd::drivers::process {
namespace {

using wire::Json;

class ProcessLens final : public Lens {
 public:
  ProcessLens(std::shared_ptr<Remote> remote, Capabilities can, const Clock& clock)
      : Lens(std::move(can)), remote_(std::move(remote)), clock_(clock) {}

 private:
  Result<void> Command(Remote::By by, std::string_view method, Json parameters) {
    const auto done = remote_->Call(by, method, std::move(parameters));
    if (!done) return PassOn(done);
    return {};
  }

  Result<void> DoStartHome(Axis axis) override {
    return Command(Remote::By::Lens, "StartHome", {{"axis", AxisName(axis)}});
  }
  Result<void> DoStartMove(Axis axis, Native target) override {
    return Command(Remote::By::Lens, "StartMove", {{"axis", AxisName(axis)}, {"target", target.value}});
  }
  Result<LensState> DoRead() override {
    const auto reply = remote_->Call(Remote::By::Lens, "Read");
    if (!reply) return PassOn(reply);
    auto state = wire::StateFrom(*reply, capabilities(), clock_.Now());
    if (!state) remote_->CountWrongReply();
    return state;
  }
  Result<void> DoStop(Axis axis) override { return Command(Remote::By::Urgent, "Stop", {{"axis", AxisName(axis)}}); }
  Result<void> DoResetFault(Axis axis) override {
    return Command(Remote::By::Lens, "ResetFault", {{"axis", AxisName(axis)}});
  }
  void DoInterrupt() override { remote_->Interrupt(); }
  void DoCutReadShort() override { remote_->CutReadShort(); }
  std::uint64_t DoCountBusErrors() const override { return remote_->bus_errors(); }

  const std::shared_ptr<Remote> remote_;
  const Clock& clock_;
};

}  // namespace

std::unique_ptr<Lens> MakeLens(std::shared_ptr<Remote> remote, Capabilities can, const Clock& clock) {
  return std::make_unique<ProcessLens>(std::move(remote), std::move(can), clock);
}

}  // namespace lensd::drivers::process
