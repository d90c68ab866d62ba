"""The surface of a height map, coarse enough to be drawn without a graphics card, with a picture over it."""
import cv2
import numpy as np

from vcharge import HeightMap

MAX_VERTICES = 160_000
MAX_PICTURE_PX = 2048
JPEG_QUALITY = 80
UNKNOWN, LARGEST = -32768, 32767


def surface_of(height_map: HeightMap):
    """A grid of heights, and a JPEG of the same area, whose rows go along y: (description for the page, int16 rows x columns,
    bytes). None for a map without a known cell."""
    rows, columns = np.nonzero(np.isfinite(height_map.height_m))
    if not len(rows):
        return None
    part = np.s_[rows.min():rows.max() + 1, columns.min():columns.max() + 1]
    heights = height_map.height_m[part].astype(float)
    step = max(1, int(np.ceil(np.sqrt(heights.size / MAX_VERTICES))))
    coarse = block_means(heights, step)
    low, high = float(np.nanmin(coarse)), max(float(np.nanmax(coarse)), float(np.nanmin(coarse)) + 1e-3)
    packed = np.where(np.isfinite(coarse), np.round((np.nan_to_num(coarse) - low) / (high - low) * 2 * LARGEST - LARGEST), UNKNOWN)
    cell = height_map.cell_size_m
    corner = height_map.origin_m + cell * (np.array([columns.min(), rows.min()]) - 0.5)
    gray = shaded(heights, cell) if height_map.gray is None else height_map.gray[part]
    scale = min(1.0, MAX_PICTURE_PX / max(gray.shape))
    picture = cv2.resize(gray, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) if scale < 1 else gray
    done, jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    assert done
    # The mean of a block belongs to the block's middle; the last blocks may reach over the edge.
    return {"originM": (corner + 0.5 * step * cell).tolist(), "cellM": step * cell, "rows": coarse.shape[0],
            "columns": coarse.shape[1], "lowM": low, "highM": high, "pictureCornerM": corner.tolist(),
            "pictureSizeM": [heights.shape[1] * cell, heights.shape[0] * cell]}, packed.astype(np.int16), jpeg.tobytes()


def block_means(heights, step):
    """Means of the known cells of blocks of step x step cells; NaN where none is known."""
    rows, columns = (-(-size // step) for size in heights.shape)
    padded = np.full((rows * step, columns * step), np.nan)
    padded[:heights.shape[0], :heights.shape[1]] = heights
    blocks = padded.reshape(rows, step, columns, step)
    known = np.isfinite(blocks)
    counts = known.sum((1, 3))
    return np.where(counts > 0, np.where(known, blocks, 0.0).sum((1, 3)) / np.maximum(counts, 1), np.nan)


def shaded(heights, cell_m):
    """Gray levels of a surface lit from the side."""
    slope = np.nan_to_num(heights - np.roll(heights, (1, 1), (0, 1))) / cell_m
    return np.clip(150 + 80 * slope, 30, 250).astype(np.uint8)
