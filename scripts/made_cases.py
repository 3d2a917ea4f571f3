"""Cases that scripts make, each a capability of its own."""

from __future__ import annotations

GRADED = "python scripts/measured_cases.py {} --cases out/{} --json"
"""Command that diagnoses and grades cases, by the beginnings of their names and their folder."""
MADE = {
    "laboratory_like": (
        "Devices, sensors and structures that no law of the bench describes, graded likewise",
        GRADED.format("lab_", "laboratory-like"),
        "python scripts/laboratory_like.py out/laboratory-like",
    ),
    "second_laboratory": (
        "Cases of a second author, who knew nothing of the diagnosis: structures, mechanisms and components",
        GRADED.format("second_", "second-laboratory"),
        "python scripts/second_laboratory.py out/second-laboratory",
    ),
    "third_laboratory": (
        "Cases of a third author, who knew nothing of the diagnosis: two-load joints, scheduled laws, faulty loggers",
        GRADED.format("third_", "third-laboratory"),
        "python scripts/third_laboratory.py out/third-laboratory",
    ),
    "fourth_laboratory": (
        "Cases of a fourth author, who knew nothing of the diagnosis: joints, guides, mounts, a damper, gears",
        GRADED.format("fourth_", "fourth-laboratory"),
        "python scripts/fourth_laboratory.py out/fourth-laboratory",
    ),
    "fifth_laboratory": (
        "Cases of a fifth author, who knew nothing of the diagnosis: drives, struts, mounts, shafts, a pendulum, a beam",
        GRADED.format("fifth_", "fifth-laboratory"),
        "python scripts/fifth_laboratory.py out/fifth-laboratory",
    ),
    "sixth_laboratory": (
        "Cases of a sixth author, who knew nothing of the diagnosis: isolators, frames, a stage, a rotor, dampers",
        GRADED.format("sixth_", "sixth-laboratory"),
        "python scripts/sixth_laboratory.py out/sixth-laboratory",
    ),
    "second_robots": (
        "Cases of a second author, who knew nothing of the diagnosis: robots",
        GRADED.format("ptz vee scar hop dsk gan", "second-robots/cases"),
        "python scripts/second_robots.py out/second-robots/cases out/second-robots/answers",
    ),
    "third_robots": (
        "Cases of a third author, who knew nothing of the diagnosis: robots",
        GRADED.format("boom gantry hung pal slide", "third-robots/cases"),
        "python scripts/third_robots.py out/third-robots/cases out/third-robots/answers",
    ),
    "fourth_robots": (
        "Cases of a fourth author, who knew nothing of the diagnosis: robots",
        GRADED.format("finger crane wrist balanced stage ankle", "fourth-robots/cases"),
        "python scripts/fourth_robots.py out/fourth-robots/cases out/fourth-robots/answers",
    ),
    "fifth_robots": (
        "Cases of a fifth author, who knew nothing of the diagnosis: robots",
        GRADED.format("fifth_", "fifth-robots/cases"),
        "python scripts/fifth_robots.py out/fifth-robots/cases out/fifth-robots/answers",
    ),
    "sixth_robots": (
        "Cases of a sixth author, who knew nothing of the diagnosis: robots",
        GRADED.format("sixth_", "sixth-robots/cases"),
        "python scripts/sixth_robots.py out/sixth-robots/cases out/sixth-robots/answers",
    ),
}
"""By name: title of the capability, its command, and the command that makes its cases."""
