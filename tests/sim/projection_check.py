#!/usr/bin/python3
"""Rendered centres against an independent projection.

    projection_check.py RENDER_PICTURES CELL.json CELL.sim.json

Shares no code with the simulator or the estimator: reads the files itself, builds rotations from six numbers,
solves the division model (spec 20 E1) for the distorted point by iteration instead of using E2, and measures the
rendered discs by grey-value-weighted area moments. Compared with the area centroid of the projected outline.
Straight lenses (K = 0) are projected by OpenCV instead. Exit 0 when all agree to 0.002 px, 77 (skip) without
numpy or OpenCV.
"""
import json
import re
import subprocess
import sys
import tempfile

try:
    import cv2
    import numpy as np
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

LARGEST_PX = 0.002
POSES = [[0, 0, 0, 0, 0, 0], [30, -30, 30, 0.2, -0.2, 0.2], [-21.3, 4.4, 17.2, -0.13, -0.19, 0.16]]


def read_json(path):
    with open(path, encoding="utf-8") as file:
        return json.loads(re.sub(r"^\s*//.*$", "", file.read(), flags=re.MULTILINE))


def turn(axis, degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def pose(six):
    matrix = np.eye(4)
    matrix[:3, :3] = turn("z", six[5]) @ turn("y", six[4]) @ turn("x", six[3])
    matrix[:3, 3] = six[:3]
    return matrix


def project_division(camera, points_C):
    """Newton on r / (1 + K r^2) = ru for the distorted radius r."""
    x, y = points_C[:, 0] / points_C[:, 2], points_C[:, 1] / points_C[:, 2]
    ru, K = np.hypot(x, y), camera["K"]
    r = ru.copy()
    for _ in range(50):
        bend = 1 + K * r * r
        r -= (r / bend - ru) / ((1 - K * r * r) / bend**2)
    assert np.all(np.abs(r / (1 + K * r * r) - ru) < 1e-15)
    scale = r / ru
    return np.stack([camera["fx"] * x * scale + camera["cx"], camera["fy"] * y * scale + camera["cy"]], 1)


def project_opencv(camera, points_C):
    K = np.array([[camera["fx"], 0, camera["cx"]], [0, camera["fy"], camera["cy"]], [0, 0, 1]])
    return cv2.projectPoints(points_C.reshape(-1, 1, 3), np.zeros(3), np.zeros(3), K, None)[0].reshape(-1, 2)


def outline(mark, X_CO):
    normal = np.array(mark["normal"]) / np.linalg.norm(mark["normal"])
    first = np.cross(normal, [0.3, -0.5, 0.81])
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    angle = np.linspace(0, 2 * np.pi, 1440, endpoint=False)[:, None]
    circle = np.array(mark["position_mm"]) + mark["radius_mm"] * (np.cos(angle) * first + np.sin(angle) * second)
    return circle @ X_CO[:3, :3].T + X_CO[:3, 3]


def area_centroid(polygon):
    origin = polygon.mean(0)
    a, b = polygon - origin, np.roll(polygon, -1, 0) - origin
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return origin + ((a + b) * cross[:, None]).sum(0) / (3 * cross.sum())


def darkness_centroid(picture, centre, radius):
    """Moments of how dark the pixels are, 0 = surface, 1 = mark; both levels are read beside the edge."""
    v, u = np.mgrid[0:picture.shape[0], 0:picture.shape[1]]
    distance = np.hypot(u - centre[0], v - centre[1])
    surface = np.median(picture[(distance > radius + 6) & (distance < radius + 9)])
    mark = np.median(picture[distance < 4])
    near = distance < radius + 7
    share = (surface - picture[near]) / (surface - mark)
    assert surface - mark > 50 and np.abs(share).max() < 1.001
    return np.array([(share * u[near]).sum(), (share * v[near]).sum()]) / share.sum()


def differences(program, cell_path, sim_path, straight):
    marks, cameras = read_json(cell_path)["jobs"][0]["marks"], read_json(sim_path)["cameras"]
    project = project_opencv if straight else project_division
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([program, cell_path, sim_path, folder, "flat"] + (["straight"] if straight else []),
                       input="\n".join(" ".join(map(str, six)) for six in POSES), text=True, check=True)
        for line, six in enumerate(POSES):
            for mark in marks:
                name = mark["cameras"][0]
                camera = cameras[name]
                picture = np.fromfile(f"{folder}/{name}-{line}.f32", np.float32).astype(float)
                polygon = project(camera, outline(mark, np.linalg.inv(pose(camera["X_WC"])) @ pose(six)))
                expected = area_centroid(polygon)
                radius = np.linalg.norm(polygon - expected, axis=1).max()
                found = darkness_centroid(picture.reshape(camera["height"], camera["width"]), expected, radius)
                yield np.linalg.norm(found - expected)


def main():
    program, cell_path, sim_path = sys.argv[1:4]
    good = True
    for straight in (False, True):
        px = np.array(list(differences(program, cell_path, sim_path, straight)))
        print(f"{'OpenCV, K = 0' if straight else 'division model'}: {len(px)} discs, "
              f"largest difference {px.max():.6f} px, rms {np.sqrt((px**2).mean()):.6f} px")
        good = good and len(px) == 12 * len(POSES) and px.max() <= LARGEST_PX
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
