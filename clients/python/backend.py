"""Builds the wheel and the source archive of this package for pip and other installers (PEP 517). It needs Python's own library
alone, so nothing is fetched. In a checkout the modules that are written by a program come from clients/generate; a source archive
has them."""
import base64
import gzip
import hashlib
import io
import os
import sys
import tarfile
import tomllib
import zipfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))


def read(*path):
    with open(os.path.join(*path), "rb") as file:
        return file.read()


def texts_of(*folder):
    """The files of a folder, by their name."""
    path = os.path.join(HERE, *folder)
    return {name: read(path, name) for name in sorted(os.listdir(path)) if name.endswith(".py") or name == "py.typed"}


def package():
    """Every file of the package, by its name."""
    if os.path.exists(os.path.join(HERE, "lensd", "types.py")):
        return texts_of("lensd")
    generator = os.path.join(ROOT, "clients", "generate")
    if not os.path.isdir(generator):
        sys.exit("lensd: clients/generate is not beside this folder, and writes modules that are missing here: take all of the repository")
    sys.path.insert(0, generator)
    import files  # pylint: disable=import-error,import-outside-toplevel
    return {name: text.encode() for name, text in sorted(files.python_package().items())}


def licence():
    return read(HERE, "LICENSE") if os.path.exists(os.path.join(HERE, "LICENSE")) else read(ROOT, "LICENSE")


def project():
    """Name and version, and the metadata that installers read."""
    about = tomllib.loads(read(HERE, "pyproject.toml").decode())["project"]
    text = (f"Metadata-Version: 2.1\nName: {about['name']}\nVersion: {about['version']}\nSummary: {about['description']}\n"
            f"License: {about['license']['text']}\nRequires-Python: {about['requires-python']}\n")
    return f"{about['name']}-{about['version']}", text.encode()


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):  # pylint: disable=unused-argument
    """Writes the wheel into a folder and returns its name."""
    base, metadata = project()
    about = f"{base}.dist-info/"
    content = {f"lensd/{name}": data for name, data in package().items()}
    content[about + "LICENSE"] = licence()
    content[about + "METADATA"] = metadata
    content[about + "WHEEL"] = b"Wheel-Version: 1.0\nGenerator: lensd\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
    record = ""
    for name, data in content.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        record += f"{name},sha256={digest},{len(data)}\n"
    content[about + "RECORD"] = f"{record}{about}RECORD,,\n".encode()
    os.makedirs(wheel_directory, exist_ok=True)
    wheel = f"{base}-py3-none-any.whl"
    with zipfile.ZipFile(os.path.join(wheel_directory, wheel), "w", zipfile.ZIP_DEFLATED) as file:
        for name, data in content.items():
            entry = zipfile.ZipInfo(name)  # of 1980, so that one source gives one wheel
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o100644 << 16
            file.writestr(entry, data)
    return wheel


def build_sdist(sdist_directory, config_settings=None):  # pylint: disable=unused-argument
    """Writes the source archive, which needs no generator, into a folder and returns its name."""
    base, metadata = project()
    content = {f"lensd/{name}": data for name, data in package().items()}
    content |= {f"examples/{name}": data for name, data in texts_of("examples").items()}
    content |= {"PKG-INFO": metadata, "LICENSE": licence(), **{name: read(HERE, name) for name in ("backend.py", "pyproject.toml")}}
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as tar:
        for name, data in sorted(content.items()):
            entry = tarfile.TarInfo(f"{base}/{name}")
            entry.size = len(data)
            tar.addfile(entry, io.BytesIO(data))
    os.makedirs(sdist_directory, exist_ok=True)
    archive = f"{base}.tar.gz"
    with open(os.path.join(sdist_directory, archive), "wb") as file:
        file.write(gzip.compress(packed.getvalue(), mtime=0))
    return archive


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):  # pylint: disable=unused-argument
    sys.exit("lensd: some modules are written by a program, so there is no editable install: run script/client-types and set "
             "PYTHONPATH=build/clients/python")


if __name__ == "__main__":  # python3 backend.py FOLDER
    for build in (build_sdist, build_wheel):
        print(os.path.join(sys.argv[1], build(sys.argv[1])))
