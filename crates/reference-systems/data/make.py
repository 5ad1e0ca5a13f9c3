#!/usr/bin/env python3
"""Makes epsg.tsv, the table of reference systems, from the database that comes with PROJ (pip install pyproj).

    make.py KNOWN.txt > epsg.tsv

KNOWN.txt holds the codes whose PROJ text another crate has, one a line: for others the text stands in the table.
One line for each system of EPSG, in the order of the codes, its fields apart by tabs:

code      EPSG code
kind      P projected, G geographic, C geocentric, V vertical, K compound, E engineering or other
parts     compound: horizontal+vertical code; not in metres: the code of the same system in metres, if there is one
plan      metres of the unit of the plan; empty for degrees
height    metres of the unit of the heights, where the system has heights
axes      directions of the first two axes (E N S W U for up, ? for others), then '-' if the code is deprecated
area      west,south,east,north of the area of use, degrees
name      as EPSG has it
alias     name in Esri's files, where it is another
proj      PROJ text, where KNOWN.txt lacks the code
"""
import sqlite3
import sys
import warnings

import pyproj
from pyproj import CRS
from pyproj.enums import PJType

warnings.filterwarnings("ignore")
known = {int(line) for line in open(sys.argv[1])}
database = sqlite3.connect(pyproj.datadir.get_data_dir() + "/proj.db")
# Of several names, the first by the alphabet.
alias = {}
for code, name in database.execute(
    "SELECT code, alt_name FROM alias_name WHERE auth_name='EPSG' AND source='ESRI' AND table_name LIKE '%_crs' ORDER BY alt_name"
):
    alias.setdefault(int(code), name)
pairs = {
    int(code): f"{flat}+{up}"
    for code, flat, up in database.execute("SELECT code, horiz_crs_code, vertical_crs_code FROM compound_crs WHERE auth_name='EPSG'")
}
deprecated = {int(c) for (c,) in database.execute("SELECT code FROM crs_view WHERE auth_name='EPSG' AND deprecated=1")}
codes = sorted(int(c) for (c,) in database.execute("SELECT code FROM crs_view WHERE auth_name='EPSG'"))
LETTER = {"east": "E", "north": "N", "south": "S", "west": "W", "up": "U", "down": "D"}


def number(value):
    return repr(float(value)).removesuffix(".0")


def method(crs):
    """What two systems have in common that differ in their unit alone."""
    operation = crs.coordinate_operation
    parts = [crs.geodetic_crs.name, operation.method_name]
    for p in operation.params:
        value = p.value * p.unit_conversion_factor
        # Definitions in metres round what is a whole number of feet.
        digits = 2 if "false" in p.name.lower() else 10
        parts.append((p.name, round(value, digits)))
    return tuple(map(str, parts))


systems = {}
for code in codes:
    try:
        systems[code] = CRS.from_epsg(code)
    except pyproj.exceptions.CRSError:
        pass

metric = {}
for code, crs in systems.items():
    if crs.is_projected and not crs.is_compound and code not in deprecated and crs.coordinate_operation and crs.axis_info[0].unit_conversion_factor == 1:
        metric.setdefault(method(crs), code)

upright = {}
for code, crs in systems.items():
    if crs.type_name == "Vertical CRS" and crs.datum and code not in deprecated and crs.axis_info[0].unit_conversion_factor == 1:
        upright.setdefault((crs.datum.name, crs.axis_info[0].direction), code)

for code, crs in systems.items():
    kind, parts, plan, height = "E", "", "", ""
    flat = crs
    if crs.is_compound:
        flat, up = crs.sub_crs_list
        kind = "K"
        parts = pairs[code]
        height = number(up.axis_info[0].unit_conversion_factor)
        plan = number(flat.axis_info[0].unit_conversion_factor) if flat.is_projected else ""
    elif crs.type_name == "Vertical CRS" or crs.is_vertical:
        kind, height = "V", number(crs.axis_info[0].unit_conversion_factor)
        if height != "1" and crs.datum:
            parts = str(upright.get((crs.datum.name, crs.axis_info[0].direction), ""))
    elif crs.is_geocentric:
        kind = "C"
    elif crs.is_geographic:
        kind = "G"
    elif crs.is_projected:
        kind, plan = "P", number(crs.axis_info[0].unit_conversion_factor)
        if len(crs.axis_info) > 2:
            height = number(crs.axis_info[2].unit_conversion_factor)
        if plan != "1" and crs.coordinate_operation:
            twin = metric.get(method(crs))
            parts = str(twin) if twin else ""
    axes = "".join(LETTER.get(a.direction.lower(), "?") for a in flat.axis_info[:2]) + ("-" if code in deprecated else "")
    area = crs.area_of_use
    bounds = ",".join(number(round(v, 2)) for v in (area.west, area.south, area.east, area.north)) if area else ""
    other = alias.get(code, "")
    text = ""
    if kind == "P" and code not in known:
        try:
            text = crs.to_proj4().replace(" +type=crs", "").replace(" +no_defs", "")
        except pyproj.exceptions.CRSError:
            pass  # No PROJ text stands for it: its places on the globe are not known.
    print("\t".join([str(code), kind, parts, plan, height, axes, bounds, crs.name, other, text]).rstrip("\t"))
