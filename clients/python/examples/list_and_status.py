"""Which lenses there are, and how each of them stands."""
import sys

import lensd

with lensd.Lens(*sys.argv[1:2]) as lenses:
    for info in lenses.list():
        print(f"{info.name}: {info.model}, driver {info.driver}, axes {', '.join(axis.axis for axis in info.axes)}")
    for state in lenses.statuses():
        if not state.connected:
            print(f"{state.name}: {state.connection}: {state.error}")
            continue
        places = ", ".join(f"{axis.axis} at {axis.position:g}" for axis in state.axes)
        print(f"{state.name}: {state.activity}, {places}")
