"""Measurement and actuation chains: what lies between a physical quantity and the numbers in a file.

One order (`order`), one file a stage:

====  ============  =======================================================
 1    AntiAlias     Butterworth low-pass
 2    Delay         whole or broken numbers of samples
 3    Lag           first order
 4    Gain          factor
 5    Bias          constant
 6    Drift         steady and wandering offset
 7    Noise         white, Gaussian
 8    Quantisation  rounding
 9    Clipping      saturation
====  ============  =======================================================

`measure` applies a chain to each channel of a recording, after cross-talk between channels.
"""

from bench.measurement.anti_alias import AntiAlias
from bench.measurement.base import Stage
from bench.measurement.bias import Bias
from bench.measurement.chain import ORDER, Chain, ChainState
from bench.measurement.clipping import Clipping
from bench.measurement.delay import Delay
from bench.measurement.drift import Drift
from bench.measurement.gain import Gain
from bench.measurement.lag import Lag
from bench.measurement.noise import Noise
from bench.measurement.quantisation import Quantisation
from bench.measurement.sensors import measure

STAGES = Stage.registry()
"""Kinds of stages by name, as a measurement chain names them in a document."""

__all__ = [
    "ORDER",
    "STAGES",
    "AntiAlias",
    "Bias",
    "Chain",
    "ChainState",
    "Clipping",
    "Delay",
    "Drift",
    "Gain",
    "Lag",
    "Noise",
    "Quantisation",
    "Stage",
    "measure",
]
