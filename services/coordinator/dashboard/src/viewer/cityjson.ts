// Meshes from CityJSON: one tile, or any file that a user opens.

import { BufferAttribute, BufferGeometry, Group, Mesh, ShapeUtils, Vector2, Vector3 } from 'three';
import type { Features, Properties } from './features';
import { material } from './look';

interface CityJson {
  type: string;
  transform: { scale: number[]; translate: number[] };
  CityObjects: Record<string, any>;
  vertices: number[][];
}

/// The buildings and the terrain of a CityJSON file at a LOD ('auto' for the best of each), in coordinates less `origin`.
export function cityJsonScene(city: CityJson, lod: string, origin: Vector3 | null): { group: Group; origin: Vector3 } {
  if (city.type !== 'CityJSON' || !city.transform) throw new Error('This is no CityJSON file with a transform.');
  const { scale, translate } = city.transform;
  const place = (i: number) => new Vector3(...city.vertices[i].map((v, k) => v * scale[k] + translate[k]));
  const from = origin ?? (city.vertices.length ? place(0).floor() : new Vector3());
  const positions: number[] = [];
  const normals: number[] = [];
  const ofBuilding: number[] = [];
  const ofSurface: number[] = [];
  const ground: number[] = [];
  const buildings: Properties[] = [];
  const surfaces: Properties[] = [];
  const numbers = new Map<string, number>();
  for (const [id, object] of Object.entries(city.CityObjects)) {
    const geometries = object.geometry ?? [];
    if (object.type === 'TINRelief') {
      for (const geometry of geometries) for (const [ring] of geometry.boundaries) {
        for (const i of ring) ground.push(...place(i).sub(from).toArray());
      }
      continue;
    }
    const best = geometries.reduce((a: any, b: any) => (!a || String(b.lod) >= String(a.lod) ? b : a), null);
    const of = (wanted: string) => geometries.filter((g: any) => String(g.lod).startsWith(wanted));
    const shown = lod === 'auto' ? [best].filter(Boolean) : of(lod).length ? of(lod) : [best].filter(Boolean);
    const owner = object.parents?.[0] ?? id;
    const attributes = city.CityObjects[owner]?.attributes ?? object.attributes ?? {};
    let building = numbers.get(owner);
    if (building === undefined) {
      building = buildings.push({ id: owner, ...attributes }) - 1;
      numbers.set(owner, building);
    }
    for (const geometry of shown) {
      const shells = geometry.type === 'Solid' ? geometry.boundaries : geometry.type === 'MultiSurface' ? [geometry.boundaries] : [];
      const values = geometry.type === 'Solid' ? geometry.semantics?.values : [geometry.semantics?.values];
      shells.forEach((shell: number[][][], s: number) =>
        shell.forEach((rings, f) => {
          const semantic = geometry.semantics?.surfaces[values?.[s]?.[f]];
          const surface = surfaces.push({ ...semantic, kind: semantic?.type ?? 'WallSurface' }) - 1;
          const loops = rings.map((ring) => ring.map((i) => place(i).sub(from)));
          const normal = newell(loops[0]);
          for (const p of triangles(loops, normal)) {
            positions.push(p.x, p.y, p.z);
            normals.push(normal.x, normal.y, normal.z);
            ofBuilding.push(building);
            ofSurface.push(surface);
          }
        }));
    }
  }
  const group = new Group();
  if (positions.length) {
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(positions), 3));
    geometry.setAttribute('normal', new BufferAttribute(new Float32Array(normals), 3));
    const mesh = new Mesh(geometry, material(lod === '0'));
    mesh.userData.features = { ofBuilding, ofSurface, buildings, surfaces } satisfies Features;
    group.add(mesh);
  }
  if (ground.length) {
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(ground), 3));
    geometry.computeVertexNormals();
    const mesh = new Mesh(geometry, material(true, 0x9aa58a));
    mesh.name = 'terrain';
    group.add(mesh);
  }
  return { group, origin: from };
}

function newell(ring: Vector3[]): Vector3 {
  const normal = new Vector3();
  ring.forEach((a, i) => {
    const b = ring[(i + 1) % ring.length];
    normal.add(new Vector3((a.y - b.y) * (a.z + b.z), (a.z - b.z) * (a.x + b.x), (a.x - b.x) * (a.y + b.y)));
  });
  return normal.normalize();
}

function triangles(loops: Vector3[][], normal: Vector3): Vector3[] {
  // Two axes in the plane of the face, so that it is seen from outside.
  const u = new Vector3().crossVectors(Math.abs(normal.z) < 0.9 ? new Vector3(0, 0, 1) : new Vector3(1, 0, 0), normal).normalize();
  const v = new Vector3().crossVectors(normal, u);
  const flat = loops.map((loop) => loop.map((p) => new Vector2(p.dot(u), p.dot(v))));
  const all = loops.flat();
  return ShapeUtils.triangulateShape(flat[0], flat.slice(1)).flat().map((i) => all[i]);
}
