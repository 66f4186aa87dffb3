"""Colours and opacities of labels, found in the transfer function of a segmentation."""

from __future__ import annotations

import numpy as np

from texvol.scene.display import straight_colors
from texvol.scene.label_counts import label_counts
from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.labels import LabelLook
from texvol.scene.volume import Volume
from texvol.window import editing
from texvol.window.navigation import triple


def look_of_labels(medium: TransferFunction, volume: Volume) -> LabelLook:
    """Return the colour of each label, and its opacity over one smallest spacing."""
    labels = label_counts(volume).labels
    optics = medium.classify(labels.astype(np.float64))
    opacities = np.clip(editing.opacity_of(optics.extinction, volume.smallest_spacing), 0, 1)
    colors = np.clip(straight_colors(medium, labels.astype(np.float64)), 0, 1)
    names = labels.tolist()
    return LabelLook(
        dict(zip(names, opacities.tolist(), strict=True)), dict(zip(names, map(triple, colors), strict=True))
    )
