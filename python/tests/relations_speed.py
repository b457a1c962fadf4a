"""Measures how many relations of two or three walks each calculus computes in a second of processor time, for `docs/relations.md`."""

import time

import numpy as np
from sketchnav import relations

SAMPLES = 1_000_000


def walk(shift):
    """A curve that does not repeat."""
    t = np.arange(SAMPLES) * 0.02
    return np.stack([3.0 * np.cos((1.0 + shift) * t) + np.sin(0.37 * t + shift), 2.0 * np.cos(0.37 * t + shift)], axis=1)


a, b, c = walk(0.0), walk(0.29), walk(0.6)
oriented = [np.hstack([walk, np.linspace(-9.0, 9.0, SAMPLES)[:, None] + i]) for i, walk in enumerate((a, b))]
boxes = [np.hstack([walk - 1.0, walk + [1.0, 0.5]]) for walk in (a, b)]
dipoles = [np.hstack([one, other]) for one, other in ((a, c), (b, walk(0.8)))]
intervals = [np.sort(walk, axis=1) + [0.0, 1e-3] for walk in (a, b)]
scale = relations.Argd({"near": 1.0, "middle": 2.0, "far": 3.0})
for calculus, objects in [
    (relations.QtcB(), (a, b)),
    (relations.QtcC(), (a, b)),
    (relations.QtcBc(), (a, b)),
    (relations.QtcB22(), (a, b)),
    (relations.QtcC22(), (a, b)),
    (relations.Mos(), (a,)),
    (relations.Cardinal(), (a, b)),
    (relations.Order(), (a, b)),
    (scale, (a, b)),
    (relations.Rcc8(), boxes),
    (relations.Rectangle(), boxes),
    (relations.Allen(), intervals),
    (relations.Opra(1), oriented),
    (relations.Opra(4), oriented),
    (relations.Qrpc(), oriented),
    (relations.Tpcc(), (a, b, c)),
    (relations.FlipFlop(), (a, b, c)),
    (relations.DoubleCross(), (a, b, c)),
    (relations.DraC(), dipoles),
    (relations.DraF(), dipoles),
]:
    seconds = []
    for _ in range(3):
        begin = time.process_time()
        calculus.relate(*objects)
        seconds.append(time.process_time() - begin)
    print(f"{calculus.name:12} {SAMPLES / min(seconds) / 1e6:6.1f} million per second")
