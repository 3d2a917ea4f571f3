"""A flow chart in Mermaid's notation drawn as SVG: boxes in layers, every arrow pointing down.

Only what the architecture page writes is read: ``flowchart TD`` and lines ``a --> b``. GitHub draws the same text itself.
"""

from __future__ import annotations

import itertools
import re
from html import escape

from grandalf.graphs import Edge, Graph, Vertex
from grandalf.layouts import SugiyamaLayout
from grandalf.routing import EdgeViewer, route_with_lines

HEIGHT, LETTER, PADDING, MARGIN = 28, 7.3, 18, 8
"""Height of a box, width of a letter at 12 px, what a box is wider than its name, and the edge of the picture [px]."""
ARROW = re.compile(r"(\w+) --> (\w+)")


class _Box:
    """What the layout asks of a vertex: its size; it sets the centre."""

    def __init__(self, name: str) -> None:
        self.w, self.h = len(name) * LETTER + PADDING, HEIGHT
        self.xy = (0.0, 0.0)


def arrows(text: str) -> list[tuple[str, str]]:
    """The arrows of a flow chart, from and to.

    Raises:
        ValueError: A line is no arrow.
    """
    first, *lines = [line.strip() for line in text.strip().splitlines() if line.strip()]
    found = [ARROW.fullmatch(line) for line in lines]
    if first != "flowchart TD" or None in found:
        raise ValueError("a flow chart is 'flowchart TD' and lines 'a --> b'")
    return [(match[1], match[2]) for match in found if match]


def layout(pairs: list[tuple[str, str]]) -> tuple[dict[str, _Box], list[list[tuple[float, float]]]]:
    """Boxes by name, and the corners of every arrow in the order given.

    Sugiyama's method: layers by the longest way from the top, crossings reduced by sweeps, long arrows led round the boxes.
    """
    vertices = {name: Vertex(name) for name in dict.fromkeys(name for pair in pairs for name in pair)}
    for name, vertex in vertices.items():
        vertex.view = _Box(name)
    edges = [Edge(vertices[tail], vertices[head]) for tail, head in pairs]
    for edge in edges:
        edge.view = EdgeViewer()
    [part] = Graph(list(vertices.values()), edges).C
    sugiyama = SugiyamaLayout(part)
    sugiyama.xspace, sugiyama.yspace = 8, 24
    sugiyama.route_edge = route_with_lines
    heads = {head for _, head in pairs}
    sugiyama.init_all(roots=[vertex for name, vertex in vertices.items() if name not in heads])
    sugiyama.draw(4)
    return {name: vertex.view for name, vertex in vertices.items()}, [edge.view._pts for edge in edges]


def _path(corners: list[tuple[float, float]]) -> str:
    """A line through the corners, rounded at each."""
    text = f"M{corners[0][0]:.1f} {corners[0][1]:.1f}"
    for corner, after in itertools.pairwise(corners[1:]):
        middle = ((corner[0] + after[0]) / 2.0, (corner[1] + after[1]) / 2.0)
        text += f" Q{corner[0]:.1f} {corner[1]:.1f} {middle[0]:.1f} {middle[1]:.1f}"
    return text + f" L{corners[-1][0]:.1f} {corners[-1][1]:.1f}"


def svg(text: str) -> str:
    """The picture of a flow chart, in the colours of the page (`site.css`).

    Raises:
        ValueError: The text is no flow chart that is read here.
    """
    boxes, lines = layout(arrows(text))
    sides = [box.xy[0] + side * box.w / 2 for box in boxes.values() for side in (-1, 1)]
    sides += [x for corners in lines for x, _ in corners]
    left, right = min(sides) - MARGIN, max(sides) + MARGIN
    top = min(box.xy[1] for box in boxes.values()) - HEIGHT / 2 - MARGIN
    bottom = max(box.xy[1] for box in boxes.values()) + HEIGHT / 2 + MARGIN
    made = [
        f'<div class="flowchart"><svg viewBox="{left:.0f} {top:.0f} {right - left:.0f} {bottom - top:.0f}" '
        f'width="{right - left:.0f}" role="img" aria-label="flow chart">',
        '<defs><marker id="head" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path d="M0 0 L8 4 L0 8 z"/></marker></defs>',
    ]
    made += [f'<path class="arrow" marker-end="url(#head)" d="{_path(corners)}"/>' for corners in lines]
    for name, box in boxes.items():
        x, y = box.xy
        made.append(
            f'<rect x="{x - box.w / 2:.1f}" y="{y - box.h / 2:.1f}" width="{box.w:.1f}" height="{box.h}" rx="5"/>'
        )
        made.append(f'<text x="{x:.1f}" y="{y + 4.5:.1f}">{escape(name)}</text>')
    return "".join([*made, "</svg></div>"])
