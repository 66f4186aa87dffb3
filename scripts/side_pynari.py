"""pynari: the ANARI device in its wheel (Barney), on the processor where there is no graphics card of NVIDIA.

Barney's media scatter the light of an even surrounding, and emit none: where its picture of a soft scene is not that of
emission and absorption, the benchmark says so in place of a figure.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pynari as anari
from numpy.typing import NDArray
from side_given import Given, Medium


class Program:
    """A device with one volume."""

    def __init__(self, given: Given) -> None:
        self._given = given
        self._device: Any = anari.newDevice("default")
        self.about = f"Barney, {'with CUDA' if anari.has_cuda_capable_gpu() else 'on the processor'}"
        self._field = self._device.newSpatialField("structuredRegular")
        values = self._device.newArray(anari.FLOAT32, np.ascontiguousarray(given.values))
        self._set(
            self._field,
            data=(anari.ARRAY3D, values),
            origin=(anari.float3, tuple(map(float, given.spacing / 2))),
            spacing=(anari.float3, tuple(map(float, given.spacing))),
        )
        self._camera = self._aimed()

    def classify(self, medium: Medium) -> None:
        """Take another transfer function."""
        device, volume, self._world = (
            self._device,
            self._device.newVolume("transferFunction1D"),
            self._device.newWorld(),
        )
        table = np.column_stack([medium.colors, medium.opacities(1.0)]).astype(np.float32)
        self._set(
            volume,
            value=(anari.SPATIAL_FIELD, self._field),
            color=(anari.ARRAY, device.newArray(anari.float4, np.ascontiguousarray(table))),
            unitDistance=(anari.FLOAT32, 1.0),
        )
        self._world.setParameterArray("volume", anari.VOLUME, [volume])
        self._world.commitParameters()

    def draw(self, family: str, rate: float) -> NDArray[np.float32]:
        """Return the picture of so many paths for each pixel."""
        renderer, frame = self._device.newRenderer("default"), self._device.newFrame()
        self._set(
            renderer,
            ambientRadiance=(anari.FLOAT32, 1.0),
            pixelSamples=(anari.INT32, int(rate)),
            background=(anari.float4, (0.0, 0.0, 0.0, 0.0)),
        )
        frame.setParameter("channel.color", anari.DATA_TYPE, anari.float4)
        self._set(
            frame,
            size=(anari.uint2, self._given.size),
            renderer=(anari.OBJECT, renderer),
            camera=(anari.OBJECT, self._camera),
            world=(anari.OBJECT, self._world),
        )
        frame.render()
        width, height = self._given.size
        return np.asarray(frame.get("channel.color"), np.float32).reshape(height, width, 4)[::-1]

    def _aimed(self) -> Any:
        told, (width, height) = self._given.camera, self._given.size
        camera = self._device.newCamera(told["projection"])
        extent = (
            {"height": told["height"]} if told["projection"] == "orthographic" else {"fovy": np.radians(told["fov"])}
        )
        self._set(
            camera,
            aspect=(anari.FLOAT32, width / height),
            position=(anari.float3, tuple(told["eye"])),
            direction=(anari.float3, tuple(np.subtract(told["target"], told["eye"]).tolist())),
            up=(anari.float3, tuple(told["up"])),
            **{name: (anari.FLOAT32, float(value)) for name, value in extent.items()},
        )
        return camera

    @staticmethod
    def _set(thing: Any, **parameters: tuple[Any, Any]) -> None:
        for name, (kind, value) in parameters.items():
            thing.setParameter(name, kind, value)
        thing.commitParameters()
