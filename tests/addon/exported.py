"""What an export holds: names and places of its instances."""

import numpy as np


def names(desc):
    return sorted(item.name for item in desc.instances)


def places(desc, name=None):
    """Sorted, rounded world positions of the instances."""
    items = [item for item in desc.instances if name in (None, item.name)]
    return sorted(tuple(float(v) for v in np.round(item.transform[:, 3] + desc.origin, 4) + 0.0) for item in items)
