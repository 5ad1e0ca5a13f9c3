#!/usr/bin/env python3
"""Line segments beside OpenCV's LSD on the same pictures, as ratios of time and shares of segments found by both.

Needs numpy, opencv-python-headless (pip) and cargo. Run from anywhere:

    python3 tests/benchmarks/line_detector.py [PICTURE ...]

Without pictures, one of turned rectangles with noise. Each program runs five times on one thread, at scales 1.0 and 0.8, and
the fastest run counts. A ratio below 1 means that gable-lines is faster. A segment over 20 pixels counts as found by the other
if one of the other's lies within 2 pixels of its middle, turned by less than 5 degrees, and covers the middle.
"""
import pathlib
import subprocess
import sys
import tempfile
import time

import cv2
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
LONG = 20.0


def rectangles(side=1500):
    rng = np.random.default_rng(3)
    picture = np.full((side, side), 90.0)
    y, x = np.mgrid[0:side, 0:side]
    for _ in range(160):
        at, angle, value = rng.uniform(0, side, 2), rng.uniform(0, np.pi), rng.uniform(20, 230)
        size = rng.uniform([20, 12], [110, 60])
        along = (x - at[0]) * np.cos(angle) + (y - at[1]) * np.sin(angle)
        across = (y - at[1]) * np.cos(angle) - (x - at[0]) * np.sin(angle)
        picture[(np.abs(along) < size[0]) & (np.abs(across) < size[1])] = value
    blurred = cv2.GaussianBlur(picture, (0, 0), 0.8)
    return np.clip(blurred + rng.normal(0, 4, blurred.shape), 0, 255).astype(np.uint8)


def opencv(picture, scale):
    detector = cv2.createLineSegmentDetector(cv2.LSD_REFINE_ADV, scale)
    best = 9e9
    for _ in range(5):
        start = time.perf_counter()
        lines = detector.detect(picture)[0]
        best = min(best, time.perf_counter() - start)
    return best, lines.reshape(-1, 4).astype(float)


def gable(picture, scale, command):
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "picture.bin"
        head = np.array([picture.shape[1], picture.shape[0], round(scale * 1000)], "<i4")
        file.write_bytes(head.tobytes() + picture.tobytes())
        text = subprocess.run([*command, file], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    first, *lines = text.splitlines()
    return float(first), np.array([line.split() for line in lines], float).reshape(-1, 4)


def found(segments, others):
    """Share of the long segments that the others hold."""
    vector = segments[:, 2:] - segments[:, :2]
    length = np.hypot(*vector.T)
    segments, vector, length = segments[length > LONG], vector[length > LONG], length[length > LONG]
    other = others[:, 2:] - others[:, :2]
    reach = np.hypot(*other.T)
    unit = other / np.maximum(reach, 1e-9)[:, None]
    hits = 0
    for a, v, n in zip((segments[:, :2] + segments[:, 2:]) / 2, vector, length):
        to = a - others[:, :2]
        along = (to * unit).sum(1)
        across = np.abs(to[:, 0] * unit[:, 1] - to[:, 1] * unit[:, 0])
        parallel = np.abs(unit @ (v / n)) > np.cos(np.radians(5))
        hits += bool(((across < 2) & (along > 0) & (along < reach) & parallel).any())
    return hits / max(len(segments), 1), len(segments)


def main():
    cv2.setNumThreads(1)
    pictures = [(pathlib.Path(p).name, cv2.imread(p, cv2.IMREAD_GRAYSCALE)) for p in sys.argv[1:]]
    for name, picture in pictures:
        if picture is None:
            sys.exit(f"{name}: cannot be read as a picture")
    example = ["-q", "--release", "-p", "gable-lines", "--example", "lsd"]
    subprocess.run(["cargo", "build", *example], cwd=ROOT, check=True)
    command = ["cargo", "run", *example, "--"]
    print(f"OpenCV {cv2.__version__}, one thread; segments over {LONG:.0f} pixels")
    print(f"{'':28}{'scale':>6}{'OpenCV':>10}{'gable':>10}{'ratio':>7}{'its by us':>18}{'ours by it':>18}")
    for name, picture in pictures or [("rectangles", rectangles())]:
        for scale in (1.0, 0.8):
            its_time, its = opencv(picture, scale)
            our_time, ours = gable(picture, scale, command)
            (its_share, its_count), (our_share, our_count) = found(its, ours), found(ours, its)
            print(
                f"{name[:28]:28}{scale:6.1f}{its_time:9.3f}s{our_time:9.3f}s{our_time / its_time:7.2f}"
                f"{its_share:9.1%} of {its_count:5}{our_share:9.1%} of {our_count:5}"
            )


if __name__ == "__main__":
    main()
