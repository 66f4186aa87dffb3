"""Mistakes in other methods, other surfaces and other kinds of volumes."""

from __future__ import annotations

from planted_mistake_shaders import changed
from planted_mistake_sources import Mistake

OF_KINDS = (
    Mistake(
        *("methods", "splatting:_composite"),
        *("left = 1 - picture[row, column, 3]", "left = 1.0"),
        "sheets of splats are added up and not composited",
        "test_object_order.py -k 'splatting'",
    ),
    Mistake(
        *("rendering", "classification:ClassificationChooser._measured"),
        *("if of_slab <= GOOD_ENOUGH:", "if of_slab <= 1.0:"),
        "slab is always good enough for auto",
        "test_classification_auto.py -k 'both_choices'",
    ),
    Mistake(
        *("scene", "volume:Volume.nearest"),
        *("return self.labels or self.blocks", "return self.labels"),
        "blocks are interpolated",
        "test_blocks.py -k 'many_samples'",
    ),
    Mistake(
        *("formats", "magnitude:magnitudes"),
        *("np.hypot(length, component, out=length)", "np.add(length, component, out=length)"),
        "the length of a vector is the sum of its components",
        "test_readers_magnitude.py -k 'lengths'",
    ),
    Mistake(
        *("rendering", "visible_rays:visible_rays"),
        *("np.maximum(np.maximum(first, eye), enters)", "np.maximum(np.maximum(first, eye), -scene.volume.radius)"),
        "a marched ray steps across the faces of the box",
        "test_checking.py -k 'faces_of_the_box'",
    ),
    Mistake(
        *("distributed", "blocks:_sees_low_first"),
        *("< split.at)", "> split.at)"),
        "blocks are composited back to front",
        "test_box_blocks.py -k 'hides_one'",
    ),
    Mistake(
        *("distributed", "cropped:over"),
        *("part *= 1 - front.pixels[..., 3:]", "part *= 1"),
        "blocks are added up and not composited",
        "test_box_blocks.py -k 'cropped'",
    ),
    Mistake(
        *("rendering", "visibility:regions_that_show"),
        *("shows[chunks(region)].any()", "shows[chunks(region)].all()"),
        "regions are left out where a single chunk of them is empty",
        "test_pictures_in_parts.py",
    ),
    Mistake(
        *("rendering", "visibility:beyond_chunks"),
        *("2 * factor", "0 * factor"),
        "regions are left out in which coarse samples alone have a surface",
        "test_isosurfaces_in_parts.py -k 'beyond_the_chunks'",
    ),
    Mistake(
        *("rendering", "levels:_coarsest"),
        *("<= budget).all()", "<= 100 * budget).all()"),
        "coarse levels may be ten times as far off",
        "test_level_prediction.py",
    ),
    Mistake(
        *("rendering", "ordering:RegionsOfPicture.continued"),
        *("for box in self.left_to_coarse(brick):", "for box in ():"),
        "beside a coarse region a fine one ends with the least value of a chunk",
        "test_level_prediction.py -k 'left_to_coarse'",
    ),
    Mistake(
        *("rendering", "sensitivity:Sensitivity._variances"),
        *("front * found", "found"),
        "what is hidden moves a picture",
        "test_level_prediction.py -k 'hidden'",
    ),
    Mistake(
        *("rendering", "left_out:Guide.left_out"),
        *("np.minimum(kept, 1) * linear", "linear"),
        "coarse levels leave out what interpolation brings back",
        "test_level_prediction.py -k 'linear'",
    ),
    Mistake(
        *("textures", "distribution:Smoothed.stored"),
        *("root *= np.float32(", "root *= 0 * np.float32("),
        "coarse levels are classified by their means",
        "test_levels.py",
    ),
    Mistake(
        *("formats", "ome:_transformation"),
        *("translation = [a * b for", "translation = [a for"),
        "a scale after a translation leaves that as it was",
        "test_ome_zarr.py",
    ),
    Mistake(
        *("formats", "reducing:_mean"),
        *("mean = np.rint(total / count)", "mean = np.floor(total / count)"),
        "means of a pyramid are rounded down",
        "test_convert.py",
    ),
    Mistake(
        *("formats", "levels:ImageWriter._write_level"),
        *("if number >= done:", "if number > done:"),
        "a conversion that goes on leaves out a shard",
        "test_interruptions.py",
    ),
    Mistake(
        *("formats", "recording:stamp_of"),
        *("seen.update(told", "str(told"),
        "a conversion goes on with an input that has changed",
        "test_interruptions.py",
    ),
    Mistake(
        *("formats", "levels:ImageWriter._reader"),
        *("labels = self._recording.form.labels", "labels = False"),
        "labels are averaged",
        "test_whole_files.py",
    ),
    Mistake(
        *("formats", "statistics:_change"),
        *(" or theirs != own", ""),
        "statistics of other chunks are trusted",
        "test_faulty_stores.py",
    ),
    Mistake(
        *("formats", "access:Store.look_up"),
        *('if ".." in key', "if None in key"),
        "paths lead out of a store",
        "test_faulty_stores.py",
    ),
    changed(
        "isosurfaces.glsl",
        "seen.color += (1.0 - seen.color.a) * behind;",
        "seen.color += behind;",
        "isosurfaces are added up and not composited",
        "test_isosurfaces.py -k 'closed_form'",
    ),
)
