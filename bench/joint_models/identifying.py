"""A joint from records to file: fitted, judged on what the fit did not see, and told where it comes from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from bench.errors import ParameterError, UnknownNameError
from bench.joint_models.document import JointFile
from bench.joint_models.records import JointColumns, joint_motions
from bench.joint_models.registry import KINDS, Settings, identify, judging_samples, scores, without_masked
from bench.recording import Recording
from bench.rig.element import Element


def identified(
    kind: str,
    records: Mapping[str, Recording],
    columns: JointColumns,
    settings: Settings,
    judged: Mapping[str, Recording] | None = None,
    joints: Sequence[str] = (),
    name: str = "",
) -> JointFile:
    """Identify a joint and judge it.

    Args:
        kind: Name in `KINDS`.
        records: Records by file.
        columns: Their channels.
        settings: How.
        judged: Records for judging; where none came, the end of every record is held out.
        joints: Joints that it will act on; those in the name of the element where left out.
        name: Name of the element.

    Raises:
        IdentificationError: The records do not determine it.
        ParameterError: It is not said where the joint goes.
    """
    motions, chosen = joint_motions(list(records.values()), columns)
    k = len(chosen.displacement)
    places = tuple(joints) or _places(chosen.element, k)
    if len(places) != k:
        raise ParameterError(
            f"the records have {k} coordinate(s) of the joint ({', '.join(chosen.displacement)}); say with --joint on which joint(s) "
            f"of the model they act, {k} name(s){f' ({len(places)} came)' if places else ''}"
        )
    if kind not in KINDS:
        raise UnknownNameError("kind of joint model", kind, KINDS)
    masks = judging_samples(kind, motions, settings)
    training = motions if judged else without_masked(motions, masks)
    fitted = identify(kind, training, settings)
    results = {"identification": scores(fitted, training)}
    if judged:
        results["judging records"] = scores(fitted, joint_motions(list(judged.values()), chosen)[0])
    else:
        results["held out"] = scores(fitted, motions, masks)
    element = Element(
        fitted.law, places, fitted.theta, name=name or chosen.element or "joint", validity=fitted.range
    )
    source = {
        "records": list(records),
        "sha256": [record.content_hash for record in records.values()],
        "displacement": list(chosen.displacement),
        "velocity": list(chosen.velocity) or ["differences of the displacement"],
        "force": list(chosen.force) or [f"{', '.join(chosen.applied)} less mass times {', '.join(chosen.acceleration)}"],
    }  # fmt: skip
    return JointFile(kind, element, fitted.report, source, results)


def _places(element: str, k: int) -> tuple[str, ...]:
    """Joints in an element's own name: "axial+torsional.gap_coupling"."""
    joints, dot, _ = element.rpartition(".")
    found = tuple(joints.split("+")) if dot else ()
    return found if len(found) == k else ()
