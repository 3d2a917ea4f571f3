"""Records that begin in motion although nobody said so.

A free run from rest of a record that was cut out of a longer one leaves the decay of whatever moved before, and an effect would be
found in it. The first samples tell: what they show beyond the nominal free run from rest is a start, or the beginning of
what is missing from the model. A missing force grows from nothing with the square of time, a wrong gain or a delay with the motion
itself; both are fitted beside the start, and so is a constant force, in whose balance a rig that stands still may be off its zero.
That takes positions of every degree of freedom: by accelerations alone, a deflection that decays and a force that sets in are
one and the same, and accelerometers may be wrong in more ways.

What a hysteretic law does at the beginning hangs on what went before, and no linear response follows that. But once the rest of a
record is explained, an error that is there with the first sample and dies away can only be that of the start.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import Case, CaseRecord, Prediction
from bench.discrepancy.case.channel_noise import noise_floor
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.model.structure import Structure
from bench.discrepancy.response.windows import channels_of, drifts
from bench.discrepancy.settings import DEFAULT, ChecksSettings, DiagnosisSettings
from bench.discrepancy.simulation.linear_response import linear_run
from bench.discrepancy.simulation.stick_slip import StructureMatrices

STATED = "starts_in_motion"
"""Option of a case that says which records start in motion; where it is given, nothing is looked for."""


def with_starts_found(
    case: Case, predict: Prediction | None = None, *, settings: DiagnosisSettings = DEFAULT
) -> Case:
    """Return a case whose records that evidently begin in motion are said to, so that their initial states are estimated.

    Args:
        case: A case; one that states which records start in motion, or whose motion is prescribed or drifts, is returned as it is.
        predict: Free run from rest of a record, response channel to samples (n,), that shows more than that of the nominal
            model does once something is known of what is missing; that of the nominal structure where None.
        settings: Thresholds of the diagnosis.
    """
    if STATED in case.options or case.rig == "damper":
        return case
    structure = structure_of(case, settings=settings)
    table = {p.name: p.value for p in case.parameters}
    linear = structure.at(np.array([table[name] for name in structure.parameters]))
    duration = max(len(r) * r.step for r in (*case.identification, *case.validation))
    if drifts(structure, linear, duration):
        return case

    def looked_at(record: CaseRecord) -> CaseRecord:
        if not record.at_rest or record.periodic:
            return record
        moves = _begins_off_rest(case, structure, linear, record, predict, settings=settings.checks)
        moves = moves or (
            predict is not None and _dies_away(case, structure, record, predict, settings=settings.checks)
        )
        return replace(record, at_rest=False) if moves else record

    return replace(
        case,
        identification=tuple(looked_at(record) for record in case.identification),
        validation=tuple(looked_at(record) for record in case.validation),
    )


def _begins_off_rest(
    case: Case,
    structure: Structure,
    linear: StructureMatrices,
    record: CaseRecord,
    predict: Prediction | None,
    *,
    settings: ChecksSettings,
) -> bool:
    """Whether the first positions of a record cannot be those of a start from rest, whatever force is missing."""
    n, n_dof = _samples(linear, record, settings=settings), len(structure.dofs)
    structure = replace(structure, observers=tuple(o for o in structure.observers if o.order == 0))
    rows = np.array([o.row for o in structure.observers]).reshape(-1, n_dof)
    measured, noise = _measured(case, structure, record)
    spread = np.std(measured, axis=0)
    if np.linalg.matrix_rank(rows) < n_dof or not np.all(spread > 0.0):
        return False
    on_dofs = linear._replace(inputs=np.eye(n_dof))

    def channels(force: Array, start: Array | None = None) -> Array:
        motion = linear_run(on_dofs, loads=force, step=record.step, start=start)
        return channels_of(structure, motion)

    loads = np.column_stack([record.values[name] for name in structure.loads])[:n]
    predicted = channels(loads @ structure.inputs.T)
    if predict is not None:
        predicted = _predicted(structure, record, predict)[:n]
    if not np.isfinite(predicted).all():
        return False
    columns = [channels(np.zeros((n, n_dof)), state) for state in np.eye(2 * n_dof)]
    columns += [channels(np.tile(force, (n, 1))) for force in np.eye(n_dof)]
    # one that makes some channel as large as it is in the whole record
    sizes = [float(np.min(spread / np.maximum(np.abs(c).max(axis=0), 1e-300))) for c in columns]
    for own in np.eye(len(noise)):
        columns += [predicted * own, np.gradient(predicted * own, axis=0)]
        sizes += [settings.start_gain, settings.start_shift]
    found, deviation = _estimated(
        np.stack(columns, axis=-1) * sizes / noise[:, None],
        (measured[:n] - predicted) / noise,
        settings=settings,
    )
    position, velocity, force = found[: 3 * n_dof].reshape(3, n_dof)
    forces = force * sizes[2 * n_dof : 3 * n_dof]
    balance = np.linalg.lstsq(linear.stiffness, forces, rcond=None)[0] / sizes[:n_dof]
    off_balance = np.minimum(np.abs(position), np.abs(position - balance))
    off = np.append(off_balance, np.abs(velocity))
    return bool(
        np.any((off > settings.start_material) & (off > settings.start_certain * deviation[: 2 * n_dof]))
    )


def _dies_away(
    case: Case, structure: Structure, record: CaseRecord, predict: Prediction, *, settings: ChecksSettings
) -> bool:
    """Whether the error of a free run from rest is there with the first sample and gone in the second half."""
    measured, noise = _measured(case, structure, record)
    error = measured - _predicted(structure, record, predict)
    first = np.abs(error[0])
    begins = (first > settings.start_certain * noise) & (
        first > settings.start_material * np.std(measured, axis=0)
    )
    half = len(error) // 2
    early, late = (np.mean(part**2, axis=0) - noise**2 for part in (error[:half], error[half:]))
    return bool(np.any(begins & (late < settings.start_forgotten * early)))


def _measured(case: Case, structure: Structure, record: CaseRecord) -> tuple[Array, Array]:
    """Response channels (n, n_channels) of a record, and their noise (n_channels,)."""
    names = [o.channel for o in structure.observers]
    measured = (
        np.column_stack([record.values[name] for name in names]) if names else np.zeros((len(record), 0))
    )
    noise = [case.channel(name).noise_std or noise_floor(record.values[name]) for name in names]
    return measured, np.array(noise)


def _predicted(structure: Structure, record: CaseRecord, predict: Prediction) -> Array:
    """Response channels (n, n_channels) of a free run."""
    free_run = predict(record)
    return np.column_stack([free_run[o.channel] for o in structure.observers])


def _samples(linear: StructureMatrices, record: CaseRecord, *, settings: ChecksSettings) -> int:
    """Samples at the beginning that are looked at."""
    squares = np.linalg.eigvals(np.linalg.solve(linear.mass, linear.stiffness)).real
    duration = len(record) * record.step
    slowest = max(float(squares.min()), (2.0 * np.pi / duration) ** 2)
    samples = settings.start_share * 2.0 * np.pi / np.sqrt(slowest) / record.step
    return int(np.clip(samples, settings.start_samples, len(record)))


def _estimated(columns: Array, gap: Array, *, settings: ChecksSettings) -> tuple[Array, Array]:
    """Coefficients (k,) of unit prior by which columns (n, n_channels, k) make a gap (n, n_channels), and their deviations.

    What no column explains is laid to the model: deviations grow with it.
    """
    matrix, right = columns.reshape(-1, columns.shape[-1]), gap.ravel()
    covariance = np.linalg.inv(matrix.T @ matrix + np.eye(matrix.shape[1]))
    found = covariance @ (matrix.T @ right)
    left = right - matrix @ found
    excess = 1.0 + max(float(left @ left) - len(right), 0.0) / settings.start_independent
    return found, np.sqrt(excess * np.diag(covariance))
