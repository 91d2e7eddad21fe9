"""Boxes around the parts of a SceneDesc, in world space."""

import numpy as np


def instance_boxes(desc):
    """(instances, 2, 3) float64: lowest and highest corner of each instance's box, metres, world."""
    boxes = np.array([_box_corners(mesh.positions) for mesh in desc.meshes]).reshape(-1, 8, 4)
    transforms = np.array([item.transform for item in desc.instances], dtype=np.float64).reshape(-1, 3, 4)
    corners = np.einsum("iab,ikb->ika", transforms, boxes[[item.mesh - 1 for item in desc.instances]])
    return np.stack((corners.min(axis=1), corners.max(axis=1)), axis=1)


def _box_corners(positions):
    """(8, 4) float64 homogeneous corners of the points' box."""
    ends = np.array((positions.min(axis=0), positions.max(axis=0)), dtype=np.float64)
    corners = np.array(np.meshgrid(*ends.T)).reshape(3, 8).T
    return np.hstack((corners, np.ones((8, 1))))
