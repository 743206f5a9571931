"""The two rows of a pose, position and angles, as it is given or in the other frame that people think in."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from PySide6.QtWidgets import QWidget

from render.base.arrays import Float
from render.base.model import Vector3
from render.base.pose import Pose
from studio.editing.euler_angles import euler_angles, rotation_from_euler
from studio.editing.forms import REQUIRED, FieldSpec, field_path
from studio.editing.targets import other_frame, rounded
from studio.editing.units import DEGREES, SHOWN, Unit
from studio.project.document import FieldPath
from studio.qt.forms.form_rows import Row

if TYPE_CHECKING:
    from studio.qt.forms.form import Form

AXES = ("x", "y", "z")


class PoseRow(Row):
    """Of a pose as it is given, or in the other frame that people think in."""

    def __init__(self, form: Form, owner: FieldPath, spec: FieldSpec) -> None:
        self._last_frame = np.eye(4)
        super().__init__(form, owner, spec)

    def refresh(self, spec: FieldSpec) -> None:
        self._last_frame = self._frame(spec)
        super().refresh(spec)

    def is_stale(self, spec: FieldSpec) -> bool:
        return super().is_stale(spec) or not np.array_equal(self._last_frame, self._frame(spec))

    def varied(self) -> list[tuple[FieldPath, FieldSpec]]:
        return [] if self._elsewhere(self.spec) else super().varied()  # the project has it as it is given

    def _elsewhere(self, spec: FieldSpec) -> bool:
        return spec.name in self.form.elsewhere

    def _frame(self, spec: FieldSpec) -> Float:
        """T_shown_given, (4, 4)."""
        session = self.form.session
        path = field_path(self.owner, spec)
        found = other_frame(session.project, path, session.step) if self._elsewhere(spec) else None
        return np.eye(4) if found is None else found[1]

    def _shown(self, pose: Pose) -> Pose:
        """In the frame that is shown; as it stands where that is its own."""
        T = self._frame(self.spec)
        return pose if np.array_equal(T, np.eye(4)) else Pose.from_matrix(T @ pose.matrix)


class PositionRow(PoseRow):
    """The translation of a pose, mm."""

    def _title(self) -> tuple[str, str]:
        return "Position", SHOWN["m"]

    def _value(self) -> Any:
        return rounded(np.array(self._shown(self.spec.value).translation))

    def _default(self) -> Any:
        return REQUIRED if self._elsewhere(self.spec) else (0.0, 0.0, 0.0)

    def _text(self, value: Any) -> str:
        return " ".join(Unit.of("m").format(part) for part in value) + f" {SHOWN['m']}"

    def _help(self) -> str:
        return "<b>Position</b><br>x, y, z of its origin. Drag sideways, or click to type."

    def _make_editor(self) -> QWidget:
        length = replace(self.spec, kind="number", unit=Unit.of("m"), optional=False)
        specs = [replace(length, name=axis, value=v) for axis, v in zip(AXES, self._value(), strict=True)]
        return self._vector(specs, self._with_part)

    def change(self, value: Any, label: str = "", merge: str = "") -> bool:
        if self._elsewhere(self.spec):
            T = self._frame(self.spec)
            value = rounded(T[:3, :3].T @ (np.array(value) - T[:3, 3]))
        return super().change(self.spec.value.model_copy(update={"translation": value}), label, merge)


class RotationRow(PoseRow):
    """The rotation of a pose as angles about the fixed axes x, then y, then z; deg."""

    def __init__(self, form: Form, owner: FieldPath, spec: FieldSpec) -> None:
        self.angles: Vector3 | None = None
        super().__init__(form, owner, spec)

    def varied(self) -> list[tuple[FieldPath, FieldSpec]]:
        return []  # the project holds no angles

    def refresh(self, spec: FieldSpec) -> None:
        # near the angles that are shown, so that turning one leaves the others alone
        self.angles = euler_angles(self._shown(spec.value).rotation, near=self.angles)
        super().refresh(spec)

    def _title(self) -> tuple[str, str]:
        return "Rotation", "deg"

    def _value(self) -> Any:
        return self.angles or (0.0, 0.0, 0.0)

    def _default(self) -> Any:
        return REQUIRED if self._elsewhere(self.spec) else (0.0, 0.0, 0.0)

    def _text(self, value: Any) -> str:
        return " ".join(DEGREES.format(part) for part in value) + " deg"

    def _help(self) -> str:
        return "<b>Rotation</b><br>About the fixed axes x, then y, then z. Drag sideways, or click to type."

    def _make_editor(self) -> QWidget:
        angle = replace(self.spec, kind="number", unit=DEGREES, optional=False)
        specs = [replace(angle, name=axis, value=v) for axis, v in zip(AXES, self._value(), strict=True)]
        return self._vector(specs, self._with_part)

    def change(self, value: Any, label: str = "", merge: str = "") -> bool:
        before, self.angles = self.angles, value
        rotation = rotation_from_euler(value)
        if self._elsewhere(self.spec):
            turned = np.eye(4)
            turned[:3, :3] = self._frame(self.spec)[:3, :3].T @ Pose(rotation=rotation).matrix[:3, :3]
            rotation = Pose.from_matrix(turned).rotation
        made = super().change(self.spec.value.model_copy(update={"rotation": rotation}), label, merge)
        if not made:
            self.angles = before
        return made
