// Handles SIGFPE: where Aravis' instruction is a division that overflowed, its result is filled in and it is passed.
#include "division_guard.h"

#if defined(__x86_64__)

#include <arv.h>
#include <link.h>
#include <ucontext.h>

#include <array>
#include <csignal>
#include <cstdint>
#include <limits>
#include <mutex>
#include <optional>

namespace lensd::drivers::aravis {
namespace {

struct CodeRange {
  std::uintptr_t begin = 0, end = 0;
};

// Both are written before the handler is set, and never again.
CodeRange aravis_code;
struct sigaction handler_before;

/// Called for every library that is loaded: takes that segment of code which holds a function of Aravis'.
int TakeCode(dl_phdr_info* library, std::size_t, void*) {
  const auto inside = reinterpret_cast<std::uintptr_t>(&arv_evaluator_evaluate_as_int64);
  for (int i = 0; i < library->dlpi_phnum; ++i) {
    const ElfW(Phdr)& segment = library->dlpi_phdr[i];
    const std::uintptr_t begin = library->dlpi_addr + segment.p_vaddr, end = begin + segment.p_memsz;
    if (segment.p_type == PT_LOAD && (segment.p_flags & PF_X) != 0 && begin <= inside && inside < end)
      aravis_code = {begin, end};
  }
  return 0;
}

/// The places of the registers 0 to 15 of an instruction.
constexpr std::array<int, 16> kRegisters = {REG_RAX, REG_RCX, REG_RDX, REG_RBX, REG_RSP, REG_RBP, REG_RSI, REG_RDI,
                                            REG_R8,  REG_R9,  REG_R10, REG_R11, REG_R12, REG_R13, REG_R14, REG_R15};
constexpr std::size_t kIdivBytes = 3;

/// The divisor's register where a 64-bit "idiv register" stands at `code`: a REX.W prefix, F7, and a byte with two
/// bits that say register, three that say idiv, and the number of the register (Intel's manual, volume 2, IDIV).
std::optional<int> DivisorOf(const unsigned char* code) {
  constexpr unsigned kRexW = 0x48, kUpperRegisters = 1, kDivision = 0xf7, kSignedByRegister = 0xf8;
  if ((code[0] & ~kUpperRegisters) != kRexW || code[1] != kDivision) return std::nullopt;
  if ((code[2] & kSignedByRegister) != kSignedByRegister) return std::nullopt;
  return kRegisters[(code[2] & 7U) + 8U * (code[0] & kUpperRegisters)];
}

/// Uses nothing that a signal handler may not.
void OnDivision(int, siginfo_t*, void* interrupted) {
  greg_t* registers = static_cast<ucontext_t*>(interrupted)->uc_mcontext.gregs;
  const auto at = static_cast<std::uintptr_t>(registers[REG_RIP]);
  if (at >= aravis_code.begin && at + kIdivBytes <= aravis_code.end) {
    const auto* inside = reinterpret_cast<const unsigned char*>(&arv_evaluator_evaluate_as_int64);
    const auto divisor = DivisorOf(inside + (registers[REG_RIP] - reinterpret_cast<std::intptr_t>(inside)));
    const bool smallest = registers[REG_RAX] == std::numeric_limits<greg_t>::min() && registers[REG_RDX] == -1;
    if (divisor && smallest && registers[*divisor] == -1) {
      registers[REG_RDX] = 0;  // the remainder; RAX has the quotient already
      registers[REG_RIP] += kIdivBytes;
      return;
    }
  }
  // The instruction is tried again on return, and faults for who handled that before.
  sigaction(SIGFPE, &handler_before, nullptr);
}

}  // namespace

void GuardDivisions() {
  static std::once_flag once;
  std::call_once(once, [] {
    dl_iterate_phdr(TakeCode, nullptr);
    sigaction(SIGFPE, nullptr, &handler_before);
    struct sigaction handler{};
    handler.sa_sigaction = OnDivision;
    handler.sa_flags = SA_SIGINFO;
    sigemptyset(&handler.sa_mask);
    sigaction(SIGFPE, &handler, nullptr);
  });
}

}  // namespace lensd::drivers::aravis

#else

namespace lensd::drivers::aravis {

void GuardDivisions() {}

}  // namespace lensd::drivers::aravis

#endif
