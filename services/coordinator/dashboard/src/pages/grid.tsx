// The blocks of a job as a heat map.

import { memo } from 'preact/compat';
import { useLayoutEffect, useMemo, useRef } from 'preact/hooks';
import type { Unit } from '../api';
import { seconds } from '../format';

export const METRICS = ['state', 'phase', 'seconds', 'attempts'] as const;
export type Metric = (typeof METRICS)[number];

/// What all stages say of a block.
export interface Block {
  name: string;
  x: number;
  y: number;
  state: Unit['state'];
  stage: string;
  seconds: number;
  attempts: number;
  reason?: string;
}

/// The stages whose units are blocks. Patches of the labelling are on a lattice of their own.
const OF_BLOCKS = ['sample', 'model', 'write'];

const places = new Map<string, [number, number]>();

/// Column and row of a block.
function place(name: string): [number, number] {
  let found = places.get(name);
  if (!found) places.set(name, (found = name.split('_').map(Number) as [number, number]));
  return found;
}

export function blocksOf(units: Unit[]): Map<string, Block> {
  const blocks = new Map<string, Block>();
  for (const unit of units) {
    const order = OF_BLOCKS.indexOf(unit.stage);
    if (order < 0) continue;
    let block = blocks.get(unit.unit);
    if (!block) {
      const [x, y] = place(unit.unit);
      blocks.set(unit.unit, (block = { name: unit.unit, x, y, state: 'ready', stage: '', seconds: 0, attempts: 0 }));
    }
    block.seconds += unit.seconds ?? 0;
    if (unit.attempts > block.attempts) block.attempts = unit.attempts;
    // A failure stays; else the latest stage that has begun tells the state.
    const later = order >= OF_BLOCKS.indexOf(block.stage);
    if (unit.state === 'failed') [block.state, block.stage, block.reason] = ['failed', unit.stage, unit.reason];
    else if (block.state !== 'failed' && later && (unit.state !== 'ready' || block.stage === '')) {
      block.state = unit.state;
      block.stage = unit.stage;
    }
  }
  return blocks;
}

/// A block that is done with a stage is not done yet if others follow.
const shade = (block: Block) =>
  block.state === 'done' || block.state === 'reused' ? `${block.state} ${block.stage}` : block.state;

export const Grid = memo(({ blocks, metric, chosen, choose }: { blocks: Map<string, Block>; metric: Metric; chosen: string | null; choose: (name: string | null) => void }) => {
  const frame = useRef<HTMLDivElement>(null);
  let [columns, rows, slowest, most] = [1, 1, 0.1, 1];
  for (const block of blocks.values()) {
    columns = Math.max(columns, block.x + 1);
    rows = Math.max(rows, block.y + 1);
    slowest = Math.max(slowest, block.seconds);
    most = Math.max(most, block.attempts);
  }
  // Which blocks there are does not change from poll to poll, how they look does: that is written to the cells themselves.
  const names = useMemo(() => [...blocks.keys()], [blocks.size]);
  const told = useRef(new Map<string, string>());
  useLayoutEffect(() => told.current.clear(), [names, columns, rows]);
  useLayoutEffect(() => {
    const cells = frame.current?.children;
    if (!cells) return;
    const first = chosen && blocks.has(chosen) ? chosen : names[0];
    for (const block of blocks.values()) {
      const level = metric === 'seconds' ? block.seconds / slowest : metric === 'attempts' ? (block.attempts - 1) / Math.max(1, most - 1) : -1;
      const look = metric === 'phase' ? `phase-${block.stage}` : level < 0 ? shade(block) : block.attempts ? 'scale' : 'ready';
      const part = level > 0 ? Math.round(level * 20) * 5 : 0;
      const [isChosen, isStop] = [block.name === chosen, block.name === first];
      const state = `${look}|${part}|${block.stage}|${block.state}|${block.attempts}|${metric === 'seconds' ? block.seconds.toFixed(1) : ''}|${isChosen}|${isStop}|${block.reason ?? ''}`;
      if (told.current.get(block.name) === state) continue;
      told.current.set(block.name, state);
      const cell = cells[(rows - 1 - block.y) * columns + block.x] as HTMLElement;
      const text = metric === 'seconds' ? `, ${seconds(block.seconds)}` : metric === 'attempts' ? `, ${block.attempts} attempts` : '';
      const label = `Block ${block.x}, ${block.y}: ${block.stage} ${block.state}${text}${block.reason ? `: ${block.reason}` : ''}`;
      cell.className = `cell ${look}`;
      cell.style.setProperty('--level', `${part}%`);
      cell.title = label;
      cell.setAttribute('aria-label', label);
      cell.setAttribute('aria-pressed', String(isChosen));
      cell.tabIndex = isStop ? 0 : -1;
    }
  });
  if (!blocks.size) return <p class="dim">The mesh is not split yet.</p>;
  const key = (event: KeyboardEvent) => {
    const cell = (event.target as HTMLElement).dataset.block;
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (!cell || !step) return;
    event.preventDefault();
    let [x, y] = place(cell);
    for (;;) {
      [x, y] = [x + step[0], y + step[1]];
      if (x < 0 || y < 0 || x >= columns || y >= rows) return;
      const next = frame.current?.querySelector<HTMLElement>(`[data-block="${x}_${y}"]`);
      if (next) return next.focus();
    }
  };
  const click = (event: MouseEvent) => {
    const cell = (event.target as HTMLElement).closest<HTMLElement>('[data-block]')?.dataset.block;
    if (cell) choose(cell === chosen ? null : cell);
  };
  return (
    <>
      <div class="grid" ref={frame} style={{ gridTemplateColumns: `repeat(${columns}, 1fr)` }} role="group" aria-label={`Blocks, ${columns} columns, ${rows} rows, north at the top`} onClick={click} onKeyDown={key}>
        <Cells names={names} columns={columns} rows={rows} />
      </div>
      <Legend metric={metric} slowest={slowest} most={most} />
    </>
  );
});

/// The cells, north at the top; nothing for places without a block.
const Cells = memo(({ names, columns, rows }: { names: string[]; columns: number; rows: number }) => {
  const there = new Set(names);
  const cells = [];
  for (let y = rows - 1; y >= 0; y--) {
    for (let x = 0; x < columns; x++) {
      const name = `${x}_${y}`;
      cells.push(there.has(name) ? <button key={name} data-block={name} /> : <span key={name} class="cell none" />);
    }
  }
  return <>{cells}</>;
});

function Legend({ metric, slowest, most }: { metric: Metric; slowest: number; most: number }) {
  const items: [string, string][] =
    metric === 'state'
      ? [['ready', 'waiting'], ['running', 'running'], ['done sample', 'sampled'], ['done model', 'modelled'], ['done write', 'written'], ['reused', 'taken over'], ['failed', 'failed']]
      : metric === 'phase'
        ? OF_BLOCKS.map((stage) => [`phase-${stage}`, stage])
        : [];
  return (
    <p class="legend" aria-hidden="true">
      {items.map(([look, text]) => <span key={look}><i class={`cell ${look}`} /> {text}</span>)}
      {!items.length && <span>{metric === 'seconds' ? '0 s' : '1'} <i class="ramp" /> {metric === 'seconds' ? seconds(slowest) : most}</span>}
    </p>
  );
}
