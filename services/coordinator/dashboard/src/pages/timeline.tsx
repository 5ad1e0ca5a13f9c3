// When which stage was worked on, and by how many units at a time.

import { memo } from 'preact/compat';
import { useMemo } from 'preact/hooks';
import type { Unit } from '../api';
import { seconds } from '../format';
import { STAGES } from '../progress';

const BINS = 120;

export const Timeline = memo(({ started, finished, units }: { started: string; finished?: string; units: Unit[] }) => {
  const drawn = useMemo(() => {
    const begin = Date.parse(started);
    let end = finished ? Date.parse(finished) : Math.max(begin + 1000, Date.now());
    for (const u of units) {
      if (u.started) end = Math.max(end, Date.parse(u.started) + 1000 * (u.seconds ?? 0));
    }
    const width = Math.max(1, end - begin) / BINS;
    const stages = new Map(STAGES.map((s) => [s, new Float32Array(BINS)]));
    for (const u of units) {
      if (!u.started) continue;
      const from = (Date.parse(u.started) - begin) / width;
      const to = u.state === 'running' ? BINS : from + (1000 * (u.seconds ?? 0)) / width;
      const bins = stages.get(u.stage);
      for (let i = Math.max(0, Math.floor(from)); bins && i < Math.min(BINS, Math.ceil(to)); i++) {
        bins[i] += Math.min(to, i + 1) - Math.max(from, i);
      }
    }
    const most = Math.max(1, ...[...stages.values()].map((bins) => Math.max(...bins)));
    return { stages, most, length: (end - begin) / 1000, worked: units.some((u) => u.started) };
  }, [units, finished]);
  if (!drawn.worked) return null;
  return (
    <figure class="timeline">
      <figcaption>Units at work over time, at most {Math.round(drawn.most)} of a stage</figcaption>
      {STAGES.map((stage) => {
        const bins = drawn.stages.get(stage)!;
        const path = Array.from(bins, (v, i) => `L${i} ${(16 - (16 * v) / drawn.most).toFixed(1)}L${i + 1} ${(16 - (16 * v) / drawn.most).toFixed(1)}`).join('');
        return (
          <div key={stage}>
            <span>{stage}</span>
            <svg viewBox={`0 0 ${BINS} 16`} preserveAspectRatio="none" role="img" aria-label={`${stage}: ${bins.some((v) => v > 0) ? 'worked on' : 'not begun'}`}>
              <path class={`phase-${stage}`} d={`M0 16${path}L${BINS} 16Z`} />
            </svg>
          </div>
        );
      })}
      <div class="axis" aria-hidden="true"><span /><span>0 s</span><span>{seconds(drawn.length)}</span></div>
    </figure>
  );
});
