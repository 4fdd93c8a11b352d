"""Asks for a setting that keeps two subjects as wanted, goes there, and says how they fare."""
import sys

import lensd

path, name = sys.argv[1:3]
with lensd.Lens(path, name) as lens:
    wanted = [lensd.sharp("1.1m..1.3m", "12um", name="wall"), lensd.blurred("5m..inf", "20um", name="background", side="behind")]
    done = lens.plan(wanted, apply=True)
    if not done.plan.feasible:
        sys.exit(f"cannot be: {', '.join(done.plan.conflict or [])}; all limits {done.plan.relax} times as wide would do")
    print(f"f/{done.plan.f_number:.3g}, focus at {done.plan.focal_plane_m:.3f} m")
    for limit in (done.reached or done.plan).limits or []:
        print(f"{limit.name}: {limit.worst_um:.1f} um of {limit.limit_um:g} um")
