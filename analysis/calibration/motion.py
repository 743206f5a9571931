"""How a board was carried between views: by a stage, a turntable or a robot's hand, whose axis or place is estimated.

The views of one placement share the board's pose in the first of them; in the others it is A times that, where A is a
rigid motion of the camera frame that the parameters give together with what the axis or the robot was told:

    stage        A = translation by g s            s (3,) m for each metre told
    turntable    A = rotation by g about the axis  through c, along n
    hand-eye     A = X^-1 M X                      X (6,) camera in the hand, M the hand's motion (a camera that stands:
                                                   camera in the robot's base, M the motion of the board's hand)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import scipy  # whose parts are loaded as they are named: the window starts without them
from numpy.typing import NDArray

from render.base.arrays import Bool, Float
from render.base.errors import InputError
from render.base.pose import invert

Kind = Literal["stage", "turntable", "hand_eye"]
Held = Literal["camera", "board"]
"""What a robot's hand holds."""
NAMES: dict[Kind, tuple[str, ...]] = {
    "stage": ("stage_x", "stage_y", "stage_z"),
    "turntable": ("axis_slope_1", "axis_slope_2", "axis_at_1", "axis_at_2"),
    "hand_eye": ("hand_turn_x", "hand_turn_y", "hand_turn_z", "hand_x", "hand_y", "hand_z"),
}
LEAST_TURN = 0.1
"""Sine of an angle below which two views tell little of an axis."""

CLEARLY = 0.2
"""rad by which one end of a board must fit better than the other."""


@dataclass(frozen=True)
class Moves:
    """Of each view: rotation (views, 3, 3) and shift (views, 3) of A, and (views, p, 3, 4) their derivatives."""

    rotation: Float
    shift: Float
    derivative: Float


@dataclass(frozen=True)
class Motion:
    """Which views share a placement of the board, what was told of each, and the parameters that are estimated.

    A turntable's axis is x = (at_1, at_2) + (slope_1, slope_2) y over the coordinate y along which it mostly runs.
    """

    kind: Kind
    group: NDArray[np.intp]
    """(views,) placement, numbered from 0 without gaps."""
    given: Float
    """(views,) m of a stage or rad of a turntable; (views, 4, 4) of a hand: its pose in the robot's base where it
    carries the camera, the inverse of that where it carries the board."""
    parameters: Float
    """As `NAMES` has them."""
    along: Float
    """(3,) the signed coordinate axis next to a turntable's; of no meaning to others."""
    holds: Held = "camera"
    """Of no meaning but to a hand."""

    @property
    def across(self) -> NDArray[np.intp]:
        """(2,) the coordinates across `along`."""
        return np.nonzero(self.along == 0.0)[0]

    @property
    def first(self) -> NDArray[np.intp]:
        """(groups,) the first view of each placement."""
        return np.unique(self.group, return_index=True)[1]

    def of_views(self, keep: Bool) -> Motion:
        """That of some views (views,)."""
        group = np.unique(self.group[keep], return_inverse=True)[1]
        return replace(self, group=group, given=self.given[keep])

    def with_parameters(self, parameters: Float) -> Motion:
        """The same told, carried out otherwise."""
        return replace(self, parameters=parameters)

    def standing(self, views: int) -> Motion:
        """The same parameters with other views, each a placement of its own."""
        given = np.broadcast_to(np.eye(4), (views, 4, 4)) if self.kind == "hand_eye" else np.zeros(views)
        return replace(self, group=np.arange(views), given=given)

    def moves(self) -> Moves:
        """A of every view."""
        start = self.first[self.group]
        if self.kind == "stage":
            return _stage(self.given - self.given[start], self.parameters)
        if self.kind == "turntable":
            return self._turntable(self.given - self.given[start])
        return _hand_eye(invert(self.given) @ self.given[start], self.parameters)

    def axis(self) -> tuple[Float, Float]:
        """(3,) unit direction of a turntable's axis, turning positively about it, and (3,) m a point on it."""
        raw, point, across = self.along.copy(), np.zeros(3), self.across
        raw[across], point[across] = self.parameters[:2], self.parameters[2:]
        return raw / np.linalg.norm(raw), point

    def axis_derivative(self) -> Float:
        """(2, 3) of the direction by its slopes."""
        normal, across = self.axis()[0], self.across
        return np.asarray((np.eye(3)[across] - normal[across][:, None] * normal) * abs(normal @ self.along))

    def axis_and_point_derivative(self) -> Float:
        """(6, 4) of a turntable's direction and of the point of its axis next to the camera, by its parameters."""
        normal, point = self.axis()
        by_normal, by_point = np.zeros((3, 4)), np.zeros((3, 4))
        by_normal[:, :2] = self.axis_derivative().T
        by_point[self.across, [2, 3]] = 1.0
        nearest = by_point - np.outer(normal, point @ by_normal + normal @ by_point) - (normal @ point) * by_normal
        return np.concatenate([by_normal, nearest])

    def _turntable(self, angle: Float) -> Moves:
        normal, point = self.axis()
        sine, versine = np.sin(angle)[:, None, None], (1.0 - np.cos(angle))[:, None, None]
        about = cross_matrices(normal[None])[0]
        rotation = np.eye(3) * (1.0 - versine) + sine * about + versine * np.outer(normal, normal)
        derivative = np.zeros((len(angle), 4, 3, 4))
        for i, change in enumerate(self.axis_derivative()):
            both = np.outer(change, normal)
            derivative[:, i, :, :3] = sine * cross_matrices(change[None])[0] + versine * (both + both.T)
            derivative[:, i, :, 3] = -derivative[:, i, :, :3] @ point
        derivative[:, 2:, :, 3] = (np.eye(3) - rotation)[:, :, self.across].transpose(0, 2, 1)
        return Moves(rotation, point - rotation @ point, derivative)


def turntable(group: NDArray[np.intp], given: Float, normal: Float, point: Float) -> Motion:
    """A turntable about an axis of unit direction (3,), in the camera's frame, through a point (3,) m."""
    main = int(np.argmax(np.abs(normal)))
    empty = Motion("turntable", group, given, np.zeros(4), np.sign(normal[main]) * np.eye(3)[main])
    at = point - normal * (point[main] / normal[main])
    return replace(empty, parameters=np.append(normal[empty.across] / abs(normal[main]), at[empty.across]))


@dataclass(frozen=True)
class Told:
    """What the axis or the robot was told, by the names of views: the placement of the board, and as `Motion.given`."""

    kind: Kind
    by_name: Mapping[str, tuple[str, Float]]
    holds: Held = "camera"

    def of(self, names: Sequence[str]) -> tuple[NDArray[np.intp], Float]:
        """(views,) placement of each, one of its own where nothing was told, and what was given.

        InputError: two views of no placement were told of.
        """
        labels = [("told", self.by_name[name][0]) if name in self.by_name else ("free", name) for name in names]
        group = np.unique([" ".join(label) for label in labels], return_inverse=True)[1]
        nothing = np.eye(4) if self.kind == "hand_eye" else np.zeros(())
        given = np.array([self.by_name[name][1] if name in self.by_name else nothing for name in names])
        if len(np.unique(group)) == len(names):
            raise InputError(
                "no two views of one placement of the board were told of",
                where="the board's motion",
                found=f"{sum(name in self.by_name for name in names)} of {len(names)} views told of",
                cure="leave the board where it is and photograph it at several positions",
            )
        return group, given


def started(kind: Kind, group: NDArray[np.intp], given: Float, rotation: Float, translation: Float) -> Motion:
    """The motion that the board's poses (views, 3, 3) and (views, 3), found view by view, show.

    InputError: they do not show it. Source of the hand's: Park and Martin, Robot sensor calibration, 1994.
    """
    number = np.unique(group, return_inverse=True)[1]
    first, second = _pairs(number)
    empty = Motion(kind, number, given, np.zeros(len(NAMES[kind])), np.array([0.0, 1.0, 0.0]))
    turned = rotation[second] @ rotation[first].transpose(0, 2, 1)
    if kind == "stage":
        far = np.abs(given[second] - given[first])
        long = far > 0.3 * far.max(initial=0.0)
        if not np.any(far[long] > 0.0):
            raise _undetermined("the stage did not move between views of one placement", "move it to two positions")
        each = (translation[second] - translation[first])[long] / (given[second] - given[first])[long, None]
        return replace(empty, parameters=np.median(each, axis=0))
    if kind == "turntable":
        sine = np.sin(given[second] - given[first])
        clear = np.abs(sine) > LEAST_TURN
        if not clear.any():
            raise _undetermined("the turntable did not turn between views of one placement", "turn it by 20 deg")
        skew = 0.5 * (turned - turned.transpose(0, 2, 1))[clear]
        each = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1) / sine[clear, None]
        normal = np.median(each, axis=0)
        normal /= max(float(np.linalg.norm(normal)), 1e-12)
        there = turntable(number, given, normal, np.zeros(3))
        turn = scipy.spatial.transform.Rotation.from_rotvec(
            (given[second] - given[first])[:, None] * normal
        ).as_matrix()
        left, right = np.eye(3) - turn, translation[second] - np.einsum("nij,nj->ni", turn, translation[first])
        at = np.linalg.lstsq(left[:, :, there.across].reshape(-1, 2), right.ravel(), rcond=None)[0]
        return replace(there, parameters=np.append(there.parameters[:2], at))
    motion = invert(given[second]) @ given[first]
    ours, theirs = (
        scipy.spatial.transform.Rotation.from_matrix(each).as_rotvec() for each in (turned, motion[:, :3, :3])
    )
    if len(ours) < 2 or np.linalg.svd(theirs, compute_uv=False)[1] < LEAST_TURN:
        raise _undetermined("the hand turned about one axis only", "turn it by 20 deg or more about another as well")
    eye = scipy.spatial.transform.Rotation.align_vectors(theirs, ours)[0].as_matrix()
    moved = translation[second] - np.einsum("nij,nj->ni", turned, translation[first])
    right = moved @ eye.T - motion[:, :3, 3]
    shift = np.linalg.lstsq((motion[:, :3, :3] - np.eye(3)).reshape(-1, 3), right.ravel(), rcond=None)[0]
    return replace(empty, parameters=np.append(scipy.spatial.transform.Rotation.from_matrix(eye).as_rotvec(), shift))


def turned_about(motion: Motion, rotation: Float) -> Bool:
    """(views,) whose board's corners were counted from the other end than in the first view of their placement.

    Half a turn leaves a checkerboard as it is, so that what was told decides: by how much a view's board has turned
    since then, of rotation (views, 3, 3). At a quarter turn about the board's normal both ends are alike.
    """
    start, ends = motion.first[motion.group], np.diag([-1.0, -1.0, 1.0])
    if motion.kind == "stage":
        told = np.zeros(len(rotation))
    elif motion.kind == "turntable":
        told = np.abs(np.angle(np.exp(1j * (motion.given - motion.given[start]))))
    else:
        told = _angle((invert(motion.given) @ motion.given[start])[:, :3, :3])
    first = rotation[start].transpose(0, 2, 1)
    as_is, other = (np.abs(_angle(turned @ first) - told) for turned in (rotation, rotation @ ends))
    return np.asarray(other + CLEARLY < as_is)


def _angle(rotation: Float) -> Float:
    return np.asarray(scipy.spatial.transform.Rotation.from_matrix(rotation).magnitude())


def placements(motion: Motion, rotation: Float, translation: Float) -> tuple[Float, Float]:
    """(groups, 3, 3) and (groups, 3), pose of each in its first view, as its views tell it on the whole."""
    moves = motion.moves()
    back = moves.rotation.transpose(0, 2, 1)
    turns, shifts = back @ rotation, np.einsum("nij,nj->ni", back, translation - moves.shift)
    groups = [motion.group == number for number in range(len(motion.first))]
    turn = np.array([scipy.spatial.transform.Rotation.from_matrix(turns[own]).mean().as_matrix() for own in groups])
    return turn, np.array([np.median(shifts[own], axis=0) for own in groups])


def _pairs(group: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    first, second = np.triu_indices(len(group), 1)
    same = group[first] == group[second]
    return first[same], second[same]


def _undetermined(what: str, cure: str) -> InputError:
    return InputError(what, where="the board's motion", cure=cure)


def _stage(told: Float, step: Float) -> Moves:
    derivative = np.zeros((len(told), 3, 3, 4))
    derivative[:, np.arange(3), np.arange(3), 3] = told[:, None]
    return Moves(np.tile(np.eye(3), (len(told), 1, 1)), told[:, None] * step, derivative)


def _hand_eye(motion: Float, parameters: Float) -> Moves:
    eye = scipy.spatial.transform.Rotation.from_rotvec(parameters[:3]).as_matrix()
    turn, shift = motion[:, :3, :3], parameters[3:]
    arm = turn @ shift + motion[:, :3, 3] - shift
    derivative = np.zeros((len(motion), 6, 3, 4))
    for i, change in enumerate(_left_jacobian(parameters[:3]).T):
        skew = cross_matrices(change[None])[0]
        derivative[:, i, :, :3] = eye.T @ (turn @ skew - skew @ turn) @ eye
        derivative[:, i, :, 3] = -(arm @ skew.T) @ eye
    derivative[:, 3:, :, 3] = (eye.T @ (turn - np.eye(3))).transpose(0, 2, 1)
    return Moves(eye.T @ turn @ eye, arm @ eye, derivative)


def _left_jacobian(turn: Float) -> Float:
    """(3, 3) J with exp(turn + d) = exp(J d) exp(turn) to first order."""
    angle, skew = float(np.linalg.norm(turn)), cross_matrices(turn[None])[0]
    if angle < 1e-6:
        return np.asarray(np.eye(3) + 0.5 * skew)
    first, second = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + first * skew + second * skew @ skew)


def cross_matrices(vectors: Float) -> Float:
    """(n, 3) a -> (n, 3, 3) [a]x, with [a]x b = a x b."""
    out = np.zeros((len(vectors), 3, 3))
    x, y, z = vectors.T
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -z, y, -x
    out[:, 1, 0], out[:, 2, 0], out[:, 2, 1] = z, -y, x
    return out
