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

// Every content that a tileset names is there; what no tileset names should not be.
const named = new Set();
const walk = (tile) => {
  if (tile.content) named.add(tile.content.uri);
  (tile.children ?? []).forEach(walk);
};
for (const name of tilesets) walk(JSON.parse(readFileSync(join(folder, name))).root);
contents.filter((name) => !named.has(name)).forEach((name) => complaints.push(`${name}: in no tileset`));
[...named].filter((name) => !contents.includes(name)).forEach((name) => complaints.push(`${name}: named, but not there`));

// A package made by the tools holds all that the tileset refers to.
const scratch = mkdtempSync(join(tmpdir(), 'gable-tiles-'));
await TilesetConverter.convert(join(folder, 'tileset.json'), undefined, join(scratch, 'city.3tz'), true);
const packed = statSync(join(scratch, 'city.3tz')).size;
rmSync(scratch, { recursive: true });

complaints.forEach((complaint) => console.error(complaint));
console.log(JSON.stringify({ contents: contents.length, tilesets: tilesets.length, buildings, surfaces, warnings, packed }));
process.exit(complaints.length ? 1 : 0);
