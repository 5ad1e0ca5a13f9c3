// Where buildings cross the borders of blocks, and how far they are.

import { memo } from 'preact/compat';
import { useMemo } from 'preact/hooks';
import type { JobDetail, Seam, Unit } from '../api';
import { plural, seconds } from '../format';
import { Columns, Failure, State, useGet } from '../ui';

/// Most seams that are listed, those first that an operator has to look at.
const ROWS = 40;

/// Most blocks of a seam that are named.
const NAMES = 4;

const named = (blocks: string[]) => blocks.map((b) => b.replace('_', ', ')).join(' · ');

const URGENCY = ['failed', 'running', 'ready', 'cancelled', 'done', 'reused'];

export function Seams({ job, units, choose }: { job: JobDetail; units: Unit[]; choose: (block: string) => void }) {
  const stitch = units.find((u) => u.stage === 'stitch');
  const over = stitch?.state === 'done' || stitch?.state === 'reused';
  // What was stitched again is asked for again.
  const { value, error, again } = useGet<Seam[]>(over ? `/jobs/${job.id}/seams#${stitch.started ?? ''}` : null);
  // A seam is as far as the unit that models its buildings.
  const states = useMemo(() => new Map(units.filter((u) => u.stage === 'model').map((u) => [u.unit, u.state])), [units]);
  const told = value?.map((seam) => `${states.get(seam.owner) ?? 'ready'}`).join() ?? '';
  return (
    <section class="card" aria-labelledby="seams-title">
      <h2 id="seams-title">Seams</h2>
      {!over && <p class="dim">{stitch ? <>Buildings are united across the borders of blocks when all patches are labelled: <State state={stitch.state} /></> : 'The mesh is not split yet.'}</p>}
      {error && <Failure error={error} retry={again} />}
      {value?.length === 0 && <p class="dim">No building crosses the border of a block.</p>}
      {!!value?.length && <List seams={value} told={told} took={stitch?.seconds} choose={choose} />}
    </section>
  );
}

/// Drawn again only if a state changed, not with each poll.
const List = memo(
  ({ seams, told, took, choose }: { seams: Seam[]; told: string; took?: number; choose: (block: string) => void }) => {
    const states = told.split(',');
    const order = seams.map((_, i) => i).sort((a, b) => URGENCY.indexOf(states[a]) - URGENCY.indexOf(states[b]) || a - b);
    const buildings = seams.reduce((sum, seam) => sum + seam.buildings, 0);
    const counts = URGENCY.map((state) => [state, states.filter((s) => s === state).length] as const).filter(([, n]) => n > 0);
    return (
      <>
        <p class="facts">
          <span>{plural(buildings, 'building')} across {plural(seams.length, 'seam')}{took !== undefined && `, stitched in ${seconds(took)}`}</span>
          {counts.map(([state, n]) => <span key={state}>{n} <State state={state} /></span>)}
        </p>
        <div class="seams">
          <table class="stacked">
            <Columns names={['Blocks', 'Buildings', 'Modelled with', 'State']} numbers={['Buildings']} />
            <tbody>
              {order.slice(0, ROWS).map((i) => (
                <tr key={seams[i].blocks.join() + seams[i].owner}>
                  <th scope="row" title={named(seams[i].blocks)}>
                    {named(seams[i].blocks.slice(0, NAMES))}{seams[i].blocks.length > NAMES && <small> and {seams[i].blocks.length - NAMES} more</small>}
                  </th>
                  <td class="number" data-label="Buildings">{seams[i].buildings}</td>
                  <td data-label="Modelled with"><button class="linklike" onClick={() => choose(seams[i].owner)}>{seams[i].owner.replace('_', ', ')}</button></td>
                  <td data-label="State"><State state={states[i]} /></td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
        {order.length > ROWS && <p class="dim">and {order.length - ROWS} more, which the API lists</p>}
      </>
    );
  },
  (old, next) => old.seams === next.seams && old.told === next.told && old.took === next.took,
);
