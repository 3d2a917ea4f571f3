"""A page for every force law: equation, loop, parameters, relatives, MuJoCo's own form of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bench.figures.look import COLOURS, save, style
from bench.laws import LAWS, ForceLaw, Parameter, describe
from bench.laws.evaluate import evaluate
from documentation import equations

NATIVE = {
    "linear": "`stiffness` and `damping` of a joint.",
    "gap": "A joint `range` of half-width clearance, its limits springs: negative `solreflimit` (stiffness, damping), `solimplimit` close to one.",
    "asymmetric_gap": "A joint `range` whose two ends lie apart unequally; both limits share one `solreflimit`, so one stiffness.",
    "one_sided_stop": "A joint `range` with one end far away and a negative `solreflimit`.",
    "quadratic_stiffness": "Second coefficient of the polynomial `stiffness` of a joint (of the stretch's magnitude: odd in q, where this law is even).",
    "cubic_stiffness": "Third coefficient of the polynomial `stiffness` of a joint.",
    "linear_damping": "`damping` of a joint.",
    "quadratic_damping": "Second coefficient of the polynomial `damping` of a joint.",
    "constant_force": "A fixed tendon with a very long soft spring, or a constant `qfrc_applied`.",
    "timed_force": "`qfrc_applied`, set by the program in each window.",
    "harmonic_force": "`qfrc_applied`, set by the program in each step.",
    "coulomb": "`frictionloss` of a joint: soft friction, a constraint that creeps at rest. `solreffriction` and `solimpfriction` say how much.",
    "soft_coulomb": "`frictionloss` itself: creep velocity and lead time follow from `solreffriction` and `solimpfriction`.",
    "lugre": "The LuGre friction of a `dcmotor` actuator, on the motor's side.",
    "carried_mass": "A child body with a joint on the same axis, of its own `stiffness` and `damping`.",
    "cogging": "The cogging torque of a `dcmotor` actuator.",
}
"""What MuJoCo has of a law, by name; a law that is not here runs as the bench's native callback only."""

RELATIVES = {
    "linear": ("linear_damping", "cubic_stiffness", "maxwell"),
    "gap": ("asymmetric_gap", "one_sided_stop", "jenkins_backlash", "gap_coupling"),
    "asymmetric_gap": ("gap", "one_sided_stop"),
    "one_sided_stop": ("gap", "asymmetric_gap"),
    "quadratic_stiffness": ("cubic_stiffness", "one_sided_stop"),
    "cubic_stiffness": ("quadratic_stiffness", "gap"),
    "stiffness_drift": ("bouc_wen_degrading", "maxwell"),
    "cogging": ("harmonic_force", "stiffness_drift"),
    "constant_force": ("timed_force", "asymmetric_coulomb"),
    "timed_force": ("constant_force", "harmonic_force"),
    "harmonic_force": ("timed_force", "cogging"),
    "linear_damping": ("asymmetric_damping", "quadratic_damping", "power_law_damping"),
    "asymmetric_damping": ("asymmetric_coulomb", "linear_damping"),
    "quadratic_damping": ("power_law_damping", "linear_damping"),
    "power_law_damping": ("quadratic_damping", "coulomb"),
    "maxwell": ("linear", "base_flexibility"),
    "base_flexibility": ("carried_mass", "maxwell", "linear"),
    "carried_mass": ("base_flexibility", "maxwell"),
    "coulomb": ("soft_coulomb", "stribeck", "jenkins"),
    "asymmetric_coulomb": ("coulomb", "constant_force"),
    "soft_coulomb": ("coulomb", "lugre"),
    "stribeck": ("coulomb", "lugre"),
    "load_dependent_friction": ("coulomb", "controlled_friction"),
    "time_varying_friction": ("controlled_friction", "coulomb"),
    "controlled_friction": ("load_dependent_friction", "time_varying_friction"),
    "dahl": ("jenkins", "lugre", "bouc_wen"),
    "lugre": ("elastoplastic_friction", "dahl", "stribeck"),
    "elastoplastic_friction": ("lugre", "dahl"),
    "jenkins": ("iwan", "jenkins_backlash", "dahl", "bouc_wen"),
    "jenkins_backlash": ("jenkins", "gap"),
    "iwan": ("jenkins", "bouc_wen"),
    "bouc_wen": ("bouc_wen_degrading", "bouc_wen_pinching", "generalised_bouc_wen", "iwan"),
    "bouc_wen_degrading": ("bouc_wen", "bouc_wen_pinching"),
    "bouc_wen_pinching": ("bouc_wen", "bouc_wen_degrading", "jenkins_backlash"),
    "generalised_bouc_wen": ("bouc_wen", "cubic_stiffness"),
    "cross_stiffness": ("gap_coupling", "axial_torsional_joint"),
    "gap_coupling": ("printed_coupling", "cross_stiffness"),
    "printed_coupling": ("gap_coupling", "axial_torsional_joint"),
    "axial_torsional_joint": ("gap", "gap_coupling", "linear"),
}
"""Laws that are taken for one another, by name."""

SHOWN = {
    "bouc_wen_degrading": {"delta_nu": 20.0, "delta_eta": 10.0},
    "bouc_wen_pinching": {"q": 0.05, "zeta_10": 0.9, "p": 100.0, "psi_0": 0.1, "lambda_": 0.3},
    "generalised_bouc_wen": {"k": 200.0, "d": 4e6},
}
"""Parameters at which a picture shows what is peculiar to a law, where its defaults do not."""

SECOND = {"gap_coupling": 0.35, "printed_coupling": 0.35, "axial_torsional_joint": 0.35}
"""Amplitude of the second coordinate [rad], of laws that couple a displacement with a rotation."""

THRESHOLDS = {"clearance", "clearance_plus", "clearance_minus", "clearance_axial", "position"}
"""Parameters that a loop has to pass by far, or the picture shows nothing."""


def _stroke(law: ForceLaw) -> float:
    """Amplitude of the motion in the picture [m]: well beyond every dead space, and into yield."""
    values = {p.name: abs(p.default) for p in law.parameters}
    lengths = [value for name, value in values.items() if name in THRESHOLDS]
    for strength, stiffness in (("limit", "stiffness"), ("Fy", "k"), ("limit", "sigma"), ("Fc", "sigma")):
        if values.get(strength) and values.get(stiffness):
            lengths.append(values[strength] / values[stiffness])
    if law.name == "cogging":
        lengths.append(values["period"] * 0.6)
    return 3.0 * max(lengths, default=0.01 / 3.0)


def motion(law: ForceLaw) -> tuple[NDArray, NDArray, NDArray]:
    """Two cycles of growing amplitude for the picture: time (n,) [s], positions and velocities (n, n_coordinates)."""
    time = np.linspace(0.0, 3.0, 3001)
    envelope = 0.5 + time / 6.0
    columns, rates = [], []
    for index in range(law.n_coordinates):
        phase = 2.0 * np.pi * (1.0 + 0.37 * index) * time
        stroke = SECOND.get(law.name, _stroke(law)) if index else _stroke(law)
        columns.append(stroke * envelope * np.sin(phase))
        rates.append(np.gradient(columns[-1], time))
    if law.n_inputs:  # a normal force that swells from 5 to 15 N
        columns[-1] = 10.0 + 5.0 * np.sin(0.7 * np.pi * time)
        rates[-1] = np.zeros_like(time)
    return time, np.column_stack(columns), np.column_stack(rates)


def draw(law: ForceLaw, path: Path) -> None:
    """Draw the force over displacement and over velocity."""
    time, q, v = motion(law)
    theta = [SHOWN.get(law.name, {}).get(p.name, p.default) for p in law.parameters]
    force = evaluate(law, theta, time, q, v, substeps=4).force[:, 0]
    with style():
        figure = Figure(figsize=(6.6, 2.5), layout="constrained")
        left, right = figure.subplots(1, 2, sharey=True)
        left.plot(q[:, 0] * 1e3, force, color=COLOURS[1], linewidth=1.2)
        left.set_xlabel("displacement [mm]")
        left.set_ylabel("restoring force [N]")
        right.plot(v[:, 0], force, color=COLOURS[0], linewidth=1.2)
        right.set_xlabel("velocity [m/s]")
        save(figure, path, dpi=90)


def _bound(value: float) -> str:
    return f"{value:g}".replace("inf", "∞")


def _row(parameter: Parameter) -> str:
    unit = (
        parameter.unit
        if parameter.rotational in {None, parameter.unit}
        else f"{parameter.unit} or {parameter.rotational}"
    )
    low, high = parameter.bounds
    return (
        f"| `{parameter.name}` | {unit.replace('**', '^')} | {parameter.default:g} | {_bound(low)} … {_bound(high)} "
        f"| {parameter.description} |"
    )


def _shown(law: ForceLaw) -> str:
    """At which parameters a law is drawn."""
    moved = SHOWN.get(law.name)
    if moved is None:
        return "at the default parameters"
    return "at the default parameters but for " + ", ".join(
        f"{name} = {value:g}" for name, value in moved.items()
    )


def _example(law: ForceLaw) -> str:
    """How an element of the law is made."""
    if law.n_inputs:
        return "# reads an actuator's force as its input: see `Element.inputs`"
    joints = ", ".join(f'"joint_{k + 1}"' for k in range(law.n_coordinates))
    place = '"carriage"' if law.n_coordinates == 1 else f"({joints})"
    given = ", ".join(f"{p.name}={p.default:g}" for p in law.parameters[:2])
    return f'element = Element.of("{law.name}", {place}, {given})'


def _as_markdown(documentation: str) -> str:
    """A docstring as Markdown: double backquotes and "::" are single ones and a plain colon; indented lines are code in both."""
    text = documentation.strip().replace("``", "`").replace("::\n", ":\n")
    return text.replace("References:\n    ", "References: ")


def _symbols(law: ForceLaw) -> list[str]:
    """Names in a law's equation that are symbols though they look like words."""
    return [p.name for p in law.parameters]


def page(law: ForceLaw) -> str:
    """The page of a law as Markdown."""
    states = ", ".join(f"`{s}`" for s in law.states) or "none: the force depends on the present motion only"
    if len(law.states) > 3:
        states = f"`{law.states[0]}` … `{law.states[-1]}`"
    smooth = {
        "smooth": "smooth: an explicit Runge-Kutta step keeps its order",
        "continuous": "continuous with kinks: the order of a step is lost where one is passed",
        "discontinuous": "jumps: take a small step",
    }[law.smoothness]
    near = ", ".join(f"[`{name}`]({name}.md)" for name in RELATIVES.get(law.name, ()))
    coordinates = f"{law.n_coordinates - law.n_inputs}" + (
        f" and {law.n_inputs} input" if law.n_inputs else ""
    )
    return "\n".join(
        [
            f"# {law.name}",
            "",
            "```math",
            equations.display(law.equation, _symbols(law)),
            "```",
            "",
            f"![Force of {law.name} over displacement and velocity](pictures/{law.name}.png)",
            "",
            f"Loops of growing amplitude, {_shown(law)}. A positive force opposes a positive displacement.",
            "",
            "| parameter | unit | default | bounds | meaning |",
            "|---|---|---|---|---|",
            *[_row(p) for p in law.parameters],
            "",
            f"- **Hidden states**: {states}.",
            f"- **Coordinates**: {coordinates}.",
            f"- **Smoothness**: {smooth}.",
            f"- **Source**: {law.reference}.",
            f"- **In MuJoCo**: {NATIVE.get(law.name, 'no form of its own; the law runs as a native passive force.')}",
            *([f"- **Not to be confused with**: {near}."] if near else []),
            "",
            "```python",
            "from bench import Element",
            "",
            _example(law),
            "```",
            "",
            "## Notes",
            "",
            _as_markdown(describe(law)["documentation"]),
            "",
        ]
    )


def pages() -> dict[str, str]:
    """All pages of laws, by path below docs/."""
    index = [
        "# Force laws",
        "",
        "Each is written once, as a compiled kernel that MuJoCo's callback, the fits and the tests share.",
        "",
    ]
    index += ["| law | equation | states | in MuJoCo |", "|---|---|---|---|"]
    for law in LAWS.values():
        equation = equations.cell(law.equation, _symbols(law))
        index.append(
            f"| [`{law.name}`]({law.name}.md) | {equation} | {len(law.states) or '–'} | {'yes' if law.name in NATIVE else '–'} |"
        )
    index.append("")
    return {"reference/laws/index.md": "\n".join(index)} | {
        f"reference/laws/{law.name}.md": page(law) for law in LAWS.values()
    }


def draw_all(docs: Path) -> None:
    """Draw the pictures of all laws."""
    folder = docs / "reference" / "laws" / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    for law in LAWS.values():
        draw(law, folder / f"{law.name}.png")
