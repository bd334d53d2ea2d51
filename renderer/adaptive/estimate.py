"""The picture so far, what is known of its error, and what to sample next."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive import allocation
from renderer.adaptive.lattice import COARSEST, smooth_cells
from renderer.adaptive.levels import LOOKED, SAMPLED, UNSEEN, Levels
from renderer.adaptive.rays import Samples
from renderer.arrays import Masks
from schemas.tiles import Tile

N_LEVELS = np.array([0, 0] + [1 << k for k in range(2, 17)], dtype=np.int64)


@dataclass
class Estimate:
    plan: object
    target: float
    rough: NDArray[np.bool_]
    stride: int = COARSEST
    level: Levels = field(init=False)
    want: Levels = field(init=False)

    def __post_init__(self):
        h, w = self.plan.height, self.plan.width
        self.value = np.zeros((3, h, w), np.float32)
        self.label = np.zeros((h, w), np.int32)
        self.level = np.zeros((h, w), np.uint8)
        self.half = np.zeros((2, 3, h, w), np.float64)
        self.squares = np.zeros((h, w), np.float64)
        self.want = np.zeros((h, w), np.uint8)
        self.want[:: self.stride, :: self.stride] = LOOKED
        self.phase = "lattice"
        self.round = 0
        self.error = None
        if self.plan.camera_is_lens:
            self.phase = "samples"; self.want[...] = SAMPLED
            self.pred = np.ones((h, w), np.float32)

    def take(self, tile: Tile, samples: Samples):
        part = np.s_[tile.y0 : tile.y1, tile.x0 : tile.x1]
        have, want = self.level[part], self.want[part]
        looked = want == LOOKED
        self.value[(slice(None), *part)][:, looked] = samples.looks
        self.label[part][looked] = samples.labels
        more = (want > have) & (want > LOOKED)
        if more.any():
            n0 = N_LEVELS[have[more]].astype(float); n1 = N_LEVELS[want[more]].astype(float)
            dn = n1 - n0
            half = self.half[(slice(None), slice(None), *part)]
            old = half[:, :, more]
            new = samples.halves.astype(np.float64)
            share = dn / n1
            merged = old + (new - old) * share
            mean_old, mean_new = old.mean(axis=0), new.mean(axis=0)
            apart = ((mean_new - mean_old) ** 2).mean(axis=0) * (n0 * share)
            self.squares[part][more] += samples.squares + apart
            half[:, :, more] = merged
            self.value_of_samples(part, more, merged)
        np.maximum(have, want, out=self.level[part])

    def value_of_samples(self, part, more, merged):
        pass

    def image(self):
        out = self.value.copy()
        s = self.shown
        out[:, s] = self.half[:, :, s].mean(axis=0)
        return out

    # ---- next pass
    def advance(self):
        """Form the next demand in self.want; returns False when done."""
        if self.phase == "lattice":
            if self.stride > 1:
                self._finer()
                return True
            self.phase = "samples"
            self.pred = allocation.predicted(np.clip(self.value, 0, 1), self.label)
        return allocation.allocate(self)

    def _finer(self):
        s, h = self.stride, self.stride // 2
        L = self.value[:, ::s, ::s]; lab = self.label[::s, ::s]
        cells = smooth_cells(L, lab, self.rough[lab], self.target * self.loose)
        a, b = lab.shape
        H, W = self.level.shape
        want = self.want; want[...] = 0
        new = self.level[::h, ::h]  # view
        A, B = new.shape
        known = np.zeros((A, B), bool)
        # padded cells: outside counts as smooth for shared edges
        pad = np.pad(cells, 1, constant_values=True)
        hor = pad[:-1, 1:-1] & pad[1:, 1:-1]       # edges (i, j+1/2): (a, b-1)
        ver = pad[1:-1, :-1] & pad[1:-1, 1:]       # (a-1, b)
        V = self.value[:, ::h, ::h]; LB = self.label[::h, ::h]
        def put(oi, oj, mask, vals, labs):
            sub = V[:, oi::2, oj::2][:, : mask.shape[0], : mask.shape[1]]
            np.copyto(sub, vals, where=mask)
            np.copyto(LB[oi::2, oj::2][: mask.shape[0], : mask.shape[1]], labs, where=mask)
            known[oi::2, oj::2][: mask.shape[0], : mask.shape[1]] = mask
        # an edge interpolates only if its ends agree
        hx = (L[:, :, 1:] + L[:, :, :-1]) / 2
        vx = (L[:, 1:] + L[:, :-1]) / 2
        put(0, 1, hor & (lab[:, 1:] == lab[:, :-1]) , hx, lab[:, 1:])
        put(1, 0, ver & (lab[1:] == lab[:-1]), vx, lab[1:])
        put(1, 1, cells, (hx[:, 1:] + hx[:, :-1]) / 2, lab[1:, 1:])
        known[0::2, 0::2] = True
        W2 = want[::h, ::h]
        W2[~known] = LOOKED
        self.stride = h
