"""Projection by the camera models of rig.yaml, for arrays of points; the formulas are those of vcharge_core."""
import abc
import math
from typing import ClassVar

import numpy as np

MAX_ITERATIONS = 60


class CameraModel(abc.ABC):
    """A lens: points in the camera's optical frame (x right, y down, z forwards) to pixels, whose centres have whole coordinates,
    and back."""

    name: ClassVar[str]
    parameter_names: ClassVar[tuple[str, ...]]
    positive: ClassVar[tuple[str, ...]]

    def __init__(self, **parameters: float):
        """Parameters by the names of rig.yaml. ValueError unless all are given, finite and, of focal lengths, positive."""
        if set(parameters) != set(self.parameter_names):
            raise ValueError(f"expected the parameters {', '.join(self.parameter_names)}")
        for key in self.parameter_names:
            if not math.isfinite(parameters[key]):
                raise ValueError(f"{key}: expected a finite number")
            if key in self.positive and parameters[key] <= 0:
                raise ValueError(f"{key}: expected a positive number")
        self.parameters = {key: float(parameters[key]) for key in self.parameter_names}

    def __repr__(self):
        values = ", ".join(f"{key}={value:g}" for key, value in self.parameters.items())
        return f"{type(self).__name__}({values})"

    def project(self, points_in_camera) -> np.ndarray:
        """Pixels (... x 2) of points (... x 3) in the camera's frame; NaN where the model has no image of the point."""
        points = np.asarray(points_in_camera, float)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            pixels, valid = self._project(points.reshape(-1, 3))
        pixels[~valid] = np.nan
        return pixels.reshape(*points.shape[:-1], 2)

    def unproject(self, pixels) -> np.ndarray:
        """Unit rays (... x 3) in the camera's frame of pixels (... x 2); NaN where no ray has that image."""
        given = np.asarray(pixels, float)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            rays, valid = self._unproject(given.reshape(-1, 2))
        rays[~valid] = np.nan
        return rays.reshape(*given.shape[:-1], 3)

    @abc.abstractmethod
    def _project(self, points):
        """Pixels, and whether they exist."""

    @abc.abstractmethod
    def _unproject(self, pixels):
        """Rays, and whether they exist."""


class _Distortion:
    """Radial-tangential distortion (Brown 1966) up to the radius at which its radial part stops growing."""

    def __init__(self, k1, k2, p1, p2):
        self.k1, self.k2, self.p1, self.p2 = k1, k2, p1, p2
        # The derivative of the radial part is 1 + 3 k1 r + 5 k2 r^2, where r is the squared radius.
        roots = np.roots([5 * k2, 3 * k1, 1.0]) if k1 or k2 else np.array([])
        real = roots[np.abs(roots.imag) < 1e-12 * (1 + np.abs(roots))].real
        self.max_radius = math.sqrt(min(real[real > 0], default=math.inf))

    def apply(self, points):
        """Distorted points (N x 2), and whether they are within the range."""
        x, y = points.T
        r = x * x + y * y
        radial = 1 + r * (self.k1 + self.k2 * r)
        distorted = np.stack([x * radial + 2 * self.p1 * x * y + self.p2 * (r + 2 * x * x),
                              y * radial + self.p1 * (r + 2 * y * y) + 2 * self.p2 * x * y], 1)
        return distorted, r < self.max_radius ** 2

    def jacobians(self, points):
        x, y = points.T
        r = x * x + y * y
        radial, slope = 1 + r * (self.k1 + self.k2 * r), self.k1 + 2 * self.k2 * r
        cross = 2 * x * y * slope + 2 * self.p1 * x + 2 * self.p2 * y
        return (radial + 2 * x * x * slope + 2 * self.p1 * y + 6 * self.p2 * x, cross,
                radial + 2 * y * y * slope + 6 * self.p1 * y + 2 * self.p2 * x)

    def remove(self, distorted):
        """Points (N x 2) with this image, and whether there are such: bisection of the radial part, then Newton's method."""
        if not any((self.k1, self.k2, self.p1, self.p2)):
            return distorted.copy(), np.isfinite(distorted).all(1)
        radius = np.linalg.norm(distorted, axis=1)
        low, high = np.zeros_like(radius), np.minimum(self.max_radius, np.maximum(1.0, 2 * radius))

        def image_of(value):
            return value * (1 + value ** 2 * (self.k1 + self.k2 * value ** 2))
        for _ in range(MAX_ITERATIONS):
            short = (high < self.max_radius) & (image_of(high) < radius)
            if not short.any():
                break
            low, high = np.where(short, high, low), np.where(short, np.minimum(self.max_radius, 2 * high), high)
        for _ in range(12):
            middle = 0.5 * (low + high)
            is_low = image_of(middle) < radius
            low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
        points = distorted * np.where(radius > 0, 0.5 * (low + high) / np.where(radius > 0, radius, 1.0), 1.0)[:, None]
        for _ in range(MAX_ITERATIONS):
            image, _ = self.apply(points)
            xx, xy, yy = self.jacobians(points)
            determinant = xx * yy - xy * xy
            rest = distorted - image
            step = np.stack([yy * rest[:, 0] - xy * rest[:, 1], xx * rest[:, 1] - xy * rest[:, 0]], 1) / determinant[:, None]
            for _ in range(MAX_ITERATIONS):  # stay within the range
                outside = np.linalg.norm(points + step, axis=1) >= self.max_radius
                if not outside.any():
                    break
                step[outside] *= 0.5
            points = points + np.where(determinant[:, None] > 0, step, np.nan)
            if not (np.linalg.norm(step, axis=1) > 1e-14 * (1 + np.linalg.norm(points, axis=1))).any():
                break
        image, valid = self.apply(points)
        return points, valid & (np.linalg.norm(image - distorted, axis=1) <= 1e-11 * (1 + radius))


def _unit(points):
    """Directions, and the lengths."""
    norms = np.linalg.norm(points, axis=1)
    return points / norms[:, None], norms


class MeiCamera(CameraModel):
    """Unified projection with radial-tangential distortion: a point on the unit sphere is projected from a centre xi behind the
    sphere's centre (Mei and Rives, "Single view point omnidirectional camera calibration from planar grids", ICRA 2007)."""

    name = "mei"
    parameter_names = ("xi", "gamma1", "gamma2", "u0", "v0", "k1", "k2", "p1", "p2")
    positive = ("gamma1", "gamma2")

    def __init__(self, **parameters: float):
        super().__init__(**parameters)
        p = self.parameters
        if p["xi"] < 0:
            raise ValueError("xi: expected at least 0")
        self._xi = p["xi"]
        self._distortion = _Distortion(p["k1"], p["k2"], p["p1"], p["p2"])
        self._scale, self._centre = np.array([p["gamma1"], p["gamma2"]]), np.array([p["u0"], p["v0"]])

    def _project(self, points):
        unit, norms = _unit(points)
        least_cosine = -1 / self._xi if self._xi > 1 else -self._xi
        distorted, valid = self._distortion.apply(unit[:, :2] / (unit[:, 2:] + self._xi))
        return distorted * self._scale + self._centre, valid & np.isfinite(norms) & (unit[:, 2] > least_cosine)

    def _unproject(self, pixels):
        plane, valid = self._distortion.remove((pixels - self._centre) / self._scale)
        r = (plane ** 2).sum(1)
        discriminant = 1 + (1 - self._xi ** 2) * r
        scale = (self._xi + np.sqrt(discriminant)) / (r + 1)
        return np.column_stack([scale[:, None] * plane, scale - self._xi]), valid & (discriminant > 0)


class PinholeCamera(CameraModel):
    """Projection into a plane with radial-tangential distortion."""

    name = "pinhole"
    parameter_names = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2")
    positive = ("fx", "fy")

    def __init__(self, **parameters: float):
        super().__init__(**parameters)
        p = self.parameters
        self._distortion = _Distortion(p["k1"], p["k2"], p["p1"], p["p2"])
        self._scale, self._centre = np.array([p["fx"], p["fy"]]), np.array([p["cx"], p["cy"]])

    def _project(self, points):
        distorted, valid = self._distortion.apply(points[:, :2] / points[:, 2:])
        is_in_front = points[:, 2] > 1e-9 * np.linalg.norm(points, axis=1)
        return distorted * self._scale + self._centre, valid & is_in_front & np.isfinite(points).all(1)

    def _unproject(self, pixels):
        plane, valid = self._distortion.remove((pixels - self._centre) / self._scale)
        return _unit(np.column_stack([plane, np.ones(len(plane))]))[0], valid


class KannalaBrandtCamera(CameraModel):
    """Radius as an odd polynomial of the angle from the axis (Kannala and Brandt, "A generic camera model and calibration method
    for conventional, wide-angle, and fish-eye lenses", PAMI 2006), up to the angle at which it stops growing."""

    name = "kannala_brandt"
    parameter_names = ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4")
    positive = ("fx", "fy")

    def __init__(self, **parameters: float):
        super().__init__(**parameters)
        p = self.parameters
        self._k = [1.0, p["k1"], p["k2"], p["k3"], p["k4"]]
        self._scale, self._centre = np.array([p["fx"], p["fy"]]), np.array([p["cx"], p["cy"]])
        roots = np.roots([(2 * i + 1) * self._k[i] for i in (4, 3, 2, 1, 0)])
        real = roots[np.abs(roots.imag) < 1e-9 * (1 + np.abs(roots))].real
        self._max_angle = min(math.pi, math.sqrt(min(real[real > 0], default=math.inf)))

    def _radius(self, angle):
        s = angle * angle
        return angle * (1 + s * (self._k[1] + s * (self._k[2] + s * (self._k[3] + s * self._k[4]))))

    def _slope(self, angle):
        s = angle * angle
        return 1 + s * (3 * self._k[1] + s * (5 * self._k[2] + s * (7 * self._k[3] + s * 9 * self._k[4])))

    def _project(self, points):
        lateral = np.hypot(points[:, 0], points[:, 1])
        angle = np.arctan2(lateral, points[:, 2])
        # Near the axis the model equals a pinhole camera to first order.
        on_axis = lateral < 1e-12 * points[:, 2]
        scale = np.where(on_axis, 1 / points[:, 2], self._radius(angle) / np.where(lateral > 0, lateral, np.nan))
        norms = np.linalg.norm(points, axis=1)
        valid = (norms > 0) & np.isfinite(norms) & (angle < self._max_angle)
        return scale[:, None] * points[:, :2] * self._scale + self._centre, valid

    def _unproject(self, pixels):
        image = (pixels - self._centre) / self._scale
        radius = np.linalg.norm(image, axis=1)
        low, high = np.zeros_like(radius), np.full_like(radius, self._max_angle)
        angle = np.minimum(radius, 0.5 * self._max_angle)
        for _ in range(MAX_ITERATIONS):
            error = self._radius(angle) - radius
            low, high = np.where(error < 0, angle, low), np.where(error < 0, high, angle)
            following = angle - error / self._slope(angle)
            following = np.where((following >= low) & (following <= high), following, 0.5 * (low + high))
            step, angle = np.abs(following - angle), following
            if not (step > 1e-16 * (1 + angle)).any():
                break
        scale = np.where(radius > 0, np.sin(angle) / np.where(radius > 0, radius, 1.0), 1.0)
        return _unit(np.column_stack([scale[:, None] * image, np.cos(angle)]))[0], radius < self._radius(self._max_angle)


MODELS = {model.name: model for model in (MeiCamera, KannalaBrandtCamera, PinholeCamera)}
