"""Autofocus with the frames of a camera of one's own. Here a second connection to lensd plays that camera: in its place stands
whatever exposes a new frame and gives its pixels."""
import sys

import lensd

path, name = sys.argv[1:3]
with lensd.Lens(path, name) as lens, lensd.Lens(path, name) as camera:

    def grab(step: lensd.types.AutofocusStep) -> lensd.Frame:
        """The lens stands at step.position; a frame that is exposed from now on will do."""
        picture = camera.snapshot(encoding="gray8")
        return lensd.Frame(picture.samples, gamma=picture.info.gamma, exposure_start_ns=picture.frame.exposure_start_ns,
                           exposure_end_ns=picture.frame.exposure_end_ns)

    result = lens.autofocus(grab=grab, pixel_um=3.45)
    print(f"{'focused' if result.focused else 'refused'} after {result.frames} frames: {result.reason}")
    if result.focused and result.vergence_d:
        print(f"at {1 / result.vergence_d:.3f} m")
    sys.exit(0 if result.focused else 1)
