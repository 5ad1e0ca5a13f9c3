// The map of a job: its units where they lie, over the mesh seen from above, coloured by how they are.

import { memo } from 'preact/compat';
import { useEffect, useLayoutEffect, useMemo, useRef, useState } from 'preact/hooks';
import { type JobMap, request } from '../api';
import { seconds } from '../format';
import { OF_BLOCKS, type Place, columnAndRow, titleOf } from './units';

export const METRICS = ['state', 'phase', 'seconds', 'attempts'] as const;
export type Metric = (typeof METRICS)[number];

export const LAYERS = ['blocks', 'patches'] as const;
export type Layer = (typeof LAYERS)[number];

type Box = [number, number, number, number];

interface Props {
  job: string;
  layer: Layer;
  blocks: Map<string, Place>;
  patches: Map<string, Place>;
  map?: JobMap;
  /// What there is once, if it failed: then nothing comes of the whole city.
  lost?: string;
  metric: Metric;
  chosen: string | null;
  choose: (name: string | null) => void;
}

/// A place that is done with a stage is not done yet if others follow.
const shade = (place: Place) =>
  place.kind === 'block' && (place.state === 'done' || place.state === 'reused') ? `${place.state} ${place.stage}` : place.state;

/// Where units lie, and the extent of all. As long as that is not told, blocks are squares in rows and columns.
function layoutOf(map: JobMap | undefined, blocks: Map<string, Place>): { bounds: Box; boxes: Map<string, Box>; metric: boolean } {
  if (map?.bbox) return { bounds: map.bbox, boxes: new Map(map.units.map((u) => [u.unit, u.bbox])), metric: true };
  const boxes = new Map<string, Box>();
  let [columns, rows] = [1, 1];
  for (const { name, x, y } of blocks.values()) {
    boxes.set(name, [x, y, x + 1, y + 1]);
    [columns, rows] = [Math.max(columns, x + 1), Math.max(rows, y + 1)];
  }
  return { bounds: [0, 0, columns, rows], boxes, metric: false };
}

/// The picture of the mesh as an address of an image.
function usePicture(job: string, there: boolean): string | undefined {
  const [picture, set] = useState<string>();
  useEffect(() => {
    if (!there) return;
    let address: string | undefined;
    let current = true;
    request(`/jobs/${job}/map/picture`).then((answer) => answer.blob()).then((blob) => {
      if (!current) return;
      address = URL.createObjectURL(blob);
      set(address);
    }, () => {});
    return () => {
      current = false;
      if (address) URL.revokeObjectURL(address);
    };
  }, [job, there]);
  return picture;
}

export const UnitMap = memo(({ job, layer, blocks, patches, map, lost, metric, chosen, choose }: Props) => {
  const frame = useRef<HTMLDivElement>(null);
  const picture = usePicture(job, map?.picture ?? false);
  const { bounds, boxes, metric: isMetric } = useMemo(() => layoutOf(map, blocks), [map, map ? 0 : blocks.size]);
  // Patches that failed are seen over the blocks, too.
  const shown = useMemo(() => {
    const above = [...patches.values()].filter((p) => p.state === 'failed');
    return layer === 'patches' ? [...patches.values()] : [...blocks.values(), ...above];
  }, [layer, blocks, patches]);
  let [slowest, most] = [0.1, 1];
  for (const place of shown) {
    slowest = Math.max(slowest, place.seconds);
    most = Math.max(most, place.attempts);
  }
  // Which units there are changes seldom from poll to poll, how they look does: that is written to the cells themselves.
  const known = shown.map((p) => p.name).filter((name) => boxes.has(name)).join();
  const names = useMemo(() => known.split(',').filter(Boolean), [known]);
  const told = useRef(new Map<string, string>());
  useLayoutEffect(() => told.current.clear(), [names, bounds, boxes]);
  useLayoutEffect(() => {
    const cells = frame.current?.querySelectorAll<HTMLElement>('[data-unit]');
    if (!cells) return;
    const drawn = new Map([...cells].map((cell) => [cell.dataset.unit!, cell]));
    const first = chosen && drawn.has(chosen) ? chosen : names[0];
    for (const place of shown) {
      const cell = drawn.get(place.name);
      if (!cell) continue;
      const failed = place.state === 'failed';
      const level = failed ? -1 : metric === 'seconds' ? place.seconds / slowest : metric === 'attempts' ? (place.attempts - 1) / Math.max(1, most - 1) : -1;
      const look = metric === 'phase' && !failed && place.stage ? `phase-${place.stage}` : level < 0 ? shade(place) : place.attempts ? 'scale' : 'ready';
      const part = level > 0 ? Math.round(level * 20) * 5 : 0;
      const [isChosen, isStop] = [place.name === chosen, place.name === first];
      const state = `${look}|${part}|${place.stage}|${place.state}|${place.attempts}|${metric === 'seconds' ? place.seconds.toFixed(1) : ''}|${isChosen}|${isStop}`;
      if (told.current.get(place.name) === state) continue;
      told.current.set(place.name, state);
      const text = metric === 'seconds' ? `, ${seconds(place.seconds)}` : metric === 'attempts' ? `, ${place.attempts} attempts` : '';
      const label = `${titleOf(place.kind, place.name)}: ${place.state === 'empty' ? 'holds nothing' : `${place.stage} ${place.state}`}${text}`;
      cell.className = `cell ${place.kind} ${look}`;
      cell.style.setProperty('--level', `${part}%`);
      cell.title = label;
      cell.setAttribute('aria-label', label);
      cell.setAttribute('aria-pressed', String(isChosen));
      cell.tabIndex = isStop ? 0 : -1;
    }
  });
  const [width, height] = [bounds[2] - bounds[0], bounds[3] - bounds[1]];
  const key = (event: KeyboardEvent) => {
    const cell = (event.target as HTMLElement).dataset.unit;
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (!cell || !step) return;
    event.preventDefault();
    const start = cell.startsWith('patch_') ? 'patch_' : '';
    let [x, y] = columnAndRow(cell);
    // Over places where there is no unit.
    for (let tries = 0; tries < 1024; tries++) {
      [x, y] = [x + step[0], y + step[1]];
      const next = frame.current?.querySelector<HTMLElement>(`[data-unit="${start}${x}_${y}"]`);
      if (next) return next.focus();
    }
  };
  const click = (event: MouseEvent) => {
    const cell = (event.target as HTMLElement).closest<HTMLElement>('[data-unit]')?.dataset.unit;
    if (cell) choose(cell === chosen ? null : cell);
  };
  if (!blocks.size && !map?.units.length) {
    return lost ? <p class="bad">The mesh could not be split: there is no map.</p> : <p class="dim">The mesh is not split yet.</p>;
  }
  const what = layer === 'patches' ? 'Patches of the labelling' : 'Blocks and tiles';
  return (
    <>
      <div class={`grid${picture ? ' pictured' : ''}`} ref={frame} role="group" onClick={click} onKeyDown={key}
        aria-label={`${what}, north at the top${lost ? `; the city failed: ${lost}` : ''}`}
        style={{ aspectRatio: `${width} / ${height}`, maxWidth: `min(100%, 640px, calc(74vh * ${width / height}))` }}>
        {picture && <img src={picture} alt="" />}
        <Cells names={names} bounds={bounds} boxes={boxes} />
        {lost && <div class="lost-city" aria-hidden="true"><span>✕ {lost} failed</span></div>}
      </div>
      {layer === 'patches' && !names.length && <p class="dim">Patches are known when all blocks are sampled.</p>}
      {isMetric && <Scale width={width} height={height} />}
      <Legend layer={layer} metric={metric} slowest={slowest} most={most} empty={shown.some((p) => p.state === 'empty')} />
    </>
  );
});

/// The units, each where it lies; what is outside of the blocks is cut off.
const Cells = memo(({ names, bounds, boxes }: { names: string[]; bounds: Box; boxes: Map<string, Box> }) => {
  const [west, south, east, north] = bounds;
  const part = (from: number, length: number, all: number) => [`${(100 * from) / all}%`, `${(100 * length) / all}%`];
  return (
    <>
      {names.map((name) => {
        const [w, s, e, n] = boxes.get(name)!;
        const [left, width] = part(w - west, e - w, east - west);
        const [bottom, height] = part(s - south, n - s, north - south);
        return <button key={name} data-unit={name} style={{ left, bottom, width, height }} />;
      })}
    </>
  );
});

/// How long things are: a bar of a round number of metres.
function Scale({ width, height }: { width: number; height: number }) {
  const most = width / 3;
  const power = 10 ** Math.floor(Math.log10(most));
  const length = [5, 2, 1].map((n) => n * power).find((n) => n <= most) ?? power;
  return (
    <p class="scale-bar">
      <i style={{ width: `${(100 * length) / width}%` }} aria-hidden="true" />
      <span>{length >= 1000 ? `${length / 1000} km` : `${length} m`}</span>
      <span class="dim">{Math.round(width)} m × {Math.round(height)} m</span>
    </p>
  );
}

function Legend({ layer, metric, slowest, most, empty }: { layer: Layer; metric: Metric; slowest: number; most: number; empty: boolean }) {
  const done: [string, string][] = layer === 'patches' ? [['done', 'labelled']] : [['done sample', 'sampled'], ['done model', 'modelled'], ['done write', 'written']];
  const nothing: [string, string][] = empty ? [['empty', 'holds nothing']] : [];
  const failed: [string, string] = ['failed', layer === 'patches' ? 'failed' : 'failed block, tile or patch'];
  const items: [string, string][] =
    metric === 'state'
      ? [['ready', 'waiting'], ['running', 'running'], ...done, ['reused', 'taken over'], ...nothing, failed]
      : metric === 'phase'
        ? [...(layer === 'patches' ? ['segment'] : OF_BLOCKS).map((stage) => [`phase-${stage}`, stage] as [string, string]), failed]
        : [failed];
  return (
    <p class="legend" aria-hidden="true">
      {items.map(([look, text]) => <span key={look}><i class={`cell ${look}`} /> {text}</span>)}
      {(metric === 'seconds' || metric === 'attempts') && <span>{metric === 'seconds' ? '0 s' : '1'} <i class="ramp" /> {metric === 'seconds' ? seconds(slowest) : most}</span>}
    </p>
  );
}
