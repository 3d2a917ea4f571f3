"""Dry friction in a user's MJCF, as soft as MuJoCo makes it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from bench.arrays import Array
from bench.discrepancy.model.nominal_forces import NominalFriction
from bench.discrepancy.settings import SimulationSettings


@dataclass(frozen=True)
class MjcfFrictionSettings:
    """Numbers of `bench.discrepancy.model.mjcf_friction`."""

    least: float = 1e-4
    most: float = 0.9999
    """MuJoCo's mjMINIMP and mjMAXIMP, between which it keeps what `solimp` says."""
    steps: float = 2.0
    """Steps of the simulation that `refsafe` lets a time constant have at least."""
    hardest: float = 0.999
    """Impedance of friction that does not creep: 1e-3 of the mobility of the joint is left."""
    default_dmax: float = 0.95
    """Second number of MuJoCo's default `solimpfriction`."""


SETTINGS = MjcfFrictionSettings()


def nominal_frictions(
    model: mujoco.MjModel,
    rows: Sequence[tuple[str, Array]],
    parameters: Sequence[str],
    step: float,
    *,
    settings: SimulationSettings,
) -> tuple[NominalFriction, ...]:
    """Dry friction of a model itself, free where it is a nominal parameter, and soft as `softness` says.

    Args:
        model: The model.
        rows: Names of joints and fixed tendons, each with its row (n_dof,) over the degrees of freedom kept.
        parameters: Names of the nominal parameters.
        step: Time between samples [s]; softness that shows only within a fraction of it is none.
        settings: `SimulationSettings` of the diagnosis.
    """
    out = []
    for name, row in rows:
        joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
        parameter = f"frictionloss:{name}"
        if joint >= 0:
            dof = int(model.jnt_dofadr[joint])
            value = float(model.dof_frictionloss[dof])
            creep = softness(model, model.dof_solref[dof], model.dof_solimp[dof], model.dof_invweight0[dof])
        else:
            tendon = model.tendon(name).id
            value = float(model.tendon_frictionloss[tendon])
            creep = softness(
                model, model.tendon_solref_fri[tendon], model.tendon_solimp_fri[tendon],
                model.tendon_invweight0[tendon],
            )  # fmt: skip
        if creep[1] < step / settings.max_substeps:
            creep = (0.0, 0.0)
        if np.any(row) and (parameter in parameters or value > 0.0):
            out.append(NominalFriction(row, parameter if parameter in parameters else "", value, *creep))
    return tuple(out)


def softness(model: mujoco.MjModel, solref: Array, solimp: Array, mobility: float) -> tuple[float, float]:
    """Creep velocity over the limit [m/s/N or rad/s/(N m)] and lead time [s] of a `frictionloss`, see `bench.laws.soft_friction`.

    Args:
        model: The model, for its step and flags.
        solref: ``solreffriction`` (2,).
        solimp: ``solimpfriction`` (5,).
        mobility: Inverse inertia of the joint or tendon at the reference position.
    """
    first, last = (float(np.clip(x, SETTINGS.least, SETTINGS.most)) for x in solimp[:2])
    width = float(solimp[2])
    if first == last or width <= mujoco.mjMINVAL:
        first = 0.5 * (first + last)
    if solref[0] > 0.0:
        safe = not model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
        constant = (
            max(float(solref[0]), SETTINGS.steps * float(model.opt.timestep)) if safe else float(solref[0])
        )
        lead = 0.5 * last * constant
    else:
        lead = last / max(-float(solref[1]), mujoco.mjMINVAL)
    return (1.0 - first) / first * float(mobility) * lead, lead


def frictionloss_of(
    limit: float, creep: float, lead: float, *, mobility: float, step: float
) -> dict[str, str]:
    """Attributes of a joint that make MuJoCo's `frictionloss` the soft friction of a limit, creep velocity and lead time.

    MuJoCo's friction has a lead always: `refsafe` lets its time constant be two steps at least.

    Args:
        limit: [N or N m].
        creep: Velocity at the limit [m/s or rad/s].
        lead: [s].
        mobility: Inverse inertia of the joint [1/kg or 1/(kg m^2)].
        step: Step of the simulation [s].
    """
    drag = creep / max(limit * mobility, 1e-300)
    lead = max(lead, 0.5 * SETTINGS.default_dmax * SETTINGS.steps * step)
    impedance = float(np.clip(1.0 / (1.0 + drag / lead), SETTINGS.least, SETTINGS.hardest))
    largest = max(impedance, SETTINGS.default_dmax)
    return {
        "frictionloss": f"{limit:.6g}",
        "solreffriction": f"{2.0 * lead / largest:.6g} 1",
        "solimpfriction": f"{impedance:.6g} {largest:.6g}",
    }
