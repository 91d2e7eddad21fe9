"""The table of all renders: a CSV file, and what can be asked of it."""

import csv
import math
import statistics
from dataclasses import dataclass

from environment import OUT
from measure import COLUMNS

KEYS = ("scene", "variant", "resolution", "threads", "budget", "repeat")
_TIMES = ("wall", "cpu")
PATH = OUT / "speed.csv"


class Results:
    """Rows of the CSV file as dicts; `add` writes through, so that an interrupted benchmark loses nothing."""

    def __init__(self, keep):
        self.rows = _read() if keep and PATH.exists() else []
        PATH.parent.mkdir(parents=True, exist_ok=True)
        if not self.rows:
            with PATH.open("w", newline="") as file:
                csv.writer(file).writerow((*KEYS, *_TIMES, *COLUMNS))

    def has(self, **key):
        return any(all(row[name] == value for name, value in key.items()) for row in self.rows)

    def add(self, row):
        self.rows.append(row)
        with PATH.open("a", newline="") as file:
            csv.writer(file).writerow(row[name] for name in (*KEYS, *_TIMES, *COLUMNS))


def _read():
    with PATH.open(newline="") as file:
        return [{name: _value(name, text) for name, text in row.items()} for row in csv.DictReader(file)]


def _value(name, text):
    if name in ("scene", "variant"):
        return text
    return int(text) if name in ("resolution", "threads", "repeat") else float(text)


@dataclass(frozen=True)
class Point:
    """All repeats of one scene, variant and budget: medians, and the least and largest error."""

    budget: float
    seconds: float
    error: float
    low: float
    high: float


def curve(rows, scene, variant, column):
    """`Point`s of growing budget; empty where the variant was not run or the column says nothing."""
    points = []
    chosen = [row for row in rows if row["scene"] == scene and row["variant"] == variant and not math.isnan(row[column])]
    for budget in sorted({row["budget"] for row in chosen}):
        repeats = [row for row in chosen if row["budget"] == budget]
        errors = [row[column] for row in repeats]
        seconds = statistics.median(row["wall"] for row in repeats)
        points.append(Point(budget, seconds, statistics.median(errors), min(errors), max(errors)))
    return points


def time_to(points, error):
    """When the curve first is at or below the error: (seconds, "" or, where that lies beyond the curve's ends, ">" or "<").

    Between points the curve is straight in logarithms. An error that is not positive is below what the reference can tell: it
    counts as reached at that point, not before.
    """
    if points[0].error <= error:
        return points[0].seconds, "" if points[0].error == error else "<"
    for a, b in zip(points, points[1:]):
        if b.error <= error:
            if b.error <= 0:
                return b.seconds, ""
            share = math.log(a.error / error) / math.log(a.error / b.error)
            return a.seconds * (b.seconds / a.seconds) ** share, ""
    return points[-1].seconds, ">"


def error_at(points, seconds):
    """The curve's error at a time, straight in logarithms, beyond its ends too; None without two positive points."""
    points = [p for p in points if p.error > 0]
    if len(points) < 2:
        return None
    end = next((i for i, p in enumerate(points) if i > 0 and p.seconds >= seconds), len(points) - 1)
    a, b = points[end - 1], points[end]
    slope = math.log(b.error / a.error) / math.log(b.seconds / a.seconds)
    return a.error * (seconds / a.seconds) ** slope


def scenes_of(rows):
    return list(dict.fromkeys(row["scene"] for row in rows))


def variants_of(rows):
    return list(dict.fromkeys(row["variant"] for row in rows))
