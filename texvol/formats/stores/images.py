"""Images of one OME-Zarr store: its own, a series of them (bioformats2raw), labels; one is chosen."""

from __future__ import annotations

from typing import Any

from texvol.formats.readers.samples import FileFault
from texvol.formats.stores.access import METADATA, Store, joined
from texvol.formats.stores.ome import Image, images_of, ome_attributes

_MOST_NAMED = 12
_MOST_SERIES = 1000  # groups of a series that names none
_REFUSED = {"plate": "a plate of many wells", "well": "a well of many fields"}


def image_of(store: Store, wanted: str | None) -> tuple[Image, list[str]]:
    """Return the chosen image, or the only one, and the names of all.

    Parameters
    ----------
    wanted : str, optional
        Name or number of an image, or the path of its group, such as labels/nuclei.

    Raises
    ------
    FileFault
        If there is none, no such one, or several and none is chosen; the message lists them.
    """
    attributes = store.attributes("")
    if attributes is None:
        raise FileFault("is no Zarr store: it has no zarr.json, .zgroup or .zarray")
    ome = ome_attributes(attributes)
    for key, what in _REFUSED.items():
        if key in ome and wanted is None:
            inside = ", ".join(_wells(ome[key])) or "none"
            raise FileFault(f"is {what}, which texvol does not read as one volume; give one of its images: {inside}")
    named = dict(_series(store, ome)) if "multiscales" not in ome else _named(images_of("", attributes))
    known = [*named, *_labels(store, "" if "multiscales" in ome else None)]
    if wanted is not None:
        return _chosen(store, wanted, named, known), known
    if not named:
        members = store.members("")
        listed = f"; its groups and arrays are {_listed(members)}: --image NAME" if members else ""
        raise FileFault(f"is a Zarr group without OME metadata of an image{listed}")
    if len(named) > 1:
        raise FileFault(f"has {len(named)} images, --image NAME chooses one: {_listed(known)}")
    return _image(store, next(iter(named.values()))), known


def _named(images: list[Image]) -> dict[str, Image]:
    """Return images by their names; those without one, or with another's, by numbers."""
    found: dict[str, Any] = {}
    for number, each in enumerate(images):
        found[each.name if each.name and each.name not in found else str(number)] = each
    return found


def _series(store: Store, ome: dict[str, Any]) -> list[tuple[str, str]]:
    """Return name and group of the images that bioformats2raw wrote; the groups are 0, 1, … unless OME/ lists them."""
    if "bioformats2raw.layout" not in ome and store.attributes("OME") is None:
        return []
    inner = ome_attributes(store.attributes("OME") or {}).get("series")
    if isinstance(inner, list) and all(isinstance(each, str) for each in inner):
        return [(each, each) for each in inner]
    groups: list[str] = []
    while len(groups) < _MOST_SERIES and store.attributes(str(len(groups))) is not None:
        groups.append(str(len(groups)))
    return [(each, each) for each in groups]


def label_names(store: Store, group: str) -> list[str]:
    """Return the names of the labels that belong to the image of a group, by which they lie in its group `labels`."""
    labels = joined(group, "labels")
    if store.json(joined(group, "zarr.json")) is not None and store.json(joined(labels, "zarr.json")) is None:
        return []  # a hierarchy is of one version
    store.look_up([joined(labels, each) for each in METADATA])
    names = ome_attributes(store.attributes(labels) or {}).get("labels")
    return [each for each in names if isinstance(each, str)] if isinstance(names, list) else []


def _labels(store: Store, group: str | None) -> list[str]:
    return [] if group is None else [joined("labels", each) for each in label_names(store, group)]


def _chosen(store: Store, wanted: str, named: dict[str, Any], known: list[str]) -> Image:
    if wanted in named:
        return _image(store, named[wanted])
    if wanted.isdigit() and int(wanted) < len(named):
        return _image(store, list(named.values())[int(wanted)])
    if store.attributes(wanted) is None:
        # The name of an image within its own group.
        for group in (each for each in named.values() if isinstance(each, str)):
            for one in images_of(group, store.attributes(group) or {}):
                if one.name == wanted:
                    return one
        raise FileFault(f"has no image {wanted!r} (--image); it has {_listed(known or store.members(''))}")
    return _image(store, wanted.strip("/"))


def _image(store: Store, which: Any) -> Image:
    """Return an image, or that of a group."""
    if isinstance(which, Image):
        return which
    inside = images_of(which, store.attributes(which) or {})
    if not inside:
        raise FileFault(f"its group {which!r} has no OME metadata of an image")
    if len(inside) > 1:
        raise FileFault(f"its group {which!r} has {len(inside)} images: give the path of that group")
    found = inside[0]
    is_label = found.is_label or "labels" in which.split("/")[:-1]
    return found._replace(is_label=is_label, name=found.name or which)


def _wells(content: Any) -> list[str]:
    wells = content.get("wells", content.get("images")) if isinstance(content, dict) else None
    paths = [each.get("path") for each in wells if isinstance(each, dict)] if isinstance(wells, list) else []
    return [f"PATH/{each}" for each in paths if isinstance(each, str)][:_MOST_NAMED]


def _listed(names: list[str]) -> str:
    more = len(names) - _MOST_NAMED
    return (", ".join(names[:_MOST_NAMED]) or "none") + (f" and {more} more" if more > 0 else "")
