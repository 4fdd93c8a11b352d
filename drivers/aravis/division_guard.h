// Formulas of a camera's GenICam file that divide the smallest 64-bit integer by -1.
//
// Aravis 0.8 computes integer formulas with the processor's division and checks for a divisor of 0 alone. The quotient
// of -2^63 and -1 does not fit into 64 bits: on x86-64 the processor raises an exception there, for which the kernel
// ends the whole process; on ARM64 the quotient is -2^63 and the remainder 0. Both operands can come from registers, so
// no look at the file tells whether that will happen.
#pragma once

namespace lensd::drivers::aravis {

/// From now on such a division inside of Aravis' library has ARM64's result on every machine. A division anywhere else,
/// and every other fault, goes to what handled SIGFPE before. Once is enough; any thread.
void GuardDivisions();

}  // namespace lensd::drivers::aravis
