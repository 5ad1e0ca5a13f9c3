"""Opens the tiles of a result with cjio, and makes one city of them: python cityjson.py FOLDER

Prints what it found as JSON in its last line. Needs cjio of PyPI.
"""

import glob
import json
import os
import sys

from cjio import cityjson

tiles = []
for path in sorted(glob.glob(os.path.join(sys.argv[1], "tiles", "*.city.json"))):
    with open(path) as file:
        tiles.append(cityjson.reader(file))
city, *others = tiles
found = {"tiles": len(tiles), "title": city.j.get("metadata", {}).get("title"), "epsg": city.get_epsg()}
# Vertices that are written twice, or that nothing refers to.
found["superfluous"] = sum(tile.remove_duplicate_vertices() + tile.remove_orphan_vertices() for tile in tiles)
city.merge(others)
buildings = city.get_subset_cotype(["Building"])
objects = buildings.j["CityObjects"].values()
found["buildings"] = sum(1 for one in objects if one["type"] == "Building")
found["heights"] = sum(1 for one in objects if one.get("attributes", {}).get("measuredHeight", 0) > 0)
found["bbox"] = buildings.calculate_bbox()
geometries = [geometry for one in city.j["CityObjects"].values() for geometry in one.get("geometry", [])]
found["lod2"] = sum(1 for geometry in geometries if geometry["lod"] == "2")
print(json.dumps(found))
