"""Compares the table of a run with the rows of a plain loop."""

import math
from dataclasses import dataclass

from archive import TEXTS, Variable

# For model exchange, of the range of a variable.
ACCURACY = 1e-6
# The least range: differences of a hundredth of a nanounit and less are those of absolute tolerances.
LEAST_RANGE = 1e-5
# Two neighbours that are farther apart have a jump between them, as a share of the range.
JUMP = 0.05


@dataclass
class Difference:
    """A difference of a variable, with its size as a share of the range."""

    name: str
    what: str
    size: float


def differences(variables: list[Variable], ours, plain, exact: bool) -> dict[str, Difference]:
    """The variables that differ. A row of ours has cells by their titles, one of a plain loop lists of values. A plain loop that ended earlier says
    nothing of the rest."""
    if len(ours) < len(plain):
        return {"": Difference("", f"{len(ours)} rows in place of {len(plain)}", math.inf)}
    found = {}
    for place, variable in enumerate(variables):
        if not exact and variable.kind in TEXTS:
            continue
        own = [values_of(row, place, variable) for row in ours[: len(plain)]]
        other = [row[place] for row in plain]
        differs = differ_in_bits(own, other) if exact else differ_by_range(own, other)
        if differs:
            row, one, two, size = differs
            found[variable.name] = Difference(variable.name, f"{variable.name} at point {row}: {one} and {two}", size)
    return found


def explains(between_plain: dict[str, Difference], found: dict[str, Difference]) -> bool:
    """Whether plain loops differ from each other in the same variables, by about as much or more."""
    alike = [between_plain.get(name) for name in found]
    return all(other and it.size <= 10.0 * other.size for it, other in zip(found.values(), alike))


def values_of(row, place: int, variable: Variable):
    """The values of a variable; an array has several columns."""
    if isinstance(row, list):
        return row[place]
    name = f"it.{variable.name}"
    cells = [row[name]] if name in row else [cell for title, cell in row.items() if title.startswith(name + "[")]
    return [cell_value(cell, variable.kind) for cell in cells]


def cell_value(cell: str, kind: str):
    if kind in TEXTS:
        text = cell[1:-1] if len(cell) > 1 and cell[0] == cell[-1] == '"' else cell
        return bytes.fromhex(text) if kind == "Binary" else text.encode()
    return float(cell) if kind in ("Real", "Float64", "Float32") else int(cell)


def same(one, other) -> bool:
    both = isinstance(one, float) and isinstance(other, float)
    return one == other or (both and math.isnan(one) and math.isnan(other))


def differ_in_bits(ours, plain):
    for row, (own, other) in enumerate(zip(ours, plain)):
        if len(own) != len(other):
            return row, f"{len(own)} values", f"{len(other)} values", math.inf
        for one, two in zip(own, other):
            if not same(one, two):
                return row, one, two, 0.0
    return None


def differ_by_range(ours, plain):
    """The largest difference beyond the accuracy. Beside a jump, a value may be on either side of it."""
    flat = [value for row in plain for value in row if math.isfinite(value)]
    reach = max(flat) - min(flat) if flat else 0.0
    # What hardly moves is compared with its size.
    scale = max(reach, 1e-3 * max(map(abs, flat), default=0.0), LEAST_RANGE)
    worst = (ACCURACY, None)
    for row, (own, other) in enumerate(zip(ours, plain)):
        for place, (one, two) in enumerate(zip(own, other)):
            if same(one, two):
                continue
            error = abs(one - two) / scale
            beside = is_beside_jump(plain, row, place, one, scale) or is_beside_jump(ours, row, place, two, scale)
            if not error <= worst[0] and not beside:
                worst = (error, (row, one, f"{two} ({error:.1e} of its range)", error))
    return worst[1]


def is_beside_jump(rows, row: int, place: int, value, scale: float) -> bool:
    """Whether the rows jump around this one, and the value of the other side lies within the jump."""
    near = [values[place] for values in rows[max(0, row - 1) : row + 2]]
    low, high = min(near), max(near)
    return high - low > JUMP * scale and low - ACCURACY * scale <= value <= high + ACCURACY * scale
