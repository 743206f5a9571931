"""What the machine must bring before anything heavy is imported: Python, its venv module, shared libraries, a font.

Standard library only: `make` runs this file with the system's Python before there is an environment, and main.py asks
it before the imports that would otherwise end in a bare ImportError, or, in VTK, in a segmentation fault.
"""

from __future__ import annotations

import ctypes
import glob
import importlib.util
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PYTHON_NEEDED = (3, 11)
TESTS = "--tests"
"""Argument of this file: check what the tests need as well."""
VALIDATION = "--validation"
"""Argument of this file: check what the comparison with another renderer needs as well."""
FONT_FOLDERS = ("/usr/share/fonts", "/usr/local/share/fonts", "~/.fonts", "~/.local/share/fonts")
OPENGL_DRIVERS = ("/usr/lib*/dri/*_dri.so", "/usr/lib/*/dri/*_dri.so", "/usr/lib*/libEGL_nvidia.so*")


@dataclass(frozen=True)
class Need:
    """Something the system must have: how to find it, what it is for, and the Debian package that brings it."""

    library: str
    package: str
    purpose: str


def _needs(purpose: str, packages: dict[str, str]) -> tuple[Need, ...]:
    """packages: what brings each library."""
    return tuple(Need(library, package, purpose) for library, package in packages.items())


LIBRARIES = (
    *_needs("geometry (open3d)", {"libgomp.so.1": "libgomp1", "libusb-1.0.so.0": "libusb-1.0-0"}),
    *_needs(
        "geometry and 3D pictures (open3d, VTK)",
        {"libGL.so.1": "libgl1", "libEGL.so.1": "libegl1", "libX11.so.6": "libx11-6"},
    ),
    *_needs(
        "the PDF report (WeasyPrint)",
        {
            "libpango-1.0.so.0": "libpango-1.0-0",
            "libpangoft2-1.0.so.0": "libpangoft2-1.0-0",
            "libharfbuzz-subset.so.0": "libharfbuzz-subset0",
        },
    ),
)
VALIDATION_LIBRARIES = (
    *_needs("the comparison with another renderer (Mitsuba)", {"libatomic.so.1": "libatomic1"}),
    *_needs("the fastest variants of another renderer (Mitsuba)", {"libLLVM-19.so": "libllvm19"}),
)
DESKTOP_LIBRARIES = (
    *_needs(
        "the desktop (Qt)",
        {
            "libxcb.so.1": "libxcb1",
            "libxcb-cursor.so.0": "libxcb-cursor0",
            "libxcb-icccm.so.4": "libxcb-icccm4",
            "libxcb-keysyms.so.1": "libxcb-keysyms1",
            "libxcb-shape.so.0": "libxcb-shape0",
            "libxkbcommon-x11.so.0": "libxkbcommon-x11-0",
            "libX11-xcb.so.1": "libx11-xcb1",
            "libdbus-1.so.3": "libdbus-1-3",
            "libfontconfig.so.1": "libfontconfig1",
            "libglib-2.0.so.0": "libglib2.0-0",
        },
    ),
)
MRCAL = Need("mrcal", "python3-mrcal", "the comparison of calibrations")
MRCAL_FILES = "/usr/lib/python3/dist-packages/mrcal/__init__.py"
"""Where Debian has it: for the system's own Python, a process of which the comparison starts."""
VIRTUAL_DISPLAY = Need("Xvfb", "xvfb", "the tests of the desktop")
DRIVER = Need("an OpenGL driver", "libgl1-mesa-dri", "3D pictures (VTK)")
FONT = Need("a TrueType font", "fonts-dejavu-core", "the PDF report (WeasyPrint)")


def missing_needs() -> list[Need]:
    """What this machine lacks. Empty where it cannot be asked this way (not Linux: wheels bring their own)."""
    if not sys.platform.startswith("linux"):
        return []
    libraries = LIBRARIES + (VALIDATION_LIBRARIES if VALIDATION in sys.argv else ())
    missing = [need for need in libraries if not _loads(need.library)]
    if not any(glob.glob(pattern) for pattern in OPENGL_DRIVERS):
        missing.append(DRIVER)
    if not any(_has_font(os.path.expanduser(folder)) for folder in FONT_FOLDERS):
        missing.append(FONT)
    return missing


def missing_desktop_needs() -> list[Need]:
    """What the desktop lacks beyond `missing_needs`."""
    if not sys.platform.startswith("linux"):
        return []
    return [need for need in DESKTOP_LIBRARIES if not _loads(need.library)]


def why_not_in_this_folder(folder: str = ROOT) -> str | None:
    """The reason why the program cannot work where it is, or None: the compiler takes no other names."""
    try:
        folder.encode("utf-8")
    except UnicodeEncodeError:
        return f"the program's folder has a name that is not UTF-8, rename or move it: {folder}"
    return None


def apt_command(packages: list[str]) -> str:
    """The exact line a person types to install them."""
    sudo = "" if os.geteuid() == 0 else "sudo "
    return f"{sudo}apt-get update && {sudo}apt-get install -y --no-install-recommends {' '.join(packages)}"


def message(missing: list[Need]) -> str:
    """One sentence a need, and the command that brings them all."""
    lines = [f"missing: {need.library}, needed for {need.purpose}" for need in missing]
    packages = sorted({need.package for need in missing})
    if shutil.which("apt-get"):
        lines.append(f"install with: {apt_command(packages)}")
    else:
        lines.append(f"install what Debian calls: {' '.join(packages)}")
    return "\n".join(lines)


def missing_python_package(name: str | None) -> str:
    """What to say when a Python package is not there: the environment was never set up, or another Python runs."""
    return (
        f"the Python package {name or '?'} is not installed for {sys.executable}; `make run` sets everything up "
        "and runs; by hand: python3 -m venv .venv && .venv/bin/pip install -c .ci/constraints.txt -e ."
    )


def main() -> int:
    """Check, install where that is possible without asking (root on Debian or Ubuntu), and say what is left."""
    if sys.version_info < PYTHON_NEEDED:
        found, wanted = ".".join(map(str, sys.version_info[:3])), ".".join(map(str, PYTHON_NEEDED))
        print(f"Python {wanted} or newer is needed; found {found} at {sys.executable}", file=sys.stderr)
        print(f"install it with: {apt_command(['python3.11', 'python3.11-venv'])}", file=sys.stderr)
        return 2
    missing, desktop = missing_needs(), _wanted_for_the_desktop()
    if importlib.util.find_spec("ensurepip") is None or importlib.util.find_spec("venv") is None:
        package = f"python{sys.version_info[0]}.{sys.version_info[1]}-venv"
        missing.append(Need("Python's venv module", package, "the virtual environment"))
    if (missing or desktop) and os.geteuid() == 0 and shutil.which("apt-get"):
        packages = sorted({need.package for need in missing + desktop})
        print(f"installing system libraries: {' '.join(packages)}", file=sys.stderr)
        _apt_install(packages)
        still_missing, desktop = missing_needs(), _wanted_for_the_desktop()
        venv_is_here = importlib.util.find_spec("ensurepip") is not None
        missing = still_missing + [need for need in missing if need.package.endswith("-venv") and not venv_is_here]
    peers = _wanted_peers()
    if peers and os.geteuid() == 0 and shutil.which("apt-get"):
        _apt_install([need.package for need in peers])  # apart: not every release has them
        peers = _wanted_peers()
    if missing or desktop or peers:
        print(message(missing + desktop + peers), file=sys.stderr)
    # without the desktop's libraries the commands still work, without peers all but the comparison with them
    return 2 if missing or (desktop and TESTS in sys.argv) else 0


def _wanted_for_the_desktop() -> list[Need]:
    """What windows need, where they can open (a display) or are to be tested (a virtual one)."""
    if not sys.platform.startswith("linux"):
        return []
    tests = TESTS in sys.argv
    wanted = missing_desktop_needs() if tests or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") else []
    return [*wanted, VIRTUAL_DISPLAY] if tests and not shutil.which("Xvfb") else wanted


def _wanted_peers() -> list[Need]:
    """What a comparison skips where it is absent."""
    wanted = VALIDATION in sys.argv and sys.platform.startswith("linux")
    return [MRCAL] if wanted and not os.path.exists(MRCAL_FILES) else []


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _has_font(folder: str) -> bool:
    return any(name.endswith((".ttf", ".otf", ".ttc")) for _, _, names in os.walk(folder) for name in names)


def _apt_install(packages: list[str]) -> None:
    """Install, refreshing the package lists once if the first attempt fails."""
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    install = ["apt-get", "install", "-y", "-qq", "--no-install-recommends", *packages]
    for command in (install, ["apt-get", "update", "-qq"], install):
        done = subprocess.run(command, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True)
        if command is install and done.returncode == 0:
            importlib.invalidate_caches()
            return
    print(done.stderr.strip(), file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
