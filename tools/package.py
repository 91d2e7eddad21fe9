"""Makes the zip that Blender installs: the staged add-on with a private copy of every library that it needs.

    python3 tools/package.py STAGED_FOLDER OUTPUT_FOLDER

Blender's process holds its own Embree, TBB and OpenEXR, and the dynamic linker takes a library of that name that is already there.
So each copy gets a name that nobody else has (libembree3.so.3 -> libsppm_embree3.so) and looks for the others beside itself.
Needs patchelf, strip and ldd. The add-on is in one folder inside the zip: Blender 3.4 wants that, 4.2 and later allow it.
"""

import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

# What every supported distribution has, as old as docs/install.md says; Blender itself needs these too.
SYSTEM_LIBRARIES = ("libc.so.6", "libm.so.6", "libgcc_s.so.1", "libstdc++.so.6", "ld-linux-x86-64.so.2")


def output_of(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def needed(library):
    """The names of the libraries that this one asks for itself."""
    return output_of("patchelf", "--print-needed", str(library)).split()


def private_name(name):
    """libOpenEXR-3_1.so.30 -> libsppm_OpenEXR-3_1.so"""
    return "libsppm_" + name.removeprefix("lib").split(".so")[0] + ".so"


def dependencies(library):
    """{name: path} of all libraries that it needs, directly or not, but those of the system."""
    found = dict(re.findall(r"^\s*(\S+) => (/\S+)", output_of("ldd", str(library)), re.MULTILINE))
    names, waiting = {}, [Path(library)]
    while waiting:
        for name in needed(waiting.pop()):
            if name in SYSTEM_LIBRARIES or name in names:
                continue
            if name not in found:
                raise SystemExit(f"package: {name} is not on this machine")
            names[name] = Path(found[name]).resolve()
            waiting.append(names[name])
    return names


def make_private(library, names):
    """Lets a copied library ask for the others by their private names, beside itself."""
    # One call each: patchelf 0.14 confuses the values of several options.
    for name in needed(library):
        if name in names:
            run("patchelf", "--replace-needed", name, private_name(name), library)
    run("patchelf", "--set-soname", library.name, library)
    run("patchelf", "--set-rpath", "$ORIGIN", library)


def run(*command):
    subprocess.run([str(part) for part in command], check=True)


def bundle(folder):
    """Copies what libsppm.so needs into the add-on's `lib`, with the licences, and binds all of it together."""
    target = folder / "lib"
    names = dependencies(target / "libsppm.so")
    for name, path in names.items():
        shutil.copy(path, target / private_name(name))
        copy_licence(path, folder / "licenses" / private_name(name).replace(".so", ".txt"))
    for library in target.iterdir():
        # First: strip does not know all of what patchelf leaves behind.
        run("strip", "--strip-unneeded", library)
        make_private(library, names)


def copy_licence(library, target):
    """Debian keeps a package's licence in its documentation."""
    # dpkg may know the file by its name from before /lib became a link to /usr/lib.
    for path in (library, Path("/") / library.relative_to("/usr") if library.is_relative_to("/usr") else library):
        owner = subprocess.run(["dpkg", "-S", str(path)], capture_output=True, text=True, check=False).stdout.split(":")[0]
        if owner:
            target.parent.mkdir(exist_ok=True)
            shutil.copy(f"/usr/share/doc/{owner}/copyright", target)
            return
    raise SystemExit(f"package: no package owns {library}, so its licence is unknown")


def write_zip(folder, path):
    """The folder and all in it; the same content makes the same bytes."""
    date = (1980, 1, 1, 0, 0, 0)
    with zipfile.ZipFile(path, "w") as archive:
        # Blender 3.4 removes an older add-on only where the zip has an entry for the folder itself.
        archive.writestr(zipfile.ZipInfo(f"{folder.name}/", date), b"")
        for file in sorted(file for file in folder.rglob("*") if file.is_file()):
            info = zipfile.ZipInfo(str(file.relative_to(folder.parent)), date)
            info.external_attr = 0o100644 << 16
            archive.writestr(info, file.read_bytes(), zipfile.ZIP_DEFLATED, compresslevel=9)


def main(staged, output):
    folder = output / "sppm"
    shutil.rmtree(output, ignore_errors=True)
    shutil.copytree(staged, folder, ignore=shutil.ignore_patterns("__pycache__"))
    bundle(folder)
    shutil.copy(Path(__file__).parents[1] / "LICENSE", folder)
    version = tomllib.loads((folder / "blender_manifest.toml").read_text())["version"]
    path = output / f"sppm-{version}-linux-x64.zip"
    write_zip(folder, path)
    unpacked = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
    print(f"{path}\n{path.stat().st_size / 1e6:.1f} MB, {unpacked / 1e6:.1f} MB when installed")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
