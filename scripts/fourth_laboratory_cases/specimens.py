"""What is tested: one axis, a pendulum, a carriage on a guide, an isolator in a testing machine, a frame of two storeys."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from third_laboratory_cases.case import Signals

from bench.arrays import Array
from fourth_laboratory_cases import axis, carriage, storeys, testing_machine
from fourth_laboratory_cases.case import Clock, Compared, Excited, Record, Specimen

GRAVITY = 9.81
"""Gravitational acceleration [m/s^2] of the model of a pendulum."""
NOTHING = axis.Missing()
"""What an axis that is as its nominal model has besides."""
WINDOWS = 10
"""Windows in which the force on a carriage that nothing holds is replayed, each from the measured state."""


@dataclass(frozen=True, kw_only=True)
class OnAxis(Specimen):
    """An axis that a load drives, or a base that shakes; a torque and rotations where it turns.

    Attributes:
        properties: The axis.
        missing: What it has besides.
        background: Small physics besides.
        stated: True values that are not those of the properties, by name.
        shaken: Whether the excitation is the displacement of a base.
        late: Time [s] by which the sensor of the displacement is late; missing, too.
        gain: Reading of the accelerometer over what is there; missing, too.
    """

    properties: axis.Axis
    missing: axis.Missing = NOTHING
    background: axis.Background
    stated: Mapping[str, float] | None = None
    shaken: bool = False
    late: float = 0.0
    gain: float = 1.0

    def stated_values(self) -> dict[str, float]:
        """As of `Specimen.stated_values`."""
        p = self.properties
        own = {"mass": p.mass, "stiffness": p.stiffness, "damping": p.damping}
        return {**own, **(self.stated or {})}

    def excited(self, record: Record, clock: Clock, rng: np.random.Generator) -> Excited:
        """As of `Specimen.excited`."""
        t = clock.half_steps(record.seconds)
        signal, still = record.excitation(rng, t, record.seconds), np.zeros_like(t)
        if not self.shaken:
            return Excited(record, clock, {"load": signal, "base": still})
        coarse = slice(None, None, 8)  # a motion in splines has an acceleration without steps
        shaking = CubicSpline(t[coarse], signal[coarse])(t, 2)
        return Excited(record, clock, {"load": still, "base": shaking})

    def simulated(self, excited: Excited, *, effect: bool, background: bool) -> Signals:
        """As of `Specimen.simulated`."""
        missing = self.missing._replace(crack_phase=excited.record.phase) if effect else NOTHING
        besides = self.background if background else axis.Background()
        signals = marched(excited, self.properties, missing, besides)
        return self._sensed(signals) if effect else signals

    def nominal(self, excited: Excited, values: Mapping[str, float], measured: Signals) -> Signals:
        """As of `Specimen.nominal`."""
        properties = axis.Axis(values["mass"], values["stiffness"], values["damping"])
        return marched(excited, properties, NOTHING, axis.Background())

    def _sensed(self, signals: Signals) -> Signals:
        t, x = signals["t"], signals["displacement"]
        seen = np.interp(t - self.late, t, x, left=x[0]) if self.late > 0.0 else x
        return {**signals, "displacement": seen, "acceleration": self.gain * signals["acceleration"]}


@dataclass(frozen=True, kw_only=True)
class Pendulum(Specimen):
    """A pendulum that is let go and recorded from later on.

    Attributes:
        mass: Its mass [kg].
        arm: Distance of its centre of mass from the pivot [m], which is known.
        inertia: Its moment of inertia about the centre of mass [kg m^2].
        damping: Viscous damping of the pivot [N m s/rad].
        missing: What it has besides.
        background: Small physics besides.
    """

    mass: float
    arm: float
    inertia: float
    damping: float
    missing: axis.Missing
    background: axis.Background

    def stated_values(self) -> dict[str, float]:
        """As of `Specimen.stated_values`."""
        return {"mass": self.mass, "inertia": self.inertia, "damping": self.damping}

    def excited(self, record: Record, clock: Clock, rng: np.random.Generator) -> Excited:
        """As of `Specimen.excited`."""
        t = clock.half_steps(record.seconds + record.cut)
        return Excited(
            record, clock, {"load": record.excitation(rng, t, record.seconds), "base": np.zeros_like(t)}
        )

    def simulated(self, excited: Excited, *, effect: bool, background: bool) -> Signals:
        """As of `Specimen.simulated`."""
        missing = self.missing if effect else NOTHING
        besides = self.background if background else axis.Background()
        hanging, before = self._hanging(self.stated_values()), excited.clock.steps(excited.record.cut)
        signals = marched(excited, hanging, missing, besides, excited.record.start)
        times = signals["t"][: len(signals["t"]) - before]
        return {**{name: values[before:] for name, values in signals.items()}, "t": times}

    def nominal(self, excited: Excited, values: Mapping[str, float], measured: Signals) -> Signals:
        """As of `Specimen.nominal`; it starts from the measured state."""
        still = np.zeros(2 * len(measured["t"]) - 1)
        recorded = excited._replace(inputs={"load": still, "base": still})
        x, v = float(measured["displacement"][0]), float(measured["velocity"][0])
        return marched(recorded, self._hanging(values), NOTHING, axis.Background(), x, v)

    def _hanging(self, values: Mapping[str, float]) -> axis.Axis:
        inertia = values["inertia"] + values["mass"] * self.arm**2
        return axis.Axis(inertia, values["mass"] * GRAVITY * self.arm, values["damping"], True)


def marched(
    excited: Excited,
    properties: axis.Axis,
    missing: axis.Missing,
    background: axis.Background,
    x: float = 0.0,
    v: float = 0.0,
) -> Signals:
    """Signals of an axis at each step (n,), from an initial displacement [m] and velocity [m/s]."""
    load, base, h = excited.inputs["load"], excited.inputs["base"], excited.clock.step()
    displacement, velocity, acceleration = axis.march(properties, missing, background, load, base, h, x, v)
    return {
        "t": excited.clock.times(len(displacement)),
        "load": load[::2],
        "base": base[::2],
        "displacement": displacement,
        "velocity": velocity,
        "acceleration": acceleration,
        "absolute_acceleration": acceleration + base[::2],
    }


@dataclass(frozen=True, kw_only=True)
class OnGuide(Specimen):
    """A carriage in its position loop, whose dry friction is missing; without the loop nothing holds it.

    Attributes:
        properties: The carriage.
        background: Small physics besides.
        loop: Its position loop.
    """

    properties: carriage.Carriage
    background: carriage.Background
    loop: carriage.PositionLoop

    def stated_values(self) -> dict[str, float]:
        """As of `Specimen.stated_values`."""
        return {"mass": self.properties.mass, "damping": self.properties.damping}

    def excited(self, record: Record, clock: Clock, rng: np.random.Generator) -> Excited:
        """As of `Specimen.excited`."""
        t = clock.half_steps(record.seconds)[::2]
        target = record.excitation(rng, t, record.seconds)
        return Excited(
            record, clock, {"t": t, "target": target, "velocity": np.gradient(target, clock.step())}
        )

    def simulated(self, excited: Excited, *, effect: bool, background: bool) -> Signals:
        """As of `Specimen.simulated`, in the position loop."""
        given = excited.inputs
        p, b = self._with(effect=effect, background=background)
        motion = carriage.controlled(
            p, b, self.loop, given["target"], given["velocity"], excited.clock.step()
        )
        return {"t": given["t"], **motion._asdict()}

    def compared(self, excited: Excited) -> Compared:
        """As of `Specimen.compared`: in its loop the carriage moves as it is told, so the force on it is replayed instead."""
        complete = self.simulated(excited, effect=True, background=True)
        h = excited.clock.step()
        alone = replayed(*self._with(effect=True, background=False), complete, h)
        return Compared(complete, alone, replayed(*self._with(effect=False, background=False), complete, h))

    def nominal(self, excited: Excited, values: Mapping[str, float], measured: Signals) -> Signals:
        """As of `Specimen.nominal`, in windows from the measured state."""
        p = self.properties._replace(mass=values["mass"], damping=values["damping"], friction=0.0)
        return replayed(p, carriage.Background(), measured, excited.clock.step())

    def _with(self, *, effect: bool, background: bool) -> tuple[carriage.Carriage, carriage.Background]:
        p = self.properties if effect else self.properties._replace(friction=0.0)
        return p, self.background if background else carriage.Background()


def replayed(p: carriage.Carriage, b: carriage.Background, measured: Signals, h: float) -> Signals:
    """Motion of a carriage at each step [s] (n,) under the measured force, in windows that start from the measured state."""
    n = len(measured["t"])
    displacement, velocity = np.empty(n), np.empty(n)
    width = (n - 1) // WINDOWS
    for window in range(WINDOWS):
        first = window * width
        last = first + width if window < WINDOWS - 1 else n - 1
        part = slice(first, last + 1)
        x, v = float(measured["displacement"][first]), float(measured["velocity"][first])
        motion = carriage.replayed(p, b, measured["force"][part], h, first * h, x, v)
        displacement[part], velocity[part] = motion.displacement, motion.velocity
    return {
        "t": measured["t"],
        "force": measured["force"],
        "displacement": displacement,
        "velocity": velocity,
    }


@dataclass(frozen=True, kw_only=True)
class InMachine(Specimen):
    """An isolator whose motion a testing machine prescribes; its Bouc-Wen element is missing.

    Attributes:
        properties: The isolator.
        background: Small physics besides.
    """

    properties: testing_machine.Isolator
    background: testing_machine.Background

    def stated_values(self) -> dict[str, float]:
        """As of `Specimen.stated_values`."""
        p = self.properties
        return {"stiffness": p.stiffness, "damping": p.damping, "coulomb": p.friction}

    def excited(self, record: Record, clock: Clock, rng: np.random.Generator) -> Excited:
        """As of `Specimen.excited`."""
        t = clock.half_steps(record.seconds)[::2]
        x = record.excitation(rng, t, record.seconds)
        spline = CubicSpline(t, x)
        moved = {"displacement": x, "velocity": spline(t, 1), "acceleration": spline(t, 2)}
        return Excited(record, clock, {"t": t, **moved})

    def simulated(self, excited: Excited, *, effect: bool, background: bool) -> Signals:
        """As of `Specimen.simulated`."""
        p = self.properties if effect else self.properties._replace(slip_stiffness=0.0)
        return self._read(excited, p, self.background if background else testing_machine.Background())

    def nominal(self, excited: Excited, values: Mapping[str, float], measured: Signals) -> Signals:
        """As of `Specimen.nominal`."""
        p = testing_machine.Isolator(values["stiffness"], values["damping"], values["coulomb"])
        return self._read(excited, p, testing_machine.Background())

    def _read(self, excited: Excited, p: testing_machine.Isolator, b: testing_machine.Background) -> Signals:
        moved: list[Array] = [excited.inputs[name] for name in ("displacement", "velocity", "acceleration")]
        return {**excited.inputs, "force": testing_machine.force(p, b, *moved, excited.clock.step())}


@dataclass(frozen=True, kw_only=True)
class Storeys(Specimen):
    """A frame of two storeys in which nothing of size is missing.

    Attributes:
        properties: The frame.
        background: Small physics besides.
    """

    properties: storeys.Frame
    background: storeys.Background

    def stated_values(self) -> dict[str, float]:
        """As of `Specimen.stated_values`."""
        return self.properties._asdict()

    def excited(self, record: Record, clock: Clock, rng: np.random.Generator) -> Excited:
        """As of `Specimen.excited`."""
        t = clock.half_steps(record.seconds)
        return Excited(record, clock, {"load": record.excitation(rng, t, record.seconds)})

    def simulated(self, excited: Excited, *, effect: bool, background: bool) -> Signals:
        """As of `Specimen.simulated`."""
        return self._moved(excited, self.properties, self.background if background else storeys.Background())

    def nominal(self, excited: Excited, values: Mapping[str, float], measured: Signals) -> Signals:
        """As of `Specimen.nominal`."""
        return self._moved(excited, storeys.Frame(**values), storeys.Background())

    def _moved(self, excited: Excited, p: storeys.Frame, b: storeys.Background) -> Signals:
        load, h = excited.inputs["load"], excited.clock.step()
        motion = storeys.march(p, b, load, h)
        slip = motion.displacement_2 - motion.displacement_1
        return {"t": excited.clock.times(len(slip)), "load": load[::2], "slip": slip, **motion._asdict()}
