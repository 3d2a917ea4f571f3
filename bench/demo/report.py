"""What the demo leaves behind: tables for the terminal, a page, a rerun recording and the records themselves."""

from __future__ import annotations

from pathlib import Path

from rich.table import Table

from bench.demo import DemoResult
from bench.demo.damper import DamperTest
from bench.demo.joint import DemoJoint, ShowProgress
from bench.discrepancy import write_report, write_rerun
from bench.discrepancy.report.figures import state_figure
from bench.figures import bar_table, loops, time_histories
from bench.files import together
from bench.page import Page
from bench.record_files import write_recording
from bench.recording import Recording
from bench.rerun_log import log_comparison
from bench.rig.library import joint_rig


def demo_summary(result: DemoResult) -> list[Table]:
    """The figures as tables for the terminal."""
    damper = Table(title="Friction damper, real: force NRMSE at 1 Hz, identified at 0.5 Hz")
    models = list(result.damper[0].nrmse)
    for column in ("band tension", *models):
        damper.add_column(column)
    for test in result.damper:
        damper.add_row(f"{test.tension} lbf", *(f"{test.nrmse[model]:.3f}" for model in models))
    joint = Table(title="Joint rig: force NMSE on unseen excitation, joint swapped in (closed loop)")
    for column in ("reduced-order joint", "axial", "torsional", "on true states", "fitting"):
        joint.add_column(column)
    for row in _joint_rows(result):
        joint.add_row(*row)
    return [damper, joint, _diagnosis_table(result)]


def _diagnosis_table(result: DemoResult) -> Table:
    verdict = result.diagnosis.verdict
    table = Table(title="Diagnosis of the real damper against Coulomb friction alone: force NRMSE at 1 Hz")
    for column in ("missing from the model", "before", "parameters only", "after", "probability"):
        table.add_column(column)
    gap = verdict.gap
    figures = [f"{x:.3f}" for x in (gap.before, gap.parameters_only, gap.after)]
    name = " + ".join(effect.name for effect in verdict.named) or verdict.verdict
    table.add_row(name, *figures, f"{verdict.probabilities[verdict.verdict]:.2f}")
    return table


def _joint_rows(result: DemoResult) -> list[list[str]]:
    rows = []
    for model in result.joint:
        closed = (
            ["diverged", "diverged"] if model.force_nmse is None else [f"{x:.3f} %" for x in model.force_nmse]
        )
        open_loop = " / ".join(f"{x:.3f} %" for x in model.open_loop_nmse)
        rows.append(
            [model.label, *closed, open_loop, f"{model.seconds:.1f} s" if model.seconds else "published"]
        )
    return rows


def write(result: DemoResult, folder: Path, progress: ShowProgress) -> list[Path]:
    """Write index.html, joint.rrd, diagnosis.html, diagnosis.rrd and the records; returns the files, the page first.

    Args:
        result: The demo's result.
        folder: Folder to write into; made where it is missing.
        progress: Called with what is being done.

    Raises:
        OutputError: The folder cannot be written to.
    """
    page, viewer = folder / "index.html", folder / "joint.rrd"
    told = [folder / "diagnosis.html", folder / "diagnosis.rrd"]
    with together():
        progress("writing the page", 1.0)
        _page(result).write(page)
        progress("writing the rerun recording", 1.0)
        log_joint(result, viewer)
        progress("writing the diagnosis", 1.0)
        write_report(result.diagnosis, told[0])
        write_rerun(result.diagnosis, told[1])
        progress("writing the records", 1.0)
        records = _write_records(result, folder / "records")
    return [page, viewer, *told, *records]


def _converged(result: DemoResult) -> list[DemoJoint]:
    return [model for model in result.joint if model.comparison is not None]


def best_of_each_kind(result: DemoResult) -> list[DemoJoint]:
    """The best model of each kind that did not diverge: kinds are the words before the brackets ("network", "polynomial")."""
    best: dict[str, DemoJoint] = {}
    for model in sorted(_converged(result), key=lambda model: sum(model.force_nmse or (0.0, 0.0))):
        best.setdefault(model.label.partition(" (")[0].split()[-1], model)
    return list(best.values())


def log_joint(result: DemoResult, path: Path) -> None:
    """The rig moving in 3-D with the true joint and with the best model of each kind side by side, and every channel."""
    rig = joint_rig()
    rigs, records = {"true": rig}, {"true": result.unseen}
    for model in best_of_each_kind(result):
        assert model.comparison is not None
        rigs[model.label] = rig.with_element(model.element)
        records[model.label] = model.comparison.reduced
    log_comparison(path, rigs, records, title="jointbench demo: true and reduced-order joints")


def _write_records(result: DemoResult, folder: Path) -> list[Path]:
    records = {
        f"training_{name}": r for name, r in zip(("axial", "torsional", "both"), result.training, strict=True)
    }
    records |= {"unseen_true": result.unseen}
    for model in _converged(result):
        assert model.comparison is not None
        records["unseen_" + model.label.replace(" ", "_").replace("(", "").replace(")", "")] = (
            model.comparison.reduced
        )
    paths = []
    for name, record in records.items():
        paths.append(folder / f"{name}.parquet")
        write_recording(paths[-1], record)
    return paths


def _page(result: DemoResult) -> Page:
    page = Page(
        "jointbench demo",
        lead="Two joints are identified from records, each model takes the true joint's place in a MuJoCo rig, and both are "
        "compared on a test that the identification never saw.",
        footer="Made by `jointbench demo`. Friction-damper data: ARTS-Laboratory, Dataset-Friction-Damper-with-Backlash, "
        "CC BY-SA 4.0, excerpt.",
    )
    _damper_section(page, result.damper)
    _joint_section(page, result)
    _diagnosis_section(page, result)
    return page


def _diagnosis_section(page: Page, result: DemoResult) -> None:
    verdict = result.diagnosis.verdict
    section = page.section("What a Coulomb model of the damper lacks")
    section.text(
        "The other way round: the nominal model of the damper knows Coulomb friction only, and the diagnosis says from the 0.5 Hz test "
        "what is missing and how far the gap shrinks at 1 Hz. The whole of it is in diagnosis.html and diagnosis.rrd beside this page."
    )
    section.text(verdict.explanation)
    section.table(
        "Force NRMSE at 1 Hz",
        ("stage", "NRMSE"),
        [(label, f"{value:.3f}") for label, value in verdict.gap.steps],
    )
    for found in result.diagnosis.where.maps:
        section.figure(
            state_figure(found), "Force that the Coulomb model lacks, over the states of the 0.5 Hz test."
        )


def _damper_section(page: Page, tests: tuple[DamperTest, ...]) -> None:
    section = page.section("A real friction damper with backlash")
    section.text(
        "Identified on the 0.5 Hz test of each band tension, predicted at 1 Hz from the measured displacement alone. The "
        "parametric model is a friction slider behind a spring with backlash: it remembers where it slipped. Polynomial and "
        "network see displacement and velocity only and cannot."
    )
    models = list(tests[0].nrmse)
    rows = [[f"{t.tension} lbf", *(f"{t.nrmse[m]:.3f}" for m in models)] for t in tests]
    section.table(
        "NRMSE of the force on the unseen test: rms(error) / std(measured)", ["band tension", *models], rows
    )
    far = ", ".join(
        f"{model} {100.0 * max(t.outside[model] for t in tests):.0f} %"
        for model in models
        if tests[0].outside[model]
    )
    section.text(
        f"At twice the frequency the velocities leave the range of the training test: {far} of the samples."
    )
    test = tests[-1]
    records = {"measured": test.measured.select(("displacement", "force"))}
    for model, record in test.simulated.items():
        aligned = {"displacement": test.measured["displacement"], "force": record["damper/force"]}
        records[model] = Recording.from_arrays(
            test.measured.time, aligned, units={"displacement": "m", "force": "N"}
        )
    window = (1.0, 4.0)
    section.figure(
        loops(
            {name: records[name] for name in ("measured", "parametric")},
            [("displacement", "force")],
            window=window,
        ),
        f"Hysteresis loop at {test.tension} lbf, unseen 1 Hz test: measured, and the parametric model in the damper rig.",
    )
    lost = [model for model in models if test.nrmse[model] > 2.0]
    shown = {name: record for name, record in records.items() if name not in lost}
    left_out = f" Left out, far off the scale: {', '.join(lost)}." if lost else ""
    section.figure(
        time_histories(shown, ["force"], window=window),
        f"Force over time, {test.tension} lbf, unseen 1 Hz test.{left_out}",
    )


def _joint_section(page: Page, result: DemoResult) -> None:
    section = page.section("The dissertation's axial-torsional joint")
    section.text(
        "Three training records (axial, torsional, both; ±1000 lbf and lbf in, flat to 12 Hz, 30 s). The joint's forces are "
        "recovered from loads, accelerations and the known mounts. The unseen test has another random seed. Closed loop: the "
        "rig runs with the model in the joint's place; on true states: the model is fed the true motion."
    )
    header = ["reduced-order joint", "axial force", "torque", "on true states", "fitting"]
    section.table("NMSE of the restoring forces on the unseen test", header, _joint_rows(result))
    for model in result.joint:
        if model.note:
            section.text(f"{model.label}: {model.note}")
    records = {"true": result.unseen}
    scores: dict[str, dict[str, float]] = {}
    channels = ("axial", "torsional", "joint/force_1", "joint/force_2")
    for model in _converged(result):
        assert model.comparison is not None
        records[model.label] = model.comparison.reduced
        scores[model.label] = {channel: model.comparison.nmse[channel] for channel in channels}
    section.figure(
        bar_table(scores), "NMSE of displacement, rotation and both forces, closed loop, unseen test."
    )
    window = (10.0, 12.0)
    section.figure(time_histories(records, channels, window=window), "Two seconds of the unseen test.")
    pairs = [("axial", "joint/force_1"), ("torsional", "joint/force_2")]
    section.figure(
        loops(records, pairs, window=window),
        "Restoring forces over relative motion: the gaps of 0.2 in and 0.2 rad.",
    )
