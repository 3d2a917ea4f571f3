"""Models: MJCF files and decks, whole and spoilt."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from fuzzing.mutations import flipped

MODEL = """<mujoco model="slide">
  <compiler autolimits="true"/>
  <option timestep="0.002" integrator="RK4"/>
  <include file="assets.xml"/>
  <worldbody>
    <body name="carriage">
      <joint name="x" type="slide" axis="1 0 0" stiffness="400" damping="4"/>
      <geom name="block" type="box" size=".05 .05 .05" mass="2"/>
      <site name="cell"/>
    </body>
  </worldbody>
  <actuator><motor name="shaker" joint="x"/></actuator>
  <sensor><jointpos name="lvdt" joint="x"/></sensor>
</mujoco>
"""

ODD_MJCF = (
    '<include file="model.xml"/>', '<include file="../x.xml"/>', '<include file="assets.xml"/>' * 200, '<include/>',
    '<replicate count="1000000000"><body/></replicate>', '<numeric name="a" size="1000000000"/>', "<worldbody>" * 600,
    '<size memory="1000000G"/>',
    '<size nuserdata="2000000000"/>', '<asset><hfield name="h" nrow="1000000" ncol="1000000" size="1 1 1 1"/></asset>',
    '<asset><mesh name="m" file="/dev/zero"/></asset>', "<!DOCTYPE a [<!ENTITY b 'c'>]>", '<geom size="nan nan nan"/>', "&x;",
    '<custom><numeric name="jointbench:gap" data="1 2 3"/></custom>', '<option timestep="0"/>', '<option timestep="nan"/>',
)  # fmt: skip


def make_mjcf(folder: Path) -> None:
    """A model, and a file that it includes."""
    (folder / "model.xml").write_text(MODEL)
    (folder / "assets.xml").write_text('<mujoco><asset><material name="steel"/></asset></mujoco>')


def spoil_mjcf(folder: Path, rng: np.random.Generator) -> None:
    """Change words and numbers of the model, or put something odd into it."""
    path = folder / ("model.xml" if rng.random() < 0.8 else "assets.xml")
    text = path.read_text()
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.integers(len(text)))
        if rng.random() < 0.5:
            lines = text.split("\n")
            lines.insert(int(rng.integers(len(lines))), str(rng.choice(ODD_MJCF)))
            text = "\n".join(lines)
        else:
            text = (
                text[:at]
                + str(rng.choice(["", "-", "9" * 30, "nan", '"', "<", "1e308", "x"]))
                + text[at + int(rng.integers(4)) :]
            )
    path.write_text(text)


def read_mjcf(folder: Path) -> None:
    """Build a rig of the user's own and run it for a while."""
    from bench.rig import Rig, simulate
    from bench.signals import Excitation, Harmonic

    rig = Rig.from_file(folder / "model.xml")
    model = rig.model
    if model.nv < 10 and rig.timestep > 1e-4 and "shaker" in rig.built.actuators:
        tone = Harmonic(frequency=3.0, amplitude=1.0)
        simulate(
            rig, Excitation({"shaker": tone}, duration=20.0 * rig.timestep, sample_rate=1.0 / rig.timestep)
        )


def make_deck(folder: Path) -> None:
    """A deck of the published network, in two files."""
    from bench.nastran.network_deck import network_text

    (folder / "deck.bdf").write_text("INCLUDE 'net.bdf'\n")
    (folder / "net.bdf").write_text(network_text(_weights(), components=(1,)))


def _weights() -> Any:
    from bench.laws.network import NetworkWeights

    rng = np.random.default_rng(0)
    return NetworkWeights(
        rng.normal(size=(3, 2)), rng.normal(size=3), rng.normal(size=(1, 3)), rng.normal(size=1)
    )


ODD_CARDS = (
    "SPOINT,1,THRU,99999999", "SPOINT,1,THRU,1", "INCLUDE 'deck.bdf'", "INCLUDE '../deck.bdf'", "INCLUDE ''", "+,1,2", "GRID,1",
    "TABLED1,1", "MPC,1", "DMIG,K,1,0,,1,0,1.+999", "NOLIN1,1,1,1,1.,1,1,1", "SPOINT," + "9" * 5000, "BEGIN BULK", "ENDDATA", "," * 500,
)  # fmt: skip


def spoil_deck(folder: Path, rng: np.random.Generator) -> None:
    """Change fields of the deck, or put odd cards into it."""
    path = folder / str(rng.choice(["deck.bdf", "net.bdf", "net.bdf", "net.bdf"]))
    lines = path.read_text().split("\n")
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.integers(len(lines)))
        if rng.random() < 0.4:
            lines.insert(at, str(rng.choice(ODD_CARDS)))
        else:
            k = int(rng.integers(max(len(lines[at]), 1)))
            lines[at] = (
                lines[at][:k]
                + str(rng.choice(["", " ", "-", "0", "9", ".", "E", "x", ",", "*", "+"]))
                + lines[at][k + 1 :]
            )
    path.write_bytes(
        flipped("\n".join(lines).encode(), rng) if rng.random() < 0.1 else "\n".join(lines).encode()
    )


def read_deck(folder: Path) -> None:
    """Read a network from a deck."""
    from bench.nastran import read_network

    with np.errstate(all="ignore"):
        read_network(folder / "deck.bdf")
