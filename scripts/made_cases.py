"""Cases that scripts make, each a capability of its own."""

from __future__ import annotations

MADE = (
    (
        "laboratory_like", "Devices, sensors and structures that no law of the bench describes, graded likewise", "lab_",
        "laboratory-like", "",
    ),
    (
        "second_laboratory", "Cases of a second author, who knew nothing of the diagnosis: structures, mechanisms and components",
        "second_", "second-laboratory", "",
    ),
    (
        "second_robots", "Cases of a second author, who knew nothing of the diagnosis: robots", "ptz vee scar hop dsk gan",
        "second-robots/cases", " out/second-robots/answers",
    ),
)  # fmt: skip
"""Cases made by a script of the name: its capability, title, beginnings of their names, folder, what follows it."""
