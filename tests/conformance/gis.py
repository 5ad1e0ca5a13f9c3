"""Opens the rasters and the layers of a result with GDAL: python3 gis.py FOLDER

Prints what it found as JSON in its last line. Needs Debian's python3-gdal.
"""

import glob
import json
import os
import statistics
import sys

import numpy
from osgeo import gdal, ogr, osr
from osgeo_utils.samples import validate_cloud_optimized_geotiff as cog

gdal.UseExceptions()
ogr.UseExceptions()
folder = sys.argv[1]
found = {"rasters": {}, "layers": {}, "gml": {}}


def code(srs, part=None):
    return None if srs is None else srs.GetAuthorityCode(part)


def turn(ring):
    """Twice the area of a ring: negative if it runs clockwise."""
    x, y = numpy.array([point[:2] for point in ring]).T
    x, y = x - x[0], y - y[0]
    return float((x[:-1] * y[1:] - x[1:] * y[:-1]).sum())


bands = {}
for path in sorted(glob.glob(os.path.join(folder, "rasters", "*.tif"))):
    name = os.path.basename(path)
    data = gdal.Open(path)
    warnings, errors, _ = cog.validate(path, full_check=True)
    srs = data.GetSpatialRef()
    band = data.GetRasterBand(1)
    values = data.ReadAsArray()
    bands[name] = values
    none = band.GetNoDataValue()
    seen = values[3] > 0 if values.ndim == 3 else values != none
    first = values[0] if values.ndim == 3 else values
    found["rasters"][name] = {
        "size": [data.RasterXSize, data.RasterYSize],
        "transform": data.GetGeoTransform(),
        "plane": None if srs is None else code(srs, "PROJCS"),
        "heights": None if srs is None else code(srs, "VERT_CS"),
        "projection": None if srs is None else srs.GetAttrValue("PROJECTION"),
        "bands": data.RasterCount,
        "colours": [gdal.GetColorInterpretationName(data.GetRasterBand(i + 1).GetColorInterpretation()) for i in range(data.RasterCount)],
        "type": gdal.GetDataTypeName(band.DataType),
        "unit": band.GetUnitType(),
        "none": none,
        "classes": {k: v for k, v in band.GetMetadata().items() if k.startswith("CLASS_")},
        "overviews": band.GetOverviewCount(),
        "block": band.GetBlockSize(),
        "compression": data.GetMetadataItem("COMPRESSION", "IMAGE_STRUCTURE"),
        "complaints": errors + warnings,
        "seen": float(seen.mean()),
        "low": float(first[seen].min()),
        "high": float(first[seen].max()),
    }

if "dsm.tif" in bands:
    dsm, dtm, ndsm = (bands[n] for n in ("dsm.tif", "dtm.tif", "ndsm.tif"))
    known = (dsm != -9999) & (dtm != -9999)
    found["difference"] = float(numpy.abs(dsm[known] - dtm[known] - ndsm[known]).max())
    found["same_places"] = bool(((dsm == -9999) == (bands["labels.tif"] == 255)).mean() > 0.99)

for path in sorted(p for kind in ("gpkg", "fgb", "geojson") for p in glob.glob(os.path.join(folder, "*." + kind))):
    data = gdal.OpenEx(path, gdal.OF_VECTOR)
    for number in range(data.GetLayerCount()):
        layer = data.GetLayer(number)
        srs = layer.GetSpatialRef()
        definition = layer.GetLayerDefn()
        area, invalid, ids, clockwise = 0.0, 0, [], 0
        for feature in layer:
            shape = feature.GetGeometryRef()
            area += shape.GetArea()
            flat = shape.Clone()
            flat.FlattenTo2D()
            invalid += 0 if flat.IsValid() else 1
            for part in range(flat.GetGeometryCount()) if flat.GetGeometryName() == "MULTIPOLYGON" else [None]:
                polygon = flat if part is None else flat.GetGeometryRef(part)
                clockwise += 1 if turn(polygon.GetGeometryRef(0).GetPoints()) < 0 else 0
            ids.append(feature.GetField("id"))
        found["layers"][f"{os.path.basename(path)}/{layer.GetName()}"] = {
            "count": layer.GetFeatureCount(),
            "kind": ogr.GeometryTypeToName(layer.GetGeomType()),
            "code": code(srs),
            "projection": None if srs is None else srs.GetAttrValue("PROJECTION"),
            "extent": layer.GetExtent(),
            "area": area,
            "invalid": invalid,
            "clockwise": clockwise,
            "unique": len(set(ids)),
            "fields": {
                definition.GetFieldDefn(i).GetName(): definition.GetFieldDefn(i).GetTypeName()
                for i in range(definition.GetFieldCount())
            },
        }

# What the rasters show at the footprints is what the attributes say.
package = os.path.join(folder, "city.gpkg")
if os.path.exists(package) and "ndsm.tif" in bands:
    data = gdal.OpenEx(package, gdal.OF_VECTOR)
    west, step, _, north, _, _ = found["rasters"]["ndsm.tif"]["transform"]
    heights, built = [], 0
    layer = data.GetLayerByName("footprints")
    # By the spatial index: the whole extent, then a corner of it.
    extent = layer.GetExtent()
    layer.SetSpatialFilterRect(extent[0], extent[2], extent[1], extent[3])
    found["indexed"] = layer.GetFeatureCount()
    layer.SetSpatialFilterRect(extent[0] - 10, extent[2] - 10, extent[0] - 5, extent[2] - 5)
    found["beside"] = layer.GetFeatureCount()
    layer.SetSpatialFilter(None)
    for feature in layer:
        shape = feature.GetGeometryRef()
        point = shape.PointOnSurface()
        column, row = int((point.GetX() - west) / step), int((north - point.GetY()) / step)
        built += int(bands["labels.tif"][row, column] == 3)
        heights.append(float(ndsm[row, column]) - feature.GetField("measuredHeight"))
    found["built"] = built
    found["height_differences"] = [min(heights), statistics.median(heights), max(heights)] if heights else []

for path in sorted(glob.glob(os.path.join(folder, "tiles", "*.gml"))):
    data = gdal.OpenEx(path, gdal.OF_VECTOR, open_options=["WRITE_GFS=NO"])
    layers = {data.GetLayer(i).GetName(): data.GetLayer(i).GetFeatureCount() for i in range(data.GetLayerCount())}
    found["gml"][os.path.basename(path)] = layers

print(json.dumps(found))
