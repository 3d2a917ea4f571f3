"""A page for every effect that a diagnosis may name: what it is, how it looks in a record, what it is taken for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bench.discrepancy.articulated_effects.catalogue import CATALOGUE as ARTICULATED
from bench.discrepancy.articulated_effects.effect import ArticulatedEffect
from bench.discrepancy.effects.catalogue import CATALOGUE as LINEAR
from bench.discrepancy.effects.effect import Effect, FreeParameter
from bench.figures.look import COLOURS, REFERENCE_COLOUR, save, style
from documentation import equations, looks

LOOKS = {
    "coulomb_friction": "The missing force is a step at every reversal of the velocity, the same at every amplitude. Free decays end after finitely many swings, along straight lines. Small motions are damped most.",
    "soft_coulomb_friction": "As Coulomb friction, but the force turns round before or after the velocity does, and a resting joint creeps.",
    "stribeck_friction": "A step at every reversal that falls off with the velocity. Slow motion stutters.",
    "coupled_friction": "The missing torque of each of two joints is a step at reversals of the sum, or the difference, of their velocities: a joint at rest is pulled along by its neighbour.",
    "presliding_friction": "The step at a reversal is rounded over a displacement that does not depend on the frequency; below it the joint is a spring.",
    "bouc_wen_hysteresis": "Loops of force over displacement with round corners; the stiffness falls with the amplitude, the loss a cycle grows with it, the frequency does not matter.",
    "backlash_friction": "A loop whose flanks are broken by a dead space: after a reversal the friction stays away for the length of the clearance, then builds up over the slip displacement.",
    "gap": "No force in the middle of the stroke, a spring at both ends. Resonances bend upwards with the amplitude and jump.",
    "one_sided_stop": "A spring on one side only: the mean of the motion moves away from it, even harmonics appear.",
    "surface_contact": "An arm that presses on its table: several joints stay behind their targets at once, wherever its end comes down to one height, and nowhere else.",
    "asymmetric_gap": "As a gap, with two different walls: even harmonics besides the odd ones.",
    "cubic_stiffness": "Resonance bends upwards (or downwards) smoothly with the amplitude; odd harmonics.",
    "quadratic_stiffness": "The rest position under a load differs by its sign; even harmonics.",
    "quadratic_damping": "Large motions are damped more than small ones; nothing at reversals.",
    "power_law_damping": "Loss a cycle grows with a power of the velocity other than one: below one it resembles friction, above one drag.",
    "asymmetric_damping": "One direction is damped more than the other: the mean of the motion moves.",
    "viscoelastic_relaxation": "Stiffer at high than at low frequency, and loss in between; a step of the load creeps.",
    "load_dependent_friction": "A step at every reversal whose height grows with the force carried: a bow tie of force over displacement.",
    "gear_friction": "A servo holds a load with far less current than it lifts it with, and its current may fall by half before anything moves. The step at reversals grows faster than the torque of the motor, and slow motion stutters under load.",
    "time_varying_friction": "A step at every reversal whose height beats with a period of its own.",
    "record_dependent_friction": "Friction of a different height in each record, steady within each.",
    "record_dependent_stiffness": "The frequency differs from record to record, and is steady within each.",
    "record_dependent_damping": "The height of peaks differs from record to record, their frequency does not.",
    "scheduled_stiffness": "The frequency follows the scheduling channel.",
    "scheduled_damping": "The height of peaks follows the scheduling channel, their frequency does not.",
    "stiffness_drift": "The frequency changes along the record; begun anew it is as before or has stayed.",
    "force_offset": "A constant force: the rest position is off, the motion about it is right.",
    "timed_force": "A force that is switched on and off by a clock and not by the motion.",
    "harmonic_force": "A line in the spectrum of all responses at a frequency that is none of the load's: the response without a load, too.",
    "gap_coupling": "One axis is damped only while the other is far out.",
    "cross_stiffness": "A load of one axis moves the other, at once and in proportion.",
    "cogging": "A force that repeats along the stroke or turn, whatever the speed: in slow motion a ripple, in fast motion a tone that rises with it.",
    "base_flexibility": "Less stiffness, an additional resonance above the joint's own, and no friction.",
    "carried_mass": "A second mode: an antiresonance at the frequency of the part that is carried, a resonance above it, at every amplitude alike; below them the whole mass.",
    "degrading_hysteresis": "Loops that lose strength or stiffness from cycle to cycle.",
    "pinching_hysteresis": "Loops with a waist: soft near the middle, stiff at the ends.",
    "mass_error": "Inertial forces are off in proportion to the acceleration; on an arm, gravity besides.",
    "base_tilt": "Gravity torques of all joints are off, as if gravity pulled another way.",
    "com_error": "Gravity torques are off by a part that turns with the posture; little else.",
    "gravity_compensation": "On an arm, gravity sags less, or more, than the mass tells; inertia is right.",
    "stiffness_error": "All resonances are off in proportion, at every amplitude.",
    "damping_error": "Peaks are too high or too low, at every amplitude alike.",
    "armature_error": "As a mass, but gravity is right.",
    "actuator_delay": "The response lags by a constant time: a phase in proportion to the frequency, all responses alike.",
    "force_delay": "The response comes before its load: a phase lead in proportion to the frequency, all responses alike.",
    "clock_skew": "The response lags or leads by a time that grows along the record: a phase in proportion to frequency and time.",
    "actuator_lag": "The response lags and fades with the frequency.",
    "target_lag": "A servo answers steps of its target as if they were rounded off; disturbances it meets as before.",
    "force_gain_error": "All responses are off by one factor.",
    "servo_gain_error": "The servo follows more tightly or more loosely; gravity sags differ in inverse proportion.",
    "actuator_saturation": "Right while the load is small; a plateau at its peaks.",
    "actuator_deadband": "Nothing happens around zero load.",
    "joint_compliance": "The link swings on behind its motor: a resonance that the motor's encoder hardly sees.",
    "backlash": "After each reversal of the torque the motor runs free for the width of the play, then strikes.",
}
"""How an effect looks in records, by name; that of sensors is told by `SENSOR`."""

LAWS = {effect.name: effect.law.name for effect in LINEAR if effect.law is not None}
"""Law of an effect, by their names."""

SENSOR = {
    "gain_error": "The channel is off by a factor, at all frequencies; the other channels of the same motion are right.",
    "delay": "The channel lags all others by a constant time.",
    "lag": "The channel lags all others and fades with the frequency: an amplifier, or a filter that nobody stated.",
    "filter": "The channel lags all others by a constant time at low frequency and fades beyond its cutoff: an anti-alias filter that nobody stated.",
    "high_pass": "The channel holds nothing slow and leads where it begins to: a coupling that lets no constant through, or a charge amplifier.",
    "bias": "The channel is off by a constant.",
    "offset": "The channel is off by a constant. Where a servo acts on it, the joint is.",
    "drift": "The channel runs away along the record.",
    "hum": "A line in the spectrum of this channel alone, most often at the frequency of the mains or a multiple of it.",
    "clipping": "The channel has plateaus at its extremes.",
    "crosstalk": "The channel holds a share of another channel.",
    "polarity": "The channel has the opposite sign of all others.",
    "quantisation": "All values lie on multiples of a step.",
}
"""How a fault of a sensor looks, by the end of its name."""


VARIED = {
    "scheduled_": "Its size follows the scheduling channel.",
    "record_dependent_": "Its size differs from record to record, and is steady within each.",
}
"""What the beginning of a name adds to how an effect looks."""


def _plain(name: str) -> str:
    """Name of the effect that another one varies; its own where it varies none."""
    for beginning in VARIED:
        name = name.removeprefix(beginning)
    return name


def look_of(name: str) -> str:
    """How an effect looks in a record."""
    if name in LOOKS:
        return LOOKS[name]
    varied = next((text for beginning, text in VARIED.items() if name.startswith(beginning)), "")
    if varied:
        return f"{LOOKS[_plain(name)]} {varied}"
    return next((text for end, text in SENSOR.items() if name.endswith(end)), "")


def _range(parameter: FreeParameter) -> str:
    """Where the prior expects a parameter, as multiples of its scale."""
    if parameter.fixed:
        return "tried: " + (
            f"{len(parameter.grid)} values from {min(parameter.grid):g} to {max(parameter.grid):g}"
            if len(parameter.grid) > 4
            else ", ".join(f"{g:g}" for g in parameter.grid)
        )
    if parameter.signed:
        return f"{parameter.mean:g} ± {parameter.std:g}"
    ends = np.exp(parameter.mean + parameter.std * np.array([-1.0, 1.0]))
    low, high = ends / (1.0 + ends) if parameter.share else ends
    return f"{low:.2g} … {high:.2g}"


def _table(parameters: tuple[FreeParameter, ...]) -> list[str]:
    rows = ["| parameter | in units of | expected there (one sigma) |", "|---|---|---|"]
    rows += [
        f"| `{p.name}` | {p.scale if p.scale != '1' else p.unit or '1'} | {_range(p)} |" for p in parameters
    ]
    return rows


def draw(effect: Effect, path: Path) -> None:
    """Draw what an actuator or a sensor makes of a swept sine."""
    assert effect.signal is not None
    time = np.linspace(0.0, 2.0, 2000)
    signal = (0.3 + 0.35 * time) * np.sin(2 * np.pi * (1.0 + 0.5 * time) * time)
    size = {
        "delay": 0.06,
        "rate_error": 0.04,
        "lag": 0.08,
        "cutoff": 3.0,
        "corner": 0.6,
        "time_constant": 0.08,
        "level": 0.6,
        "step": 0.2,
        "drift": 0.5,
        "bias": 0.3,
    }
    first = effect.parameters[0].name
    value = np.array([size.get(first, 0.35)])
    with style():
        figure = Figure(figsize=(6.6, 2.2), layout="constrained")
        axes = figure.subplots()
        axes.plot(time, signal, color=REFERENCE_COLOUR, linewidth=2.0, alpha=0.6, label="true")
        axes.plot(
            time,
            effect.signal(signal, value, float(time[1])),
            color=COLOURS[0],
            linewidth=1.2,
            label=effect.name,
        )
        axes.set_xlabel("time [s]")
        axes.set_ylabel("channel")
        axes.legend(loc="upper left", ncols=2)
        save(figure, path, dpi=90)


def _drawn(effect: Effect) -> bool:
    return effect.signal is not None and not effect.pickup


def _equation(effect: Effect | ArticulatedEffect) -> list[str]:
    """The equation of an effect; a sentence where it is one."""
    text = effect.equation
    if not equations.is_equation(text):
        return [f"{text[0].upper()}{text[1:]}.", ""]
    return ["```math", equations.display(text, [p.name for p in effect.parameters]), "```", ""]


def page(name: str) -> str:
    """The page of the effect of that name, of linear structures and of arms together."""
    linear = next((e for e in LINEAR if e.name == name), None)
    arms = [e for e in ARTICULATED if e.name == name]
    first = linear or next(iter(arms), None)
    assert first is not None
    lines = [f"# {name}", "", *_equation(first), "## In a record", "", look_of(name), ""]
    if linear is not None and linear.law is not None:
        law = linear.law.name
        lines += [
            f"![Force of the law {law}](../laws/pictures/{law}.png)",
            "",
            f"The law: [`{law}`](../laws/{law}.md).",
            "",
        ]
    elif name in looks.PICTURED:
        lines += [f"![A small example with and without {name}](pictures/{name}.png)", ""]
    elif (plain := _plain(name)) in LAWS:
        law = LAWS[plain]
        lines += [f"![Force of the law {law}, of which this is a multiple](../laws/pictures/{law}.png)", ""]
    elif linear is not None and _drawn(linear):
        lines += [f"![What {name} makes of a swept sine](pictures/{name}.png)", ""]
    if linear is not None:
        when = "only where no common effect explains the records alone" if linear.rare else "always"
        lines += [
            "## On a linear structure",
            "",
            f"Place: {linear.site}. Family: {linear.family}. Tried: {when}.",
            "",
        ]
        lines += [*_table(linear.parameters), ""]
    for arm in arms:
        where = "" if arm.hinge is None else ": a hinge" if arm.hinge else ": a slide"
        lines += [
            f"## On an arm, a leg or a servo{where}",
            "",
            f"Place: {arm.site}. Family: {arm.family}.",
            "",
        ]
        lines += [
            *(_equation(arm) if linear is not None and arm.equation != linear.equation else []),
            *_table(arm.parameters),
            "",
        ]
    lines += [
        "`force`, `position`, `velocity` and so on stand for the largest of the records at the place of the effect.",
        "",
    ]
    return "\n".join(lines)


def names() -> list[str]:
    """Names of all effects, those of linear structures first."""
    return list(dict.fromkeys([*(e.name for e in LINEAR), *(e.name for e in ARTICULATED)]))


def pages() -> dict[str, str]:
    """All pages of effects, by path below docs/."""
    lines = ["# Effects", "", "What a diagnosis may find missing, and how it shows.", ""]
    lines += ["| effect | place | structures | arms, servos | in a record |", "|---|---|---|---|---|"]
    linear, arms = {e.name: e for e in LINEAR}, {e.name: e for e in ARTICULATED}
    for name in names():
        site = (linear.get(name) or arms[name]).site
        lines.append(
            f"| [`{name}`]({name}.md) | {site} | {'yes' if name in linear else '–'} | {'yes' if name in arms else '–'} | {look_of(name)} |"
        )
    lines.append("")
    return {"reference/effects/index.md": "\n".join(lines)} | {
        f"reference/effects/{n}.md": page(n) for n in names()
    }


def draw_all(docs: Path) -> None:
    """Draw the pictures of all effects that have no law to show."""
    folder = docs / "reference" / "effects" / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    for effect in LINEAR:
        if _drawn(effect):
            draw(effect, folder / f"{effect.name}.png")
    for name in looks.PICTURED:
        looks.draw(name, folder / f"{name}.png")
