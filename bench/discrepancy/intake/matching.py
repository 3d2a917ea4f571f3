"""Columns of a log matched by their names to the joints, actuators and sensors of a model."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from shlex import quote

import mujoco

from bench.discrepancy.intake.assumptions import is_servo
from bench.errors import ParameterError, UnknownNameError
from bench.rig.actuators import commanded

WORDS: Mapping[str, frozenset[str]] = {
    "position": frozenset(
        (
            "position",
            "positions",
            "pos",
            "q",
            "qpos",
            "angle",
            "angles",
            "displacement",
            "disp",
            "deflection",
            "theta",
            "encoder",
        )
    ),
    "velocity": frozenset(("velocity", "velocities", "vel", "speed", "dq", "qd", "qvel", "omega", "rate")),
    "acceleration": frozenset(("acceleration", "accelerations", "acc", "accel", "ddq", "qdd", "qacc")),
    "torque": frozenset(("torque", "torques", "tau", "force", "forces", "effort", "efforts", "loadcell")),
}
"""What a word in a heading says of the quantity."""
COMMANDED = frozenset(
    (
        "command", "commands", "cmd", "commanded", "desired", "des", "target", "targets", "goal", "setpoint", "set", "ref",
        "reference", "action", "ctrl", "control",
    )
)  # fmt: skip
"""Words of something that was asked for."""
FILLING = frozenset(
    (
        "measured", "meas", "actual", "act", "state", "states", "joint", "joints", "motor", "servo", "actuator", "obs",
        "observation", "data", "value",
    )
)  # fmt: skip
"""Words that say nothing here."""
QUANTITIES = ("position", "velocity", "acceleration", "torque", "command")
"""What may stand behind the dot in ``--map COLUMN=joint.quantity``."""


@dataclass(frozen=True)
class Match:
    """A column and what it stands for.

    Attributes:
        column: Its heading.
        kind: "joint", "actuator" or "sensor".
        name: Name of that in the model.
        quantity: "position", "velocity" or "acceleration" of a joint.
        role: "response", "measured" or "command".
        how: Why it was matched, in words.
    """

    column: str
    kind: str
    name: str
    quantity: str = ""
    role: str = "response"
    how: str = ""

    @property
    def told(self) -> str:
        """The match in words."""
        what = f"{self.quantity} of joint '{self.name}'" if self.quantity else f"{self.kind} '{self.name}'"
        role = "" if self.role == "response" else f", {self.role}"
        return f"{self.column} -> {what}{role} ({self.how})"


@dataclass(frozen=True)
class Matching:
    """The matches, and the columns that stand for nothing, with the reason."""

    matches: tuple[Match, ...]
    unused: Mapping[str, str]


@dataclass(frozen=True)
class _Heading:
    column: str
    quantity: str
    commanded: bool
    rest: tuple[str, ...]


def match_columns(
    columns: Sequence[str], model: mujoco.MjModel, asked: Mapping[str, str] | None = None
) -> Matching:
    """Match the columns of logs to a model.

    A column is taken as asked for; else by a name of the model that it bears itself; else by the words in it: what is left of
    ``position_elbow_measured`` without its quantity is the joint. Numbers stand for the joints in their order.

    Args:
        columns: Headings without units; the time is not among them.
        model: The model.
        asked: Column to "JOINT.quantity" (position, velocity, acceleration, torque, command), an actuator or a sensor; "-" for
            none.

    Raises:
        UnknownNameError: A column or its target is not there.
        ParameterError: Nothing drives the model, or nothing measures it.
    """
    own = dict(asked or {})
    for column in own:
        if column not in columns:
            raise UnknownNameError("column of the logs (--map)", column, columns)
    given = [asked_match(column, own[column], model) for column in columns if own.get(column, "-") != "-"]
    free = [_heading(column) for column in columns if column not in own]
    aliases = {
        _heading(match.column).rest: match.name if match.kind == "joint" else _joint_driven(model, match.name)
        for match in given
        if match.kind != "sensor" and _heading(match.column).rest
    }
    found = [*given]
    reasons = {column: "left out by --map" for column, target in own.items() if target == "-"}
    for heading in free:
        match, reason = _one(heading, free, model, aliases)
        if match is None:
            reasons[heading.column] = reason
        else:
            found.append(match)
    kept = _without_doubles(found, reasons)
    kept = _one_input(kept, model, reasons)
    _check(kept, model, columns)
    return Matching(tuple(kept), reasons)


def _heading(column: str) -> _Heading:
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Za-z])(?=\d)", " ", column)
    words = [word for word in re.split(r"[^0-9A-Za-z]+", apart.lower()) if word]
    quantity = next((q for word in words for q, known in WORDS.items() if word in known), "")
    commanded = any(word in COMMANDED for word in words)
    said = COMMANDED | FILLING | (WORDS[quantity] if quantity else frozenset())
    return _Heading(column, quantity, commanded, tuple(word for word in words if word not in said))


def _plain(name: str) -> tuple[str, ...]:
    """A name of the model as the rest of a heading would say it."""
    return _heading(name).rest or tuple(word for word in re.split(r"[^0-9A-Za-z]+", name.lower()) if word)


def _joints(model: mujoco.MjModel) -> list[str]:
    kinds = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    return [model.joint(i).name for i in range(model.njnt) if int(model.jnt_type[i]) in kinds]


def _names(model: mujoco.MjModel, kind: str) -> list[str]:
    counts = {"sensor": model.nsensor, "actuator": model.nu}
    return _joints(model) if kind == "joint" else [getattr(model, kind)(i).name for i in range(counts[kind])]


def _actuator_of(model: mujoco.MjModel, joint: str) -> str:
    """The only actuator of a joint; empty where it has none, or several."""
    target = model.joint(joint).id
    found = [
        model.actuator(u).name
        for u in range(model.nu)
        if int(model.actuator_trntype[u]) == int(mujoco.mjtTrn.mjTRN_JOINT)
        and int(model.actuator_trnid[u, 0]) == target
    ]
    return found[0] if len(found) == 1 else ""


def _joint_driven(model: mujoco.MjModel, actuator: str) -> str:
    """The joint of an actuator; empty where it drives something else."""
    u = model.actuator(actuator).id
    at_joint = int(model.actuator_trntype[u]) == int(mujoco.mjtTrn.mjTRN_JOINT)
    return model.joint(int(model.actuator_trnid[u, 0])).name if at_joint else ""


def asked_match(column: str, target: str, model: mujoco.MjModel) -> Match:
    """A column as somebody says it.

    Raises:
        UnknownNameError: The model has nothing of that name.
        ParameterError: A joint came without its quantity, or has no actuator.
    """
    name, dot, quantity = target.rpartition(".")
    if dot and quantity in QUANTITIES:
        if name not in _joints(model):
            raise UnknownNameError(f"joint that --map {column}={target} names", name, _joints(model))
        if quantity in ("torque", "command"):
            actuator = _actuator_of(model, name)
            if not actuator:
                raise ParameterError(
                    f"--map {column}={target}: joint '{name}' has no single actuator; name the actuator"
                )
            role = "command" if quantity == "command" else "measured"
            return Match(column, "actuator", actuator, role=role, how="as asked for")
        return Match(column, "joint", name, quantity, how="as asked for")
    if target in _names(model, "actuator"):
        servo = is_servo(model, model.actuator(target).id)
        role = "command" if servo or _heading(column).commanded else "measured"
        return Match(column, "actuator", target, role=role, how="as asked for")
    if target in _names(model, "sensor"):
        return Match(column, "sensor", target, how="as asked for")
    known = [f"{j}.{q}" for j in _joints(model) for q in QUANTITIES[:3]]
    raise UnknownNameError(
        f"target of --map {column}", target, [*known, *_names(model, "actuator"), *_names(model, "sensor")]
    )


def _one(
    heading: _Heading,
    others: Sequence[_Heading],
    model: mujoco.MjModel,
    aliases: Mapping[tuple[str, ...], str],
) -> tuple[Match | None, str]:
    """What a heading stands for, or why nothing."""
    column = heading.column
    if sensor := _called(column, _names(model, "sensor")):
        return Match(column, "sensor", sensor, how="the sensor of that name"), ""
    if column in _names(model, "actuator") and column not in _joints(model):
        return _driving(heading, column, model, "the actuator of that name")
    joint, how = _joint_of(heading, others, model)
    if aliases.get(heading.rest):
        joint, how = aliases[heading.rest], f"as '{' '.join(heading.rest)}' of --map"
    if not joint:
        actuators = [a for a in _names(model, "actuator") if a and _plain(a) == heading.rest]
        if len(actuators) == 1:
            return _driving(heading, actuators[0], model, "by name")
        if heading.quantity == "torque" and not heading.rest and model.nu == 1:
            return _driving(heading, model.actuator(0).name, model, "the only actuator")
        return None, "bears no name of the model"
    if heading.commanded or heading.quantity == "torque":
        actuator = _actuator_of(model, joint)
        if not actuator:
            return None, f"joint '{joint}' has no single actuator"
        return _driving(heading, actuator, model, how)
    if not heading.quantity and column not in _joints(model):
        return None, f"says no quantity of joint '{joint}'"
    return Match(column, "joint", joint, heading.quantity or "position", how=how), ""


def _called(column: str, names: Sequence[str]) -> str:
    """The name that a column bears, or bears but for capitals where that is one alone; empty where it bears none."""
    like = [name for name in names if name.casefold() == column.casefold()]
    return column if column in names else like[0] if len(like) == 1 else ""


def _joint_of(heading: _Heading, others: Sequence[_Heading], model: mujoco.MjModel) -> tuple[str, str]:
    joints = _joints(model)
    found = [joint for joint in joints if joint == heading.column or _plain(joint) == heading.rest]
    if len(found) == 1:
        return found[0], "by name"
    if not heading.rest and len(joints) == 1 and (heading.quantity or heading.commanded):
        return joints[0], "the only joint"
    if len(heading.rest) == 1 and heading.rest[0].isdigit():
        like = [h for h in others if (h.quantity, h.commanded) == (heading.quantity, heading.commanded)]
        numbers = sorted(int(h.rest[0]) for h in like if len(h.rest) == 1 and h.rest[0].isdigit())
        first = numbers[0]
        if first in (0, 1) and numbers == list(range(first, first + len(joints))):
            return joints[int(heading.rest[0]) - first], "by number, the joints in their order"
    return "", ""


def _driving(heading: _Heading, actuator: str, model: mujoco.MjModel, how: str) -> tuple[Match | None, str]:
    asked = commanded(model, model.actuator(actuator).id)
    follows, given = asked in ("position", "velocity"), heading.quantity
    if follows and given in {"position", "velocity", "torque", "acceleration"} - {asked}:
        return None, f"actuator '{actuator}' follows a {asked}; its {given} is an outcome, not an input"
    if not follows and given in ("position", "velocity", "acceleration"):
        return None, f"actuator '{actuator}' exerts a force; no controller in the model follows a {given}"
    role = "command" if follows or heading.commanded else "measured"
    return Match(heading.column, "actuator", actuator, role=role, how=how), ""


def _without_doubles(found: Sequence[Match], reasons: dict[str, str]) -> list[Match]:
    """The first column of each thing; what was asked for stands first."""
    seen: dict[tuple[str, str, str, str], str] = {}
    kept = []
    for match in found:
        key = (match.kind, match.name, match.quantity, match.role)
        if key in seen:
            reasons[match.column] = f"says the same as '{seen[key]}'"
            continue
        seen[key] = match.column
        kept.append(match)
    return kept


def _one_input(found: Sequence[Match], model: mujoco.MjModel, reasons: dict[str, str]) -> list[Match]:
    """One input an actuator: the measured force where there is one, since it holds what the amplifier made of its command."""
    inputs = defaultdict(list)
    for match in found:
        if match.kind == "actuator":
            inputs[match.name].append(match)
    dropped = set()
    for matches in inputs.values():
        if len(matches) > 1:
            best = next((m for m in matches if m.role == "measured"), matches[0])
            for other in matches:
                if other is not best:
                    dropped.add(other.column)
                    reasons[other.column] = f"the measured force '{best.column}' is taken instead"
    return [match for match in found if match.column not in dropped]


def _check(found: Sequence[Match], model: mujoco.MjModel, columns: Sequence[str]) -> None:
    if any(match.kind != "actuator" for match in found):
        return
    listed = ", ".join(f"'{column}'" for column in list(columns)[:12])
    taken = {match.column for match in found}
    free = next((column for column in columns if column not in taken), "COLUMN")
    raise ParameterError(
        f"no column bears the name of a joint or sensor of the model; columns: {listed}; joints: {', '.join(_joints(model)) or 'none'}. "
        f"Say which is which, as in --map {quote(free)}={(_joints(model) or ['JOINT'])[0]}.position"
        + _by_order(columns, model)
    )


def _by_order(columns: Sequence[str], model: mujoco.MjModel) -> str:
    """A proposal where the columns of a quantity are as many as the joints, in their order perhaps."""
    joints = _joints(model)
    proposals = []
    for quantity in ("command", "position", "velocity"):
        like = [c for c in columns if (h := _heading(c)) and (("command" if h.commanded else h.quantity) == quantity)]  # fmt: skip
        if len(like) == len(joints):
            proposals += [f"{c}={j}.{quantity}" for c, j in zip(like, joints, strict=True)]
    return f"; if they are in the order of the joints: --map {' '.join(proposals)}" if proposals else ""
