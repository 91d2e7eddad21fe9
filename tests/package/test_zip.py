"""What is in the zip, and what it asks of the machine."""

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from blenders import PACKAGE, ROOT, is_python

sys.path.insert(0, str(ROOT / "tools"))
from package import SYSTEM_LIBRARIES, needed

LIB = PACKAGE / "sppm" / "lib"
LIBRARIES = sorted(LIB.glob("*"))


def test_holds_the_staged_addon_and_the_licences(package):
    with zipfile.ZipFile(package) as archive:
        names = set(archive.namelist())
    stage = ROOT / "build" / "stage" / "addons"
    staged = {str(path.relative_to(stage)) for path in stage.rglob("*") if path.is_file() and "__pycache__" not in path.parts}
    assert staged <= names
    assert "sppm/LICENSE" in names
    copies = {path.stem for path in LIBRARIES} - {"libsppm"}
    assert {f"sppm/licenses/{name}.txt" for name in copies} <= names


def test_versions_agree(package):
    """Of the manifest (in the name), of the legacy add-on and of the library."""
    sys.path.insert(0, str(PACKAGE))
    import sppm

    version = re.search(r"VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text().split("project(")[1]).group(1)
    assert package.name == f"sppm-{version}-linux-x64.zip"
    assert ".".join(map(str, sppm.bl_info["version"])) == version


def test_size(package):
    """docs/install.md states 18 MB."""
    assert 10e6 < package.stat().st_size < 20e6


@pytest.mark.parametrize("library", LIBRARIES, ids=lambda path: path.name)
def test_needs_only_the_package_and_the_system(library):
    assert set(needed(library)) <= {path.name for path in LIBRARIES} | set(SYSTEM_LIBRARIES)
    assert library.name.startswith("libsppm")


@pytest.mark.parametrize("library", LIBRARIES, ids=lambda path: path.name)
@pytest.mark.parametrize(("prefix", "newest"), [("GLIBC", (2, 34)), ("GLIBCXX", (3, 4, 29)), ("CXXABI", (1, 3, 13))])
def test_runs_on_the_oldest_system_of_the_docs(library, prefix, newest):
    """Debian 12, Ubuntu 22.04, Enterprise Linux 9."""
    symbols = subprocess.run(["objdump", "-T", str(library)], check=True, capture_output=True, text=True).stdout
    versions = {tuple(map(int, found.split("."))) for found in re.findall(rf"\({prefix}_([\d.]+)\)", symbols)}
    assert max(versions, default=()) <= newest


LOAD = """
import ctypes, os, sys
for path in sys.argv[2:]:
    ctypes.CDLL(path, mode=os.RTLD_NOW | os.RTLD_GLOBAL)
sys.path.insert(0, sys.argv[1])
from sppm import native_library
print(native_library.version())
"""


def blenders_libraries(blender):
    """The host's libraries of the same symbols as ours; Debian's Blender uses the system's."""
    if is_python(blender):
        folder = next(Path(blender).parents[1].glob("lib/python*/site-packages/bpy/lib"))
    else:
        folder = Path("/usr/lib/x86_64-linux-gnu")
    return [path for name in ("libtbb", "libembree", "libImath", "libIex", "libIlmThread", "libOpenEXR")
            for path in sorted(folder.glob(f"{name}[-0-9._a-z]*so.[0-9]*"))]


# TBB looks for helpers at run time and does without them where there are none: a memory allocator and a reader of the machine's
# topology, both with a C interface that all versions share. The last is an empty constant that the linker keeps once a process.
SHARED_SYMBOLS = {"scalable_malloc", "scalable_free", "scalable_aligned_malloc", "scalable_aligned_free",
                  "__TBB_internal_initialize_system_topology", "__TBB_internal_destroy_system_topology",
                  "__TBB_internal_get_default_concurrency", "__TBB_internal_allocate_binding_handler",
                  "__TBB_internal_deallocate_binding_handler", "__TBB_internal_apply_affinity",
                  "__TBB_internal_restore_affinity", "_ZSt19piecewise_construct"}


def test_no_symbol_comes_from_blenders_libraries(blender, tmp_path):
    """Where they are in global scope: the linker itself tells what it bound to what."""
    host = blenders_libraries(blender)
    assert any("embree" in path.name for path in host)
    environment = dict(os.environ, LD_DEBUG="bindings", LD_DEBUG_OUTPUT=str(tmp_path / "bindings"))
    done = subprocess.run(["/usr/bin/python3", "-c", LOAD, str(PACKAGE), *map(str, host)], env=environment,
                          capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    lines = "".join(path.read_text() for path in tmp_path.iterdir())
    found = re.findall(rf"binding file {re.escape(str(LIB))}/(\S+) \[0\] to (\S+) \[0\]: \w+ symbol `(\S+)'", lines)
    assert {asking for asking, _, _ in found} == {path.name for path in LIBRARIES}
    foreign = {(asking, giving, symbol) for asking, giving, symbol in found
               if Path(giving).parent != LIB and Path(giving).name not in SYSTEM_LIBRARIES and symbol not in SHARED_SYMBOLS}
    assert not foreign


def test_loads_where_the_build_packages_are_not_installed(hidden):
    plain = subprocess.run([*hidden, "/usr/bin/python3", "-c", "import ctypes; ctypes.CDLL('libtbb.so.12')"],
                           capture_output=True, text=True, check=False)
    assert plain.returncode != 0, "the libraries are not hidden: this test shows nothing"
    done = subprocess.run([*hidden, "/usr/bin/python3", "-c", LOAD, str(PACKAGE)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
