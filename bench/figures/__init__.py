"""Figures of records, joints and diagnoses: matplotlib without state, a display or a call to pyplot.

Every function returns a `matplotlib.figure.Figure` with a quantity and a unit on each axis. The first record is the
reference: grey and broad; the others are drawn thin on top in the colours of Okabe & Ito, which every colour vision
tells apart, and in differing dashes, which a grey print does. `save` writes a file whole or not at all; `as_svg` and
`as_png_data_uri` embed a figure in a page.
"""

from bench.figures.diagnosis import bar_table, contributions, waterfall
from bench.figures.histories import (
    element_loops,
    error_histories,
    loops,
    phase_plot,
    spectrum,
    time_histories,
)
from bench.figures.look import COLOURS, as_png_data_uri, as_svg, save, style
from bench.figures.surfaces import residual_map, surface

__all__ = [
    "COLOURS",
    "as_png_data_uri",
    "as_svg",
    "bar_table",
    "contributions",
    "element_loops",
    "error_histories",
    "loops",
    "phase_plot",
    "residual_map",
    "save",
    "spectrum",
    "style",
    "surface",
    "time_histories",
    "waterfall",
]
