// Buildings as the viewer has them, whether they come from 3D Tiles or from CityJSON.

import { BufferAttribute, type BufferGeometry, type Mesh, type Object3D } from 'three';

export type Properties = Record<string, string | number | null>;

/// What a mesh of buildings knows: for each vertex the number of its building and of its surface, and the attributes of each.
export interface Features {
  ofBuilding: ArrayLike<number>;
  ofSurface: ArrayLike<number>;
  buildings: Properties[];
  surfaces: Properties[];
}

export const featuresOf = (mesh: Object3D): Features | undefined => mesh.userData.features;

export const MODES = ['semantics', 'height', 'roof type', 'RMSE', 'method'] as const;
export type Mode = (typeof MODES)[number];

type Colour = [number, number, number];

export interface Legend {
  items?: [string, string][];
  ramp?: { from: string; to: string; css: string };
}

const hex = (text: string): Colour => [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16)) as Colour;

const SURFACES: Record<string, string> = { RoofSurface: '#b4533f', WallSurface: '#d9d2c5', GroundSurface: '#7b7b76' };
/// Colours that people with any colour vision can tell apart (Okabe and Ito).
const KINDS = ['#0072b2', '#e69f00', '#009e73', '#cc79a7', '#56b4e9', '#d55e00', '#f0e442', '#999999'];
/// From low to high, evenly seen (viridis).
const RAMP = ['#440154', '#414487', '#2a788e', '#22a884', '#7ad151', '#fde725'].map(hex);
const MISSING = '#8a8a8a';
const CHOSEN = hex('#ffd23e');

/// Ends of the ramps. Above them, colours stay.
const HEIGHT_MOST = 40;
const RMSE_MOST = 0.5;

const kinds = new Map<string, Map<string, string>>();

/// The colour of a kind: the next free one, the same for all tiles.
function kind(group: string, value: string): string {
  const known = kinds.get(group) ?? new Map<string, string>();
  kinds.set(group, known);
  if (!known.has(value)) known.set(value, KINDS[known.size % KINDS.length]);
  return known.get(value)!;
}

function ramp(part: number): Colour {
  const at = Math.min(0.9999, Math.max(0, part)) * (RAMP.length - 1);
  const [i, t] = [Math.floor(at), at % 1];
  return [0, 1, 2].map((k) => RAMP[i][k] * (1 - t) + RAMP[i + 1][k] * t) as Colour;
}

const number = (value: unknown) => (typeof value === 'number' && value !== -9999 ? value : undefined);
export const heightOf = (b: Properties) => number(b.measuredHeight) ?? number(b.measured_height_m) ?? number(b.height_m);

/** Older results have the second name. */
const roofOf = (b: Properties) => b.roofType ?? b.roof_type;

function colourOf(mode: Mode, building: Properties): Colour {
  const scaled = (value: number | undefined, most: number) => (value === undefined ? hex(MISSING) : ramp(value / most));
  switch (mode) {
    case 'height':
      return scaled(heightOf(building), HEIGHT_MOST);
    case 'RMSE':
      return scaled(number(building.rmse_m), RMSE_MOST);
    case 'roof type':
      return roofOf(building) ? hex(kind(mode, String(roofOf(building)))) : hex(MISSING);
    default:
      return building.method ? hex(kind(mode, String(building.method))) : hex(MISSING);
  }
}

export function legendOf(mode: Mode): Legend {
  const css = `linear-gradient(90deg, ${RAMP.map((c) => `rgb(${c.join(' ')})`).join(', ')})`;
  switch (mode) {
    case 'semantics':
      return { items: Object.entries(SURFACES).map(([name, colour]) => [name.replace('Surface', ''), colour]) };
    case 'height':
      return { ramp: { from: '0 m', to: `${HEIGHT_MOST} m and more`, css } };
    case 'RMSE':
      return { ramp: { from: '0 m', to: `${RMSE_MOST} m and more`, css } };
    default:
      return { items: [...(kinds.get(mode) ?? [])] };
  }
}

/// Colours the vertices of a mesh of buildings.
export function paint(mesh: Mesh, mode: Mode, chosen: string | null) {
  const features = featuresOf(mesh);
  if (!features) return;
  const geometry = mesh.geometry as BufferGeometry;
  const count = geometry.getAttribute('position').count;
  let colours = geometry.getAttribute('color') as BufferAttribute;
  if (!(colours?.array instanceof Uint8Array) || colours.itemSize !== 3) {
    colours = new BufferAttribute(new Uint8Array(count * 3), 3, true);
    geometry.setAttribute('color', colours);
  }
  const target = colours.array as Uint8Array;
  const byBuilding = features.buildings.map((b) => (b.id === chosen && chosen ? CHOSEN : mode === 'semantics' ? null : linear(colourOf(mode, b))));
  const bySurface = features.surfaces.map((s) => linear(hex(SURFACES[String(s.kind)] ?? MISSING)));
  for (let i = 0; i < count; i++) {
    const own = byBuilding[features.ofBuilding[i]] ?? bySurface[features.ofSurface[i]];
    // Walls a little darker, so that the roofs stand out.
    const share = mode !== 'semantics' && features.surfaces[features.ofSurface[i]]?.kind === 'WallSurface' ? 0.72 : 1;
    for (let k = 0; k < 3; k++) target[3 * i + k] = own[k] * share;
  }
  colours.needsUpdate = true;
}

/// Vertex colours are linear, names of colours are not.
function linear(colour: Colour): Colour {
  return colour.map((v) => 255 * ((v / 255 + 0.055) / 1.055) ** 2.4) as Colour;
}
