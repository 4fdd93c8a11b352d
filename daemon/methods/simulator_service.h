// The interface io.lensd.Simulator: the truth of simulated lenses, and faults on demand.
#pragma once

#include <stop_token>

#include "daemon/methods/lens_service.h"
#include "daemon/server/router.h"
#include "daemon/threads/task_thread.h"

namespace lensd::daemon {

/// Event loop thread only.
class SimulatorService final : public Service {
 public:
  /// `lenses` must outlive it.
  explicit SimulatorService(LensService& lenses);
  ~SimulatorService() override;

  /// While any lens of the configuration, which may change, is simulated.
  bool Offered() const override;
  const varlink::InterfaceDefinition& definition() const override { return definition_; }
  const MethodTable& methods() const override { return methods_; }

 private:
  using Serve = void (SimulatorService::*)(drivers::Simulation& simulation, const ExchangePointer& exchange);
  /// Serves calls with the simulation of the lens they name, once its device has been tried.
  Method Row(std::string_view name, Serve serve);
  void Truth(drivers::Simulation& simulation, const ExchangePointer& exchange);
  void Inject(drivers::Simulation& simulation, const ExchangePointer& exchange);
  void Render(drivers::Simulation& simulation, const ExchangePointer& exchange);

  LensService& lenses_;
  varlink::InterfaceDefinition definition_;
  MethodTable methods_;
  std::stop_source ending_;
  TaskThread pictures_;
};

}  // namespace lensd::daemon
