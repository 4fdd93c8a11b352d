"""Moves focus, waits until it has settled, and says what that is worth."""
import sys

import lensd

path, name, where = sys.argv[1:4]  # "/run/lensd/io.lensd.Lens" "cam" "2m"
with lensd.Lens(path, name) as lens:
    try:
        move = lens.focus(where, progress=lambda now: print(f"  at {now.position:.0f}"), timeout_s=60)
    except lensd.OutOfRange as error:
        sys.exit(f"{error}; it takes {error.minimum} to {error.maximum} {error.unit}")
    except lensd.LensdError as error:
        print(error, file=sys.stderr)
        sys.exit(error.exit_status)
    print(f"{'reached' if move.reached else 'missed'}: focus at {move.position:g} +- {move.position_bound}, {move.reason or 'measured'}")
    if move.vergence_d is not None:
        print(f"in focus: {move.vergence_d:.4f} D")
