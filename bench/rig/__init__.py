"""A rig: an MJCF model with elements in it, and how it is driven, simulated and recorded.

A `Rig` is immutable; `rig.with_(elements=…)` swaps a joint, so that the true rig and its reduced-order twin differ in
one field. Simulations run in `mujoco.batch` over threads with native callbacks: nothing of Python runs inside a step.

Channels of a record, in this order: the command of each actuator under the actuator's name; each sensor of the MJCF
under the sensor's name (vectors as ``name_x``, ``name_y``, ``name_z``); for each element ``<element>/displacement``,
``…/velocity``, ``…/force`` (restoring force, with ``_1``, ``_2``, … where it acts on several coordinates) and
``…/<state>`` for its hidden states. All are taken at the same instants: the start of each sample.
"""

from bench.rig.description import Rig
from bench.rig.drives import Drive, controls_of
from bench.rig.element import Element, Validity
from bench.rig.simulation import simulate, simulate_batch

__all__ = ["Drive", "Element", "Rig", "Validity", "controls_of", "simulate", "simulate_batch"]
