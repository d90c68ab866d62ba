"""Published images of parking places taken for calibration, with masks that leave out the patterns and the own car."""
import cv2
import numpy as np

MAX_BOARD = 0.25  # of the image: with larger boards little else is seen


def field_of_view_mask(images):
    """255 in the lens's image circle, without its rim: what is brighter than the black around it in some image."""
    bright = (np.max(images, axis=0) > 25).astype(np.uint8) * 255
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (31, 31))
    return cv2.erode(cv2.morphologyEx(bright, cv2.MORPH_CLOSE, kernel), kernel)


def board_outline(image):
    """Convex outline of the chessboard of 9 x 6 inner corners, with its border; None where it is not found."""
    found, corners = cv2.findChessboardCornersSB(image, (9, 6))
    if not found:
        return None
    middle = corners.mean(axis=0)
    return cv2.convexHull(np.rint(middle + 1.5 * (corners - middle)).astype(np.int32))


def workshop_images(folder):
    """Images and masks of a V-Charge camera in a workshop, where the board is small."""
    images = [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in sorted((folder / "images").iterdir())]
    circle = field_of_view_mask(images)
    chosen, masks = [], []
    for image in images:
        outline = board_outline(image)
        if outline is not None and cv2.contourArea(outline) < MAX_BOARD * image.size:
            chosen.append(image)
            masks.append(cv2.fillConvexPoly(circle.copy(), outline, 0))
    return chosen, masks


def parking_lot_images(folder):
    """Images and masks of four cameras of a parked car: what is beyond the printed pattern on the ground."""
    images, masks = [], []
    for name in ("front", "left", "back", "right"):
        image = cv2.imread(str(folder / "images" / f"{name}.png"), cv2.IMREAD_GRAYSCALE)
        file = cv2.FileStorage(str(folder / "yaml" / f"{name}.yaml"), cv2.FILE_STORAGE_READ)
        camera, lens, ground_from_view, scale, shift = (
            file.getNode(key).mat() for key in ("camera_matrix", "dist_coeffs", "project_matrix", "scale_xy", "shift_xy"))
        view = camera.copy()
        view[[0, 1], [0, 1]] *= scale.ravel()
        view[:2, 2] += shift.ravel()
        y, x = np.mgrid[:image.shape[0], :image.shape[1]]
        pixels = np.stack([x, y], -1).reshape(-1, 1, 2).astype(float)
        seen = cv2.fisheye.undistortPoints(pixels, camera, lens, P=view)
        ground = np.concatenate([seen[:, 0], np.ones((len(seen), 1))], 1) @ ground_from_view.T
        # The pattern begins at the far edge of the bird's-eye view, y = 0; above the horizon the last coordinate changes its sign.
        beyond = (ground[:, 2] * ground[image.size - image.shape[1] // 2, 2] < 0) | (ground[:, 1] / ground[:, 2] < -20.0)
        mask = field_of_view_mask([image])
        mask[~beyond.reshape(image.shape)] = 0
        images.append(image)
        masks.append(mask)
    return images, masks
