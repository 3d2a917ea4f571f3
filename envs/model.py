"""The environment with a user's own MuJoCo model: joint targets from which its unknown parameters can be told."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.excitation import Draw, fans
from bench.excitation.background import SETTINGS as ERROR_SETTINGS
from bench.excitation.background import expected_error
from bench.excitation.information import accumulate
from bench.files import replacing

from .arms import ArmArguments, ArmSetup, arm_setup
from .base import options_of
from .options import Options
from .single import BenchEnv
from .stepped import SteppedBenches, sensed
from .vector import BenchVectorEnv


class ModelBenches(SteppedBenches):
    """Copies of a user's model with hidden parameters, each beside copies in which one parameter after the other is moved.

    All of them run in one MuJoCo batch; the reward is minus the logarithm of the expected error at the hidden parameters.
    """

    def __init__(self, setup: ArmSetup, options: Options, n: int, threads: int = 1) -> None:
        """Set up benches; each must be `reset` before it is stepped."""
        super().__init__(setup, options, n)
        self.setup: ArmSetup = setup  # pyrefly: ignore[bad-override-mutable-attribute]
        self._threads, self._fields = threads, setup.fields()
        self._p = len(self._fields)
        self.question = np.zeros(n, dtype=np.int64)
        self.coordinates = np.zeros((n, self._p))
        self.commands = np.zeros((n, self.n_windows * self.n_steps, len(setup.axes)))
        self._sums = [np.zeros((n, 1, self._p, self._p)), np.zeros((n, 1, self._p)), np.zeros((n, 1))]
        self._values, self._latest = np.zeros(n), np.zeros(n)
        self._begin()

    def _begin(self) -> None:
        """Set up the batch."""
        model = self.setup.compiled
        self._batch = Batch(model, self.n * (1 + self._p), self._threads)
        self._expanded = {name: self._batch.expand(name) for name, _ in self._fields}
        joints = [model.joint(axis.joint.name).id for axis in self.setup.axes]
        self._at = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        self._driven = [model.actuator(axis.drive.name).id for axis in self.setup.axes]
        self._columns = [self._column(name) for name in self.station.channels]
        self._middle = np.array([axis.middle for axis in self.setup.axes])

    def _column(self, channel: str) -> int:
        """Place of a channel among positions, velocities and torques of all axes."""
        for i, axis in enumerate(self.setup.axes):
            if channel in axis.channels:
                return axis.channels.index(channel) * len(self.setup.axes) + i
        raise ParameterError(f"no driven joint has a channel '{channel}'")

    def _members(self, places: NDArray[np.int64]) -> NDArray[np.int64]:
        """Simulations of benches: the hidden one, and those with one parameter moved ``(m, 1 + p)``."""
        return places[:, None] * (1 + self._p) + np.arange(1 + self._p)

    def _install(self, place: int) -> None:
        """Write the parameters of a bench's simulations."""
        hypothesis = self.setup.hypothesis
        rows = self._members(np.array([place]))[0]
        around = fans(self.coordinates[place], ERROR_SETTINGS.step)
        for j, ((name, row), parameter) in enumerate(zip(self._fields, hypothesis.parameters, strict=True)):
            for member, x in zip(rows, around[:, j], strict=True):
                values = self._expanded[name][member]
                values.reshape(len(values), -1)[row, 0] = parameter.value(float(x))

    def reset(self, places: NDArray[np.int64], rngs: Sequence[np.random.Generator]) -> NDArray[np.float32]:
        """Put hidden parameters, drawn anew, into some benches, the joints at rest in the middle of their ranges.

        Args:
            places: Benches, ascending ``(m,)``.
            rngs: Generators of all benches; only those of `places` are drawn from.
        """
        bound, model = np.sqrt(3.0), self.setup.compiled
        for place in places:
            self.coordinates[place] = rngs[place].uniform(-bound, bound, self._p)
            self.truth[place] = self.setup.hypothesis.at(self.coordinates[place])
            self._install(int(place))
            rngs[place].standard_normal(out=self._disturbance[place])
        members = self._members(places).ravel()
        self._batch.state[members] = 0.0
        position = model.qpos0.copy()
        position[self._at[0]] = self._middle
        self._batch.bind("qpos")[members] = position
        if model.na:  # filters before the drives are settled
            own, at = model.actuator_actadr[self._driven], np.arange(len(self._driven))
            self._batch.bind("act")[np.ix_(members, own[own >= 0])] = self.setup.centres[at[own >= 0]]
        self._disturbance[places] *= self.desk.noise
        self.desk.begin(places)
        for array in (*self._sums, self._values, self._latest, self._merit, self.commands):
            array[places] = 0.0
        rest = np.zeros((len(places), self.n_steps, len(self.setup.axes)))
        still = np.zeros((len(places), self.width))
        return self.desk.observe(places, self._disturbance[places, -1], rest, still)

    def _measured(
        self, places: NDArray[np.int64], commands: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        for place, own in zip(places, commands, strict=True):
            begin = int(self.desk.window[place]) * self.n_steps
            self.commands[place, begin : begin + self.n_steps] = own
        outputs = self._run(places, commands)
        parts = [array[places] for array in self._sums]
        counts, values = np.full((len(places), 1), self._p), np.zeros((len(places), 1))
        ideal = outputs[:, 0].copy()
        fisher, score, square = parts
        accumulate(
            0, len(places), outputs, counts, ERROR_SETTINGS.step, 1.0 / self.desk.noise, None, fisher, score, square, values
        )  # fmt: skip
        for array, part in zip(self._sums, parts, strict=True):
            array[places] = part
        known = np.where(np.isfinite(parts[0][:, 0]), parts[0][:, 0], 0.0)
        self._latest[places] = -np.log(expected_error(known, np.zeros((len(places), self._p))))
        return sensed(ideal, self._disturbance[places, self.desk.window[places]])

    def _run(self, places: NDArray[np.int64], commands: NDArray[np.float64]) -> NDArray[np.float64]:
        """Drive all simulations of some benches; channels at the end of each interval ``(m, 1 + p, n_steps, n_channels)``."""
        m, members, substeps = len(places), self._members(places), self.setup.substeps
        inputs = np.zeros((m, 1, self.n_steps, self.setup.compiled.nu))
        inputs[:, 0][:, :, self._driven] = self.setup.centres + commands
        control = np.repeat(np.repeat(inputs, 1 + self._p, axis=1), substeps, axis=2)
        control = control.reshape(members.size, self.n_steps * substeps, -1)
        record = self._batch.rollout(
            self.n_steps * substeps, control, record=["qpos", "qvel", "qfrc_actuator"], ids=members.ravel()
        )
        last = slice(substeps - 1, None, substeps)
        parts = [
            record["qpos"][:, last][:, :, self._at[0]] - self._middle,
            record["qvel"][:, last][:, :, self._at[1]],
            record["qfrc_actuator"][:, last][:, :, self._at[1]],
        ]
        outputs = np.concatenate(parts, axis=2)[:, :, self._columns]
        return outputs.reshape(m, 1 + self._p, self.n_steps, -1)

    def _told(
        self, places: NDArray[np.int64], measured: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        gain = self._latest[places] - self._values[places]
        self._values[places] = self._latest[places]
        self._merit[places] += gain
        return gain, self.effective_draws(places)

    @property
    def merit(self) -> NDArray[np.float64]:
        """Minus the logarithm of the expected error by now [nat] ``(n,)``."""
        return self._merit.copy()

    def effective_draws(self, places: NDArray[np.int64]) -> NDArray[np.float64]:
        """One: the reward knows one arm ``(m,)``."""
        return np.ones(len(places))

    def positions(self, place: int) -> NDArray[np.float64]:
        """Joint positions of a bench's arm, to be looked at."""
        return self._batch.bind("qpos")[place * (1 + self._p)].copy()

    def targets(self, place: int) -> NDArray[np.float64]:
        """Inputs of the drives in the episode so far ``(n, n_axes)``, in their units."""
        n = int(self.desk.window[place]) * self.n_steps
        return self.setup.centres + self.commands[place, :n]

    def write_targets(self, path: Path, place: int = 0) -> None:
        """Write the episode so far as CSV: time and the input of each drive.

        Args:
            path: The file, written whole or not at all.
            place: The bench.

        Raises:
            ParameterError: Nothing was run yet, or a joint left its range, speed or torque.
            OutputError: It cannot be written.
        """
        targets = self.targets(place)
        if not len(targets):
            raise ParameterError("no window of this episode has been run; step the environment first")
        stroke, velocity = self.desk.peak[place]
        if max(stroke, velocity) > 1.0:
            raise ParameterError(
                f"in this episode {100.0 * stroke:.0f} % of a joint's range and {100.0 * velocity:.0f} % of a joint's speed or torque "
                "were reached; at most 100 % may be written: ask for less"
            )
        names = ["time [s]"] + [
            f"{axis.drive.name} [{axis.joint.unit if axis.drive.servo else 'input'}]"
            for axis in self.setup.axes
        ]
        clock = np.arange(len(targets)) * self.timestep
        with replacing(path) as temporary:
            np.savetxt(
                temporary, np.column_stack([clock, targets]), delimiter=",", header=",".join(names), comments="", fmt="%.9g",
            )  # fmt: skip

    def __getstate__(self) -> dict[str, Any]:
        kept = ("_batch", "_expanded")
        rest = {name: value for name, value in self.__dict__.items() if name not in kept}
        return {**rest, "state": self._batch.state.copy()}

    def __setstate__(self, saved: dict[str, Any]) -> None:
        state = saved.pop("state")
        self.__dict__.update(saved)
        self._begin()
        for place in range(self.n):
            if self.truth[place] is not None:
                self._install(place)
        self._batch.state[:] = state


def make_model_benches(n: int, threads: int, arguments: Mapping[str, Any]) -> ModelBenches:
    """Benches for an environment with given arguments.

    Raises:
        TypeError: An argument is unknown, or the model is missing.
        BenchError: An argument has a value outside its range.
    """
    rest = dict(arguments)
    if "model" not in rest:
        raise TypeError("JointBench/ModelExcitation-v0 takes the path of an MJCF: model='arm.xml'")
    tables = {
        name: dict(rest.pop(name, None) or {}) for name in ("uncertain", "ranges", "velocity", "torque")
    }
    setup = arm_setup(ArmArguments(str(rest.pop("model")), **tables))
    options = options_of(rest)
    for name in ("average", "reward", "terminate_when_certain"):
        if getattr(options, name) != getattr(Options(), name):
            raise ParameterError(f"{name} means nothing for a model of your own; leave it out")
    return ModelBenches(setup, options, n, threads)


class ModelExcitationEnv(BenchEnv):
    """Move an arm or leg of your own so that its joints' friction, damping and inertia can be identified.

    ## Description

    An MJCF with hinges and slides on a fixed base, driven by servos (position actuators) or motors. Each step shapes the inputs of the
    drives over the next window; each episode hides other values of what is unknown. The aim is a motion from which they can be
    told, within ranges, speeds and torques. `env.unwrapped.benches.write_targets(path)` writes an episode's inputs as CSV.

    Hidden, drawn anew in every episode:

    | Unknown | Smallest | Largest | Distribution |
    |---|---|---|---|
    | damping, frictionloss, armature of driven joints, where there are any | half of the model's | twice the model's | log-uniform |
    | or what `uncertain` names | as given | as given | log-uniform |

    `uncertain` takes damping, frictionloss, armature and stiffness of joints, and the mass of bodies, their inertia as it is.

    ## Action Space

    `Box(-1, 1, (n_axes n_knots,), float32)` for `shaping="knots"`: the input of each drive at the end of each part of the window, reached
    along half a cosine; ±1 are 90 % of the range of its inputs about their middle, of a servo those within its joint's range.
    `Box(-1, 1, (2 n_axes,), float32)` for `shaping="amplitude_frequency"`: amplitude and frequency (0.1 … 2 Hz) of each.

    ## Observation Space

    `Box(-1, 1, (n,), float32)`: for each reading of the last window position, velocity and, where it is limited, torque of each driven
    joint, then the commands, the last action, time, energy, largest stroke and largest velocity, as in `SDOFExcitationEnv`.

    | Reading | Unit of ±1 | Noise (std) |
    |---|---|---|
    | position from the middle | 45 % of the joint's range | 0.1 % of that |
    | velocity | its limit | 1 % of that |
    | torque | its limit | 2 % of that |

    ## Rewards

    The growth of the merit [nat] in the window, less the cost. The merit is minus the logarithm of the error that an identification is
    expected to have, root mean square over the unknown parameters in prior standard deviations. It is taken at the hidden values, as
    a teacher may; observations do not know them. What the model lacks altogether is not in it.

    | Limit | Value | What happens |
    |---|---|---|
    | input | 90 % of its range | cannot be exceeded: actions are fractions of it |
    | range | 90 % of the joint's | "terminate": the episode ends, cost `penalty`; "cost": as velocity |
    | velocity | the joint's range within a second, or `velocity` | cost `penalty` times the share above the limit, at most 1 |
    | torque | the drive's `forcerange`, or `torque` | as velocity |

    ## Starting State

    All driven joints at rest in the middle of their ranges, the drives at the middle of their inputs.

    ## Episode End

    Terminated where a joint leaves its range; truncated after `duration`.

    ## Information

    As in `SDOFExcitationEnv`; `velocity` is the larger of velocities and torques, `energy` and `separated` are 0.

    ## Arguments

    | Argument | Default | Meaning |
    |---|---|---|
    | `model` | – | path of the MJCF |
    | `uncertain` | see above | ranges of what is unknown, as {"damping:elbow": (0.1, 0.4)} |
    | `ranges` | the model's | ranges of joints [rad or m] |
    | `velocity` | a range a second | largest velocities of joints [rad/s or m/s] |
    | `torque` | the model's | largest torques of joints [N m or N] |
    | `shaping`, `n_knots` | "knots", 1 | as in `SDOFExcitationEnv` |
    | `window` | 0.1 s | duration of a step |
    | `duration` | 10 s | duration of an episode |
    | `enforcement`, `penalty` | "terminate", 10 nat | as in `SDOFExcitationEnv` |
    | `render_mode` | None | "rgb_array" or "human" |

    Commands and readings come every 0.01 s, or every step of a model whose step is longer.

    ```python
    import envs, gymnasium
    env = gymnasium.make("JointBench/ModelExcitation-v0", model="examples/arm/arm.xml", velocity={"wrist": 2.0})
    ```

    ## References

    Swevers, Ganseman, Tükel, De Schutter, Van Brussel 1997, IEEE Transactions on Robotics and Automation 13(5) (exciting trajectories).

    ## Version History

    * v0: first version
    """

    kind = "model"

    def _make(self, arguments: dict[str, Any]) -> ModelBenches:
        return make_model_benches(1, 1, arguments)

    @property
    def truth(self) -> Draw | None:
        """The hidden arm of this episode; for evaluation, not for policies."""
        return self.benches.truth[0]


class ModelExcitationVectorEnv(BenchVectorEnv):
    """Vector environment of `ModelExcitationEnv`."""

    kind = "model"

    def _make(self, n: int, threads: int, arguments: dict[str, Any]) -> ModelBenches:
        return make_model_benches(n, threads, arguments)
