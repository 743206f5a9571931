"""Every command of the menus in one table, with its shortcut, icon and help; toolbar and cheat sheet read it too."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QMainWindow, QMenu

from studio.qt.core.icons import icon


@dataclass(frozen=True)
class Command:
    """One thing a person can ask for; `menu` is where it stands, "File/Export" for a submenu."""

    key: str
    menu: str
    text: str
    shortcut: str = ""
    """Several are parted by "; "."""
    icon: str = ""
    tip: str = ""
    checkable: bool = False


VIEW_KEYS = {
    "1": "from the front",
    "2": "from the left",
    "3": "from above",
    "4": "at an angle",
    "5": "parallel or in perspective",
    "C": "through the camera",
    "L": "along the laser",
    "F": "frame what is selected",
    "A": "frame everything",
    "X": "arrows along the part or the world",
    "T": "aim the laser at the next click",
    "G": "move: then X, Y or Z and a number",
    "R": "turn: then X, Y or Z and a number",
    "V": "put a corner or face on another",
    "B": "a box about points, to be told of",
}
"""Key -> what it does while the 3D view has the focus."""
COMMANDS: tuple[Command | str, ...] = (
    Command("new", "File", "New from &template…", "Ctrl+N", "new", "Start from a project that comes with the program"),
    Command("open", "File", "&Open…", "Ctrl+O", "open", "Open a project file"),
    Command("open_results", "File", "Open res&ults…", "Ctrl+Shift+O", "", "Look at the folder of a finished scan"),
    Command("recent", "File", "Open &recent"),
    "File/-",
    Command("save", "File", "&Save", "Ctrl+S", "save", "Save the project"),
    Command("save_as", "File", "Save &as…", "Ctrl+Shift+S", "", "Save under another name, with the files it needs"),
    "File/-",
    Command("export_html", "File/Export", "Report as &HTML…", "Ctrl+E", "", "One self-contained file for a browser"),
    Command("export_pdf", "File/Export", "Report as &PDF…", "", "", "The same report, to print"),
    "File/Export/-",
    Command("export_exr", "File/Export", "&Frame as EXR…", "", "", "Radiance of every light group, with the truth"),
    Command("export_png", "File/Export", "&Image as PNG…", "", "", "As the sensor sees it"),
    Command(
        "export_ply", "File/Export", "&Points as PLY…", "Ctrl+Shift+E", "", "With error and scan line as attributes"
    ),
    Command("export_csv", "File/Export", "Points as &CSV…", "", "", "A table for a spreadsheet"),
    Command("export_pcd", "File/Export", "Points as PC&D…", "", "", "For PCL and CloudCompare"),
    Command("export_xyz", "File/Export", "Points as &XYZ…", "", "", "Coordinates alone, a line a point"),
    Command("export_las", "File/Export", "Points as &LAS…", "", "", 'With the extra "points": laspy'),
    Command("export_e57", "File/Export", "Points as &E57…", "", "", 'With the extra "points": pye57'),
    Command(
        "export_film", "File/Export", "Fil&m of the scan…", "", "", "A video as MP4: image and points, step by step"
    ),
    Command("export_heightmap", "File/Export", "&Height map of the scan…", "", "", "16 bit, with its scale beside it"),
    Command(
        "export_photographs",
        "File/Export",
        "Li&ne in photographs…",
        "",
        "",
        "Points found in photographs, as CSV or PNG",
    ),
    "File/Export/-",
    Command("screenshot", "File/Export", "&Screenshot of the window…", "Ctrl+Shift+P", "picture"),
    "File/-",
    Command("quit", "File", "&Quit", "Ctrl+Q"),
    Command("undo", "Edit", "&Undo", "Ctrl+Z", "undo"),
    Command("redo", "Edit", "&Redo", "Ctrl+Shift+Z; Ctrl+Y", "redo"),
    "Edit/-",
    Command("duplicate", "Edit", "&Duplicate", "Ctrl+D", "", "A copy of what is selected"),
    Command("delete", "Edit", "D&elete", "Del", "", "Remove what is selected"),
    Command("rename", "Edit", "Re&name", "F2"),
    Command("hide", "Edit", "&Hide or show", "H", "", "Hidden objects are neither drawn nor measured"),
    "Edit/-",
    Command(
        "copy_python", "Edit", "Copy as &Python", "Ctrl+Shift+C", "", "Lines for a notebook that give what is shown"
    ),
    Command("preferences", "Edit", "Pre&ferences…", "Ctrl+,", "", "Units, threads, image scale, autosave, undo"),
    Command("deselect", "Edit", "Select &nothing", "Ctrl+Shift+A"),
    Command("setup", "View", "&Set up", "F6", "", "", True),
    Command("render_workspace", "View", "&Render", "F7", "", "", True),
    Command("measure", "View", "&Measure", "F8", "", "", True),
    Command("study", "View", "S&tudy", "F12", "", "", True),
    Command("calibrate", "View", "&Calibrate", "F3", "", "", True),
    Command("dataset", "View", "Datas&et", "F10", "", "", True),
    "View/-",
    Command("panels", "View", "&Panels"),
    Command("log", "View", "M&essages", "Ctrl+L", "", "The log of this session"),
    Command("arrange", "View", "Panels as they &were", "", "", "Put the panels of this workspace back in place"),
    "View/-",
    Command("theme_system", "View/Theme", "As the &desktop", "", "", "", True),
    Command("theme_dark", "View/Theme", "&Dark", "", "", "", True),
    Command("theme_light", "View/Theme", "&Light", "", "", "", True),
    Command("full_screen", "View", "&Full screen", "F11", "", "", True),
    Command(
        "import_mesh",
        "Scene",
        "Import &mesh…",
        "Ctrl+I",
        "mesh",
        "STL, PLY, OBJ, GLB, STEP; or drop them on the window",
    ),
    Command("replace_mesh", "Scene", "&Replace mesh…", "", "", "Of the selected object; pose, scale and material stay"),
    Command("aim", "Scene", "A&im the laser at a click", "", "", "The next click in 3D says what it is to light (T)"),
    "Scene/-",
    Command("add", "Scene", "&Add"),
    Command("presets", "Scene", "&Presets"),
    Command("motion", "Scene", "M&otion"),
    Command("render", "Render", "&Render", "F5", "render", "Render the frame with the settings of the Render panel"),
    Command("expose", "Render", "Automatic &exposure", "F4", "", "The line's brightest pixels nearly full"),
    Command("pause", "Render", "&Pause or go on", "F9", "pause"),
    Command("cancel", "Render", "&Cancel", "Shift+F5", "cancel", "Stop what is being computed"),
    "Render/-",
    Command(
        "scan", "Render", "Run the whole &scan…", "Ctrl+F5", "", "Every step of the motion, with points and report"
    ),
    Command("resume_scan", "Render", "Res&ume the scan", "", "", "Go on with the scan that was stopped, as it began"),
    Command("previous_line", "Measure", "&Previous scan line", "Alt+Up"),
    Command("next_line", "Measure", "&Next scan line", "Alt+Down"),
    Command("worst_line", "Measure", "&Worst scan line", "Alt+W", "", "Where the error is largest"),
    "Measure/-",
    Command(
        "deviation", "Measure", "&Deviation from nominal…", "Alt+D", "", "From the part or its CAD, with a tolerance"
    ),
    Command("section", "Measure", "&Section…", "Alt+X", "", "Truth and points in a plane, as DXF or CSV"),
    Command(
        "heights", "Measure", "Height &map…", "Alt+Z", "", "Of a scan: picture, profile along a line, 16 bit files"
    ),
    Command(
        "measure_scan",
        "Measure",
        "Measure the scan &again",
        tip="Points, measures and report of all its steps with sensor, extraction and measures of now; no render",
    ),
    "Measure/-",
    Command("photographs", "Measure", "Line in p&hotographs…", "", "", "Of a real scanner, beside the rendered image"),
    "Measure/-",
    Command("frame_points", "Measure", "Points in &view", "Alt+P", "", "The measured points in the middle of the view"),
    Command(
        "calibrate_photographs",
        "Calibrate",
        "From &photographs…",
        "",
        "",
        "Of a board, in a folder; or drop them",
    ),
    Command("calibrate_project", "Calibrate", "In &silico", "", "", "Virtual boards before the open project's camera"),
    "Calibrate/-",
    Command("drop_view", "Calibrate", "&Drop or restore the view", "", "", "And adjust the rest again"),
    "Calibrate/-",
    Command("save_calibration", "Calibrate", "Sa&ve the calibration…", "", "", "For projects to load; or for others"),
    Command(
        "use_calibration",
        "Calibrate",
        "&Use it in the project",
        "",
        "",
        "The calibration found makes the project's points",
    ),
    Command("use_calibration_file", "Calibrate", "Use a calibration &file in the project…"),
    Command(
        "remove_calibration",
        "Calibrate",
        "&Remove it from the project",
        "",
        "",
        "The project's calibration goes: points are made by the scene",
    ),
    Command("help", "Help", "&Contents", "F1", "help", "The page of the panel that has the focus"),
    Command(
        "search",
        "Help",
        "&Find a command…",
        "Ctrl+P",
        "",
        "All that the menus can do, and every field, by a few letters",
    ),
    Command("shortcuts", "Help", "&Shortcuts", "Ctrl+/"),
    Command("tour", "Help", "&Guided tour"),
    "Help/-",
    Command("about", "Help", "&About Blazer Studio"),
)
SUBMENUS = ("recent", "panels", "add", "presets", "motion")
"""Commands that are menus, filled by whoever knows what is in them."""


class Actions:
    """The menus of a window, and the action of every command by its key."""

    def __init__(self, window: QMainWindow, before: Callable[[], None] = lambda: None) -> None:
        """before: called ahead of what any command does."""
        self.window = window
        self.before = before
        self.by_key: dict[str, QAction] = {}
        self.submenus: dict[str, QMenu] = {}
        self._menus: dict[str, QMenu] = {}
        for entry in COMMANDS:
            if isinstance(entry, str):
                self._menu(entry.rpartition("/")[0]).addSeparator()
            elif entry.key in SUBMENUS:
                self.submenus[entry.key] = self._menu(entry.menu).addMenu(entry.text)
            else:
                self.by_key[entry.key] = self._action(entry)

    def __getitem__(self, key: str) -> QAction:
        return self.by_key[key]

    def connect(self, key: str, handler: Callable[[], object]) -> None:
        """Call the handler when the command is chosen."""

        def call(_checked: bool = False) -> None:
            self.before()
            handler()

        self.by_key[key].triggered.connect(call)

    def _menu(self, path: str) -> QMenu:
        if path not in self._menus:
            parent, _, name = path.rpartition("/")
            holder = self._menu(parent) if parent else self.window.menuBar()
            self._menus[path] = holder.addMenu(f"&{name}")
        return self._menus[path]

    def _action(self, command: Command) -> QAction:
        action = QAction(command.text, self.window)
        action.setObjectName(command.key)
        action.setCheckable(command.checkable)
        if command.shortcut:
            action.setShortcuts(QKeySequence.listFromString(command.shortcut))
            action.setShortcutContext(Qt.ShortcutContext.WindowShortcut)
        if command.icon:
            action.setIcon(icon(command.icon))
            action.setIconVisibleInMenu(False)
        plain = command.text.replace("&", "")
        tip = command.tip or plain.rstrip("…")
        action.setStatusTip(tip)
        action.setToolTip(f"{tip} ({command.shortcut})" if command.shortcut else tip)
        self._menu(command.menu).addAction(action)
        return action
