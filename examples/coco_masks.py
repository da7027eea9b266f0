"""COCO: annotations as masks, labels and boxes, and a picture with them on it.

The polygons of an annotation are flat lists, x, y, x, y, in pixels; an object may have several parts. A mask with the
exact share of each pixel has soft edges, for training or to look at.
"""

import json

import numpy as np
from picture import beside, output_path

import topleft as tl

SIZE = (320, 320)
COLORS = np.array([[228, 87, 70], [66, 135, 196], [88, 168, 92]], np.float32)


def blob(x: float, y: float, radius: float, n: int, seed: int) -> list[float]:
    """Return a flat ring of n corners."""
    angles = np.linspace(0, 2 * np.pi, n, endpoint=False)
    reach = radius * (1 + 0.25 * np.sin(3 * angles + seed) + 0.1 * np.cos(7 * angles))
    return np.column_stack([x + reach * np.cos(angles), y + reach * np.sin(angles)]).round(2).ravel().tolist()


TORN = [blob(230, 120, 45, 40, 2), blob(250, 235, 40, 9, 1)]
ANNOTATIONS = {
    "images": [{"id": 1, "file_name": "blobs.jpg", "width": SIZE[0], "height": SIZE[1]}],
    "categories": [{"id": 1, "name": "round"}, {"id": 2, "name": "torn"}],
    "annotations": [
        {"id": 1, "image_id": 1, "category_id": 1, "segmentation": [blob(110, 100, 70, 60, 0)]},
        {"id": 2, "image_id": 1, "category_id": 2, "segmentation": TORN},
        {"id": 3, "image_id": 1, "category_id": 1, "segmentation": [blob(120, 230, 60, 200, 4)]},
    ],
}


def main() -> None:
    path = output_path(__doc__)
    content = json.loads(json.dumps(ANNOTATIONS))  # a file, say
    picture = np.full((*SIZE[::-1], 3), 40, np.float32)
    picture += np.linspace(0, 90, SIZE[0])[:, None]
    labels = np.zeros(SIZE[::-1], np.uint8)
    for annotation, color in zip(content["annotations"], COLORS, strict=True):
        parts = [[ring] for ring in annotation["segmentation"]]  # parts may overlap: they are polygons of their own
        mask = tl.polygons(parts, SIZE)
        labels[mask] = annotation["id"]
        share = tl.polygons(parts, SIZE, sampling="area")[..., None]
        picture += (color - picture) * (0.75 * share)
        rows, columns = np.nonzero(mask)
        box = [int(n) for n in (columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1)]
        print(f"annotation {annotation['id']}: {mask.sum()} pixels, area {share.sum(dtype=float):.2f}, box {box}")
    shown = np.concatenate([[[20, 20, 20]], COLORS])[labels].astype(np.uint8)
    tl.save_image(path, beside(picture.astype(np.uint8), shown))


if __name__ == "__main__":
    main()
