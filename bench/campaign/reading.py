"""Reading plans: TOML or JSON documents, checked entry by entry.

```toml
name = "gap and hysteresis"
seed = 2006
records = 10_000
duration = 10.0                     # [s]
sample_rate = 1000.0                # [Hz]
sampling = "sobol"                  # or "random", "latin_hypercube"
channels = ["shaker", "displacement", "acceleration"]

[[rigs]]                            # entries as in a rig configuration, with distributions for numbers
rig = "sdof"
structure.mass.carriage = { uniform = [1.5, 2.5] }
[[rigs.elements]]
law = "gap"
joints = ["carriage"]
parameters = { stiffness = { log_uniform = [1e3, 1e4] }, clearance = 0.003 }
probability = 0.5                   # half of the records have it
withheld = true                     # and the manifest does not say which

[[excitations]]
signals.shaker = { type = "band_limited_noise", cutoff = 40.0, rms = { log_uniform = [5.0, 50.0] } }

[[sensors]]
chains.displacement = [{ type = "noise", std = 1e-5 }]
```
"""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from bench.campaign.distribution import Distribution, is_quantity_table, read_quantity
from bench.campaign.plan import ElementPlan, ExcitationPlan, Node, Plan, RigPlan, SensorPlan
from bench.errors import FileFormatError, ParameterError, UnknownNameError


def read_plan(path: str | Path) -> Plan:
    """Read a plan from a TOML or JSON file.

    Raises:
        FileFormatError: It cannot be read, or is neither.
        UnknownNameError: An entry, distribution, law, signal or stage is not known.
        ParameterError: An entry is missing or out of range.
    """
    file = Path(path)
    try:
        text = file.read_text(encoding="utf-8")
        document = json.loads(text) if file.suffix == ".json" else tomllib.loads(text)
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise FileFormatError(f"cannot read the plan {file}: {error}") from error
    document.setdefault("name", file.stem)
    return plan_from_dict(document, folder=file.parent)


def plan_from_dict(document: Mapping[str, Any], *, folder: str | Path = ".") -> Plan:
    """The plan that a document stands for.

    Args:
        document: Entries as in the module's example.
        folder: Folder that MJCF paths are relative to.

    Raises:
        UnknownNameError: An entry, distribution, law, signal or stage is not known.
        ParameterError: An entry is missing or out of range.
    """
    known = [item.name for item in fields(Plan)]
    _check_entries("plan", document, known, ("records", "duration", "sample_rate", "rigs", "excitations"))
    entries = dict(document)
    shared: dict[str, Distribution] = {}
    for name, entry in entries.pop("shared", {}).items():
        quantity = read_quantity(entry, f"the shared quantity '{name}'")
        if not isinstance(quantity, Distribution):
            raise ParameterError(f"the shared quantity '{name}' is {entry!r}; a distribution is expected")
        shared[name] = quantity
    return Plan(
        name=str(entries.pop("name", "campaign")),
        rigs=tuple(_rig(entry, str(folder)) for entry in _tables("rigs", entries.pop("rigs"))),
        excitations=tuple(
            _excitation(entry, index)
            for index, entry in enumerate(_tables("excitations", entries.pop("excitations")))
        ),
        sensors=tuple(
            _sensors(entry, index)
            for index, entry in enumerate(_tables("sensors", entries.pop("sensors", [])))
        ),
        shared=shared,
        channels=tuple(entries.pop("channels", ())),
        **entries,
    )


def _check_entries(what: str, entry: object, known: Sequence[str], needed: Sequence[str] = ()) -> None:
    if not isinstance(entry, Mapping):
        raise ParameterError(f"a {what} is a table; {entry!r} came")
    for key in entry:
        if key not in known:
            raise UnknownNameError(f"entry of a {what}", str(key), known)
    missing = [key for key in needed if key not in entry]
    if missing:
        raise ParameterError(f"a {what} needs {', '.join(needed)}; {', '.join(missing)} missing")


def _tables(what: str, entries: Any) -> list[Any]:
    if not isinstance(entries, list | tuple):
        raise ParameterError(f"{what} is {entries!r}; a list of tables, as [[{what}]], is expected")
    return list(entries)


def _rig(entry: Mapping[str, Any], folder: str) -> RigPlan:
    known = (
        "rig",
        "name",
        "weight",
        "timestep",
        "integrator",
        "structure",
        "structure_withheld",
        "elements",
        "model_sha256",
    )
    _check_entries("rig of a plan", entry, known, ("rig",))
    structure = []
    for kind, named in entry.get("structure", {}).items():
        if not isinstance(named, Mapping):
            raise ParameterError(
                f"structure.{kind} is {named!r}; a table by body or joint, as structure.{kind}.carriage = 2.0"
            )
        structure += [
            (kind, target, read_quantity(value, f"{kind} of '{target}'")) for target, value in named.items()
        ]
    which = str(entry["rig"])
    digest = entry.get("model_sha256", "")
    if which.endswith(".xml"):
        file = Path(folder) / which
        try:
            digest = hashlib.sha256(file.read_bytes()).hexdigest()
        except OSError as error:
            raise FileFormatError(f"cannot read the model {file}: {error.strerror}") from error
    return RigPlan(
        name=str(entry.get("name", Path(which).stem)),
        rig=which,
        elements=tuple(_element(item) for item in _tables("rigs.elements", entry.get("elements", []))),
        structure=tuple(structure),
        structure_withheld=bool(entry.get("structure_withheld", False)),
        weight=entry.get("weight", 1.0),
        timestep=entry.get("timestep"),
        integrator=entry.get("integrator"),
        folder=str(Path(folder).resolve()),
        model_sha256=digest,
    )


def _element(entry: Mapping[str, Any]) -> ElementPlan:
    from bench.laws import find_law  # noqa: PLC0415  (the registry imports every law)

    known = ("law", "header", "joints", "inputs", "parameters", "name", "exact", "withheld", "probability")
    _check_entries("element of a plan", entry, known, ("law", "joints"))
    law = find_law(entry["law"], entry.get("header", ()))
    joints = tuple(entry["joints"])
    name = str(entry.get("name") or f"{'+'.join(joints)}.{law.name}")
    given = entry.get("parameters", {})
    for key in given:
        if key not in law.parameter_names:
            raise UnknownNameError(f"parameter of law '{law.name}'", str(key), law.parameter_names)
    # all parameters stand in the table of the records, those at their defaults too: a reader can then rebuild the element
    parameters = {
        parameter.name: read_quantity(
            given.get(parameter.name, parameter.default), f"{parameter.name} of '{name}'"
        )
        for parameter in law.parameters
    }
    return ElementPlan(
        law=str(entry["law"]),
        joints=joints,
        name=name,
        parameters=parameters,
        header=tuple(entry.get("header", ())),
        inputs=tuple(entry.get("inputs", ())),
        exact=bool(entry.get("exact", False)),
        withheld=bool(entry.get("withheld", False)),
        probability=entry.get("probability", 1.0),
    )


def _excitation(entry: Mapping[str, Any], index: int) -> ExcitationPlan:
    _check_entries(
        "excitation of a plan", entry, ("name", "weight", "rigs", "prescribe", "signals"), ("signals",)
    )
    signals = entry["signals"]
    if not isinstance(signals, Mapping) or not signals:
        raise ParameterError(f"signals of an excitation is {signals!r}; a table by actuator is expected")
    return ExcitationPlan(
        name=str(entry.get("name", f"excitation_{index}")),
        signals={actuator: _nest(node, f"excitation of '{actuator}'") for actuator, node in signals.items()},
        weight=entry.get("weight", 1.0),
        rigs=tuple(entry.get("rigs", ())),
        prescribe=str(entry.get("prescribe", "")),
    )


def _sensors(entry: Mapping[str, Any], index: int) -> SensorPlan:
    _check_entries(
        "set of sensors of a plan", entry, ("name", "weight", "rigs", "withheld", "chains"), ("chains",)
    )
    chains = {}
    for channel, stages in entry["chains"].items():
        if not isinstance(stages, list | tuple) or any("type" not in stage for stage in stages):
            raise ParameterError(
                f"the chain of '{channel}' is {stages!r}; a list of stages with a type each is expected"
            )
        chains[channel] = {
            str(stage["type"]): _nest(
                {key: value for key, value in stage.items() if key != "type"},
                f"{stage['type']} of '{channel}'",
            )
            for stage in stages
        }
        if len(chains[channel]) < len(stages):
            raise ParameterError(f"the chain of '{channel}' has a stage twice; each may come once")
    return SensorPlan(
        name=str(entry.get("name", f"sensors_{index}")),
        chains=chains,
        weight=entry.get("weight", 1.0),
        rigs=tuple(entry.get("rigs", ())),
        withheld=bool(entry.get("withheld", False)),
    )


def _nest(node: Any, where: str) -> Node:
    """A signal's or stage's table with its distributions read."""
    if is_quantity_table(node):
        return read_quantity(node, where)
    if isinstance(node, Mapping):
        return {key: _nest(value, f"{key} of {where}") for key, value in node.items()}
    if isinstance(node, list | tuple):
        return [_nest(value, where) for value in node]
    return node
