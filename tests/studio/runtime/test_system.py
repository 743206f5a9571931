"""What the machine lacks is named with the command that brings it, before anything can crash on it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from studio.runtime import system

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def bare_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """Linux on which no library loads, with no OpenGL driver and no font."""
    monkeypatch.setattr(system.sys, "platform", "linux")
    monkeypatch.setattr(
        system,
        "LIBRARIES",
        tuple(system.Need(f"no-such-{n.package}.so", n.package, n.purpose) for n in system.LIBRARIES),
    )
    monkeypatch.setattr(system, "OPENGL_DRIVERS", ("/no/such/*.so",))
    monkeypatch.setattr(system, "FONT_FOLDERS", ("/no/such",))


@pytest.mark.usefixtures("bare_machine")
class TestBareMachine:
    def test_everything_missing_is_named_with_its_purpose(self) -> None:
        text = system.message(system.missing_needs())
        for package in ("libegl1", "libgl1", "libusb-1.0-0", "libgl1-mesa-dri", "libpango-1.0-0", "fonts-dejavu-core"):
            assert package in text
        assert text.count("needed for") == len(system.LIBRARIES) + 2

    def test_the_command_can_be_typed_as_it_is(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(system.shutil, "which", lambda name: f"/usr/bin/{name}")
        monkeypatch.setattr(system.os, "geteuid", lambda: 1000)
        command = system.message(system.missing_needs()).splitlines()[-1]
        assert command.startswith(
            "install with: sudo apt-get update && sudo apt-get install -y --no-install-recommends "
        )
        assert "no-such" not in command

    def test_where_there_is_no_apt_the_packages_are_still_named(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(system.shutil, "which", lambda name: None)
        assert system.message(system.missing_needs()).splitlines()[-1].startswith("install what Debian calls: ")

    def test_a_plain_user_gets_the_message_and_nothing_is_installed(
        self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
    ) -> None:
        monkeypatch.setattr(system.os, "geteuid", lambda: 1000)
        monkeypatch.setattr(system, "_apt_install", lambda packages: pytest.fail("installed without being root"))
        assert system.main() == 2
        assert "libegl1" in capsys.readouterr().err

    def test_root_installs_and_what_is_still_missing_is_told(
        self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
    ) -> None:
        installed: list[str] = []
        monkeypatch.setattr(system.shutil, "which", lambda name: f"/usr/bin/{name}")
        monkeypatch.setattr(system.os, "geteuid", lambda: 0)
        monkeypatch.setattr(system, "_apt_install", installed.extend)
        assert system.main() == 2
        assert "libharfbuzz-subset0" in installed
        assert "missing: no-such-libegl1.so" in capsys.readouterr().err


def test_a_peer_that_cannot_be_installed_is_named_and_ends_nothing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    tried: list[list[str]] = []
    for name in ("missing_needs", "_wanted_for_the_desktop"):
        monkeypatch.setattr(system, name, lambda: [])
    monkeypatch.setattr(system.sys, "platform", "linux")
    monkeypatch.setattr(system, "MRCAL_FILES", "/no/such/file")
    monkeypatch.setattr(system.shutil, "which", lambda name: f"/usr/bin/{name}")
    monkeypatch.setattr(system.os, "geteuid", lambda: 0)
    monkeypatch.setattr(system, "_apt_install", tried.append)
    monkeypatch.setattr(system.sys, "argv", ["system.py", system.VALIDATION])
    assert system.main() == 0
    assert tried == [["python3-mrcal"]] and "missing: mrcal, needed for" in capsys.readouterr().err
    monkeypatch.setattr(system.sys, "argv", ["system.py"])
    assert system.main() == 0
    assert len(tried) == 1 and capsys.readouterr().err == ""


def test_apt_refreshes_its_lists_once_when_a_package_is_not_found(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[list[str]] = []

    def fake_run(command: list[str], **_: object) -> subprocess.CompletedProcess[str]:
        calls.append(command)
        return subprocess.CompletedProcess(command, 0 if len(calls) > 1 else 100, "", "Unable to locate package")

    monkeypatch.setattr(system.subprocess, "run", fake_run)
    system._apt_install(["libegl1"])
    assert [command[1] for command in calls] == ["install", "update", "install"]


def test_an_old_python_is_told_before_anything_else(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(system.sys, "version_info", (3, 9, 2))
    assert system.main() == 2
    assert "Python 3.11 or newer is needed; found 3.9.2" in capsys.readouterr().err


def test_the_check_needs_the_standard_library_only() -> None:
    done = subprocess.run(
        [sys.executable, "-I", "-S", str(ROOT / "studio" / "runtime" / "system.py"), "--help"],
        capture_output=True,
        text=True,
    )
    assert "ModuleNotFoundError" not in done.stderr
    assert done.returncode in (0, 2)


def test_without_python_packages_the_entry_names_the_way_to_set_up() -> None:
    done = subprocess.run([sys.executable, "-S", str(ROOT / "main.py"), "--help"], capture_output=True, text=True)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr and "make run" in done.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="virtual displays of X11")
def test_a_benchmark_without_a_display_names_what_would_make_one() -> None:
    environment = {name: value for name, value in os.environ.items() if name != "DISPLAY"} | {"PATH": ""}
    script = ROOT / "tests" / "benchmarks" / "bench_start.py"
    done = subprocess.run([sys.executable, str(script), "1"], env=environment, capture_output=True, text=True)
    assert done.returncode == 1 and "xvfb" in done.stderr and "Traceback" not in done.stderr


def test_what_opens_windows_for_make_has_its_libraries_looked_for_first() -> None:
    rules = (ROOT / "Makefile").read_text()
    assert all(f"\n{target}: system-tests " in rules for target in ("test", "benchmark"))


def test_a_program_in_a_folder_whose_name_is_not_text_says_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import main
    from studio.runtime import command_line

    reason = system.why_not_in_this_folder("/opt/\udcff/blazer")
    assert reason is not None and "UTF-8" in reason and system.why_not_in_this_folder() is None
    monkeypatch.setattr(command_line, "why_not_in_this_folder", lambda: reason)
    with pytest.raises(SystemExit, match="2"):
        main.cli(["inspect"])
    assert "\\udcff/blazer" in capsys.readouterr().err
