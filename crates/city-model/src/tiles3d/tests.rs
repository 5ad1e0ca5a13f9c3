use super::*;
use crate::shell::samples::{gabled, prism};
use crate::{Attributes, Building, Lods, Semantic, Terrain, Value};
use gable_geometry::{Box2, Crs, DVec3, dvec2, dvec3};
use serde_json::Value as Json;

/// A GLB as a reader finds it.
struct Read {
    json: Json,
    bytes: Vec<u8>,
}

impl Read {
    fn of(glb: &[u8]) -> Self {
        let word = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&glb[..4], word(4), word(8)), (b"glTF".as_slice(), 2, glb.len()));
        let json = word(12);
        assert_eq!((&glb[16..20], json % 4), (b"JSON".as_slice(), 0));
        let begin = 20 + json;
        assert_eq!((&glb[begin + 4..begin + 8], begin % 8), (b"BIN\0".as_slice(), 0));
        assert_eq!(begin + 8 + word(begin), glb.len());
        Self { json: serde_json::from_slice(&glb[20..begin]).unwrap(), bytes: glb[begin + 8..].to_vec() }
    }

    fn view(&self, number: &Json) -> &[u8] {
        let view = &self.json["bufferViews"][number.as_u64().unwrap() as usize];
        let at = view["byteOffset"].as_u64().unwrap() as usize;
        assert_eq!(at % 8, 0);
        &self.bytes[at..][..view["byteLength"].as_u64().unwrap() as usize]
    }

    fn primitive(&self) -> &Json {
        &self.json["meshes"][0]["primitives"][0]
    }

    fn floats(&self, attribute: &str) -> Vec<f32> {
        let accessor = &self.json["accessors"][self.primitive()["attributes"][attribute].as_u64().unwrap() as usize];
        let bytes = self.view(&accessor["bufferView"]);
        bytes.chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
    }

    fn indices(&self) -> Vec<u32> {
        let accessor = &self.json["accessors"][self.primitive()["indices"].as_u64().unwrap() as usize];
        let bytes = self.view(&accessor["bufferView"]);
        match accessor["componentType"].as_u64() {
            Some(5123) => bytes.chunks(2).map(|b| u32::from(u16::from_le_bytes(b.try_into().unwrap()))).collect(),
            _ => bytes.chunks(4).map(|b| u32::from_le_bytes(b.try_into().unwrap())).collect(),
        }
    }

    /// Positions in local metres, z up.
    fn positions(&self) -> Vec<DVec3> {
        let shift: Vec<f64> =
            self.json["nodes"][0]["translation"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
        let place = |p: &[f32]| {
            let [x, y, z] = [0, 1, 2].map(|i| f64::from(p[i]) + shift[i]);
            dvec3(x, -z, y)
        };
        self.floats("POSITION").chunks(3).map(place).collect()
    }

    fn table(&self, number: usize) -> &Json {
        &self.json["extensions"]["EXT_structural_metadata"]["propertyTables"][number]
    }

    fn texts(&self, table: usize, name: &str) -> Vec<String> {
        let column = &self.table(table)["properties"][name];
        let offsets: Vec<usize> = (self.view(&column["stringOffsets"]).chunks(4))
            .map(|b| u32::from_le_bytes(b.try_into().unwrap()) as usize)
            .collect();
        let bytes = self.view(&column["values"]);
        offsets.windows(2).map(|w| String::from_utf8(bytes[w[0]..w[1]].to_vec()).unwrap()).collect()
    }

    fn numbers(&self, table: usize, name: &str) -> Vec<f64> {
        let bytes = self.view(&self.table(table)["properties"][name]["values"]);
        bytes.chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect()
    }
}

fn house(id: &str, at: DVec3, rmse: Option<f64>) -> Building {
    let roof = gabled(at);
    let (low, high) = roof.bounds().unwrap();
    let block = prism(
        &[&[(low.x, low.y), (high.x, low.y), (high.x, high.y), (low.x, high.y)]],
        low.z,
        (low.z + high.z) / 2.0 + 1.0,
    );
    let mut attributes = Attributes::from([("roof_type".to_owned(), Value::Text("gabled".to_owned()))]);
    attributes.extend(rmse.map(|v| ("rmse_m".to_owned(), Value::Number(v))));
    let lods = Lods { lod1: vec![block], lod2: vec![roof], ..Lods::default() };
    Building { id: id.to_owned(), attributes, lods }
}

/// Two houses far from the origin, one without roof shape.
fn street() -> Vec<Building> {
    let mut blind = house("c", dvec3(5_030.0, -3_000.0, 12.0), None);
    blind.lods.lod2.clear();
    vec![
        house("a", dvec3(5_000.25, -3_000.0, 10.0), Some(0.125)),
        house("b", dvec3(5_015.0, -3_000.0, 11.0), None),
        blind,
    ]
}

#[test]
fn every_vertex_belongs_to_the_building_that_its_table_names() {
    let street = street();
    let content = buildings_content(&street, TileLod::Lod2).unwrap().unwrap();
    assert_eq!(content, buildings_content(&street, TileLod::Lod2).unwrap().unwrap(), "the same bytes");
    let glb = Read::of(&content.glb);
    assert_eq!(glb.texts(0, "id"), ["a", "b", "c"]);
    assert_eq!(glb.texts(0, "lod"), ["2", "2", "1"]);
    assert_eq!(glb.texts(0, "roof_type"), ["gabled"; 3]);
    let class = &glb.json["extensions"]["EXT_structural_metadata"]["schema"]["classes"]["building"]["properties"];
    let missing = class["rmse_m"]["noData"].as_f64().unwrap();
    assert_eq!(glb.numbers(0, "rmse_m"), [0.125, missing, missing]);

    let positions = glb.positions();
    let normals: Vec<DVec3> =
        (glb.floats("NORMAL").chunks(3)).map(|n| dvec3(f64::from(n[0]), -f64::from(n[2]), f64::from(n[1]))).collect();
    let owners = glb.floats("_FEATURE_ID_0");
    let surfaces = glb.floats("_FEATURE_ID_1");
    let kinds = glb.view(&glb.table(1)["properties"]["kind"]["values"]);
    let of: Vec<u32> = (glb.view(&glb.table(1)["properties"]["building"]["values"]).chunks(4))
        .map(|b| u32::from_le_bytes(b.try_into().unwrap()))
        .collect();
    assert_eq!(glb.table(1)["count"].as_u64().unwrap() as usize, kinds.len());
    for (i, p) in positions.iter().enumerate() {
        let building = &street[owners[i] as usize];
        let shell = building.lods.lod2.first().unwrap_or(&building.lods.lod1[0]);
        let nearest = shell.vertices.iter().map(|v| v.distance(*p)).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-4, "{p} is {nearest} m from the corners of {}", building.id);
        assert_eq!(of[surfaces[i] as usize], owners[i] as u32);
        let upright = normals[i].z.abs() < 1e-6;
        assert_eq!(kinds[surfaces[i] as usize] == 1, upright, "walls stand");
    }
    // The volume of what is drawn is the volume of the solids: all faces are there, and look outward.
    let volume: f64 = glb
        .indices()
        .chunks(3)
        .map(|t| [t[0], t[1], t[2]].map(|i| positions[i as usize] - positions[0]))
        .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
        .sum();
    let solids: f64 = street.iter().map(|b| b.lods.lod2.first().unwrap_or(&b.lods.lod1[0]).volume()).sum();
    assert!((volume - solids).abs() < 1e-2, "{volume} of {solids}");
}

#[test]
fn the_error_of_blocks_is_their_distance_from_the_roofs() {
    let street = street();
    let of = |b: &Building| {
        let top = b.lods.lod1[0].bounds().unwrap().1.z;
        let roof = b.lods.lod2[0].faces.iter().filter(|f| f.semantic == Semantic::RoofSurface);
        let corners = roof.flat_map(|f| &f.rings).flatten().map(|&i| b.lods.lod2[0].vertices[i as usize].z);
        corners.map(|z| (z - top).abs()).fold(0.0, f64::max)
    };
    assert_eq!(block_error(&street), of(&street[0]).max(of(&street[1])));
    assert!(block_error(&street[..1]) > 0.25);
    assert_eq!(block_error(&street[2..]), 0.25, "without roofs there is nothing to be far from");
}

#[test]
fn terrain_carries_its_picture() {
    let vertices = vec![dvec3(0.0, 0.0, 1.0), dvec3(10.0, 0.0, 1.0), dvec3(10.0, 8.0, 2.0), dvec3(0.0, 8.0, 2.0)];
    let terrain = Terrain { id: "t".to_owned(), vertices, triangles: vec![[0, 1, 2], [0, 2, 3]] };
    let bounds = Box2 { min: dvec2(0.0, 0.0), max: dvec2(10.0, 8.0) };
    let texture = GroundTexture { jpeg: b"no picture".to_vec(), bounds };
    let content = terrain_content(&terrain, &texture).unwrap().unwrap();
    let glb = Read::of(&content.glb);
    // South-west is the lower left corner of the picture, whose rows begin in the north.
    assert_eq!(glb.floats("TEXCOORD_0"), [0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    assert_eq!(glb.view(&glb.json["images"][0]["bufferView"]), b"no picture");
    assert!(glb.floats("NORMAL").chunks(3).all(|n| n[1] > 0.9), "up is y");
    let broken = Terrain { triangles: vec![[0, 1, 4]], ..terrain.clone() };
    assert!(terrain_content(&broken, &texture).unwrap_err().to_string().contains("out of range"));
    assert_eq!(terrain_content(&Terrain { triangles: Vec::new(), ..terrain }, &texture).unwrap(), None);
}

/// Tiles of a grid in a pattern with gaps, each with two levels, and the tileset over them.
fn town() -> (std::collections::BTreeMap<String, Content>, Json) {
    let mut contents = std::collections::BTreeMap::new();
    let mut layer = Vec::new();
    for (x, y) in [(0_u32, 0_u32), (1, 0), (4, 2), (4, 3), (5, 3), (2, 6), (6, 6)] {
        let at = dvec3(f64::from(x) * 100.0, f64::from(y) * 100.0, f64::from(x + y));
        let buildings = vec![house(&format!("{x}-{y}"), at, Some(0.1)), house(&format!("{x}-{y}'"), at + 20.0, None)];
        let level = |lod: TileLod, error: f64| {
            let content = buildings_content(&buildings, lod).unwrap().unwrap();
            let uri = format!("{x}_{y}.{lod:?}.glb");
            (LayerLevel { uri: uri.clone(), error, low: content.low, high: content.high }, (uri, content))
        };
        let (levels, made): (Vec<_>, Vec<_>) =
            [level(TileLod::Lod1, block_error(&buildings)), level(TileLod::Lod2, 0.0)].into_iter().unzip();
        contents.extend(made);
        layer.push(Layer { tile: [x, y], levels });
    }
    let header = TilesetHeader {
        title: "town".to_owned(),
        crs: "unknown".to_owned(),
        origin: [10.0, 20.0, 0.0],
        transform: None,
    };
    let layer = TileLayer { tiles: &layer, overviews: &[] };
    let written = write_tileset(&header, &[layer, TileLayer::default()]);
    assert_eq!(written, write_tileset(&header, &[layer]), "an empty layer is left out");
    (contents, serde_json::from_slice(&written).unwrap())
}

fn bounds(tile: &Json) -> (DVec3, DVec3) {
    let b: Vec<f64> = tile["boundingVolume"]["box"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    assert_eq!([b[4], b[5], b[6], b[8], b[9], b[10]], [0.0; 6], "parallel to the axes");
    let (centre, half) = (dvec3(b[0], b[1], b[2]), dvec3(b[3], b[7], b[11]));
    (centre - half, centre + half)
}

fn walk<'a>(tile: &'a Json, visit: &mut dyn FnMut(&'a Json, Option<&'a Json>), parent: Option<&'a Json>) {
    visit(tile, parent);
    for child in tile["children"].as_array().into_iter().flatten() {
        walk(child, visit, Some(tile));
    }
}

#[test]
fn tilesets_hold_the_rules_of_3d_tiles() {
    let (contents, tileset) = town();
    assert_eq!(tileset["asset"]["version"], "1.1");
    let root = &tileset["root"];
    assert!(tileset["geometricError"].as_f64() >= root["geometricError"].as_f64());
    let mut seen = Vec::new();
    walk(
        root,
        &mut |tile, parent| {
            let (low, high) = bounds(tile);
            let error = tile["geometricError"].as_f64().unwrap();
            if let Some(parent) = parent {
                let (outer_low, outer_high) = bounds(parent);
                // Centre and half-extents are rounded: a micrometre.
                assert!((outer_low - 1e-6).cmple(low).all() && (outer_high + 1e-6).cmpge(high).all());
                assert!(error <= parent["geometricError"].as_f64().unwrap(), "errors never rise");
                if parent.get("content").is_some() {
                    assert_eq!(parent["refine"], "REPLACE", "roofs replace blocks");
                    assert!(error < parent["geometricError"].as_f64().unwrap(), "what replaces is better");
                } else {
                    assert_eq!(parent["refine"], "ADD");
                }
            }
            match tile["content"]["uri"].as_str() {
                Some(uri) => {
                    for p in Read::of(&contents[uri].glb).positions() {
                        assert!(low.cmple(p).all() && high.cmpge(p).all(), "{p} of {uri} is outside of {low} {high}");
                    }
                    seen.push(uri);
                    let leaf = tile.get("children").is_none();
                    assert_eq!(leaf, error == 0.0, "only the finest is without error");
                    assert_eq!(leaf, uri.ends_with("Lod2.glb"));
                }
                None => assert!(tile["children"].as_array().unwrap().len() > 1, "no chain of empty tiles"),
            }
        },
        None,
    );
    seen.sort_unstable();
    assert_eq!(seen, contents.keys().map(String::as_str).collect::<Vec<_>>(), "each content once");
}

#[test]
fn an_empty_city_has_an_empty_tileset() {
    let header =
        TilesetHeader { title: String::new(), crs: String::new(), origin: [0.0; 3], transform: Some([1.0; 16]) };
    let tileset: Json = serde_json::from_slice(&write_tileset(&header, &[TileLayer::default()])).unwrap();
    assert!(tileset["root"].get("content").is_none() && tileset["root"].get("children").is_none());
    assert_eq!(tileset["root"]["transform"].as_array().unwrap().len(), 16);
}

#[test]
fn overviews_stand_for_their_tiles_until_these_are_better() {
    let level = |uri: &str, error: f64, low: DVec3, high: DVec3| LayerLevel { uri: uri.to_owned(), error, low, high };
    let tile = |x: u32, y: u32| {
        let low = dvec3(f64::from(x) * 10.0, f64::from(y) * 10.0, 0.0);
        let levels = [("coarse", 0.5), ("fine", 0.0)];
        let levels = levels.map(|(name, error)| level(&format!("{x}_{y}.{name}"), error, low, low + 10.0));
        Layer { tile: [x, y], levels: levels.to_vec() }
    };
    // Two tiles in the south-west, and one by itself in the north-east of a grid of four.
    let tiles = [tile(0, 0), tile(1, 0), tile(3, 3)];
    let overview = |corner, side, uri: &str, error, high| Overview {
        corner,
        side,
        level: level(uri, error, dvec3(0.0, 0.0, -1.0), dvec3(high, high, 12.0)),
    };
    let overviews = [overview([0, 0], 2, "pair", 1.0, 20.0), overview([0, 0], 4, "all", 2.0, 40.0)];
    let header = TilesetHeader { title: String::new(), crs: String::new(), origin: [0.0; 3], transform: None };
    let layer = TileLayer { tiles: &tiles, overviews: &overviews };
    let tileset: Json = serde_json::from_slice(&write_tileset(&header, &[layer])).unwrap();
    let mut seen = Vec::new();
    walk(
        &tileset["root"],
        &mut |tile, parent| {
            seen.push(tile["content"]["uri"].as_str().unwrap());
            assert_eq!(tile["refine"], "REPLACE");
            if let Some(parent) = parent {
                assert!(tile["geometricError"].as_f64() < parent["geometricError"].as_f64());
                let ((low, high), (outer_low, outer_high)) = (bounds(tile), bounds(parent));
                assert!(outer_low.cmple(low).all() && outer_high.cmpge(high).all());
            }
        },
        None,
    );
    assert_eq!(seen, ["all", "pair", "0_0.coarse", "0_0.fine", "1_0.coarse", "1_0.fine", "3_3.coarse", "3_3.fine"]);
    assert_eq!(tileset["root"]["geometricError"], 2.0);
    assert!(tileset["geometricError"].as_f64() > Some(2.0), "without the root all is missing");
}

fn moved(transform: [f64; 16], p: DVec3) -> DVec3 {
    let column = |i: usize| dvec3(transform[4 * i], transform[4 * i + 1], transform[4 * i + 2]);
    column(0) * p.x + column(1) * p.y + column(2) * p.z + column(3)
}

#[test]
fn cities_stand_where_they_are_on_earth() {
    assert_eq!(earth_transform(&Crs::Unknown, [0.0; 3], DVec3::ZERO, 0.0), None);
    assert_eq!(earth_transform(&Crs::Epsg(4326), [0.0; 3], DVec3::ZERO, 0.0), None, "degrees are no metres");
    // On the equator at 90° east, east is -x and north is z.
    let enu = Crs::Enu { latitude: 0.0, longitude: 90.0, height: 0.0 };
    let transform = earth_transform(&enu, [100.0, 200.0, 0.0], dvec3(7.0, 7.0, 7.0), 0.0).unwrap();
    let p = moved(transform, dvec3(1.0, 2.0, 3.0));
    assert!(p.distance(dvec3(-101.0, 6_378_140.0, 202.0)) < 1e-6, "{p}");
    // UTM 32 on its central meridian and the equator: scale 0.9996, grid north is north.
    let utm = earth_transform(&Crs::Epsg(25832), [499_000.0, 0.0, 0.0], dvec3(1000.0, 0.0, 0.0), 0.0).unwrap();
    let (sin, cos) = 9.0_f64.to_radians().sin_cos();
    let at = dvec3(6_378_137.0 * cos, 6_378_137.0 * sin, 0.0);
    assert!(moved(utm, dvec3(1000.0, 0.0, 0.0)).distance(at) < 1e-3);
    let north = moved(utm, dvec3(1000.0, 100.0, 0.0));
    assert!((north.z - 100.0 / 0.9996).abs() < 1e-3, "{north}");
    // The church tower of Amersfoort, the origin of the Dutch grid: 52.155174° north, 5.387206° east.
    let dutch = earth_transform(&Crs::Epsg(7415), [155_000.0, 463_000.0, 0.0], DVec3::ZERO, 0.0).unwrap();
    let enu = Crs::Enu { latitude: 52.155_174_4, longitude: 5.387_206_2, height: 0.0 };
    let known = earth_transform(&enu, [0.0; 3], DVec3::ZERO, 0.0).unwrap();
    let distance = moved(dutch, DVec3::ZERO).distance(moved(known, DVec3::ZERO));
    assert!(distance < 1.0, "{distance} m");
    // Heights above the sea are lifted by the geoid, those of a plane by the height of its origin.
    let lifted = earth_transform(&Crs::Epsg(7415), [155_000.0, 463_000.0, 0.0], DVec3::ZERO, 43.0).unwrap();
    assert!((moved(lifted, DVec3::ZERO).length() - moved(dutch, DVec3::ZERO).length() - 43.0).abs() < 0.01);
    let high = Crs::Enu { latitude: 0.0, longitude: 90.0, height: 520.0 };
    let high = earth_transform(&high, [0.0; 3], DVec3::ZERO, 0.0).unwrap();
    assert!(moved(high, DVec3::ZERO).distance(dvec3(0.0, 6_378_657.0, 0.0)) < 1e-6);
    // A pair stands where its plane does.
    let pair = Crs::Compound { horizontal: 28992, vertical: 5709 };
    assert_eq!(earth_transform(&pair, [155_000.0, 463_000.0, 0.0], DVec3::ZERO, 0.0), Some(dutch));
}
