#!/usr/bin/env python3
"""Writes the seeds of the fuzz targets anew: tests/fuzz/seeds.py PROGRAM

Small files, by hand or by `gable` itself (PROGRAM), of which only the small results are taken.
"""

import base64
import gzip
import io
import json
import re
import struct
import subprocess
import sys
import tarfile
import tempfile
import zipfile
import zlib
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
BETWEEN = b"\n%%%%\n"
LARGEST = 16_384


def seed(target, name, *files):
    data = BETWEEN.join(f if isinstance(f, bytes) else f.encode() for f in files)
    if len(data) > LARGEST:
        return
    folder = HERE / "seeds" / target
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(data)


def png(width, height, depth, colour, rows):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    head = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0)
    body = zlib.compress(b"".join(b"\0" + bytes(row) for row in rows))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


PICTURE = png(2, 2, 8, 2, [[255, 0, 0, 0, 255, 0], [0, 0, 255, 255, 255, 255]])
# A ground of 40 × 30 m with a box on it.
POINTS = [(x, y, z) for z, (w, s, e, n) in ((0.5, (0, 0, 40, 30)), (0.25, (10, 10, 20, 18)), (6.125, (10, 10, 20, 18)))
          for x, y in ((w, s), (e, s), (e, n), (w, n))]
QUADS = [q for i in range(4) for j in [(i + 1) % 4] for q in ((i, j, 4 + j, 4 + i), (4 + i, 4 + j, 8 + j, 8 + i))] + [(8, 9, 10, 11)]


def meshes():
    library = "newmtl other\nKd 1 0.5 0\nnewmtl brick\nKd 1 1 1\nmap_Kd -clamp on a.png\n"
    text = "mtllib a.mtl\nusemtl brick\n" + "".join(f"v {x} {y} {z}\nvt {x / 40} {y / 30}\n" for x, y, z in POINTS)
    text += "".join("f " + " ".join(f"{i + 1}/{i + 1}" for i in q) + "\n" for q in QUADS)
    seed("obj", "town", text, library)
    odd = "# odd\nmtllib a.mtl\nv 0 0 0 1 0 0\nv 9 0 \\\n 0\nv 9 9 0\nv 0 9 0\nvn 0 0 1\nusemtl brick\nf -4//1 -3//1 -2//1 -1//1\n"
    seed("obj", "odd", odd, library)
    for name in ("ascii", "binary_little_endian", "binary_big_endian"):
        head = (f"ply\nformat {name} 1.0\ncomment made here\nelement vertex {len(POINTS)}\nproperty double x\nproperty double y\n"
                "property double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
                f"element face {len(QUADS)}\nproperty list uchar int vertex_indices\nend_header\n").encode()
        end = ">" if "big" in name else "<"
        if name == "ascii":
            body = "".join(f"{x} {y} {z} 1 2 3\n" for x, y, z in POINTS) + "".join("4 %d %d %d %d\n" % q for q in QUADS)
            body = body.encode()
        else:
            body = b"".join(struct.pack(end + "dddBBB", *p, 1, 2, 3) for p in POINTS)
            body += b"".join(struct.pack(end + "Biiii", 4, *q) for q in QUADS)
        seed("ply", name, head + body)
    seed("ply", "corners", "ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 4\nproperty float x\nproperty float y\n"
         "property float z\nelement face 2\nproperty list uchar uint vertex_index\nproperty list uchar float texcoord\n"
         "property int texnumber\nend_header\n0 0 0\n9 0 0\n9 9 0\n0 9 0\n3 0 1 2 6 0 0 1 0 1 1 0\n3 0 2 3 6 0 0 1 1 0 1 0\n")
    seed("off", "ascii", f"COFF # a town\n{len(POINTS)} {len(QUADS)} 0\n" + "".join(f"{x} {y} {z} 1 2 3 255\n" for x, y, z in POINTS)
         + "".join("4 %d %d %d %d 200 200 200\n" % q for q in QUADS))
    seed("off", "binary", b"OFF BINARY\n" + struct.pack(">III12f6I", 4, 1, 0, 0, 0, 0, 9, 0, 0, 9, 9, 0, 0, 9, 0, 4, 0, 1, 2, 3, 0))
    places = b"".join(struct.pack("<fff", x - 7, z, -y) for x, y, z in POINTS)
    corners = b"".join(struct.pack("<6H", q[0], q[1], q[2], q[0], q[2], q[3]) for q in QUADS)
    uvs = b"".join(struct.pack("<ff", x / 40, y / 30) for x, y, _ in POINTS)
    parts, views, at = [places, uvs, corners, PICTURE], [], 0
    for part in parts:
        views.append({"buffer": 0, "byteOffset": at, "byteLength": len(part)})
        at += len(part)
    buffer = b"".join(parts)
    scene = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [1]}],
        "nodes": [{"mesh": 0, "scale": [2, 2, 2]}, {"children": [0], "translation": [7, 0, 0]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
        "materials": [{"name": "brick", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}], "images": [{"bufferView": 3, "mimeType": "image/png"}],
        "buffers": [{"byteLength": len(buffer)}], "bufferViews": views,
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(POINTS), "type": "VEC3", "min": [-50] * 3, "max": [50] * 3},
            {"bufferView": 1, "componentType": 5126, "count": len(POINTS), "type": "VEC2"},
            {"bufferView": 2, "componentType": 5123, "count": 6 * len(QUADS), "type": "SCALAR"}]}
    glb_json = json.dumps(scene).encode()
    glb_json += b" " * (-len(glb_json) % 4)
    padded = buffer + b"\0" * (-len(buffer) % 4)
    glb = struct.pack("<4sIII4s", b"glTF", 2, 28 + len(glb_json) + len(padded), len(glb_json), b"JSON") + glb_json
    glb += struct.pack("<I4s", len(padded), b"BIN\0") + padded
    seed("gltf", "town.glb", glb)
    scene["buffers"][0]["uri"] = "a.bin"
    seed("gltf", "town.gltf", json.dumps(scene), buffer)
    scene["accessors"][0]["sparse"] = {"count": 1, "indices": {"bufferView": 2, "componentType": 5123}, "values": {"bufferView": 0}}
    scene["meshes"][0]["primitives"][0]["mode"] = 5
    scene["buffers"][0]["uri"] = "data:;base64," + base64.b64encode(buffer).decode()
    seed("gltf", "sparse.gltf", json.dumps(scene))
    inner = {"asset": {"version": "1.0"}, "root": {"geometricError": 0, "refine": "REPLACE", "content": {"uri": "a.b3dm"}}}
    outer = {"asset": {"version": "1.0", "gltfUpAxis": "Y"}, "geometricError": 500, "root": {
        "transform": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1], "boundingVolume": {"box": [20, 15, 3, 20, 0, 0, 0, 15, 0, 0, 0, 3]},
        "geometricError": 10, "refine": "ADD", "content": {"url": "a.b3dm"},
        "children": [{"geometricError": 0, "boundingVolume": {"region": [0.07, 0.9, 0.08, 0.91, 0, 50]}, "content": {"uri": "inner.json"}}]}}
    table = b'{"BATCH_LENGTH":0,"RTC_CENTER":[1,2,3]}     '
    tile = struct.pack("<4s6I", b"b3dm", 1, 28 + len(table) + len(glb), len(table), 0, 0, 0) + table + glb
    seed("tileset", "nested", json.dumps(outer), json.dumps(inner), tile)


def textures():
    seed("texture", "a.png", PICTURE)
    seed("texture", "palette.png", png(4, 2, 4, 0, [[0x12, 0x34], [0x56, 0x78]]))
    pixels = bytes(range(36))
    seed("texture", "a.bmp", struct.pack("<2sIIIIiiHHIIiiII", b"BM", 54 + 48, 0, 54, 40, 3, 4, 1, 24, 0, 48, 2835, 2835, 0, 0) + bytes(48))
    head = struct.pack("<BBBHHBHHHHBB", 0, 0, 2, 0, 0, 0, 0, 0, 4, 3, 24, 0x20)
    seed("texture", "a.tga", head + pixels)
    seed("texture", "packed.tga", head[:2] + b"\x0a" + head[3:] + b"\x83abc\x03" + pixels[:12] + b"\x83xyz")
    entries = [(256, 3, 1, 4), (257, 3, 1, 3), (258, 3, 1, 8), (259, 3, 1, 1), (262, 3, 1, 1), (273, 4, 1, 8), (277, 3, 1, 1),
               (278, 3, 1, 3), (279, 4, 1, 12)]
    tiff = b"II*\0" + struct.pack("<I", 20) + pixels[:12] + struct.pack("<H", len(entries))
    seed("texture", "a.tif", tiff + b"".join(struct.pack("<HHII", *entry) for entry in entries) + bytes(4))
    # One pixel, without loss.
    webp = bytes.fromhex("2f00000000fef8ff0300")
    seed("texture", "a.webp", b"RIFF" + struct.pack("<I", 12 + len(webp)) + b"WEBPVP8L" + struct.pack("<I", len(webp)) + webp)
    text = (ROOT / "crates/scene/tests/reading/textures.rs").read_text()
    text = re.sub(r"[\s\\]", "", text.split('const JP2: &str = "')[1].split('"')[0])
    seed("texture", "a.jp2", base64.b64decode(text))


def archives():
    files = [("City/a.obj", b"v 0 0 0\nv 9 0 0\nv 9 9 0\nf 1 2 3\n"), ("City/metadata.xml", b"<x/>"), ("__MACOSX/._a", b"x")]
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files:
            archive.writestr(zipfile.ZipInfo(name), content, zipfile.ZIP_DEFLATED)
    seed("archive", "a.zip", packed.getvalue())
    for kind, name in ((tarfile.USTAR_FORMAT, "ustar"), (tarfile.PAX_FORMAT, "pax"), (tarfile.GNU_FORMAT, "gnu")):
        packed = io.BytesIO()
        with tarfile.open(fileobj=packed, mode="w", format=kind) as archive:
            for entry, content in files + ([("City/" + "long/" * 30 + "b.obj", b"v 1 2 3\n")] if name != "ustar" else []):
                head = tarfile.TarInfo(entry)
                head.size = len(content)
                archive.addfile(head, io.BytesIO(content))
        seed("archive", f"{name}.tar", packed.getvalue())
        seed("archive", f"{name}.tar.gz", gzip.compress(packed.getvalue(), mtime=0))
    for name, end in (("city.7z", "7z"), ("deflate64.zip", "deflate64")):
        text = (ROOT / f"services/coordinator/src/unpack/tests/{name}.hex").read_text()
        seed("archive", f"a.{end}", bytes.fromhex("".join(text.split())))


def artefacts():
    seed("block", "none", struct.pack("<I", 0) + bytes(9))
    seed("block", "head", b"\x89GBLK\r\n\x1a" + struct.pack("<IQQQ", 1, 1, 40, 40) + bytes(72))
    window = struct.pack("<dqqII", 0.5, -3, 2, 4, 3)
    walls = b"\0" * 6 + b"\1" + b"\0" * 5 + bytes(range(20))
    seed("orthograph", "sealed", window + b"\0" * 48, b"\1" * 36, b"\0\1" * 6, b"\0\x80" * 24, walls)
    for kind in (b"GBLTER01", b"GBLLOW01"):
        # An empty frame of Zstandard.
        frame = bytes.fromhex("28b52ffd0000010000")
        head = struct.pack("<d", 2.0) + struct.pack("<qqII", 0, 0, 0, 0) * 2 if b"TER" in kind else struct.pack("<I", 2) + b"{}"
        seed("maps", kind.decode(), kind + head + frame)
    description = {"step": 0.5, "width": 2, "height": 2, "corner": [10, 20], "classes": ["ground", "grass", "tree", "building"]}
    seed("labels", "hand", "", json.dumps(description), png(2, 2, 8, 0, [[0, 1], [2, 3]]))


def parameters():
    seed("params", "file", 'preset = "fast"\n\n[sampling]\nstep = 0.3\n\n[grid]\ncolumns = 4\n\n[output]\nformats = ["cityjson"]\nreport = false\n')
    seed("params", "settings", "method=zhu2018\nmodeling.beta = 0.6\nup=z\ncrs=EPSG:7415\norigin=1,2,3\nsampling-step = 0.2\n")
    stump = {"feature": 0, "threshold": 0.5, "below": -1.0, "above": 1.0}
    classifier = {"stumps": [stump], "scale": 1.0, "offset": 0.0}
    seed("weights", "small", json.dumps({"version": 1, "features": "zhu27", "tree": classifier, "grass": None, "trained_on": "nothing"}))


def places():
    metadata = ('<?xml version="1.0" encoding="utf-8"?>\n<ModelMetadata version="1"><SRS>{}</SRS>'
                "<SRSOrigin>476000,5553000,100</SRSOrigin></ModelMetadata>")
    for name, crs in (("epsg", "EPSG:25832"), ("urn", "urn:ogc:def:crs,crs:EPSG::28992,crs:EPSG::5709"), ("enu", "ENU:52.01,4.36")):
        seed("georeference", name, metadata.format(crs))
    wkt = ('PROJCS["ETRS89 / UTM zone 32N",GEOGCS["ETRS89",DATUM["European_Terrestrial_Reference_System_1989",'
           'SPHEROID["GRS 1980",6378137,298.257222101]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],'
           'PROJECTION["Transverse_Mercator"],PARAMETER["latitude_of_origin",0],PARAMETER["central_meridian",9],'
           'PARAMETER["scale_factor",0.9996],PARAMETER["false_easting",500000],PARAMETER["false_northing",0],'
           'UNIT["metre",1],AUTHORITY["EPSG","25832"]]')
    seed("georeference", "pix4d", "", wkt, "476000.0 5553000.0 100.0")
    seed("georeference", "odm", "", "", "", "WGS84 UTM 32N\n476000 5553000\n", "+proj=utm +zone=32 +datum=WGS84 +units=m +no_defs")


def requests():
    job = {"source": "mesh.obj", "city": "delft", "preset": "fast", "priority": 3,
           "parameters": {"grid.columns": 4, "output.report": False, "sampling.step": "0.25"}}
    schedule = {"cron": "30 2 * * MON", "zone": "Europe/Amsterdam", "missed": "once", "enabled": True, "job": job}
    execution = {"inputs": job, "response": "document", "subscriber": {"successUri": "https://example.com/a"}}
    for name, line, body in (
        ("job", "POST /api/v1/jobs", job),
        ("jobs", "GET /api/v1/jobs?state=running&limit=5", None),
        ("schedule", "PUT /api/v1/schedules/nightly", schedule),
        ("webhook", "POST /api/v1/webhooks", {"url": "https://example.com/hook", "events": ["city.published"], "city": "delft"}),
        ("execution", "POST /ogc/processes/city-model/execution", execution),
        ("echo", "POST /ogc/processes/echo/execution", {"inputs": {"text": "a", "number": 1}, "outputs": {"text": {}}}),
        ("member", "PUT /api/v1/cities/delft/members/group:south", {"role": "editor"}),
        ("open-upload", "POST /api/v1/open-uploads", {"name": "a.zip", "city": "delft"}),
        ("link", "POST /api/v1/cities/delft/links", {"path": "3dtiles/", "seconds": 60}),
        ("roll-back", "POST /api/v1/cities/delft/roll-back", {"generation": 1}),
        ("buildings", "GET /api/v1/cities/delft/buildings?bbox=0,0,9,9&limit=3&f=geojson", None),
        ("audit", "GET /api/v1/audit?city=delft&limit=2", None),
    ):
        seed("api", name, line + "\n" + (json.dumps(body) if body else ""))


def results(program):
    """What the program makes of a small house."""
    with tempfile.TemporaryDirectory() as folder:
        case, out = Path(folder) / "case", Path(folder) / "out"
        subprocess.run([program, "synth", "--quiet", "--case", "gable", "--out", case], check=True)
        formats = "cityjson,cityjsonseq,citygml,citygml3,obj,glb"
        subprocess.run([program, "run", case / "mesh", "--out", out, "--quiet", "--step", "0.5", "--grid", "2x2", "--formats", formats,
                        "--set", "output.labels=true"], check=True)
        for file in sorted(out.rglob("*")):
            name = f"house-{file.name}"
            data = file.read_bytes() if file.is_file() else b""
            if file.name.endswith((".city.json", ".city.jsonl")):
                for target in ("cityjson", "eval", "footprints"):
                    seed(target, name, data)
            elif file.suffix == ".gml":
                seed("citygml", name, data)
            elif file.suffix == ".glb" and file.parent.name == "tiles":
                seed("gltf", name, data)
            elif file.suffix == ".jpg":
                seed("texture", name, data)
            elif file.parent.name == "labels" and file.suffix == ".json":
                seed("labels", f"house-{file.stem}", "", data, file.with_suffix(".png").read_bytes())
        truth = case / "truth"
        for target in ("cityjson", "eval", "footprints"):
            seed(target, "truth.city.jsonl", (truth / "truth.city.jsonl").read_bytes())
        name = next(truth.glob("labels/*.json"))
        seed("labels", "truth", (truth / "truth.json").read_bytes(), name.read_bytes(), name.with_suffix(".png").read_bytes())
    outline = {"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {"class": "building", "id": "a"},
               "geometry": {"type": "Polygon", "coordinates": [[[0, 0], [9, 0], [9, 9], [0, 0]]]}}]}
    seed("footprints", "outlines.geojson", json.dumps(outline))


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    for write in (meshes, textures, archives, artefacts, parameters, places, requests):
        write()
    results(sys.argv[1])


if __name__ == "__main__":
    main()
