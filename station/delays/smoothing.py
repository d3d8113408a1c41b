"""A track without its quick noise, and without lag."""

import numpy as np

from station.biases.sightings import Track


def smoothed(track: Track, sigma_s: float) -> Track:
    """Local straight lines with Gaussian weights: symmetric in time, so that nothing is shifted, also where samples are missing.

    Interpolating between noisy samples averages them, most so half-way: without this, a delay of half a sample period would
    seem to explain any picture best.

    Args:
        track: The samples.
        sigma_s: Standard deviation of the weights, seconds.
    """
    times_s = track.times_s
    reach = int(np.ceil(3.0 * sigma_s / max(float(np.median(np.diff(times_s))), 1e-3)))
    near = np.arange(len(times_s))[:, None] + np.arange(-reach, reach + 1)
    inside = (near >= 0) & (near < len(times_s))
    near = np.clip(near, 0, len(times_s) - 1)
    since_s = times_s[near] - times_s[:, None]
    w = np.where(inside, np.exp(-0.5 * (since_s / sigma_s) ** 2), 0.0)
    zeroth, first, second = w.sum(axis=1), (w * since_s).sum(axis=1), (w * since_s**2).sum(axis=1)
    level = np.einsum("nk,nkc->nc", w, track.values[near])
    moment = np.einsum("nk,nkc->nc", w * since_s, track.values[near])
    scale = zeroth * second - first**2
    lines = (second[:, None] * level - first[:, None] * moment) / np.where(scale > 0.0, scale, 1.0)[:, None]
    return Track(times_s, np.where((scale > 1e-12 * zeroth * second)[:, None], lines, track.values))
