"""The command line: one message and a meaningful exit code for everything that can happen."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
import pytest
from click.testing import CliRunner, Result

import main
from render.base.errors import Cancelled, InputError
from studio.project.templates import DESCRIPTIONS, template_folder
from studio.runtime import command_line

ROOT = Path(__file__).resolve().parents[1]
PATIENCE = 600.0
"""s; how long a process takes decides nothing, but one that hangs shall end."""
HEAVY = {"numpy", "numba", "rich", "pydantic", "PySide6", "cv2", "jinja2"}


def call(*arguments: object) -> Result:
    return CliRunner().invoke(main.cli, [str(argument) for argument in arguments])


def spawn(*arguments: object, **options: Any) -> subprocess.Popen[str]:
    command = [sys.executable, str(ROOT / "main.py"), *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


class TestHelp:
    def test_help_imports_only_what_answers_at_once(self) -> None:
        process = spawn("--help", env={**os.environ, "PYTHONPROFILEIMPORTTIME": "1"})
        text, errors = process.communicate(timeout=PATIENCE)
        assert process.returncode == 0 and "reconstruct" in text
        imported = {line.rsplit("|", 1)[1].strip() for line in errors.splitlines() if line.startswith("import time:")}
        own = {name for name in imported if name.split(".")[0] in ("render", "analysis", "studio")}
        assert {name.split(".")[0] for name in imported} & HEAVY == set()
        runtime = {
            "studio.runtime",
            *(f"studio.runtime.{name}" for name in ("command_line", "command_options", "streams", "system")),
        }
        assert "click" in imported and own == {"studio", "studio.commands", "studio.commands.of_scans", *runtime}

    def test_help_with_json_is_json(self) -> None:
        answer = json.loads(call("run", "--json", "--help").stdout)
        assert answer["ok"] and "--scale" in answer["text"]

    @pytest.mark.parametrize("command", ["run", "render", "reconstruct", "extract", "report", "inspect", "new"])
    def test_every_command_explains_itself(self, command: str) -> None:
        done = call(command, "--help")
        assert done.exit_code == 0 and "--json" in done.stdout


class TestExitCodes:
    @pytest.mark.parametrize(
        ("error", "code", "text"),
        [
            (InputError("albedo is out of range", where="weld.json", found=2), 2, "weld.json: albedo is out of range"),
            (Cancelled(), 130, "interrupted"),
            (KeyboardInterrupt(), 130, "interrupted"),
            (ModuleNotFoundError("No module named 'open3d'", name="open3d"), 2, "make run"),
            (MemoryError(), 2, "--scale"),
            (PermissionError(13, "Permission denied", "/x"), 2, "/x: Permission denied"),
            (ZeroDivisionError("division by zero"), 3, "please report"),
        ],
        ids=lambda value: type(value).__name__ if isinstance(value, BaseException) else None,
    )
    def test_every_end_has_its_code_and_no_traceback(
        self, error: BaseException, code: int, text: str, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def fail(*_: object, **__: object) -> None:
            raise error

        monkeypatch.setattr("studio.commands.commands.inspect_project", fail)
        done = call("inspect", "--json")
        assert done.exit_code == code
        assert text in done.stderr and "Traceback" not in done.output
        answer = json.loads(done.stdout)
        assert answer["ok"] is False and answer["exit_code"] == code and text in answer["error"]["message"]

    def test_debug_shows_where_it_happened(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr("studio.commands.commands.inspect_project", lambda *_, **__: 1 / 0)
        done = call("inspect", "--debug")
        assert done.exit_code == 3 and "Traceback" in done.stderr and "ZeroDivisionError" in done.stderr

    @pytest.mark.parametrize(
        "arguments", [["scan"], ["run", "--threads", "0"], ["run", "--scale", "x"], ["report"], ["inspect", "--x"]]
    )
    def test_wrong_usage_is_bad_input(self, arguments: list[str]) -> None:
        done = call(*arguments)
        assert done.exit_code == 2 and "Traceback" not in done.output and done.stderr.count("error: ") == 1
        assert done.stdout == ""
        told = call(*arguments, "--json")
        answer = json.loads(told.stdout)
        assert told.exit_code == 2 and answer["ok"] is False and answer["exit_code"] == 2
        assert answer["error"]["message"] in told.stderr

    @pytest.mark.parametrize("arguments", [["render", "x/" * 5000], ["reconstruct", "scan", "--laser", "x" * 10_000]])
    def test_what_is_wrong_is_told_on_one_screen_however_long_it_is(self, arguments: list[str]) -> None:
        done = call(*arguments, "--json")
        assert (
            done.exit_code == 2 and len(json.loads(done.stdout)["error"]["message"]) <= command_line.LONGEST_MESSAGE + 5
        )

    def test_every_option_of_every_command_that_is_wrong_is_told_as_json(self) -> None:
        for name, command in main.cli.commands.items():
            for option in [item for item in command.params if item.opts[0].startswith("--")]:
                takes_none = getattr(option, "is_flag", False)
                wrong = [f"{option.opts[0]}=\x1b[31m"] if takes_none else [option.opts[0]]
                done = call(name, "--json", *wrong)
                answer = json.loads(done.stdout)
                assert (done.exit_code, answer["ok"]) == (2, False), wrong
                assert "\x1b" not in done.output and ("Traceback" in done.stderr) == ("--debug" in option.opts)

    def test_what_ends_a_command_is_not_mistaken_for_an_interrupt(self, monkeypatch: pytest.MonkeyPatch) -> None:
        def fail(*_: object, **__: object) -> None:
            raise EOFError("Ran out of input")

        monkeypatch.setattr("studio.commands.commands.inspect_project", fail)
        assert call("inspect").exit_code == 3

    @pytest.mark.parametrize("value", ["nan", "-nan", "inf", "-inf", "1e400", "0x1p3"])
    @pytest.mark.parametrize("option", ["--scale", "--time-limit", "--exposure-ratio", "--nearest", "--farthest"])
    def test_a_number_that_is_none_is_bad_input(self, option: str, value: str, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr("studio.commands.commands.run_project", lambda *_, **__: None)
        assert call("run", option, "2").exit_code == 0
        done = call("run", option, value)
        assert done.exit_code == 2 and option in done.stderr and "Traceback" not in done.output

    @pytest.mark.parametrize("times", ["1e300,1e-300", "nan,1", "inf,1", "0,1", "1e20,1", "1,-1", "1e-320,1e-321"])
    def test_exposure_times_that_cannot_be_are_bad_input(self, times: str, tmp_path: Path) -> None:
        image = np.random.default_rng(0).normal(100, 5, (64, 64)).clip(0, 255).astype(np.uint8)
        for name in ("a.png", "b.png"):
            PIL.Image.fromarray(image).save(tmp_path / name)
        done = call("extract", tmp_path / "a.png", tmp_path / "b.png", "--hdr", times)
        assert done.exit_code == 2 and "expos" in done.stderr and "Traceback" not in done.output

    def test_a_missing_system_library_is_named_before_anything_is_imported(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        from studio.runtime.system import LIBRARIES

        monkeypatch.setattr(command_line, "missing_needs", lambda: [LIBRARIES[0]])
        done = call("inspect")
        assert done.exit_code == 2 and LIBRARIES[0].package in done.stderr and "install" in done.stderr


class TestBadProjects:
    def test_a_template_is_a_project_by_its_name_unless_a_file_has_it(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        assert json.loads(call("inspect", "v_groove", "--json").stdout)["ok"]
        done = call("inspect", "groove")
        assert done.exit_code == 2 and "did you mean v_groove?" in done.output
        (tmp_path / "v_groove").write_text("none")
        assert call("inspect", "v_groove").exit_code == 2

    @pytest.mark.parametrize("command", ["run", "render", "inspect"])
    @pytest.mark.parametrize("text", ["", "{", "[]", '{"schema_version": 99}', "\x00\x01", '{"schema_version": 1}'])
    def test_a_damaged_project_is_refused_and_nothing_is_written(
        self, command: str, text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.chdir(tmp_path)
        file = tmp_path / "weld.json"
        file.write_text(text)
        done = call(command, file)
        assert done.exit_code == 2
        assert "weld.json" in done.stderr and "Traceback" not in done.output
        assert list(tmp_path.iterdir()) == [file] and file.read_text() == text

    def test_a_mesh_outside_the_folder_is_not_touched(self, tmp_path: Path) -> None:
        project = tmp_path / "inside" / "weld.json"
        project.parent.mkdir()
        data = json.loads((template_folder("plane") / "project.json").read_text())
        data["scene"]["objects"][0]["shape"] = {"kind": "file", "path": "../secret.stl"}
        project.write_text(json.dumps(data))
        (tmp_path / "secret.stl").write_text("solid")
        done = call("inspect", project)
        assert done.exit_code == 2 and "leaves the project folder" in done.stderr

    def test_a_name_that_cannot_be_printed_is_still_told(self, tmp_path: Path) -> None:
        data = json.loads((template_folder("plane") / "project.json").read_text())
        data["\ud800"] = 1
        (tmp_path / "a.json").write_text(json.dumps(data))
        done = call("inspect", tmp_path / "a.json")
        assert done.exit_code == 2 and "half a character; found \\ud800" in done.stderr


class TestNew:
    def test_templates_are_listed(self) -> None:
        assert set(json.loads(call("new", "--json").stdout)["templates"]) == set(DESCRIPTIONS)
        assert "weld_seam" in call("new").stdout

    def test_a_new_project_can_be_inspected(self, tmp_path: Path) -> None:
        made = json.loads(call("new", "plane", tmp_path / "p", "--json").stdout)
        answer = json.loads(call("inspect", made["project"], "--json").stdout)
        assert answer["ok"] and answer["lasers"][0]["scan_lines_hit"] > 1900

    def test_an_exposure_is_told_to_its_last_digit(self, tmp_path: Path) -> None:
        made = Path(json.loads(call("new", "plane", tmp_path / "p", "--json").stdout)["project"])
        project = json.loads(made.read_text())
        project["sensor"]["exposure_time"] = 0.001755
        made.write_text(json.dumps(project))
        assert "exposure 1.755 ms" in call("inspect", made).stdout

    def test_nothing_is_overwritten_without_force(self, tmp_path: Path) -> None:
        assert call("new", "plane", tmp_path).exit_code == 0
        (tmp_path / "project.json").write_text("mine")
        done = call("new", "plane", tmp_path)
        assert done.exit_code == 2 and "--force" in done.stderr
        assert (tmp_path / "project.json").read_text() == "mine"
        assert call("new", "plane", tmp_path, "--force").exit_code == 0

    def test_a_slip_of_the_pen_is_corrected(self, tmp_path: Path) -> None:
        done = call("new", "weld_sem", tmp_path / "p")
        assert done.exit_code == 2 and "did you mean weld_seam?" in done.stderr
        assert not (tmp_path / "p").exists()


class TestStudio:
    def test_without_a_display_the_reason_is_plain(self, monkeypatch: pytest.MonkeyPatch) -> None:
        ran: list[object] = []
        monkeypatch.delenv("DISPLAY", raising=False)
        monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
        monkeypatch.setattr("studio.commands.commands.run_project", lambda *given, **_: ran.append(given))
        done = call()
        assert done.exit_code == 0 and "does not open here" in done.stderr and ran == [(None,)]


class TestProcess:
    def test_json_is_alone_on_standard_output(self) -> None:
        process = spawn("inspect", "plane", "--json")
        text, _ = process.communicate(timeout=PATIENCE)
        assert process.returncode == 0 and json.loads(text)["ok"]

    def test_a_reader_that_goes_away_is_no_error(self) -> None:
        process = spawn("inspect", "plane", "--json")
        assert process.stdout is not None and process.stderr is not None
        process.stdout.close()
        errors = process.stderr.read()
        process.wait(timeout=PATIENCE)
        assert (
            "Traceback" not in errors and "BrokenPipe" not in errors and process.returncode == command_line.BROKEN_PIPE
        )

    @pytest.mark.skipif(not os.path.exists("/dev/full"), reason="a device of Linux")
    @pytest.mark.parametrize(
        ("shell", "code"),
        [
            ("{} new > /dev/full", 2),
            ("{} new --json > /dev/full", 2),
            ("{} --help > /dev/full", 2),
            ("{} nope 2> /dev/full", 2),
            ("{} new 2> /dev/full", 0),
            ("{} new >&- 2>&- <&-", 0),
            ("set -o pipefail; {} --help | true", command_line.BROKEN_PIPE),
            ("set -o pipefail; {} new | true", command_line.BROKEN_PIPE),
            ("set -o pipefail; {} nope --json 2>&1 | true", 2),
        ],
    )
    def test_streams_that_take_nothing_do_not_end_in_a_fault(self, shell: str, code: int) -> None:
        command = shell.format(f"{sys.executable} {ROOT / 'main.py'}")
        done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=PATIENCE)
        assert done.returncode == code and done.stdout[:9] == ("Templates" if "new 2>" in shell else "")
        assert done.stderr.count("\n") <= 1 and "Exception" not in done.stderr

    @pytest.mark.skipif(sys.platform != "linux", reason="file names are bytes there")
    def test_a_file_name_that_is_not_text_is_printed_as_an_escape(self, tmp_path: Path) -> None:
        folder = os.fsdecode(os.fsencode(tmp_path) + b"/\xff")
        strict = {**os.environ, "PYTHONIOENCODING": "utf-8:strict"}
        for arguments in (["new", "plane", folder], ["new", "--force", "--json", "plane", folder], ["inspect", folder]):
            process = spawn(*arguments, env=strict)
            text, errors = process.communicate(timeout=PATIENCE)
            assert (process.returncode, "Traceback" in errors) == (0, False)
            assert "udcff" in text or arguments[0] == "inspect"

    @pytest.mark.skipif(sys.platform != "linux", reason="only there a library is known to print")
    def test_what_a_library_says_of_a_damaged_image_is_not_in_the_json(self, tmp_path: Path) -> None:
        import numpy as np
        import OpenEXR

        image = tmp_path / "shot.exr"
        pixels = np.random.default_rng(1).random((64, 64), dtype=np.float32)
        OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION}, {"Y": pixels}).write(str(image))
        data = image.read_bytes()
        for cut in (len(data) // 2, len(data) - 100, 400):
            image.write_bytes(data[:cut])
            process = spawn("extract", image, "--json")
            text, _ = process.communicate(timeout=PATIENCE)
            assert process.returncode == 2 and json.loads(text)["ok"] is False

    @pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
    def test_ctrl_c_stops_a_render_without_half_a_file(self, tmp_path: Path) -> None:
        process = spawn("render", "--out", tmp_path / "out", start_new_session=True)
        assert process.stderr is not None
        for line in process.stderr:  # until rendering has begun
            if "exact line" in line:
                break
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=PATIENCE)
        assert process.returncode == command_line.INTERRUPTED and "interrupted" in errors and "Traceback" not in errors
        left = [path for path in (tmp_path / "out").rglob("*") if path.is_file()] if (tmp_path / "out").exists() else []
        assert [path for path in left if path.name.startswith(".")] == [] and not (
            tmp_path / "out" / "scan.json"
        ).exists()

    @pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
    def test_a_second_ctrl_c_ends_the_wait_for_threads_without_a_word(self) -> None:
        code = (
            "import main, sys, threading, studio.commands.commands as commands\n"
            "def busy(*_, **__):\n"
            "    threading.Thread(target=threading.Event().wait, args=(600,)).start()\n"
            "    raise KeyboardInterrupt\n"
            "commands.inspect_project = busy\n"
            "sys.argv = ['main.py', 'inspect', '--json']\n"
            "main.cli()"
        )
        command = [sys.executable, "-c", code]
        process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        assert process.stdout is not None and process.stderr is not None
        while process.stdout.readline() != "}\n":
            assert process.poll() is None
        while process.poll() is None:
            process.send_signal(signal.SIGINT)
            time.sleep(0.05)
        assert process.returncode == -signal.SIGINT and process.stderr.read().count("\n") == 1
