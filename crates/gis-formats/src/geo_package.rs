//! GeoPackage 1.3 (OGC 12-128r17): an SQLite database with a table for each layer and a spatial index over it.
//!
//! The bytes depend on the features and their order alone: times of change are fixed, and all is written in one transaction.

use crate::georeference::WGS_84;
use crate::{ColumnKind, Error, Feature, GeoReference, LayerInfo};
use gable_city_model::Value;
use rusqlite::types::ToSqlOutput;
use rusqlite::{Connection, ToSql, params};
use std::path::{Path, PathBuf};

/// When everything was last changed: a time that is always the same.
const CHANGED: &str = "1970-01-01T00:00:00.000Z";

/// Number of the reference system of those that have none.
const UNDEFINED: i64 = -1;

const TABLES: &str = "
CREATE TABLE gpkg_spatial_ref_sys (
  srs_name TEXT NOT NULL, srs_id INTEGER NOT NULL PRIMARY KEY, organization TEXT NOT NULL,
  organization_coordsys_id INTEGER NOT NULL, definition TEXT NOT NULL, description TEXT);
CREATE TABLE gpkg_contents (
  table_name TEXT NOT NULL PRIMARY KEY, data_type TEXT NOT NULL, identifier TEXT UNIQUE, description TEXT DEFAULT '',
  last_change DATETIME NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now')),
  min_x DOUBLE, min_y DOUBLE, max_x DOUBLE, max_y DOUBLE, srs_id INTEGER,
  CONSTRAINT fk_gc_r_srs_id FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys(srs_id));
CREATE TABLE gpkg_geometry_columns (
  table_name TEXT NOT NULL, column_name TEXT NOT NULL, geometry_type_name TEXT NOT NULL, srs_id INTEGER NOT NULL,
  z TINYINT NOT NULL, m TINYINT NOT NULL,
  CONSTRAINT pk_geom_cols PRIMARY KEY (table_name, column_name),
  CONSTRAINT uk_gc_table_name UNIQUE (table_name),
  CONSTRAINT fk_gc_tn FOREIGN KEY (table_name) REFERENCES gpkg_contents(table_name),
  CONSTRAINT fk_gc_srs FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys(srs_id));
CREATE TABLE gpkg_extensions (
  table_name TEXT, column_name TEXT, extension_name TEXT NOT NULL, definition TEXT NOT NULL, scope TEXT NOT NULL,
  CONSTRAINT ge_tce UNIQUE (table_name, column_name, extension_name));
";

/// Keeps the index right when others change features: the triggers of the extension gpkg_rtree_index.
const TRIGGERS: &str = "
CREATE TRIGGER rtree_LAYER_geom_insert AFTER INSERT ON LAYER
WHEN (NEW.geom NOT NULL AND NOT ST_IsEmpty(NEW.geom)) BEGIN
  INSERT OR REPLACE INTO rtree_LAYER_geom VALUES (
    NEW.fid, ST_MinX(NEW.geom), ST_MaxX(NEW.geom), ST_MinY(NEW.geom), ST_MaxY(NEW.geom)); END;
CREATE TRIGGER rtree_LAYER_geom_update1 AFTER UPDATE OF geom ON LAYER
WHEN OLD.fid = NEW.fid AND (NEW.geom NOTNULL AND NOT ST_IsEmpty(NEW.geom)) BEGIN
  INSERT OR REPLACE INTO rtree_LAYER_geom VALUES (
    NEW.fid, ST_MinX(NEW.geom), ST_MaxX(NEW.geom), ST_MinY(NEW.geom), ST_MaxY(NEW.geom)); END;
CREATE TRIGGER rtree_LAYER_geom_update2 AFTER UPDATE OF geom ON LAYER
WHEN OLD.fid = NEW.fid AND (NEW.geom ISNULL OR ST_IsEmpty(NEW.geom)) BEGIN
  DELETE FROM rtree_LAYER_geom WHERE id = OLD.fid; END;
CREATE TRIGGER rtree_LAYER_geom_update3 AFTER UPDATE ON LAYER
WHEN OLD.fid != NEW.fid AND (NEW.geom NOTNULL AND NOT ST_IsEmpty(NEW.geom)) BEGIN
  DELETE FROM rtree_LAYER_geom WHERE id = OLD.fid;
  INSERT OR REPLACE INTO rtree_LAYER_geom VALUES (
    NEW.fid, ST_MinX(NEW.geom), ST_MaxX(NEW.geom), ST_MinY(NEW.geom), ST_MaxY(NEW.geom)); END;
CREATE TRIGGER rtree_LAYER_geom_update4 AFTER UPDATE ON LAYER
WHEN OLD.fid != NEW.fid AND (NEW.geom ISNULL OR ST_IsEmpty(NEW.geom)) BEGIN
  DELETE FROM rtree_LAYER_geom WHERE id IN (OLD.fid, NEW.fid); END;
CREATE TRIGGER rtree_LAYER_geom_delete AFTER DELETE ON LAYER WHEN OLD.geom NOT NULL BEGIN
  DELETE FROM rtree_LAYER_geom WHERE id = OLD.fid; END;
";

/// A GeoPackage that is being written.
pub struct GeoPackage {
    path: PathBuf,
    database: Connection,
    srs: i64,
    layers: Vec<Layer>,
}

/// A layer of it.
struct Layer {
    info: LayerInfo,
    insert: String,
    features: i64,
    /// West, south, east, north.
    extent: Option<[f64; 4]>,
}

impl GeoPackage {
    /// Begins a file, which must not be there yet.
    ///
    /// # Errors
    /// If SQLite cannot write it.
    pub fn create(path: &Path, place: &GeoReference, layers: &[LayerInfo]) -> Result<Self, Error> {
        let begin = || {
            let database = Connection::open(path)?;
            // Whoever stops in between leaves no file: it is written under another name.
            database.execute_batch(
                "PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; PRAGMA temp_store = MEMORY; PRAGMA page_size = 4096;
                 PRAGMA application_id = 1196444487; PRAGMA user_version = 10300; PRAGMA trusted_schema = ON; BEGIN;",
            )?;
            database.execute_batch(TABLES)?;
            Ok(database)
        };
        let database = begin().map_err(|source| Error::GeoPackage { path: path.to_owned(), source })?;
        let mut package = Self { path: path.to_owned(), database, srs: UNDEFINED, layers: Vec::new() };
        package.add_systems(place).map_err(|source| package.error(source))?;
        for info in layers {
            package.add_layer(info).map_err(|source| package.error(source))?;
        }
        Ok(package)
    }

    /// Adds a feature to a layer, by its number.
    ///
    /// # Errors
    /// If SQLite cannot write it.
    pub fn add(&mut self, layer: usize, feature: &Feature) -> Result<(), Error> {
        let number = self.layers[layer].features + 1;
        let [west, south, east, north] = extent(feature);
        let geometry = geometry(&self.layers[layer].info, feature, self.srs as i32, [west, east, south, north]);
        let insert = || {
            let mut statement = self.database.prepare_cached(&self.layers[layer].insert)?;
            let mut values: Vec<&dyn ToSql> = vec![&number, &geometry];
            let row: Vec<Cell<'_>> = feature.values.iter().map(|value| Cell(value.as_ref())).collect();
            values.extend(row.iter().map(|cell| cell as &dyn ToSql));
            statement.execute(values.as_slice())?;
            let index = format!("INSERT INTO rtree_{}_geom VALUES (?, ?, ?, ?, ?)", self.layers[layer].info.name);
            self.database.prepare_cached(&index)?.execute(params![number, west, east, south, north])
        };
        insert().map_err(|source| self.error(source))?;
        let layer = &mut self.layers[layer];
        layer.features = number;
        let known = layer.extent.unwrap_or([west, south, east, north]);
        let [w, s, e, n] = known;
        layer.extent = Some([w.min(west), s.min(south), e.max(east), n.max(north)]);
        Ok(())
    }

    /// Writes what is left.
    ///
    /// # Errors
    /// If SQLite cannot write it.
    pub fn finish(self) -> Result<(), Error> {
        let finish = || {
            for layer in &self.layers {
                if let Some([west, south, east, north]) = layer.extent {
                    self.database.execute(
                        "UPDATE gpkg_contents SET min_x = ?, min_y = ?, max_x = ?, max_y = ? WHERE table_name = ?",
                        params![west, south, east, north, layer.info.name],
                    )?;
                }
                self.database.execute_batch(&TRIGGERS.replace("LAYER", layer.info.name))?;
            }
            self.database.execute_batch("COMMIT;")
        };
        finish().map_err(|source| self.error(source))?;
        let path = self.path.clone();
        self.database.close().map_err(|(_, source)| Error::GeoPackage { path, source })
    }

    fn error(&self, source: rusqlite::Error) -> Error {
        Error::GeoPackage { path: self.path.clone(), source }
    }

    /// The reference systems: those that every GeoPackage has, and that of the city.
    fn add_systems(&mut self, place: &GeoReference) -> rusqlite::Result<()> {
        let add = |name: &str, id: i64, organisation: &str, code: i64, text: &str| {
            self.database.execute(
                "INSERT INTO gpkg_spatial_ref_sys VALUES (?, ?, ?, ?, ?, NULL)",
                params![name, id, organisation, code, text],
            )
        };
        add("Undefined Cartesian SRS", -1, "NONE", -1, "undefined")?;
        add("Undefined geographic SRS", 0, "NONE", 0, "undefined")?;
        add("WGS 84 geodetic", 4326, "EPSG", 4326, WGS_84)?;
        let text = place.text().unwrap_or_else(|| "undefined".to_owned());
        if let Some(code) = place.plane() {
            add(&place.name(), i64::from(code), "EPSG", i64::from(code), &text)?;
            self.srs = i64::from(code);
        } else if place.tangent().is_some() {
            // Numbers from 100000 on are free for everyone.
            add(&place.name(), 100_000, "NONE", 100_000, &text)?;
            self.srs = 100_000;
        }
        Ok(())
    }

    fn add_layer(&mut self, info: &LayerInfo) -> rusqlite::Result<()> {
        let name = info.name;
        let kind = if info.is_multi { "MULTIPOLYGON" } else { "POLYGON" };
        let mut columns = format!("fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, geom {kind}");
        for column in &info.columns {
            let kind = match column.kind {
                ColumnKind::Boolean => "BOOLEAN",
                ColumnKind::Integer => "INTEGER",
                ColumnKind::Number => "REAL",
                ColumnKind::Text => "TEXT",
            };
            columns.push_str(&format!(", \"{}\" {kind}", column.name.replace('"', "\"\"")));
        }
        self.database.execute_batch(&format!(
            "CREATE TABLE {name} ({columns});
             CREATE VIRTUAL TABLE rtree_{name}_geom USING rtree(id, minx, maxx, miny, maxy);"
        ))?;
        self.database.execute(
            "INSERT INTO gpkg_contents VALUES (?, 'features', ?, ?, ?, NULL, NULL, NULL, NULL, ?)",
            params![name, name, info.description, CHANGED, self.srs],
        )?;
        self.database.execute(
            "INSERT INTO gpkg_geometry_columns VALUES (?, 'geom', ?, ?, ?, 0)",
            params![name, kind, self.srs, i64::from(info.has_heights)],
        )?;
        self.database.execute(
            "INSERT INTO gpkg_extensions VALUES (?, 'geom', 'gpkg_rtree_index',
               'http://www.geopackage.org/spec120/#extension_rtree', 'write-only')",
            params![name],
        )?;
        let places = vec!["?"; info.columns.len() + 2].join(", ");
        let insert = format!("INSERT INTO {name} VALUES ({places})");
        self.layers.push(Layer { info: info.clone(), insert, features: 0, extent: None });
        Ok(())
    }
}

/// A value as SQLite takes it.
struct Cell<'a>(Option<&'a Value>);

impl ToSql for Cell<'_> {
    fn to_sql(&self) -> rusqlite::Result<ToSqlOutput<'_>> {
        use rusqlite::types::{Value as Own, ValueRef};
        Ok(match self.0 {
            None => ToSqlOutput::Owned(Own::Null),
            Some(Value::Bool(b)) => ToSqlOutput::Owned(Own::Integer(i64::from(*b))),
            Some(Value::Integer(n)) => ToSqlOutput::Owned(Own::Integer(*n)),
            Some(Value::Number(n)) => ToSqlOutput::Owned(Own::Real(*n)),
            Some(Value::Text(text)) => ToSqlOutput::Borrowed(ValueRef::Text(text.as_bytes())),
        })
    }
}

/// West, south, east, north.
fn extent(feature: &Feature) -> [f64; 4] {
    let start = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    let points = feature.polygons.iter().flatten().flatten();
    points.fold(start, |[w, s, e, n], &[x, y, _]| [w.min(x), s.min(y), e.max(x), n.max(y)])
}

/// A geometry as GeoPackage has it: a head with the envelope, then well-known binary.
fn geometry(info: &LayerInfo, feature: &Feature, srs: i32, envelope: [f64; 4]) -> Vec<u8> {
    // Version 0; little-endian, with an envelope in the plane.
    let mut out = vec![b'G', b'P', 0, 0b0000_0011];
    out.extend(srs.to_le_bytes());
    out.extend(envelope.iter().flat_map(|v| v.to_le_bytes()));
    let z = if info.has_heights { 1000_u32 } else { 0 };
    if info.is_multi {
        head(&mut out, 6 + z, feature.polygons.len());
    }
    for rings in &feature.polygons {
        head(&mut out, 3 + z, rings.len());
        for ring in rings {
            out.extend((ring.len() as u32).to_le_bytes());
            for point in ring {
                let count = if info.has_heights { 3 } else { 2 };
                out.extend(point[..count].iter().flat_map(|v| v.to_le_bytes()));
            }
        }
    }
    out
}

/// The head of a geometry in well-known binary: its byte order, type, and the number of its parts.
fn head(out: &mut Vec<u8>, kind: u32, parts: usize) {
    out.push(1);
    out.extend(kind.to_le_bytes());
    out.extend((parts as u32).to_le_bytes());
}
