"""A case drafted from logs and a model: nominal.json with everything that was assumed, and the records in its units."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated.recognition import applies
from bench.discrepancy.case.case import Case, NominalParameter
from bench.discrepancy.intake.assumptions import Assumptions, assumed_parameters, is_servo
from bench.discrepancy.intake.logs import Log
from bench.discrepancy.intake.matching import Match, Matching, match_columns
from bench.discrepancy.intake.models import ModelFile
from bench.errors import RecordingError, UnitError
from bench.files import write_text
from bench.record_files.column_map import name_and_unit
from bench.recording.units import conversion, read_as
from bench.rig.actuators import commanded

_TURNING = int(mujoco.mjtJoint.mjJNT_HINGE)


@dataclass(frozen=True)
class DraftingSettings:
    """Numbers of `bench.discrepancy.intake.drafting`."""

    far: float = 100.0
    """Angle [rad] beyond which a hinge without limits is taken to be logged in degrees: sixteen turns, 100 degrees are less than two."""
    shortest: int = 200
    """Samples that a record needs, as `case.MIN_SAMPLES`."""


SETTINGS = DraftingSettings()


@dataclass(frozen=True)
class Draft:
    """A case before it is written.

    Attributes:
        model: The model.
        nominal: Content of ``nominal.json``.
        records: Name to columns, the time among them.
        matching: What the columns stand for.
        assumed: Everything that was assumed, a sentence each.
    """

    model: ModelFile
    nominal: Mapping[str, Any]
    records: Mapping[str, Mapping[str, Array]]
    matching: Matching
    assumed: tuple[str, ...]

    def write(self, folder: Path) -> list[Path]:
        """Write the case folder's files; return them."""
        folder.mkdir(parents=True, exist_ok=True)
        written = [folder / "nominal.json", folder / self.nominal["rig"]]
        write_text(written[0], json.dumps(self.nominal, indent=2, ensure_ascii=False) + "\n")
        write_text(written[1], self.model.text_for(folder))
        for name, columns in self.records.items():
            path = folder / f"{name}.csv"
            rows = np.column_stack(list(columns.values()))
            head = ",".join(f'"{c}"' if "," in c else c for c in columns)
            lines = [head, *(",".join(f"{x:.12g}" for x in row) for row in rows.tolist())]
            write_text(path, "\n".join(lines) + "\n")
            written.append(path)
        return written


def draft(
    logs: Sequence[Log],
    model: ModelFile,
    *,
    judging: Sequence[Log] = (),
    asked: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    assumptions: Assumptions | None = None,
) -> Draft:
    """Draft a case.

    Args:
        logs: Logs; where none is named for judging the last one judges, of a single log its end.
        model: The model.
        judging: Logs that judge.
        asked: What columns stand for, see `match_columns`.
        units: Units of columns that their headings do not tell.
        assumptions: Uncertainties of nominal parameters.

    Raises:
        RecordingError: A log lacks a column, or is too short.
        UnitError: A unit does not fit.
        UnknownNameError: A name is not known.
        ParameterError: It cannot be told what is what.
    """
    if not logs:
        raise RecordingError("no log came; give at least one beside the model")
    own = assumptions or Assumptions()
    columns = list(logs[0].arrays)
    matching = match_columns(columns, model.compiled, asked)
    articulated = _articulated(model)
    matching = _heeded(matching, articulated)
    assumed = [f"column {match.told}" for match in matching.matches]
    assumed += [f"column {column} is not used: {why}" for column, why in matching.unused.items()]
    driven = {match.name for match in matching.matches if match.kind == "actuator"}
    names = [model.compiled.actuator(u).name for u in range(model.compiled.nu)]
    assumed += [f"actuator '{name}' has no column: nothing drives it" for name in names if name not in driven]
    parameters = assumed_parameters(model.compiled, own, articulated=articulated)
    assumed += [p.told for p in parameters]
    channels: dict[str, Any] = {"time": {"unit": "s"}} if articulated else {}
    for match in matching.matches:
        channels[match.column] = _channel(match, model.compiled)
    everything = [*logs, *judging]
    values = [_values(log, matching, model.compiled, units or {}, assumed) for log in everything]
    records, moving, words = _divided(logs, judging, values, own.judging)
    assumed.append(words)
    assumed.append("the noise of every response: the flattest part of its spectrum")
    nominal: dict[str, Any] = {
        "rig": model.name,
        "parameters": {p.name: p.entry for p in parameters},
        "channels": channels,
    }
    if moving:
        nominal["starts_in_motion"] = moving
    servos = any(is_servo(model.compiled, u) for u in range(model.compiled.nu))
    if servos:
        nominal["load_interpolation"] = "zero_order_hold"
        assumed.append("targets of servos are held between their samples")
    assumed += [f"{log.name}: {note}" for log in everything for note in log.notes]
    return Draft(model, nominal, records, matching, tuple(dict.fromkeys(assumed)))


def _articulated(model: ModelFile) -> bool:
    """Whether drives are among what may be wrong: of a single joint on a servo, too, whose gain is then an uncertain parameter."""
    compiled = model.compiled
    if any(is_servo(compiled, u) for u in range(compiled.nu)):
        return True
    return applies(
        Case("", model.path.name, (NominalParameter("", 1.0, 0.0),), (), (), (), model.path.parent)
    )


def _heeded(matching: Matching, articulated: bool) -> Matching:
    """Without accelerations of joints, which an articulated model is not held against."""
    if not articulated:
        return matching
    kept = tuple(m for m in matching.matches if m.quantity != "acceleration")
    why = "an articulated model is held against positions and velocities"
    gone = {m.column: why for m in matching.matches if m not in kept}
    return Matching(kept, {**matching.unused, **gone})


def unit_of(match: Match, model: mujoco.MjModel) -> str:
    """SI unit of what a column stands for; empty where only the model knows."""
    if match.kind == "sensor":
        return ""
    if match.kind == "actuator":
        u = model.actuator(match.name).id
        if int(model.actuator_trntype[u]) != int(mujoco.mjtTrn.mjTRN_JOINT):
            return ""
        turning = int(model.jnt_type[int(model.actuator_trnid[u, 0])]) == _TURNING
        asked = commanded(model, u)
        known = {"position": ("rad", "m"), "velocity": ("rad/s", "m/s"), "voltage": ("V", "V")}
        if asked in known:
            return known[asked][0 if turning else 1]
        if abs(float(model.actuator_gear[u, 0]) * float(model.actuator_gainprm[u, 0])) != 1.0:
            return ""
        return "N m" if turning else "N"
    turning = int(model.jnt_type[model.joint(match.name).id]) == _TURNING
    units = {
        "position": ("rad", "m"),
        "velocity": ("rad/s", "m/s"),
        "acceleration": ("rad/s^2", "m/s^2"),
    }
    return units[match.quantity][0 if turning else 1]


def _channel(match: Match, model: mujoco.MjModel) -> dict[str, Any]:
    entry: dict[str, Any] = {}
    unit = unit_of(match, model)
    if unit:
        entry["unit"] = unit
    if match.role != "response":
        entry["role"] = match.role
    entry[match.kind] = match.name
    if match.quantity:
        entry["quantity"] = match.quantity
    if match.role == "command":
        entry["noise_std"] = 0.0
    return entry


def _values(
    log: Log, matching: Matching, model: mujoco.MjModel, units: Mapping[str, str], assumed: list[str]
) -> dict[str, Array]:
    """Time and columns of a log in the units of the case."""
    out = {"time": np.asarray(log.time, dtype=float)}
    untold: dict[str, list[str]] = {}
    for match in matching.matches:
        if match.column not in log.arrays:
            raise RecordingError(
                f"'{log.name}' has no column '{match.column}' (it has {', '.join(list(log.arrays)[:12])}); all logs need the same columns"
            )
        values = np.asarray(log.arrays[match.column], dtype=float)
        told = units.get(match.column, log.units.get(match.column, "")) or name_and_unit(match.column)[1]
        wanted = unit_of(match, model)
        if told and wanted:
            try:
                meant, _ = read_as(told, (wanted,))
            except UnitError as error:
                raise UnitError(f"'{log.name}': column '{match.column}': {error}") from None
            slope, offset = conversion(meant, wanted)
            values = slope * values + offset
            if (slope, offset) != (1.0, 0.0):
                assumed.append(f"column {match.column}: {told} converted to {wanted}")
        elif wanted:
            _doubt(log, match, values, model)
            untold.setdefault(wanted, []).append(match.column)
        out[match.column] = values
    assumed += [f"no unit is told of {', '.join(names)}: taken as {unit}" for unit, names in untold.items()]
    return out


def _doubt(log: Log, match: Match, values: Array, model: mujoco.MjModel) -> None:
    """Refuse angles that are probably degrees."""
    if match.kind != "joint" or match.quantity != "position":
        return
    joint = model.joint(match.name)
    if int(model.jnt_type[joint.id]) != _TURNING:
        return
    reach = float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))
    limit = (
        float(np.abs(model.jnt_range[joint.id]).max()) if model.jnt_limited[joint.id] else SETTINGS.far / 4.0
    )
    if reach > 4.0 * limit:
        raise UnitError(
            f"'{log.name}': column '{match.column}' reaches {reach:.4g}, joint '{match.name}' of the model {limit:.3g} rad: degrees? "
            f"Say so with --unit {match.column}=deg, or =rad if not"
        )


def _divided(
    logs: Sequence[Log], judging: Sequence[Log], values: Sequence[Mapping[str, Array]], share: float
) -> tuple[dict[str, Mapping[str, Array]], list[str], str]:
    """Records by name, those that start in motion, and what was done in words."""
    find, judge = list(values[: len(logs)]), list(values[len(logs) :])
    names = [log.name for log in logs]
    moving: list[str] = []
    if judge:
        words = f"judged by {', '.join(log.name for log in judging)}, found by {', '.join(names)}"
    elif len(find) > 1:
        judge = [find.pop()]
        words = f"judged by the last log, {names[-1]}, found by {', '.join(names[:-1])}"
    else:
        n = len(find[0]["time"])
        cut = round(n * (1.0 - share))
        judge = [{name: column[cut:] for name, column in find[0].items()}]
        find = [{name: column[:cut] for name, column in find[0].items()}]
        moving = ["validation"]
        words = f"{names[0]} is divided: its last {100 * share:.0f} % judge, the rest finds; give two logs for records of their own"
    records = {
        **{_numbered("identification", k): columns for k, columns in enumerate(find)},
        **{_numbered("validation", k): columns for k, columns in enumerate(judge)},
    }
    for name, columns in records.items():
        if len(columns["time"]) < SETTINGS.shortest:
            raise RecordingError(
                f"{name} would have {len(columns['time'])} samples; at least {SETTINGS.shortest} are needed: give a longer log"
            )
    return records, moving, words


def _numbered(stem: str, k: int) -> str:
    return stem if k == 0 else f"{stem}_{k + 1}"
