"""Parcels: polygons of shapely as labels, and the mean of a raster over each, by the exact share of its pixels.

A map of parcels that tile a town, and a raster of what grows there. Each pixel of the labels belongs to one parcel; a
pixel on a border counts for both of them, by its area, in the means.
"""

import numpy as np
from picture import beside, output_path

import topleft as tl

SIZE = (320, 320)
EXTENT = (500_000.0, 500_640.0, 4_200_000.0, 4_200_640.0)  # metres
N_PARCELS = 140


def make_parcels() -> list:
    """Return parcels of a town, as shapely polygons; one of them has a pond."""
    import shapely

    rng = np.random.default_rng(4)
    places = np.column_stack([rng.uniform(*side, N_PARCELS) for side in (EXTENT[:2], EXTENT[2:])])
    seeds = shapely.MultiPoint(places)
    town = shapely.box(EXTENT[0] + 20, EXTENT[2] + 20, EXTENT[1] - 20, EXTENT[3] - 20)
    found = shapely.intersection(np.array(shapely.voronoi_polygons(seeds, extend_to=town).geoms), town)
    parcels = found[~shapely.is_empty(found)].tolist()
    largest = max(range(len(parcels)), key=lambda i: parcels[i].area)
    parcels[largest] = parcels[largest].difference(parcels[largest].representative_point().buffer(12))
    return parcels


def main() -> None:
    path = output_path(__doc__)
    parcels = make_parcels()
    grid = tl.Grid(SIZE, EXTENT)

    labels = tl.polygons(parcels, grid, values="index")  # -1 outside of the town
    shares = tl.overlap(parcels, grid)
    x, y = np.meshgrid(grid.x_centers - EXTENT[0], grid.y_centers - EXTENT[2])
    growth = np.sin(x / 60) * np.cos(y / 85) + (x + y) / 900
    means = shares.means(growth)

    areas = shares.totals() * np.prod(grid.pixel_size)
    print(f"{len(parcels)} parcels, {areas.sum():.1f} square metres; {sum(p.area for p in parcels):.1f} by shapely")
    print(f"{(labels >= 0).sum()} pixels have a parcel, {len(shares.areas)} pairs of a parcel and a pixel share area")

    level = np.clip((means - growth.min()) / np.ptp(growth), 0, 1)
    colors = np.stack([60 + 150 * level, 90 + 120 * level, 80 - 30 * level], axis=1).astype(np.uint8)
    picture = tl.polygons(parcels, grid, values=colors, background=(245, 245, 245))
    raster = np.clip((growth - growth.min()) / np.ptp(growth), 0, 1)[..., None]
    shown = (np.array([60, 90, 80]) + raster * np.array([150, 120, -30])).astype(np.uint8)
    borders = (labels[:-1, :-1] != labels[1:, :-1]) | (labels[:-1, :-1] != labels[:-1, 1:])
    shown[:-1, :-1][borders] = 40
    tl.save_image(path, beside(shown, picture))


if __name__ == "__main__":
    main()
