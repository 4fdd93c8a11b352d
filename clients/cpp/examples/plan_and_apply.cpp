// Asks for a setting that keeps two subjects as wanted, goes there, and says how they fare.
#include <lensd/client.h>

#include <cstdio>

int main(int argc, char** argv) {
  if (argc < 3) return 64;
  lensd::Client client(argv[1]);
  const std::vector<lensd::BlurLimit> limits = {lensd::Sharp("1.1m..1.3m", "12um").name("wall"),
                                                lensd::Blurred("5m..inf", "20um").name("background").side("behind")};
  const lensd::PlanReply done =
      client.Plan(lensd::PlanParameters().lens(argv[2]).request(lensd::PlanRequest().limits(limits)).apply(true));
  if (!done.plan().feasible()) {
    std::printf("cannot be: all limits %g times as wide would do\n", done.plan().relax().value_or(0));
    return 1;
  }
  std::printf("f/%.3g, focus at %.3f m\n", done.plan().fNumber().value(), done.plan().focalPlaneM().value());
  const std::optional<lensd::PlanAnswer> reached = done.reached();
  if (!reached) return 1;
  for (const lensd::PlanLimit& limit : reached->limits()) {
    std::printf("%s: %.1f um of %g um\n", limit.name().c_str(), limit.worstUm().value(), limit.limitUm().value());
  }
}
