"""What the last render of each scene told about itself, kept in memory for the panels; nothing of it goes into a file."""

from dataclasses import dataclass, field
from typing import Optional

from .native import Progress

_reports = {}  # scene's full name -> {view layer's name: Report}
_version = 0


@dataclass(frozen=True)
class Report:
    """A render of one view layer.

    Attributes:
        messages: what the scene cannot show, in one line each.
        progress: counters at its end, None while it is under way or when it failed.
        memory_bytes: of the scene and the session together.
        shares: name of a part of the light -> its share of the picture, 0 to 1.
    """

    messages: list = field(default_factory=list)
    progress: Optional[Progress] = None
    memory_bytes: int = 0
    shares: dict = field(default_factory=dict)


def record(scene_name, layer_name, report):
    """Replaces what is known of a view layer's render."""
    global _version
    _reports.setdefault(scene_name, {})[layer_name] = report
    _version += 1


def reports(scene_name, layer_names):
    """[(view layer's name, Report)] of the layers that have been rendered and still exist."""
    known = _reports.get(scene_name, {})
    return [(name, known[name]) for name in layer_names if name in known]


def clear():
    """Forgets every render."""
    global _version
    _reports.clear()
    _version += 1


def version():
    """A number that changes with every record: a panel that showed another one is out of date."""
    return _version


class Told:
    """What a render has told in the log, so that several view layers do not say the same."""

    def __init__(self):
        self._layers = {}

    def news(self, layer_name, messages):
        """Those that no other layer of this render has told; a layer that comes again begins another render."""
        if layer_name in self._layers:
            self._layers.clear()
        known = set().union(*self._layers.values())
        self._layers[layer_name] = set(messages)
        return [message for message in messages if message not in known]


def messages(found):
    """Every message of several reports once, with the layer's name where not all layers have it."""
    names = {}
    for layer, report in found:
        for message in report.messages:
            names.setdefault(message, []).append(layer)
    return [text if len(layers) == len(found) else f"{', '.join(layers)}: {text}" for text, layers in names.items()]


def lines(report):
    """[(what, how much)] of one render, for a panel: `what` is short enough not to be cut in a narrow one."""
    p = report.progress
    rays = p.rays_camera + p.rays_shadow + p.rays_photon
    rows = [("Iterations", f"{p.iteration}"), ("Time", seconds(p.seconds)), *_phases(p),
            ("Photons sent", count(p.photons_emitted)), ("Photons used", count(p.photons_stored)),
            ("Rays", count(rays)), ("Rays/s", count(round(rays / max(p.seconds, 1e-9)))),
            ("Memory", f"{report.memory_bytes / 2**20:.1f} MB")]
    rows += [(name, f"{share:.1%} of light") for name, share in report.shares.items()]
    rows += [("Indirect by", p.indirect.lower())]
    return rows + ([("Dropped", f"{count(p.dropped_samples)} samples")] if p.dropped_samples else [])


def _phases(progress):
    """Time and share of each phase of an iteration."""
    phases = {"Camera": progress.seconds_camera, "Photons": progress.seconds_photons,
              "Sorting": progress.seconds_grid, "Gathering": progress.seconds_gather}
    return [(f"    {name}", f"{seconds(time)}, {time / max(progress.seconds, 1e-9):.0%}") for name, time in phases.items()]


def seconds(value):
    """0.31 s, 2:05 or 1:00:09."""
    if value < 59.995:
        return f"{value:.2f} s"
    minutes, rest = divmod(round(value), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


def count(value):
    """12, 1.20 k, 3.40 M or 5.60 G."""
    for size, unit in ((1e9, " G"), (1e6, " M"), (1e3, " k")):
        if value >= size:
            return f"{value / size:.2f}{unit}"
    return f"{value}"
