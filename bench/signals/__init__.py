"""Excitations: frozen descriptions of signals, sampled at any rate.

::

    from bench.signals import BandLimitedNoise, Excitation, Multisine

    drive = Excitation(
        {
            "axial": BandLimitedNoise(cutoff=12.0, peak=1000.0),
            "torsion": Multisine(band=(0.5, 12.0), phases="optimised", peak=1000.0),
        },
        duration=30.0,
        sample_rate=1000.0,
    )
    u = drive.sample(np.random.default_rng(1))  # (30000, 2)

`SIGNALS` lists the classes by the name under which `to_dict`, campaign plans and `Signal.from_dict` know
them.
"""

from bench.signals.base import Scaled, Signal, Sum
from bench.signals.composition import Concatenation, Tapered, scaled
from bench.signals.elementary import Constant, Harmonic, ImpulseTrain, Ramp
from bench.signals.excitation import Excitation
from bench.signals.measures import crest_factor, energy, rms
from bench.signals.multisine import Multisine
from bench.signals.noise import PRBS, BandLimitedNoise
from bench.signals.record import Record
from bench.signals.streams import named_streams
from bench.signals.sweeps import Step, SteppedSine, Sweep

SIGNALS = Signal.registry()
"""Kinds of signals by name, as an excitation names them in a document."""

__all__ = [
    "PRBS",
    "SIGNALS",
    "BandLimitedNoise",
    "Concatenation",
    "Constant",
    "Excitation",
    "Harmonic",
    "ImpulseTrain",
    "Multisine",
    "Ramp",
    "Record",
    "Scaled",
    "Signal",
    "Step",
    "SteppedSine",
    "Sum",
    "Sweep",
    "Tapered",
    "crest_factor",
    "energy",
    "named_streams",
    "rms",
    "scaled",
]
