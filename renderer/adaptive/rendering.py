"""A whole picture of target quality: passes, until its error is what was asked for or the time is spent."""

import time
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive.estimate import Estimate
from renderer.adaptive.levels import Levels
from renderer.adaptive.samples import Samples, render_samples
from renderer.errors import told
from renderer.execute import render_layers
from renderer.film import BRIGHTEST
from renderer.layers import Layers
from renderer.plan import RenderPlan
from renderer.results import RenderResult, TileEvent
from renderer.tiling import cut
from renderer.workers import Workers
from schemas.quality import TargetQuality
from schemas.tiles import Pass, Tile

TILE = 256
"""Side of a tile, pixels, unless asked otherwise: few pixels of it have anything to do in most passes."""
