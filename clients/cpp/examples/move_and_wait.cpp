// Moves focus, waits until it has settled, and says what that is worth.
#include <lensd/client.h>

#include <cstdio>

int main(int argc, char** argv) {
  if (argc < 4) return 64;
  try {
    lensd::Client client(argv[1]);
    const lensd::MoveResult move = client.Focus(argv[2], argv[3]);  // "cam", "2m"
    std::printf("%s: focus at %g within %g: %s\n", move.reached() ? "reached" : "missed", move.position(),
                move.positionBound().value_or(0), move.reason().value_or("measured").c_str());
    return move.reached() ? 0 : 1;
  } catch (const lensd::LensdError& error) {
    std::fprintf(stderr, "%s (%s)\n", error.what(), error.code().c_str());
    if (error.Is("OutOfRange") && error.minimum())
      std::fprintf(stderr, "from %g %s\n", *error.minimum(), error.unit().c_str());
    return error.exit_status();
  }
}
