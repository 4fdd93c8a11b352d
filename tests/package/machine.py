"""A Debian 12 in a folder, for tests of packages. Needs root and Debian's archive."""
import glob
import os
import shutil
import subprocess
import tempfile

# What any installation of anything writes.
OTHERS = ("./var/cache/", "./var/log/", "./var/lib/dpkg/", "./var/lib/apt/", "./tmp/", "./debs/", "./older/", "./proc/", "./dev/",
          "./run/", "./etc/ld.so.cache", "./root/")
EXAMPLE = "/usr/share/doc/lensd/examples/sim.toml"


class Machine:
    """Its base is made once, in the folder that the packages' folder lies in; each folder of packages is copied into it by its name."""

    def __init__(self, debs, **others):
        base = os.path.join(os.path.dirname(debs), "package-base.tar")
        if not os.path.exists(base):
            subprocess.run(["mmdebstrap", "--variant=minbase", "bookworm", base], check=True, stdout=subprocess.DEVNULL,
                           stderr=subprocess.DEVNULL)
        self.root = tempfile.mkdtemp(prefix="lensd-package-")
        subprocess.run(["tar", "-x", "-f", base, "-C", self.root], check=True)
        self.write("usr/sbin/policy-rc.d", "#!/bin/sh\nexit 101\n")
        for folder, packages in {"debs": debs, **others}.items():
            os.mkdir(os.path.join(self.root, folder))
            for package in glob.glob(os.path.join(packages, "*.deb")):
                if "-dbgsym" not in package:
                    shutil.copy(package, os.path.join(self.root, folder))
        self.run("apt-get -qq update")

    def close(self):
        shutil.rmtree(self.root)

    def write(self, name, script):
        with open(os.path.join(self.root, name), "w", encoding="utf-8") as file:
            file.write(script)
        os.chmod(file.name, 0o755)

    def run(self, command, check=True):
        done = subprocess.run(["unshare", "--mount", "--pid", "--fork", f"--mount-proc={self.root}/proc", "chroot", self.root, "sh", "-c",
                               command], capture_output=True, text=True, timeout=900, check=False,
                              env={"PATH": "/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin", "DEBIAN_FRONTEND": "noninteractive",
                                   "LC_ALL": "C.UTF-8"})
        if check and done.returncode != 0:
            raise AssertionError(f"{command}: {done.returncode}\n{done.stdout[-3000:]}{done.stderr[-3000:]}")
        return done.stdout

    def files(self):
        listed = subprocess.run(["find", ".", "-xdev"], cwd=self.root, capture_output=True, text=True, check=True).stdout.split("\n")
        return {name for name in listed if not name.startswith(OTHERS) and "__pycache__" not in name}

    def with_daemon(self, *commands):
        """Each command's output, with lensd on the example that it brings."""
        script = [f"lensd --config {EXAMPLE} --socket /run/l --state /var/lib/lensd 2>/tmp/log & daemon=$!",
                  "for i in $(seq 200); do [ -S /run/l ] && break; sleep 0.1; done", "export LENSD_SOCKET=/run/l",
                  "lensctl wait connected --timeout 20s >/dev/null"]
        script += [f"{command}; echo \"=== $?\"" for command in commands]
        script += ["kill $daemon", "wait $daemon"]
        return self.run("; ".join(script)).split("=== ")

    def packages(self):
        return set(self.run("dpkg-query -W -f '${db:Status-Status} ${Package}\\n' | sed -n 's/^installed //p'").split())
