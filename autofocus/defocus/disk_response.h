// How much of a sinusoid survives a blur disk: the optics of the method, in one function.
#pragma once

namespace lensd::autofocus::defocus {

/// 2 J1(x)/x with x = pi * diameter * frequency: what a uniform disk leaves of a sinusoid's amplitude, with its sign.
/// `turns` = diameter (px) * frequency (cycles per px), any sign. From a table, within 1e-5; zero beyond 200 turns.
double DiskResponse(double turns);

}  // namespace lensd::autofocus::defocus
