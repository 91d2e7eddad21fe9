"""Tests of the zip that users install. `./dev package` makes it; they never use the staged add-on.

    pytest tests/package --blender /usr/bin/blender --blender build/venv/bpy-4.5/bin/python
"""

import subprocess

import pytest
from blenders import PACKAGE, name_of


def pytest_addoption(parser):
    parser.addoption("--blender", action="append", default=[],
                     help="a Blender program, or the Python of an environment that has the bpy module; several times")


def pytest_generate_tests(metafunc):
    if "blender" in metafunc.fixturenames:
        blenders = metafunc.config.getoption("--blender") or ["/usr/bin/blender"]
        metafunc.parametrize("blender", blenders, ids=[name_of(blender) for blender in blenders])


@pytest.fixture(scope="session")
def package():
    """The zip."""
    found = list(PACKAGE.glob("sppm-*-linux-x64.zip"))
    assert len(found) == 1, f"run ./dev package; found {found}"
    return found[0]


HIDE = 'for file in $HIDDEN; do mount --bind /dev/null "$file" || exit 1; done; exec "$@"'


@pytest.fixture(scope="session")
def hidden():
    """What to put before a command so that it finds none of this machine's libraries that the package has its own copy of."""
    names = ("libembree", "libtbb", "libOpenEXR", "libImath", "libIex", "libIlmThread")
    listing = subprocess.run(["/sbin/ldconfig", "-p"], check=True, capture_output=True, text=True).stdout
    paths = {line.split(" => ")[1] for line in listing.splitlines() if line.strip().startswith(names)}
    assert paths, "nothing to hide: the library was built without these"
    prefix = ["env", "HIDDEN=" + " ".join(sorted(paths)), "unshare", "--mount", "--map-root-user", "sh", "-c", HIDE, "sh"]
    if subprocess.run([*prefix, "true"], check=False).returncode != 0:
        pytest.skip("this machine lets nobody make a mount namespace")
    return prefix
