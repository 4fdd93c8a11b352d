// Requests to end a call are not waited for: their replies are passed over before the next call begins.
#include "urgent.h"

#include <sys/eventfd.h>

#include <utility>

namespace lensd::drivers::process {

Urgent::Urgent(std::unique_ptr<Link> link, std::string device)
    : link_(std::move(link)), device_(std::move(device)), wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

Result<void> Urgent::Settle(Instant deadline) {
  if (link_->received() >= link_->sent()) return {};
  const auto last = link_->Receive(link_->sent(), deadline, -1);
  if (!last) return PassOn(last);
  return {};
}

void Urgent::Begin(bool reading) {
  const std::lock_guard lock(mutex_);
  under_way_ = UnderWay{.reading = reading};
  eventfd_t unused = 0;
  eventfd_read(wake_.get(), &unused);
}

void Urgent::End() {
  const std::lock_guard lock(mutex_);
  under_way_.reset();
}

bool Urgent::interrupted() {
  const std::lock_guard lock(mutex_);
  return under_way_ && under_way_->interrupted;
}

Result<std::uint64_t> Urgent::Send(std::string_view method, varlink::Json parameters, Instant deadline) {
  const std::lock_guard lock(mutex_);
  return link_->Send(method, std::move(parameters), deadline);
}

/// Where the process does not even read this, its call is given up all the same.
void Urgent::Urge(std::string_view method) {
  (void)link_->Send(method, {{"device", device_}}, MonotonicClock().Now());
  eventfd_write(wake_.get(), 1);
}

void Urgent::Interrupt() {
  const std::lock_guard lock(mutex_);
  if (!under_way_ || under_way_->interrupted) return;
  under_way_->interrupted = true;
  Urge("Interrupt");
}

void Urgent::CutReadShort() {
  const std::lock_guard lock(mutex_);
  if (!under_way_ || !under_way_->reading || under_way_->cut_short || under_way_->interrupted) return;
  under_way_->cut_short = true;
  Urge("CutReadShort");
}

}  // namespace lensd::drivers::process
