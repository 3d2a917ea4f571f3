"""The arm of examples/arm, measured as a ghost over simulated, before and after: docs/pictures/arm.webp.

    python scripts/moving_picture.py                 diagnoses the example, applies what was found, draws
    python scripts/moving_picture.py --work out/arm  keeps case, verdict and corrected model there, and goes on from them

Needs EGL; set `MUJOCO_GL` to choose another way.
"""

from __future__ import annotations

import io
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "egl")

import mujoco
import numpy as np
import tyro
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from bench.figures.look import COLOURS, REFERENCE_COLOUR, style

ROOT = Path(__file__).resolve().parent.parent
JOINTS = ("shoulder", "elbow", "wrist")
SIZE = (420, 380)
FRAMES, SECONDS = 72, 6.0


@dataclass(frozen=True)
class Args:
    """Draw the arm before and after.

    Attributes:
        work: Folder for case, verdict and corrected model.
        out: The picture.
    """

    work: Path = Path("out/arm")
    out: Path = ROOT / "docs" / "pictures" / "arm.webp"


def prepare(work: Path) -> None:
    """Measure, diagnose, apply: what is there already is kept."""
    command = [sys.executable, "-m", "bench.cli"]
    if not (work / "case").is_dir():
        subprocess.run([sys.executable, ROOT / "examples/arm/measure.py", work / "case"], check=True)
    if not (work / "verdict.json").is_file():
        subprocess.run([*command, "diagnose", work / "case", "--json", work / "verdict.json"], check=True)
    if not (work / "corrected.xml").is_file():
        applied = ["apply", work / "verdict.json", "--model", work / "case/arm.xml", "--case", work / "case"]
        subprocess.run([*command, *applied, "-o", work / "corrected.xml"], check=True)


def replay(model: mujoco.MjModel, table: NDArray) -> NDArray[np.float64]:
    """Angles (n, 3) [rad] of a model that is given the logged targets, held between samples."""
    data = mujoco.MjData(model)
    angles = np.zeros((len(table), len(JOINTS)))
    steps = round(float(table["time"][1]) / model.opt.timestep)
    for k in range(len(table)):
        angles[k] = data.qpos
        data.ctrl[:] = [table[f"{joint}_goal"][k] for joint in JOINTS]
        mujoco.mj_step(model, data, nstep=steps)
    return angles


class Ghost:
    """A renderer of one arm with the measured one as a ghost over it."""

    def __init__(self, path: Path) -> None:
        self.model = mujoco.MjModel.from_xml_path(str(path))
        self.data, self.measured = mujoco.MjData(self.model), mujoco.MjData(self.model)
        self.renderer = mujoco.Renderer(self.model, SIZE[1], SIZE[0])
        self.camera = mujoco.MjvCamera()
        self.camera.lookat[:] = (0.05, 0.0, 0.27)
        self.camera.distance, self.camera.azimuth, self.camera.elevation = 1.15, 90.0, -8.0

    def draw(self, simulated: NDArray, measured: NDArray) -> Image.Image:
        """One frame; the ghost is half transparent and light."""
        self.data.qpos[:], self.measured.qpos[:] = simulated, measured
        for data in (self.data, self.measured):
            mujoco.mj_kinematics(self.model, data)
        self.renderer.update_scene(self.data, self.camera)
        scene = self.renderer.scene
        first = scene.ngeom
        mujoco.mjv_addGeoms(
            self.model,
            self.measured,
            mujoco.MjvOption(),
            mujoco.MjvPerturb(),
            mujoco.mjtCatBit.mjCAT_DYNAMIC,
            scene,
        )
        for k in range(first, scene.ngeom):
            scene.geoms[k].rgba[:] = (0.1, 0.1, 0.1, 0.45)
        return Image.fromarray(self.renderer.render())


def curves(errors: dict[str, NDArray], time: NDArray, now: float) -> Image.Image:
    """The error of the elbow over time, with a mark at the frame."""
    with style():
        figure = Figure(figsize=(2 * SIZE[0] / 100, 1.6), dpi=100, layout="constrained")
        axes = figure.subplots()
        for colour, (name, error) in zip(COLOURS, errors.items(), strict=False):
            axes.plot(time, 1e3 * error, color=colour, label=name)
        axes.axvline(now, color=REFERENCE_COLOUR, linewidth=1.0)
        axes.set(xlabel="time [s]", ylabel="error of the\nelbow [mrad]", xlim=(0.0, SECONDS), ylim=(-32.0, 48.0))
        axes.legend(loc="upper right", ncols=2)
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", dpi=100)
    return Image.open(buffer).convert("RGB")


def main(args: Args) -> None:
    """Draw the picture."""
    args.work.mkdir(parents=True, exist_ok=True)
    prepare(args.work)
    table = np.genfromtxt(args.work / "case" / "validation.csv", delimiter=",", names=True)
    measured = np.column_stack([table[f"{joint}_angle"] for joint in JOINTS])
    paths = {"before": args.work / "case" / "arm.xml", "after": args.work / "corrected.xml"}
    ghosts = {name: Ghost(path) for name, path in paths.items()}
    runs = {name: replay(ghost.model, table) for name, ghost in ghosts.items()}
    shown = table["time"] <= SECONDS
    errors = {name: (run - measured)[shown, 1] for name, run in runs.items()}
    frames = []
    for now in np.linspace(0.0, SECONDS, FRAMES, endpoint=False):
        k = int(np.searchsorted(table["time"], now))
        below = curves(errors, table["time"][shown], now)
        frame = Image.new("RGB", (2 * SIZE[0], SIZE[1] + below.height), "white")
        for column, (name, ghost) in enumerate(ghosts.items()):
            frame.paste(ghost.draw(runs[name][k], measured[k]), (column * SIZE[0], 0))
            text = {"before": "nominal model", "after": "with what was found"}[name]
            ImageDraw.Draw(frame).text((column * SIZE[0] + 12, 10), text, fill="black", font_size=20)
        frame.paste(below, (0, SIZE[1]))
        frames.append(frame)
    args.out.parent.mkdir(parents=True, exist_ok=True)
    frames[0].save(
        args.out,
        save_all=True,
        append_images=frames[1:],
        duration=round(1e3 * SECONDS / FRAMES),
        loop=0,
        quality=60,
    )
    rms = {name: 1e3 * float(np.sqrt(np.mean(error**2))) for name, error in errors.items()}
    print(
        f"{args.out}: {args.out.stat().st_size / 1e3:.0f} kB; elbow rms {rms['before']:.1f} mrad before, {rms['after']:.1f} after"
    )
    frames[len(frames) // 2].save(args.work / "frame.png")


if __name__ == "__main__":
    main(tyro.cli(Args))
