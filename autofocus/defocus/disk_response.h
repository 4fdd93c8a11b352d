// How much of a sinusoid survives a blur disk: the optics of the method, in one function.
#pragma once

namespace lensd::autofocus::defocus {

/// 2 J1(x)/x with x = pi * diameter * frequency: what a uniform disk leaves of a sinusoid's amplitude, with its sign.
/// `turns` = diameter (px) * frequency (cycles per px), any sign. From a table, within 1e-5; zero beyond 200 turns.
double DiskResponse(double turns);

/// What DiskResponse() interpolates between: entry i is the response at i / kDiskResponsePerTurn turns. For sums over
/// many rings at a time; never ends.
constexpr int kDiskResponseEntries = 200 * 256 + 2;
constexpr double kDiskResponsePerTurn = 256.0;
const double* DiskResponseTable();

}  // namespace lensd::autofocus::defocus
