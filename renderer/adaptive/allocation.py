import numpy as np

from renderer.adaptive.levels import HIGHEST, LOOKED, SAMPLED
from renderer.streams import bits, keys, uniforms

N = np.array([1.0, 1.0] + [float(1 << k) for k in range(2, 17)])
VB = 24
GAIN = 1.0


def predicted(value, label):
    """Predicted squared error of one look at each pixel, mean over channels."""
    out = np.zeros(label.shape, np.float32)
    for axis in (1, 2):
        v = value if axis == 2 else value.transpose(0, 2, 1)
        d = np.diff(v, axis=2)
        e = np.empty_like(v)
        e[:, :, 1:-1] = d[:, :, 1:] - d[:, :, :-1]
        e[:, :, 0] = e[:, :, 1]; e[:, :, -1] = e[:, :, -2]
        np.multiply(e, e, out=e)
        m = e.sum(axis=0)
        np.maximum(out, m if axis == 2 else m.T, out=out)
    out *= 1 / 36
    return out


def box(a):
    """Mean over 3x3 neighbours."""
    p = np.pad(a, 1, mode="edge")
    r = p[:-2] + p[1:-1] + p[2:]
    return (r[:, :-2] + r[:, 1:-1] + r[:, 2:]) / 9


def bins_of(est):
    b = np.clip(((np.log2(np.maximum(est.pred, 1e-12)) + 36) * 0.67).astype(np.int64), 0, VB - 1)
    lab = est.label
    edge = np.zeros(lab.shape, bool)
    dx = lab[:, 1:] != lab[:, :-1]; dy = lab[1:] != lab[:-1]
    edge[:, 1:] |= dx; edge[:, :-1] |= dx; edge[1:] |= dy; edge[:-1] |= dy
    kind = np.where(est.level == LOOKED, 1 + edge + 2 * est.rough[lab], 0)
    return b + VB * kind


def allocate(est):
    H, W = est.level.shape
    P = H * W
    e2 = est.target**2 * P
    level = est.level
    est.round += 1
    sampled = level >= SAMPLED
    want = est.want
    NB = VB * 5
    if est.round == 1:
        est.bin = bins_of(est)
        u = uniforms(bits(keys(est.plan.seed, 1 << 41, np.arange(P)), 0)).reshape(H, W)
        n = np.bincount(est.bin.ravel(), minlength=NB)
        V = np.bincount(est.bin.ravel(), est.pred.ravel(), minlength=NB)
        asked = est.q * n + 16 + 50 * V / e2
        est.probability = np.minimum(asked / np.maximum(n, 1), 1)
        est.shown = np.zeros((H, W), bool)
        est.probe = u < est.probability[est.bin]
        want[...] = 0
        want[est.probe] = SAMPLED
        return True
    lev = level.ravel()
    shown = est.shown.ravel()
    binr = est.bin.ravel()
    ii = np.flatnonzero(shown)
    half = est.half.reshape(2, 3, -1)

    def halves(index):
        hf = half[:, :, index]
        return np.clip(hf[0], 0, 1), np.clip(hf[1], 0, 1)
    a, b = halves(ii)
    d2 = ((a - b) ** 2).mean(axis=0) / 4
    lv = lev[ii]
    n = N[lv]
    E1 = float(d2.sum())
    v1 = 2 * float((d2 ** 2).sum())
    pi = np.flatnonzero(est.probe.ravel() & ~shown)
    base = np.clip(est.value.reshape(3, -1)[:, pi], 0, 1)
    a, b = halves(pi)
    D = ((a - base) * (b - base)).mean(axis=0)
    bp = binr[pi]
    cnt = np.bincount(bp, minlength=NB)
    mD = np.bincount(bp, D, minlength=NB) / np.maximum(cnt, 1)
    m2 = np.bincount(bp, D**2, minlength=NB) / np.maximum(cnt, 1)
    se = np.sqrt(m2 / np.maximum(cnt, 1))
    unref = np.flatnonzero(~shown)
    N0 = np.bincount(binr[unref], minlength=NB)
    full_bin = cnt >= N0
    E0 = float((N0 * mD).sum())
    v0 = float(((N0 * se)**2).sum())
    total = E1 + E0
    sd = np.sqrt(v1 + v0)
    upper = total + 1.64 * sd
    est.error = tuple(float(np.sqrt(max(x, 0) / P)) for x in (total, total - 1.64 * sd, upper))
    est.parts = tuple(float(x) for x in (E1, E0, np.sqrt(v1), np.sqrt(v0)))
    if upper <= e2:
        return False
    out = np.zeros(P, np.uint8)
    if ii.size:
        s2 = est.squares.ravel()[ii] / np.maximum(n - 1, 1)
        s2[(half[:, :, ii].mean(axis=0) > 1).all(axis=0)] = 0
        full = np.zeros(P); full[ii] = s2
        s2m = (box(full.reshape(H, W)) / np.maximum(box(est.shown.astype(float)), 1e-9)).ravel()[ii]
        c = np.maximum(s2, s2m)
        gain = E1 / max(float((c * n**-1.5).sum()), 1e-30)
        c = c * gain
    else:
        c = np.zeros(0)
    # per bin: what its probes say of single samples
    sp = est.squares.ravel()[pi] / np.maximum(N[lev[pi]] - 1, 1)
    cb = np.bincount(bp, sp, minlength=NB) / np.maximum(cnt, 1) * GAIN
    keep = np.maximum(mD - se, 0)
    goal = max((0.9 * est.target) ** 2 * P - 1.0 * np.sqrt(v1), 0.3 * e2)
    key = (np.clip(np.log2(np.maximum(c, 1e-15)) * 4 + 200, 0, 255).astype(np.int64)) * 32 + lv
    cw = np.bincount(key, minlength=256 * 32)
    used = np.flatnonzero(cw)
    hc = 2.0 ** ((used // 32 - 199.5) / 4); hl = used % 32; hw = cw[used]

    def levels(cc, lam):
        nn = (1.5 * cc * lam) ** 0.4
        return np.clip(np.round(np.log2(np.maximum(nn, 1))), 2, HIGHEST).astype(np.int64)

    def solve(lam):
        bl = levels(cb, lam)
        e = cb * N[bl] ** -1.5
        refine = (e + N[bl] / lam < keep) & (N0 > 0)
        hl2 = np.maximum(levels(hc, lam), hl)
        err = (hw * hc * N[hl2] ** -1.5).sum() + (N0 * np.where(refine, e, keep)).sum()
        return err, np.where(refine, bl, 0)
    lo, hi = 1e-2, 1e12
    while hi / lo > 1.05:
        lam = np.sqrt(lo * hi)
        if solve(lam)[0] > goal: lo = lam
        else: hi = lam
    blev = solve(hi)[1]
    out[ii] = np.maximum(levels(c, hi), lv)
    out[unref] = blev[binr[unref]]
    newly = (out > 0) & ~shown
    est.shown |= newly.reshape(H, W)
    # probes of bins that stay, where what they do not know matters
    unsure = (blev == 0) & (N0 * se > 0.05 * e2)
    more = pi[unsure[bp]]
    out[more] = np.minimum(lev[more] + 2, HIGHEST)
    out = np.minimum(out, np.maximum(lev + 3, SAMPLED + 2))
    want[...] = np.where(out > lev, out, 0).reshape(H, W)
    est.info = (newly.sum(), more.size, int((want>0).sum()))
    print(est.round, est.info, est.parts, "lam", hi, "goal", goal, "e2", e2, "c", len(c), c.sum(), np.bincount(np.minimum(out[out>lev],20)), flush=True)
    if not want.any():
        if newly.any(): return allocate(est)
        out = np.where(shown | est.probe.ravel(), np.minimum(lev + 1, HIGHEST), 0); want[...] = out.reshape(H, W)
    return est.round < 14
