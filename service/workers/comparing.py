"""Comparison of two pictures, as a worker runs it."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator
from contextlib import contextmanager

import renderer
from accuracy.comparison import Comparison, NotComparableError, Picture, Policy, compare, heat, picture_of
from accuracy.comparison.shown import names_of, shapes_shown
from schemas.api.comparisons import ComparisonAnswer, ComparisonPictures, ComparisonRequest
from schemas.api.jobs import JobRequest
from schemas.errors import Problem
from service.errors import RefusedError, StoreDamagedError
from service.storage.tiles import TileStore
from service.workers import layers
from service.workers.tasks import ComparedPicture, CompareTask

CODE = "not_comparable"


def compared(task: CompareTask, store: TileStore, assets: renderer.AssetSource) -> ComparisonAnswer:
    """Compare the pictures of a task.

    Raises
    ------
    RefusedError
        If one of them cannot be used, or they cannot be compared.
    """
    with _refusing("/reference"):
        reference = _picture(task.reference, "reference", store, assets)
    with _refusing("/image"):
        image = _picture(task.image, "image", store, assets, reference.size)
    with _refusing(""):
        return _answer(_compared(task, image, reference, store, assets), task.request)


@contextmanager
def _refusing(pointer: str) -> Iterator[None]:
    try:
        yield
    except NotComparableError as error:
        raise RefusedError([Problem(pointer=pointer, detail=str(error), code=CODE)]) from None


def _picture(
    asked: ComparedPicture,
    role: str,
    store: TileStore,
    assets: renderer.AssetSource,
    size: tuple[int, int] | None = None,
) -> Picture:
    if asked.asset is not None:
        return picture_of(_uploaded(asked.asset, assets), role, asked.encoding, size=size)
    if asked.job is None:
        return picture_of(asked.content, role, asked.encoding, size=size)
    name = f"{asked.prefix}image.npy"
    names = {layer: f"{asked.prefix}{layers.file_name(layer)}" for layer in asked.layers}
    try:
        content = store.get_file(asked.render, name, asked.expected[name])
        sheets = {
            layer: store.get_array(asked.render, file, asked.expected[file]) for layer, file in names.items()
        }
    except (FileNotFoundError, StoreDamagedError) as error:
        raise NotComparableError("The stored picture is damaged. Submit the job again.") from error
    return picture_of(content, f"job:{asked.job}", asked.encoding, sheets, size)


def _uploaded(asset: str, assets: renderer.AssetSource) -> bytes:
    try:
        return assets.read(asset)
    except KeyError as error:
        raise NotComparableError("The uploaded file is no longer there. Upload it again.") from error


def _compared(
    task: CompareTask, image: Picture, reference: Picture, store: TileStore, assets: renderer.AssetSource
) -> Comparison:
    asked = task.request
    policy = Policy(tolerance=asked.tolerance, most_bias=asked.max_bias, limit=asked.limit)
    if task.reference.job is None or image.linear.shape != reference.linear.shape:
        return compare(image, reference, policy=policy, with_flip=asked.flip)
    spec = JobRequest.model_validate(
        json.loads(store.get_spec(task.reference.render, task.reference.spec_sha256))
    )
    scene = renderer.load_scene(spec.scene, assets=assets)
    return compare(
        image,
        reference,
        policy=policy,
        shapes=shapes_shown(scene),
        names=names_of(scene.document),
        with_flip=asked.flip,
    )


def _answer(found: Comparison, asked: ComparisonRequest) -> ComparisonAnswer:
    answer = ComparisonAnswer.model_validate(found.document())
    if not asked.pictures:
        return answer
    pictures = found.image.linear, found.reference.linear
    drawn = (heat.heat_map(*pictures), heat.side_by_side(*pictures))
    heat_map, side_by_side = (base64.b64encode(heat.encoded(codes)).decode("ascii") for codes in drawn)
    images = ComparisonPictures(heat_map=heat_map, side_by_side=side_by_side)
    return answer.model_copy(update={"images": images})
