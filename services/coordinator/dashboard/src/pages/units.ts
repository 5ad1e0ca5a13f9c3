// The units of a job by the place where they lie: blocks and the tiles in their places, and patches of the labelling.

import type { Unit, UnitKind } from '../api';

/// What all stages say of a place.
export interface Place {
  name: string;
  kind: 'block' | 'patch';
  x: number;
  y: number;
  state: Unit['state'] | 'empty';
  stage: string;
  seconds: number;
  attempts: number;
  reason?: string;
}

/// The stages whose units lie where the blocks lie.
export const OF_BLOCKS = ['sample', 'model', 'write'];

const places = new Map<string, [number, number]>();

/// Column and row in the name of a block, tile or patch.
export function columnAndRow(name: string): [number, number] {
  let found = places.get(name);
  if (!found) places.set(name, (found = name.replace(/^patch_/, '').split('_').map(Number) as [number, number]));
  return found;
}

const NAMES: Record<UnitKind, string> = { scene: 'Mesh', block: 'Block', patch: 'Patch', tile: 'Tile', city: 'City', unknown: 'Unit' };

/// The name of a unit for people: "Patch 3, 7". There is one mesh and one city.
export function titleOf(kind: UnitKind, name: string): string {
  return kind === 'scene' || kind === 'city' ? NAMES[kind] : `${NAMES[kind]} ${columnAndRow(name).join(', ')}`;
}

/// The kind of what a name stands for on the map.
export const kindOf = (name: string): UnitKind =>
  name === 'scene' || name === 'city' ? name : name.startsWith('patch_') ? 'patch' : 'block';

/// The places of a kind, by name. `written`: whether it is known which tiles hold something.
export function placesOf(units: Unit[], kind: Place['kind'], written: boolean): Map<string, Place> {
  const found = new Map<string, Place>();
  const tiles = new Set<string>();
  for (const unit of units) {
    if (unit.stage === 'write') tiles.add(unit.unit);
    const order = kind === 'patch' ? (unit.kind === 'patch' ? 0 : -1) : OF_BLOCKS.indexOf(unit.stage);
    if (order < 0) continue;
    let place = found.get(unit.unit);
    if (!place) {
      const [x, y] = columnAndRow(unit.unit);
      found.set(unit.unit, (place = { name: unit.unit, kind, x, y, state: 'ready', stage: '', seconds: 0, attempts: 0 }));
    }
    place.seconds += unit.seconds ?? 0;
    if (unit.attempts > place.attempts) place.attempts = unit.attempts;
    // A failure stays; else the latest stage that has begun tells the state.
    const later = kind === 'patch' || order >= OF_BLOCKS.indexOf(place.stage);
    if (unit.state === 'failed') [place.state, place.stage, place.reason] = ['failed', unit.stage, unit.reason];
    else if (place.state !== 'failed' && later && (unit.state !== 'ready' || place.stage === '')) {
      place.state = unit.state;
      place.stage = unit.stage;
    }
  }
  if (kind === 'block' && written) {
    for (const place of found.values()) {
      if (!tiles.has(place.name) && (place.state === 'done' || place.state === 'reused')) place.state = 'empty';
    }
  }
  return found;
}
