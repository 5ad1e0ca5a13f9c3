// The blocks of a job as a heat map.

import { memo } from 'preact/compat';
import { useRef } from 'preact/hooks';
import type { Unit } from '../api';
import { seconds } from '../format';
import { STAGES } from '../progress';

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

export function blocksOf(units: Unit[]): Map<string, Block> {
  const blocks = new Map<string, Block>();
  for (const unit of units) {
    if (!OF_BLOCKS.includes(unit.stage)) continue;
    const [x, y] = unit.unit.split('_').map(Number);
    const block = blocks.get(unit.unit) ?? { name: unit.unit, x, y, state: 'ready', stage: '', seconds: 0, attempts: 0 };
    block.seconds += unit.seconds ?? 0;
    block.attempts = Math.max(block.attempts, unit.attempts);
    // A failure stays; else the latest stage that has begun tells the state.
    const later = STAGES.indexOf(unit.stage) >= STAGES.indexOf(block.stage);
    if (unit.state === 'failed') [block.state, block.stage, block.reason] = ['failed', unit.stage, unit.reason];
    else if (block.state !== 'failed' && later && (unit.state !== 'ready' || block.stage === '')) {
      [block.state, block.stage] = [unit.state, unit.stage];
    }
    blocks.set(unit.unit, block);
  }
  return blocks;
}

/// A block that is done with a stage is not done yet if others follow.
const shade = (block: Block) =>
  block.state === 'done' || block.state === 'reused' ? `${block.state} ${block.stage}` : block.state;

export function Grid({ blocks, metric, chosen, choose }: { blocks: Map<string, Block>; metric: Metric; chosen: string | null; choose: (name: string | null) => void }) {
  const frame = useRef<HTMLDivElement>(null);
  if (!blocks.size) return <p class="dim">The mesh is not split yet.</p>;
  let [columns, rows, slowest, most] = [1, 1, 0.1, 1];
  for (const block of blocks.values()) {
    columns = Math.max(columns, block.x + 1);
    rows = Math.max(rows, block.y + 1);
    slowest = Math.max(slowest, block.seconds);
    most = Math.max(most, block.attempts);
  }
  const key = (event: KeyboardEvent) => {
    const cell = (event.target as HTMLElement).dataset.block;
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (!cell || !step) return;
    event.preventDefault();
    let [x, y] = cell.split('_').map(Number);
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
  const first = chosen && blocks.has(chosen) ? chosen : blocks.keys().next().value;
  const cells = [];
  for (let y = rows - 1; y >= 0; y--) {
    for (let x = 0; x < columns; x++) {
      const block = blocks.get(`${x}_${y}`);
      if (!block) {
        cells.push(<span key={`${x}_${y}`} class="cell none" />);
        continue;
      }
      const level = metric === 'seconds' ? block.seconds / slowest : metric === 'attempts' ? (block.attempts - 1) / Math.max(1, most - 1) : -1;
      const text = metric === 'seconds' ? seconds(block.seconds) : metric === 'attempts' ? `${block.attempts} attempts` : '';
      cells.push(
        <Cell
          key={block.name}
          name={block.name}
          look={metric === 'phase' ? `phase-${block.stage}` : level < 0 ? shade(block) : block.attempts ? 'scale' : 'ready'}
          level={level < 0 ? 0 : Math.round(level * 20) / 20}
          label={`Block ${x}, ${y}: ${block.stage} ${block.state}${text ? `, ${text}` : ''}${block.reason ? `: ${block.reason}` : ''}`}
          chosen={block.name === chosen}
          stop={block.name === first}
        />,
      );
    }
  }
  return (
    <>
      <div class="grid" ref={frame} style={{ gridTemplateColumns: `repeat(${columns}, 1fr)` }} role="group" aria-label={`Blocks, ${columns} columns, ${rows} rows, north at the top`} onClick={click} onKeyDown={key}>
        {cells}
      </div>
      <Legend metric={metric} slowest={slowest} most={most} />
    </>
  );
}

const Cell = memo(({ name, look, level, label, chosen, stop }: { name: string; look: string; level: number; label: string; chosen: boolean; stop: boolean }) => (
  <button class={`cell ${look}`} data-block={name} style={level ? { '--level': `${level * 100}%` } : undefined} title={label} aria-label={label} aria-pressed={chosen} tabIndex={stop ? 0 : -1} />
));

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
