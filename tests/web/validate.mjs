// Holds the 3D Tiles of a folder against gltf-validator and 3d-tiles-tools: node validate.mjs FOLDER
// Prints what was checked as JSON; every complaint goes to standard error and makes the exit code 1.

import { readFileSync, readdirSync, statSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import validator from 'gltf-validator';
import { GltfTransform, TilesetConverter } from '3d-tiles-tools';

const folder = process.argv[2];
const complaints = [];
const contents = readdirSync(folder).filter((name) => name.endsWith('.glb'));
const tilesets = readdirSync(folder).filter((name) => name.endsWith('.json'));
let [buildings, surfaces, warnings] = [0, 0, 0];
/// Triangles of the mesh, by level from fine to coarse.
const meshTriangles = [];

const io = await GltfTransform.getIO();
for (const name of contents) {
  const bytes = new Uint8Array(readFileSync(join(folder, name)));
  const report = await validator.validateBytes(bytes, { uri: name, maxIssues: 100 });
  warnings += report.issues.numWarnings;
  if (report.issues.numErrors) {
    complaints.push(...report.issues.messages.filter((m) => m.severity === 0).map((m) => `${name}: ${m.code} ${m.message} ${m.pointer}`));
  }
  // Another reader finds the tables and what refers to them.
  const document = await io.readBinary(bytes);
  const root = document.getRoot();
  const metadata = root.getExtension('EXT_structural_metadata');
  if (name.includes('.mesh-')) {
    const triangles = root.listMeshes().flatMap((mesh) => mesh.listPrimitives()).reduce((sum, p) => sum + p.getIndices().getCount() / 3, 0);
    const level = Number(name.match(/mesh-(\d+)/)[1]);
    meshTriangles[level] = (meshTriangles[level] ?? 0) + triangles;
    if (root.listMeshes().some((mesh) => mesh.listPrimitives().some((p) => !p.getAttribute('COLOR_0')))) complaints.push(`${name}: no colours`);
    continue;
  }
  if (name.includes('.ground')) {
    if (root.listTextures().length !== 1) complaints.push(`${name}: no picture`);
    continue;
  }
  const tables = metadata?.listPropertyTables() ?? [];
  if (tables.length !== 2) complaints.push(`${name}: ${tables.length} property tables`);
  for (const primitive of root.listMeshes().flatMap((mesh) => mesh.listPrimitives())) {
    const features = primitive.getExtension('EXT_mesh_features')?.listFeatureIDs() ?? [];
    if (features.length !== 2 || features.some((f, i) => f.getPropertyTable() !== tables[i])) {
      complaints.push(`${name}: the features do not refer to the tables`);
    }
  }
  if (name.endsWith('.lod2.glb')) {
    buildings += tables[0]?.getCount() ?? 0;
    surfaces += tables[1]?.getCount() ?? 0;
  }
}

const bytes = contents.reduce((sum, name) => sum + statSync(join(folder, name)).size, 0);

// The rules of 3D Tiles 1.1 for tilesets: volumes hold what is below them and their contents, errors never rise and fall where a content
// is replaced; and every content that a tileset names is there, while what no tileset names should not be.
const named = new Set();
const box = (tile) => {
  const b = tile.boundingVolume.box;
  return [0, 1, 2].map((i) => [b[i] - b[3 + 4 * i], b[i] + b[3 + 4 * i]]);
};
const holds = (outer, inner) => outer.every(([low, high], i) => low <= inner[i][0] + 1e-6 && high >= inner[i][1] - 1e-6);
/// The extent of a GLB in the axes of the tileset: z up.
const extent = (name) => {
  const glb = readFileSync(join(folder, name));
  const json = JSON.parse(glb.subarray(20, 20 + glb.readUInt32LE(12)));
  const [x, y, z] = json.nodes[0].translation;
  const positions = json.meshes.flatMap((m) => m.primitives.map((p) => json.accessors[p.attributes.POSITION]));
  const at = (pick, i) => pick(...positions.map((p) => (pick === Math.min ? p.min[i] : p.max[i])));
  return [[at(Math.min, 0) + x, at(Math.max, 0) + x], [-at(Math.max, 2) - z, -at(Math.min, 2) - z], [at(Math.min, 1) + y, at(Math.max, 1) + y]];
};
let tiles = 0;
const walk = (set, tile, parent) => {
  tiles++;
  if (parent) {
    if (!holds(box(parent), box(tile))) complaints.push(`${set}: a tile reaches out of its parent: ${JSON.stringify(tile.boundingVolume)}`);
    const better = parent.content ? tile.geometricError < parent.geometricError : tile.geometricError <= parent.geometricError;
    if (!better) complaints.push(`${set}: the error ${tile.geometricError} under ${parent.geometricError}`);
  }
  if (tile.content) {
    named.add(tile.content.uri);
    if (tile.refine !== 'REPLACE') complaints.push(`${set}: ${tile.content.uri} would be shown with what is finer`);
    if (contents.includes(tile.content.uri) && !holds(box(tile), extent(tile.content.uri))) complaints.push(`${set}: ${tile.content.uri} reaches out of its volume`);
  }
  (tile.children ?? []).forEach((child) => walk(set, child, tile));
};
for (const name of tilesets) {
  const set = JSON.parse(readFileSync(join(folder, name)));
  if (set.geometricError < set.root.geometricError) complaints.push(`${name}: the root's error is larger than the tileset's`);
  walk(name, set.root);
}
contents.filter((name) => !named.has(name)).forEach((name) => complaints.push(`${name}: in no tileset`));
[...named].filter((name) => !contents.includes(name)).forEach((name) => complaints.push(`${name}: named, but not there`));

// A package made by the tools holds all that the tileset refers to.
const scratch = mkdtempSync(join(tmpdir(), 'gable-tiles-'));
await TilesetConverter.convert(join(folder, 'tileset.json'), undefined, join(scratch, 'city.3tz'), true);
const packed = statSync(join(scratch, 'city.3tz')).size;
rmSync(scratch, { recursive: true });

complaints.forEach((complaint) => console.error(complaint));
console.log(JSON.stringify({ contents: contents.length, tilesets: tilesets.length, buildings, surfaces, warnings, packed, bytes, tiles, meshTriangles }));
process.exit(complaints.length ? 1 : 0);
