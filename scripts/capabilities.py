"""What the bench can do, each shown by one command, with the limits that its figures keep."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from capability_figures import (
    Figures,
    backgrounds,
    benchmark,
    bouc_wen,
    demo,
    excitation,
    kills,
    memory_joint,
    monitoring,
    reproduction,
    rewards,
    training,
    training_plans,
)
from diagnosis_figures import (
    applied,
    arms,
    background,
    formats,
    graded,
    localisation,
    measured,
    native_effects,
    pendulum,
    planted,
    real_formats,
    sealed,
    ten_minutes,
)
from made_cases import MADE
from robot_figures import robots


@dataclass(frozen=True)
class Capability:
    """Something the bench can do, shown by one command."""

    name: str
    title: str
    command: tuple[str, ...]
    figures: Callable[[Any], Figures] = field(repr=False)
    data: str = ""  # folder of measured records that it needs and that is not shipped
    before: tuple[tuple[str, ...], ...] = ()  # commands that make what the command reads
    hours: bool = False  # run only where it is named

    def shown(self) -> str:
        """The commands as a person types them."""
        commands = (*self.before, self.command)
        return " && ".join(" ".join(command) for command in commands).replace("{data}", "FOLDER")


def words(command: str) -> tuple[str, ...]:
    """A command's words, none of which holds a space."""
    return tuple(command.split())


def _excitation_task(task: str, title: str) -> Capability:
    command = ("python", "scripts/evaluate_excitation.py", task, "--json", "-")
    return Capability(f"excitation_{task}", title, command, excitation, hours=True)


def _benchmark_group(name: str, title: str) -> Capability:
    return Capability(name, title, ("python", "scripts/benchmark.py", name, "--json"), benchmark)


SEALED_SEED = "20261208"
"""Of the sealed cases that are published: a new one for every set, so that nobody has looked at its cases before."""
CAPABILITIES: Sequence[Capability] = (
    Capability("demo", "The main job", words("jointbench demo --json"), demo),
    _benchmark_group("native", "Native callbacks"),
    Capability(
        "reproduce",
        "The dissertation ([reproduction.md](reproduction.md) has sources and reasons, [gallery.md](gallery.md) the figures)",
        words("python scripts/make_gallery.py --fresh --json"),
        reproduction,
    ),
    Capability(
        "monitoring",
        "A damper watched in service",
        words("python scripts/monitor_damper.py --json"),
        monitoring,
    ),
    _benchmark_group("stream", "Least squares on line, against padasip"),
    _benchmark_group("accuracy", "Equal error: the joint rig against SciPy's integrators"),
    _benchmark_group("identify", "Identification against torch, scikit-learn and mujoco.sysid"),
    _benchmark_group("envs", "Vector environments against gymnasium's own"),
    Capability(
        "trials",
        "Diagnosis of the development trials, made by integrators of others",
        words("jointbench blind score out/trials {data}/../trials/answers --json"),
        sealed,
        before=(words("jointbench blind run {data}/../trials out/trials --again"),),
        data="../trials",
    ),
    Capability(
        "sealed",
        "Diagnosis of own sealed cases ([blind_results.md](blind_results.md) has the bands)",
        words(f"python scripts/sealed_cases.py --n 300 --struck 0 --seed {SEALED_SEED} --json"),
        lambda told: sealed(told["score"]),
        hours=True,
    ),
    Capability(
        "background",
        "Diagnosis of cases of others whose truth holds a background besides",
        words(
            "python scripts/background_cases.py {data}/../trials-background {data}/../trials-background/answers --json"
        ),
        background,
        data="../trials-background",
    ),
    Capability(
        "sealed_background",
        "Diagnosis of own sealed cases whose truth holds a background besides",
        words("jointbench blind score out/sealed-background/results out/sealed-background/answers --json"),
        lambda told: background(told["background"]),
        before=(
            words(
                "jointbench blind make out/sealed-background/cases out/sealed-background/answers --n 60 "
                f"--seed {SEALED_SEED} --background --no-detectability --workers 2"
            ),
            words(
                "jointbench blind run out/sealed-background/cases out/sealed-background/results --workers 2 --again"
            ),
        ),
        hours=True,
    ),
    Capability(
        "arms",
        "Diagnosis of arms, legs and servos of others",
        words("jointbench blind score out/arms {data}/../trials-arms/answers --json"),
        arms,
        before=(words("jointbench blind run {data}/../trials-arms out/arms --again"),),
        data="../trials-arms",
        hours=True,
    ),
    Capability(
        "robots",
        "Public records of robots, diagnosed against their public models",
        words("python scripts/robots.py --data {data}/robots --json"),
        robots,
        data="robots",
        hours=True,
    ),
    Capability(
        "native_effects",
        "Effects that MJCF has attributes for: put in, diagnosed, applied",
        words("python scripts/native_effects.py --json"),
        native_effects,
    ),
    Capability(
        "ten_minutes",
        "From a log to a corrected model",
        words("python scripts/ten_minutes.py --robots {data}/robots --json"),
        ten_minutes,
        data="robots",
    ),
    Capability(
        "applied",
        "Verdicts of the development trials, applied in plain MuJoCo",
        words("python scripts/applied.py {data}/../trials out/applied --again --json"),
        applied,
        data="../trials",
        hours=True,
    ),
    Capability(
        "applied_arms",
        "Verdicts of arms, legs and desks of others, applied in plain MuJoCo",
        words(
            "python scripts/applied.py {data}/../trials-arms out/applied-arms --only arm2 leg3 desk5 --verdicts out/arms --again --json"
        ),
        applied,
        before=(words("jointbench blind run {data}/../trials-arms out/arms"),),
        data="../trials-arms",
        hours=True,
    ),
    Capability(
        "localisation",
        "Where the missing force lies",
        words("python scripts/localisation.py --json"),
        localisation,
    ),
    Capability(
        "pendulum",
        "Diagnosis of a pendulum that swings far, gravity read off its MJCF",
        words("python scripts/pendulum.py --json"),
        pendulum,
    ),
    Capability(
        "measured",
        "Diagnosis of measured records, the effect never named",
        words("python scripts/diagnose_measured.py --data {data} --json"),
        measured,
        data=".",
    ),
    Capability(
        "measured_cases",
        "Measured records, graded by what was written down before",
        words("python scripts/measured_cases.py --data {data} --json"),
        graded,
        data=".",
    ),
    *(
        Capability(name, title, words(command), graded, before=(words(making),))
        for name, (title, command, making) in MADE.items()
    ),
    Capability(
        "check",
        "Faults planted into records of a slide, and what `jointbench check` says",
        words("python scripts/planted_faults.py --faults 200 --sound 100"),
        planted,
    ),
    Capability(
        "check_arm",
        "The same, planted into logs of an arm",
        words("python scripts/planted_faults.py --machine arm --faults 80 --sound 40"),
        planted,
    ),
    Capability(
        "formats",
        "The same case from records in other formats",
        words("python scripts/same_formats.py out/formats --json"),
        formats,
        before=(words("python examples/mismatch/measure.py out/formats"),),
    ),
    Capability(
        "real_formats",
        "Files of laboratories and robots in eight formats, against the same as CSV",
        words("python scripts/real_formats.py --data {data} --json"),
        real_formats,
        data=".",
    ),
    Capability(
        "unstated",
        "The same where nothing is said of the acquisition",
        words("python scripts/diagnose_measured.py --data {data} bouc_wen silverbox --unstated --json"),
        measured,
        data=".",
    ),
    _benchmark_group("diagnosis", "Diagnosis against mujoco.sysid and pysindy, side by side"),
    Capability(
        "peers",
        "The same on the development trials of one degree of freedom",
        words("python scripts/benchmark.py diagnosis --data {data}/../trials --work out/peers --json"),
        benchmark,
        data="../trials",
        hours=True,
    ),
    Capability(
        "peers_joint",
        "The same on the development trials of the joint, mujoco.sysid given ten times the diagnosis's time",
        words(
            "python scripts/benchmark.py diagnosis --data {data}/../trials --rig joint --work out/peers_joint --json"
        ),
        benchmark,
        data="../trials",
        hours=True,
    ),
    Capability(
        "peers_arms",
        "mujoco.sysid on ten arms of others, given the diagnosis's time",
        words("python scripts/benchmark.py arms --data {data}/../trials-arms --json"),
        benchmark,
        data="../trials-arms",
    ),
    Capability(
        "peers_so101",
        "mujoco.sysid on the public record of the SO-101, given the diagnosis's time",
        words("python scripts/benchmark.py arms --data {data}/robots --json"),
        benchmark,
        data="robots",
    ),
    _excitation_task(
        "sdof", "Excitation on the SDOF rig: trained policy and planners against the baselines, held-out rigs"
    ),
    _excitation_task(
        "joint", "Excitation of the joint with two loads: trained policy against the baselines, held-out rigs"
    ),
    _excitation_task("rivals", "Excitation that tells rivals apart: trained policy against the baselines"),
    _benchmark_group("decisions", "What a decision takes while a test runs"),
    Capability(
        "backgrounds_sdof",
        "Policy `sdof` on rigs with a background that no hypothesis holds",
        words("python scripts/policy_experiment.py backgrounds sdof --json -"),
        backgrounds,
        hours=True,
    ),
    Capability(
        "rewards",
        "Which reward of an excitation follows identification",
        words("python scripts/policy_experiment.py rewards sdof --seed 2006 --json -"),
        rewards,
    ),
    _benchmark_group("campaign", "Campaigns"),
    Capability(
        "kills",
        "Campaigns killed and resumed",
        words("python scripts/killed_campaigns.py --kills 200 --json"),
        kills,
        hours=True,
    ),
    Capability(
        "training_sdof",
        "Training from scratch of the policy `sdof`",
        words("python scripts/train_plans.py sdof --fresh --json"),
        training_plans,
        hours=True,
    ),
    Capability(
        "training_joint",
        "Training from scratch of the policy `joint`",
        words("python scripts/train_plans.py joint --decisions 0.2 0.4 0.6 --rigs 6000 --fresh --json"),
        training_plans,
        hours=True,
    ),
    Capability(
        "training_rivals",
        "Training from scratch of the policy `rivals`",
        words(
            "python scripts/train_excitation.py rivals --memory 64 --steps 9000000 --n-envs 96 --discount 0.98 --fresh --json"
        ),
        training,
        hours=True,
    ),
    Capability(
        "memory_joint",
        "The joint with memory against its rivals ([memory-joint.md](memory-joint.md))",
        words("python scripts/memory_joint.py --data {data} --fresh --json"),
        memory_joint,
        data="bouc_wen_benchmark",
    ),
    Capability(
        "bouc_wen",
        "Published Bouc-Wen benchmark, its own parameters",
        words("python scripts/bouc_wen_benchmark.py {data}/bouc_wen_benchmark --json"),
        bouc_wen,
        data="bouc_wen_benchmark",
    ),
)
