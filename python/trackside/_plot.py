"""Draw signals over time as SVG, which notebooks and browsers show: lines, axes and a legend, nothing else."""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import pyarrow as pa
import pyarrow.compute as pc

#: Colours that can be told apart on light and dark grounds, also by those who do not see red and green alike.
COLOURS = ("#0b66b5", "#c8520a", "#0a7f5a", "#8b44a8", "#a07400", "#5f6b75")
#: More curves than colours and a few more line styles cannot be told apart.
DASHES = ("", "6 3", "2 3")
#: Space of the picture around the axes [px]: left, right, top, bottom.
LEFT, RIGHT, TOP, BOTTOM = 62.0, 12.0, 26.0, 34.0
#: Height of a line of the legend [px].
LINE = 16.0


@dataclass(frozen=True)
class Curve:
    """A curve: its name in the legend, its column, and how its numbers become those of the axis."""

    label: str
    signal: str
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Plot:
    """A diagram over time. Jupyter shows it; `str` gives the SVG."""

    svg: str

    def __str__(self) -> str:
        return self.svg

    def _repr_svg_(self) -> str:
        return self.svg


def draw(title: str, table: pa.Table, curves: Sequence[Curve], size: tuple[float, float] = (420.0, 240.0)) -> Plot:
    """Draw columns of a table over its first column."""
    width, height = size
    rows = legend_rows(curves, width)
    height += LINE * len(rows)
    bottom = BOTTOM + LINE * len(rows)
    x_name = table.schema.names[0]
    lines = [points(table, x_name, curve, int(width - LEFT - RIGHT)) for curve in curves]
    seen = [point for line in lines for point in line]
    x_ends = ends([x for x, _ in seen])
    y_ends = widened(ends([y for _, y in seen]))
    to_x = scale(x_ends, (LEFT, width - RIGHT))
    to_y = scale(y_ends, (height - bottom, TOP))
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}" height="{height:g}" viewBox="0 0 {width:g} {height:g}" '
        'font-family="system-ui, sans-serif" font-size="11" fill="currentColor" role="img">',
        f"<title>{html.escape(title)}</title>",
        f'<text x="{LEFT:g}" y="16" font-size="12" font-weight="600">{html.escape(title)}</text>',
    ]
    for value in ticks(*x_ends):
        x = to_x(value)
        parts.append(grid(x, TOP, x, height - bottom))
        parts.append(f'<text x="{x:.1f}" y="{height - bottom + 14:.1f}" text-anchor="middle">{number(value)}</text>')
    for value in ticks(*y_ends):
        y = to_y(value)
        parts.append(grid(LEFT, y, width - RIGHT, y))
        parts.append(f'<text x="{LEFT - 5:g}" y="{y + 4:.1f}" text-anchor="end">{number(value)}</text>')
    middle = (LEFT + width - RIGHT) / 2
    parts.append(f'<text x="{middle:.1f}" y="{height - bottom + 28:.1f}" text-anchor="middle">{html.escape(x_name)} [s]</text>')
    parts += [path(line, to_x, to_y, place) for place, line in enumerate(lines)]
    parts += legend(rows, height - LINE * len(rows) + 6)
    parts.append("</svg>")
    return Plot("\n".join(parts))


def points(table: pa.Table, x_name: str, curve: Curve, width: int) -> list[tuple[float, float]]:
    """Return the curve as it looks on so many pixels: of each pixel its lowest and its highest value."""
    x = table[x_name]
    y = pc.cast(table[curve.signal], pa.float64())
    if curve.factor != 1.0 or curve.offset != 0.0:
        y = pc.add(pc.multiply(y, curve.factor), curve.offset)
    pair = pa.table({"x": x, "y": y})
    if len(pair) > 2 * width:
        span = pc.min_max(x)
        first, last = span["min"].as_py(), span["max"].as_py()
        pixel = pc.floor(pc.multiply(pc.subtract(x, first), width / ((last - first) or 1.0)))
        groups = pair.append_column("pixel", pixel).group_by("pixel", use_threads=False)
        each = groups.aggregate([("x", "min"), ("y", "min"), ("y", "max")]).sort_by("x_min")
        columns = (each["x_min"].to_pylist(), each["y_min"].to_pylist(), each["y_max"].to_pylist())
        line = []
        for at, low, high in zip(*columns):
            line.append((at, low))
            if high != low:
                line.append((at, high))
    else:
        line = list(zip(pair["x"].to_pylist(), pair["y"].to_pylist()))
    return [(at, value) for at, value in line if value is not None and math.isfinite(value)]


def ends(values: list[float]) -> tuple[float, float]:
    """Return the lowest and the highest value."""
    return (min(values), max(values)) if values else (0.0, 1.0)


def widened(pair: tuple[float, float]) -> tuple[float, float]:
    """Leave room around the values; a constant gets an axis around it."""
    low, high = pair
    room = 0.06 * (high - low) or 0.05 * abs(high) or 1.0
    return low - room, high + room


def scale(values: tuple[float, float], pixels: tuple[float, float]) -> Callable[[float], float]:
    """Return the function from a value to its pixel."""
    slope = (pixels[1] - pixels[0]) / ((values[1] - values[0]) or 1.0)
    return lambda value: pixels[0] + (value - values[0]) * slope


def ticks(low: float, high: float, wanted: int = 5) -> list[float]:
    """Return round values between two ends, about as many as wanted."""
    raw = (high - low) / wanted
    if not raw > 0.0 or not math.isfinite(raw):
        return [low]
    power = 10.0 ** math.floor(math.log10(raw))
    step = min((factor * power for factor in (1, 2, 5, 10)), key=lambda it: abs(it - raw))
    first = math.ceil(low / step - 1e-9)
    return [place * step for place in range(first, first + 2 * wanted + 2) if place * step <= high + 1e-9 * step]


def number(value: float) -> str:
    """Write the value of a tick."""
    return f"{0.0 if abs(value) < 1e-300 else value:.6g}"


def grid(x1: float, y1: float, x2: float, y2: float) -> str:
    """Return a line of the grid."""
    return f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="currentColor" stroke-opacity="0.18"/>'


def path(line: list[tuple[float, float]], to_x: Callable[[float], float], to_y: Callable[[float], float], place: int) -> str:
    """Return a curve."""
    corners = " ".join(f"{to_x(x):.1f},{to_y(y):.1f}" for x, y in line)
    return f'<polyline points="{corners}" fill="none" stroke-width="1.5" stroke-linejoin="round" {style(place)}/>'


def style(place: int) -> str:
    """Return the stroke of a curve by its place."""
    dash = DASHES[place // len(COLOURS) % len(DASHES)]
    return f'stroke="{COLOURS[place % len(COLOURS)]}"' + (f' stroke-dasharray="{dash}"' if dash else "")


def legend_rows(curves: Sequence[Curve], width: float) -> list[list[tuple[int, str, float]]]:
    """Lay out the legend: for each line the place of each curve, its label, and where it begins [px]."""
    rows: list[list[tuple[int, str, float]]] = [[]]
    x = LEFT
    for place, curve in enumerate(curves):
        room = 26.0 + 6.2 * len(curve.label)
        if x + room > width and rows[-1]:
            rows.append([])
            x = LEFT
        rows[-1].append((place, curve.label, x))
        x += room
    return rows


def legend(rows: list[list[tuple[int, str, float]]], top: float) -> list[str]:
    """Return the legend: a piece of each curve beside its label."""
    parts = []
    for row, entries in enumerate(rows):
        y = top + LINE * row
        for place, label, x in entries:
            parts.append(f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{x + 16:.1f}" y2="{y:.1f}" stroke-width="2" {style(place)}/>')
            parts.append(f'<text x="{x + 20:.1f}" y="{y + 4:.1f}">{html.escape(label)}</text>')
    return parts
