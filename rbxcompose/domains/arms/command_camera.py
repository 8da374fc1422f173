"""`arm calibrate-camera`: where a camera of a running robot is, measured by a tag on the hand.

It is found from poses of the hand and of the tag together. With the hand in the base A, the tag before the camera B,
the camera in the base X and the tag on the hand Y, each pair has A Y = X B. A first solution by M. Shah, Solving the
Robot-World/Hand-Eye Calibration Problem Using the Kronecker Product, 2013, is refined by least squares over positions
and rotations. Lengths are in [m], angles in [rad].
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable, Sequence
from itertools import combinations
from pathlib import Path

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import replace_file
from rbxcompose.base.findings import Finding, kind
from rbxcompose.base.geometry import Transform3, angle_between, rpy_from_quaternion
from rbxcompose.base.printable import plain
from rbxcompose.base.transforms import TransformError, TransformTree, UnknownFrameError
from rbxcompose.commands import options
from rbxcompose.commands.console import NotDoneError, emit, misused
from rbxcompose.commands.guest import NAME, NO_NAME, NOBODY, Guest, visit, wanted
from rbxcompose.commands.lookup import add_bus_options
from rbxcompose.domains.body.command_body import ReceivedFrames
from rbxcompose.domains.worlds.physics.solids import quaternion_of, rotation_matrix
from rbxcompose.msgs.rbxcompose_msgs import MoveArm
from rbxcompose.sdk.bound import Ended, Outcome

LEAST = 3  # pairs
TURNED = math.radians(8)  # by which a hand turns about each of two axes, root mean square over all pairs of poses
PER_TURN = 0.2  # an error of 1 rad counts as one of so many metres
ROUNDS = 20
STEP = 1e-6  # of numeric slopes [m, rad]
APART = 0.02, math.radians(5)  # by one of which poses of a hand are other ones
STILL = 0.002, math.radians(0.3)  # within both of which a hand stands
STANDS, READINGS = 1.0, 5  # [s], and readings of the tag, of which a pair is the mean


class PoorMotionsError(ValueError):
    """Raised when a camera cannot be measured by the poses that there are, with the reason."""


@dataclass(frozen=True, slots=True)
class HandSight:
    """Where the hand was in the base, and the tag in the frame of the camera."""

    hand: Transform3
    tag: Transform3


@dataclass(frozen=True, slots=True)
class HandEye:
    """A camera that was measured."""

    camera: Transform3
    """In the base."""
    tag: Transform3
    """On the hand."""
    off: tuple[tuple[float, float], ...]
    """How far each pair is off [m] and by which angle [rad]."""
    known_to: tuple[float, float]
    """Standard deviation of the position and of the rotation of the camera, by what pairs are off."""

    @property
    def misses(self) -> tuple[float, float]:
        """Return how far pairs are off, root mean square [m] and [rad]."""
        away, angle = np.sqrt(np.mean(np.square(self.off), axis=0)).tolist()
        return away, angle


def measured(pairs: Sequence[HandSight]) -> HandEye:
    """Return the camera and the tag that explain pairs best.

    Raises:
        PoorMotionsError: if these are too few, or the hand has turned too little for it.
    """
    if len(pairs) < LEAST:
        raise PoorMotionsError(f"{len(pairs)} poses of the hand are too few: {LEAST} is the least, and 10 are good")
    hands = np.array([rotation_matrix(pair.hand.rotation) for pair in pairs])
    tags = np.array([rotation_matrix(pair.tag.rotation) for pair in pairs])
    _prove_turned(hands)
    hand_at = np.array([pair.hand.translation for pair in pairs])
    tag_at = np.array([pair.tag.translation for pair in pairs])
    left, _, right = np.linalg.svd(sum(np.kron(tag, hand) for hand, tag in zip(hands, tags, strict=True)))
    camera, tag = _rotation(left[:, 0]), _rotation(right[0])
    if np.trace(hands[0] @ tag @ tags[0].T @ camera.T) < 0:  # both vectors of the decomposition may be turned round
        camera = _rotation(-left[:, 0])
    rows = np.concatenate([np.hstack((np.eye(3), -hand)) for hand in hands])
    both, *_ = np.linalg.lstsq(rows, (hand_at - tag_at @ camera.T).ravel(), rcond=None)
    found: list[tuple[Array, Array]] = [(camera, np.asarray(both[:3], float)), (tag, np.asarray(both[3:], float))]

    def misses(change: Array) -> Array:
        (turn_x, at_x), (turn_y, at_y) = (_moved(*one, change[6 * n : 6 * n + 6]) for n, one in enumerate(found))
        away = hand_at + hands @ at_y - (at_x + tag_at @ turn_x.T)
        turned = np.swapaxes(turn_x @ tags, 1, 2) @ hands @ turn_y
        return np.column_stack((away, PER_TURN * np.array([_vector(one) for one in turned]))).ravel()

    for _ in range(ROUNDS):
        off = misses(np.zeros(12))
        slopes = np.column_stack([(misses(step) - off) / STEP for step in np.eye(12) * STEP])
        solved, *_ = np.linalg.lstsq(slopes, -off, rcond=None)
        change = np.asarray(solved, float)
        found = [_moved(*one, change[6 * n : 6 * n + 6]) for n, one in enumerate(found)]
        if np.abs(change).max() < 1e-9:
            break
    off = misses(np.zeros(12)).reshape(-1, 2, 3)
    spread = np.linalg.pinv(slopes.T @ slopes) * (off**2).sum() / max(1, off.size - 12)
    away, angles = np.linalg.norm(off, axis=2).T
    camera_pose, tag_pose = (Transform3(_three(at), quaternion_of(turn)) for turn, at in found)
    known_to = (math.sqrt(np.trace(spread[:3, :3])), math.sqrt(np.trace(spread[3:6, 3:6])))
    each = tuple(zip(away.tolist(), (angles / PER_TURN).tolist(), strict=True))
    return HandEye(camera_pose, tag_pose, each, known_to)


class StandingHand:
    """Takes a pair each time the hand stands somewhere else, as the mean of several readings."""

    def __init__(self) -> None:
        self.pairs: list[HandSight] = []
        self._readings: list[tuple[float, HandSight]] = []

    def take(self, now: float, reading: HandSight) -> bool:
        """Take one more reading at a time [s]; return whether it completes a pair."""
        if self._readings and not _is_within(reading.hand, self._readings[0][1].hand, STILL):
            self._readings.clear()
        if any(_is_within(reading.hand, pair.hand, APART) for pair in self.pairs):
            return False
        self._readings.append((now, reading))
        if now - self._readings[0][0] < STANDS or len(self._readings) < READINGS:
            return False
        hands, tags = ([getattr(one, name) for _, one in self._readings] for name in ("hand", "tag"))
        self.pairs.append(HandSight(_mean(hands), _mean(tags)))
        self._readings.clear()
        return True


def _prove_turned(hands: Array) -> None:
    """Raise an error unless hands with rotations (n, 3, 3) have turned enough, and about two axes."""
    turns = np.array([_vector(other @ one.T) for one, other in combinations(hands, 2)])
    _, second, most = np.sqrt(np.maximum(0.0, np.linalg.eigvalsh(turns.T @ turns / len(turns)))).tolist()
    if most < TURNED:
        raise PoorMotionsError(
            f"the hand has turned by {math.degrees(most):.0f} deg only: poses of it must differ by 30 deg and more"
        )
    if second < TURNED:
        raise PoorMotionsError(
            "the hand has turned about one axis only, which leaves open where along that the camera is: turn it about "
            "another one, too, by 30 deg and more"
        )


def _rotation(vector: Array) -> Array:
    """Return the rotation (3, 3) nearest to a matrix, given column by column and by some factor (9,)."""
    matrix = vector.reshape(3, 3).T
    matrix = matrix * np.sign(np.linalg.det(matrix))
    left, _, right = np.linalg.svd(matrix)
    return np.asarray(left @ right)


def _moved(turn: Array, at: Array, change: Array) -> tuple[Array, Array]:
    """Return a rotation (3, 3) and a position, changed by a translation and by a rotation about fixed axes (6,)."""
    x, y, z = change[3:]
    angle = float(np.linalg.norm(change[3:]))
    cross = np.array(((0, -z, y), (z, 0, -x), (-y, x, 0)))
    sine, versine = (math.sin(angle) / angle, (1 - math.cos(angle)) / angle**2) if angle > 1e-9 else (1.0, 0.5)
    return (np.eye(3) + sine * cross + versine * cross @ cross) @ turn, at + change[:3]


def _vector(turn: Array) -> Array:
    """Return a rotation (3, 3) as its axis times its angle (3,)."""
    x, y, z, w = quaternion_of(turn)
    sine = math.sqrt(x * x + y * y + z * z)
    angle = 2 * math.atan2(sine, w)
    angle = angle if angle <= math.pi else angle - math.tau
    return np.array((x, y, z)) * (angle / sine if sine > 1e-12 else 2.0)


def _is_within(one: Transform3, other: Transform3, bounds: tuple[float, float]) -> bool:
    away, angle = math.dist(one.translation, other.translation), angle_between(one.rotation, other.rotation)
    return away <= bounds[0] and angle <= bounds[1]


def _mean(poses: Sequence[Transform3]) -> Transform3:
    """Return the mean of poses that are nearly alike."""
    turns = np.array([pose.rotation for pose in poses])
    turns *= np.sign(turns @ turns[0])[:, None]
    x, y, z, w = (turns.sum(0) / np.linalg.norm(turns.sum(0))).tolist()
    return Transform3(_three(np.array([pose.translation for pose in poses]).mean(0)), (x, y, z, w))


def _three(vector: Array) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z


NOT_MEASURED = kind("RBX3710")
COUNT = 10  # poses that are good
PATIENCE = 5.0  # [s] without the tag after which that is said, or the next pose is tried
FAR_OFF = 3.0  # times as far off as others a pose is doubtful


def add_camera_options(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `arm calibrate-camera`."""
    parser.add_argument("hand", metavar="HAND", help="the link that carries the tag, such as right_gripper_link")
    parser.add_argument("tag", metavar="TAG", help="the frame of the tag, such as tag_hand")
    words = "the frame to be placed (default: the one in which the tag is seen)"
    parser.add_argument("--place", metavar="FRAME", help=words)
    words = "the link to which the camera is fixed (default: the parent of that frame)"
    parser.add_argument("--parent", metavar="LINK", help=words)
    words = f"how many poses of the hand are used (default: {COUNT})"
    parser.add_argument("--count", type=options.count, default=COUNT, metavar="N", help=words)
    parser.add_argument("--arm", metavar="ARM", help="the arm that goes to --poses; else you move it")
    parser.add_argument("--poses", metavar="POSE,POSE", default="", help="poses of the arm, by name")
    options.out_option("write the result as YAML")(parser)
    options.add_timeout_option(parser, "5s")
    options.add_json_option(parser)
    add_bus_options(parser)


def run_camera(arguments: argparse.Namespace) -> int:
    """Take poses until there are enough, or an interrupt, and print where the camera is."""
    if bool(arguments.arm) != bool(arguments.poses):
        return misused("arm calibrate-camera", "--arm and --poses are given together")
    return visit(arguments, lambda guest: _measure(guest, arguments))


class CameraFrames:
    """The frames that take part, in a tree that grows while the robot runs."""

    def __init__(self, tree: TransformTree, hand: str, tag: str, place: str | None, parent: str | None) -> None:
        """Find out in which frame the tag is seen.

        Raises:
            TransformError: if the tag is not seen, or frames are not known.
        """
        seen_in = tree.parent_of(tag)
        if seen_in is None:
            raise UnknownFrameError(tag, tree.frames)
        self.tree, self.hand, self.tag, self.seen_in = tree, hand, tag, seen_in
        self.place = place or seen_in
        self.parent = parent or tree.parent_of(self.place) or self.place
        for pair in ((self.parent, hand), (self.seen_in, self.place)):
            if problem := tree.problem(*pair):
                raise problem
        self.standing, self.read_at = StandingHand(), tree.newest_common(seen_in, tag)

    def look(self, now: float) -> bool:
        """Take what is new at a time [s]; return whether it completes a pair."""
        try:
            time = self.tree.newest_common(self.seen_in, self.tag)
            if time is None or time == self.read_at:
                return False
            hand = self.tree.lookup_at(self.parent, self.hand, time)
            reading = HandSight(hand, self.tree.lookup_at(self.seen_in, self.tag, time))
        except TransformError:
            return False  # the joints of that time come soon
        self.read_at = time
        return self.standing.take(now, reading)

    def placed(self, found: HandEye) -> Transform3:
        """Return where the frame to be placed is in its parent."""
        return found.camera.compose(self.tree.lookup(self.seen_in, self.place) or Transform3())


def _measure(guest: Guest, arguments: argparse.Namespace) -> int:
    received = ReceivedFrames(guest)
    frames = _frames(guest, received.tree, arguments)
    pairs = frames.standing.pairs

    def look_for(count: int, patience: float = math.inf) -> bool:
        def is_enough() -> bool:
            if frames.look(guest.clock.now()):
                sys.stderr.write(f"pose {len(pairs)}\n")
            return len(pairs) >= count or guest.is_interrupted

        return guest.run(is_enough, patience)

    with guest.interruptible():
        if arguments.arm:
            _visit_poses(guest, arguments, lambda: look_for(len(pairs) + 1, PATIENCE))
        else:
            words = f"move the arm to {arguments.count} poses, and turn the hand about all axes; Ctrl-C ends it before"
            sys.stderr.write(f"{words}\n")
            before = -1
            while not look_for(arguments.count, PATIENCE):
                if before == (before := frames.read_at or 0):
                    sys.stderr.write(f"'{plain(arguments.tag)}' is not seen\n")
    try:
        found = measured(pairs)
    except PoorMotionsError as error:
        raise NotDoneError(NOT_MEASURED.at(None, str(error))) from error
    return show(CameraResult(frames.parent, frames.place, frames.placed(found), found), arguments)


def _frames(guest: Guest, tree: TransformTree, arguments: argparse.Namespace) -> CameraFrames:
    """Return the frames as soon as they are known.

    Raises:
        NotDoneError: if they do not become known in time.
    """
    made: list[CameraFrames] = []
    problems: list[TransformError] = []

    def are_known() -> bool:
        try:
            made.append(CameraFrames(tree, arguments.hand, arguments.tag, arguments.place, arguments.parent))
        except TransformError as error:
            problems.append(error)
        return bool(made)

    if not guest.run(are_known, arguments.timeout):
        raise NotDoneError(_finding(problems[-1], tree))
    return made[0]


def _finding(problem: TransformError, tree: TransformTree) -> Finding:
    if isinstance(problem, UnknownFrameError):
        name = problem.frame
        return NO_NAME.misspelt(None, f"there is no frame '{plain(name)}'", name, tree.frames, "frames")
    return NOBODY.at(None, str(problem))


def _visit_poses(guest: Guest, arguments: argparse.Namespace, look: Callable[[], bool]) -> None:
    """Lead the arm to each pose, and look there."""
    action = wanted([name for name in guest.graph().actions if name.givers], f"{arguments.arm}/move", "action")
    client = guest.bus(action.kinds[0]).action_client(NAME, action.name, MoveArm)
    if not guest.run(lambda: client.is_available, arguments.timeout):
        raise NotDoneError(NOBODY.at(None, f"the server of '{action.name}' cannot be reached"))
    for pose in filter(None, (pose.strip() for pose in arguments.poses.split(","))):
        ends: list[Ended[MoveArm.Result]] = []
        sent = client(MoveArm.Goal(pose=pose), ends.append)
        guest.run(lambda ends=ends: bool(ends) or guest.is_interrupted)  # type: ignore[misc]
        if guest.is_interrupted:
            sent.cancel()
            guest.run(lambda ends=ends: bool(ends), PATIENCE)  # type: ignore[misc]
            return
        if ends[0].outcome is not Outcome.SUCCEEDED:
            why = ends[0].result.message if ends[0].result else ends[0].message
            sys.stderr.write(f"'{plain(pose)}' is left out: {plain(why)}\n")
        elif not look():
            sys.stderr.write(f"'{plain(pose)}' is left out: the tag is not seen there, or the hand was there before\n")


@dataclass(frozen=True, slots=True)
class CameraResult:
    """Where a frame is in its parent, and how that was measured."""

    parent: str
    frame: str
    pose: Transform3
    found: HandEye

    @property
    def origin(self) -> dict[str, str]:
        """Return the pose as `origin` of a joint has it in a URDF."""
        turn = rpy_from_quaternion(self.pose.rotation)
        return {
            name: " ".join(f"{round(one, 5) + 0.0:.5f}" for one in each)
            for name, each in (("xyz", self.pose.translation), ("rpy", turn))
        }

    @property
    def text(self) -> str:
        """Return it as YAML, with the pose as `attach` and URDF have it."""
        x, y, z = (f"{round(one * 1000, 1) + 0.0:.1f} mm" for one in self.pose.translation)
        roll, pitch, yaw = (
            f"{round(math.degrees(one), 2) + 0.0:.2f} deg" for one in rpy_from_quaternion(self.pose.rotation)
        )
        origin, (away, angle), (near, turn) = self.origin, self.found.misses, self.found.known_to
        return (
            f"parent: {json.dumps(self.parent)}\nframe: {json.dumps(self.frame)}\n"
            f"at: {{x: {x}, y: {y}, z: {z}, roll: {roll}, pitch: {pitch}, yaw: {yaw}}}\n"
            f'origin: {{xyz: "{origin["xyz"]}", rpy: "{origin["rpy"]}"}}\n'
            f"poses: {len(self.found.off)}\n"
            f"off: {{position: {away * 1000:.2f} mm, rotation: {math.degrees(angle):.2f} deg}}\n"
            f"known_to: {{position: {near * 1000:.2f} mm, rotation: {math.degrees(turn):.2f} deg}}\n"
        )

    @property
    def doubtful(self) -> list[int]:
        """Return the numbers of poses that are much farther off than the others."""
        away, angle = self.found.misses
        return [
            number
            for number, one in enumerate(self.found.off, 1)
            if one[0] > FAR_OFF * max(away, 1e-4) or one[1] > FAR_OFF * max(angle, 1e-3)
        ]


def show(result: CameraResult, arguments: argparse.Namespace) -> int:
    """Write and print a result."""
    if arguments.out is not None:
        try:
            replace_file(Path(arguments.out).resolve(), result.text.encode())
        except OSError as error:
            raise NotDoneError(
                NOT_MEASURED.at(None, f"'{plain(arguments.out)}' cannot be written: {error.strerror}")
            ) from error
    if arguments.json:
        found = result.found
        data = {"parent": result.parent, "frame": result.frame, **result.origin, "off": found.off}
        emit(json.dumps(data | {"misses": found.misses, "known_to": found.known_to}))
        return 0
    emit(result.text.rstrip())
    if result.doubtful:
        emit(f"poses that are far off: {', '.join(map(str, result.doubtful))}; was the tag seen well there?")
    return 0
