"""Boxes around the parts of a SceneDesc, in world space."""

import numpy as np


def instance_boxes(desc, indices=None):
    """(instances, 2, 3) float64: lowest and highest corners of boxes, metres, world; of all instances or those at `indices`."""
    instances = desc.instances if indices is None else [desc.instances[index] for index in indices]
    meshes = sorted({item.mesh for item in instances})
    boxes = np.array([_box_corners(desc.meshes[mesh - 1].positions) for mesh in meshes]).reshape(-1, 8, 4)
    transforms = np.array([item.transform for item in instances], dtype=np.float64).reshape(-1, 3, 4)
    corners = np.einsum("iab,ikb->ika", transforms, boxes[np.searchsorted(meshes, [item.mesh for item in instances])])
    return np.stack((corners.min(axis=1), corners.max(axis=1)), axis=1)


def _box_corners(positions):
    """(8, 4) float64 homogeneous corners of the points' box."""
    ends = np.array((positions.min(axis=0), positions.max(axis=0)), dtype=np.float64)
    corners = np.array(np.meshgrid(*ends.T)).reshape(3, 8).T
    return np.hstack((corners, np.ones((8, 1))))
