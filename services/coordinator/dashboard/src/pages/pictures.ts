// Pictures of a block from the files of the result.

import { request } from '../api';

/// The orthophoto inside the GLB of a tile's ground, as an address of an image.
export async function photograph(url: string): Promise<string> {
  const bytes = await (await request(url)).arrayBuffer();
  const view = new DataView(bytes);
  const length = view.getUint32(12, true);
  const json = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 20, length)));
  const at = json.bufferViews[json.images[0].bufferView];
  const picture = new Uint8Array(bytes, 28 + length + (at.byteOffset ?? 0), at.byteLength);
  return URL.createObjectURL(new Blob([picture], { type: json.images[0].mimeType }));
}

export interface Roof {
  rings: [number, number][][];
  slope: number;
  azimuth?: number;
}

type Surfaces = number[][][];

/// The roof surfaces of each building of a CityJSON file at its best LOD, in world coordinates.
export async function roofsByBuilding(url: string): Promise<Map<string, Roof[]>> {
  const city = await (await request(url)).json();
  const { scale, translate } = city.transform;
  const place = (i: number): [number, number] => {
    const v = city.vertices[i];
    return [v[0] * scale[0] + translate[0], v[1] * scale[1] + translate[1]];
  };
  const found = new Map<string, Roof[]>();
  for (const [id, object] of Object.entries<any>(city.CityObjects)) {
    const best = (object.geometry ?? []).reduce((a: any, b: any) => (!a || Number(b.lod) >= Number(a.lod) ? b : a), null);
    if (!best || (best.type !== 'Solid' && best.type !== 'MultiSurface')) continue;
    const surfaces: Surfaces = best.type === 'Solid' ? best.boundaries[0] : best.boundaries;
    const values: number[] = best.type === 'Solid' ? best.semantics?.values[0] : best.semantics?.values;
    const own = surfaces.flatMap((rings, i) => {
      const semantic = best.semantics?.surfaces[values?.[i]];
      if (semantic?.type !== 'RoofSurface') return [];
      return [{ rings: rings.map((ring) => ring.map(place)), slope: semantic.slope_deg ?? 0, azimuth: semantic.azimuth_deg }];
    });
    // Parts count as their building.
    const building = object.parents?.[0] ?? id;
    found.set(building, [...(found.get(building) ?? []), ...own]);
  }
  return found;
}

export const roofsOf = async (url: string): Promise<Roof[]> => [...(await roofsByBuilding(url)).values()].flat();
