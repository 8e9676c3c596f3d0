"""What the library takes as texts and numbers."""

from __future__ import annotations

import math
import numbers
import operator
import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from .errors import Fault, GraphWarning


def vector(name: str, value: Any, length: int = 3) -> tuple[float, ...]:
    """So many finite floats."""
    try:
        numbers_ = tuple(float(v) for v in value)
    except (TypeError, ValueError):
        raise TypeError(f"{name} = {value!r}: give {length} numbers, such as (0, 1, 0)") from None
    if len(numbers_) != length:
        raise ValueError(f"{name} = {value!r} has {len(numbers_)} numbers: give {length}")
    if not all(map(math.isfinite, numbers_)):
        raise ValueError(f"{name} = {value!r} holds a NaN or an infinity: give finite numbers")
    return numbers_


def number(name: str, value: Any) -> float:
    """A finite float."""
    if isinstance(value, (bool, str)) or not isinstance(value, numbers.Real):
        raise TypeError(f"{name} = {value!r}: give a number")
    if not math.isfinite(value):
        raise ValueError(f"{name} = {value!r}: give a finite number")
    return float(value)


def array(name: str, value: Any) -> np.ndarray:
    """What numpy makes of it."""
    try:
        return np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{name} makes no array: give rows of equal length ({error})") from None


def matrix(name: str, value: Any) -> list[float]:
    """4 rows of 4 finite numbers, column by column."""
    found = array(name, value)
    if found.dtype.kind not in "fiu":
        raise TypeError(f"{name} has the dtype {found.dtype}: give numbers")
    if found.shape != (4, 4):
        raise ValueError(f"{name} has the shape {found.shape}: give 4 rows of 4 numbers")
    if not np.isfinite(found).all():
        raise ValueError(f"{name} holds a NaN or an infinity: give finite numbers")
    return found.T.ravel().tolist()


def seconds(time: Any) -> float | None:
    """A time, or None."""
    if time is None:
        return None
    if not isinstance(time, numbers.Real):
        raise TypeError(f"time = {time!r}: give seconds, as a number")
    if not math.isfinite(time):
        raise ValueError(f"time = {time!r}: give a finite number of seconds")
    return float(time)


def pixels(size: Any) -> tuple[int, int]:
    """Width and height."""
    try:
        width, height = (operator.index(n) for n in size)
    except (TypeError, ValueError):
        raise TypeError(f"size = {size!r}: give width and height in whole pixels, such as (640, 480)") from None
    if not (0 < width < 2**32 and 0 < height < 2**32):
        raise ValueError(f"size = {size!r}: both must be at least 1")
    return width, height


def names(what: str, value: Any) -> list[str] | None:
    """A list of names, or None."""
    if value is None:
        return None
    if isinstance(value, str) or not isinstance(value, Iterable) or not all(isinstance(n, str) for n in value):
        raise TypeError(f'{what} = {value!r}: give a list of names, such as ["color"]')
    return list(dict.fromkeys(value))


def text(name: str, value: Any) -> str:
    """A parameter as `NAME=VALUE`."""
    return f"{name}={_written(name, value)}"


def texts(params: Mapping[str, Any]) -> list[str]:
    """Parameters as `NAME=VALUE`."""
    return [text(name, value) for name, value in params.items()]


def _written(name: str, value: Any) -> str:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (bool, np.bool_)):
        return str(bool(value)).lower()
    if isinstance(value, numbers.Integral):
        return str(int(value))
    if isinstance(value, numbers.Real):
        return repr(float(value))
    if isinstance(value, str):
        return value
    if isinstance(value, Sequence) and value:
        return "(" + ", ".join(_written(name, v) for v in value) + ")"
    raise TypeError(f"{name} = {value!r}: a parameter is a number, a bool or a tuple of numbers")


def say(faults: Iterable[Fault]) -> None:
    """Warns of what is probably not as meant."""
    for fault in faults:
        if fault.severity == "warning":
            warnings.warn(GraphWarning(str(fault)), stacklevel=4)
