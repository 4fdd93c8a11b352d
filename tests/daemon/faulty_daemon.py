"""lensd with a driver that throws and hangs when told to (tests/daemon/faulty)."""
import os
import shutil
import tempfile

from harness import HERE, LENS, Daemon


class FaultyDaemon(Daemon):
    """Its simulated lenses each have a scene of their own, and a file beside it that says what goes wrong."""
    program = "lensd_faulty"

    def __init__(self, lenses=("a", "b"), **options):
        self.scenes = tempfile.TemporaryDirectory(prefix="lensd-faulty-")
        text = "version = 1\n"
        for name in lenses:
            shutil.copy(os.path.join(HERE, "small.toml"), self.scene(name))
            text += f'[[lens]]\nname = "{name}"\ndriver = "sim"\nscene = "{self.scene(name)}"\n'
        super().__init__(config=text, **options)

    def scene(self, lens):
        return os.path.join(self.scenes.name, lens + ".toml")

    def fault(self, lens, *faults):
        """From now on these go wrong with a lens, and nothing else."""
        with open(self.scene(lens) + ".new", "w", encoding="utf-8") as file:
            file.write("".join(fault + "\n" for fault in faults))
        os.rename(self.scene(lens) + ".new", self.scene(lens) + ".faults")

    @staticmethod
    def status(client, lens):
        return client.call(LENS + "Status", {"lens": lens})["parameters"]["lenses"][0]

    @staticmethod
    def move(client, lens, position):
        return client.call(LENS + "Move", {"lens": lens, "axis": "focus", "target": {"position": position}})

    def lines(self, *words):
        return [line for line in self.log().splitlines() if all(word in line for word in words)]

    def stop(self):
        status = super().stop()
        self.scenes.cleanup()
        return status
