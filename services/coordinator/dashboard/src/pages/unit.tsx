// One unit of a job, or a block with the tile in its place: what happened to it, and pictures of what came of it.

import type { JobDetail, JobEvent, JobMap, ResultFile, Unit, UnitKind } from '../api';
import { ApiError, download, filesOf, jobPlace, request } from '../api';
import { seconds } from '../format';
import { STAGES } from '../progress';
import { link } from '../router';
import { Columns, Failure, Loading, State, useGet } from '../ui';
import { useEffect, useRef, useState } from 'preact/hooks';
import { EventLine } from './job';
import { type Roof, photograph, roofsOf } from './pictures';
import { kindOf, titleOf } from './units';

/// What a unit is, for those who do not know.
const MEANINGS: Partial<Record<UnitKind, string>> = {
  scene: 'The mesh as a whole, which is split into blocks.',
  block: 'A part of the mesh, and the tile of the result in its place.',
  patch: 'A part of the fixed lattice on which ground, plants and buildings are told apart; it does not hang on the blocks.',
  city: 'What is done once for the whole city.',
};

export function UnitPanel({ job, name, units, map, events, choose }: { job: JobDetail; name: string; units: Unit[]; map?: JobMap; events: JobEvent[]; choose: (name: string | null) => void }) {
  const own = units.filter((u) => u.unit === name).sort((a, b) => STAGES.indexOf(a.stage) - STAGES.indexOf(b.stage));
  const log = events.filter((e) => e.unit === name);
  const kind = kindOf(name);
  const title = titleOf(kind, name);
  // There would be a grey square.
  const seen = !own.some((u) => u.stage === 'sample' && u.state === 'failed');
  const panel = useRef<HTMLElement>(null);
  // On a narrow screen the panel is below the map, out of sight.
  useEffect(() => panel.current?.scrollIntoView({ block: 'nearest', behavior: 'smooth' }), [name]);
  // A reason that many have is told above.
  const reasons = own.filter((u) => u.reason && u.state !== 'failed');
  return (
    <section class="card block" ref={panel} aria-label={title}>
      <div class="title small">
        <h2>{title}</h2>
        <button class="quiet" onClick={() => choose(null)} aria-label="Close">✕</button>
      </div>
      <p class="dim">{MEANINGS[kind]}</p>
      <Whereabouts name={name} kind={kind} map={map} choose={choose} />
      <div class="scroll"><table class="stacked">
        <Columns names={['Stage', 'State', 'Attempts', 'Time', 'Worker']} numbers={['Attempts', 'Time']} />
        <tbody>
          {own.map((u) => (
            <tr key={u.stage}>
              <th scope="row">{u.stage}</th>
              <td data-label="State"><span><State state={u.state} /> {u.phase && <small>{u.phase}</small>}</span></td>
              <td class="number" data-label="Attempts">{u.attempts}</td>
              <td class="number" data-label="Time">{u.seconds !== undefined ? seconds(u.seconds) : ''}</td>
              <td class="long" data-label="Worker"><small>{u.worker}</small></td>
            </tr>
          ))}
        </tbody>
      </table></div>
      {!own.length && <p class="dim">This job has no such unit.</p>}
      {reasons.map((u) => <p class="bad" key={u.stage}>Its last attempt at {u.stage}: {u.reason}</p>)}
      {job.finished && kind === 'block' && (seen ? <Pictures job={job.id} name={name} /> : <p class="dim">There is no picture: the mesh of this block was not sampled.</p>)}
      <Said job={job.id} name={name} version={own.map((u) => u.state + u.attempts).join()} />
      <h3>Events</h3>
      <ol class="events short" tabIndex={0} aria-label="Events of the unit">{log.map((e) => <EventLine key={e.number} event={e} />)}</ol>
      {!log.length && <p class="dim">No event of this unit.</p>}
    </section>
  );
}

type Box = JobMap['units'][number]['bbox'];

/// Where a unit lies, in metres, and what else lies there.
function Whereabouts({ name, kind, map, choose }: { name: string; kind: UnitKind; map?: JobMap; choose: (name: string) => void }) {
  const box = map?.units.find((u) => u.unit === name)?.bbox ?? (kind === 'scene' || kind === 'city' ? map?.bbox : undefined);
  if (!map || !box) return null;
  const shares = (b: Box) => Math.min(b[2], box[2]) - Math.max(b[0], box[0]) > 0 && Math.min(b[3], box[3]) - Math.max(b[1], box[1]) > 0;
  const others = kind === 'block' ? 'patch' : 'block';
  const beside = kind === 'block' || kind === 'patch' ? map.units.filter((u) => u.kind === others && shares(u.bbox)) : [];
  const metres = (value: number) => String(Math.round(10 * value) / 10);
  return (
    <>
      <p class="facts">
        <span>{metres(box[2] - box[0])} m × {metres(box[3] - box[1])} m</span>
        <span>east {metres(box[0])} to {metres(box[2])}, north {metres(box[1])} to {metres(box[3])}</span>
        {map.crs && <span>{map.crs}</span>}
      </p>
      {beside.length > 0 && (
        <p class="chips">
          <span class="dim">{kind === 'block' ? 'Labelled in' : 'Lies in'}</span>
          {beside.slice(0, 9).map((u) => <button key={u.unit} class="chip" onClick={() => choose(u.unit)}>{titleOf(u.kind, u.unit)}</button>)}
          {beside.length > 9 && <span class="dim">and {beside.length - 9} more</span>}
        </p>
      )}
    </>
  );
}

/// What the unit's programs said, asked for when somebody wants to see it, and again when more of them have ended.
function Said({ job, name, version }: { job: string; name: string; version: string }) {
  const [open, setOpen] = useState(false);
  const path = open ? `/jobs/${job}/blocks/${encodeURIComponent(name)}/log#${version}` : null;
  const { value, error, again } = useGet<string>(path, async (at) => (await request(at)).text());
  return (
    <details onToggle={(e) => setOpen(e.currentTarget.open)}>
      <summary>Log</summary>
      {value !== undefined ? <pre class="log" tabIndex={0} aria-label="Log of the unit">{value}</pre>
        : error instanceof ApiError && error.status === 404 ? <p class="dim">Nothing yet.</p>
        : error ? <Failure error={error} retry={again} />
        : open && <Loading what="the log" />}
    </details>
  );
}

interface Shown {
  photo?: string;
  labels?: string;
  roofs: Roof[];
  bounds?: [number, number, number, number];
  files: ResultFile[];
}

function Pictures({ job, name }: { job: string; name: string }) {
  const place = jobPlace(job);
  const { value, error, again } = useGet<Shown>(`${place.list}#${name}`, async () => {
    const files = await filesOf(place);
    const of = (path: string) => files.find((f) => f.path === path) && place.file(path);
    const model = of(`tiles/${name}.city.json`);
    const drape = of(`3dtiles/${name}.ground.glb`);
    const labels = of(`labels/${name}.png`);
    const [photo, drawn, picture] = await Promise.all([
      drape && photograph(drape),
      model && roofsOf(model),
      labels && request(labels).then((answer) => answer.blob()).then(URL.createObjectURL),
    ]);
    const index = of('index.json') && (await (await request(place.file('index.json'))).json());
    const entry = index?.tiles.find((t: { tile: [number, number] }) => t.tile.join('_') === name);
    const own = files.filter((f) => new RegExp(`/${name}\\.`).test(f.path));
    return { photo, labels: picture, roofs: drawn || [], bounds: entry?.bbox, files: own };
  });
  if (error) return <Failure error={error} retry={again} />;
  if (!value) return <Loading what="the pictures" />;
  const { bounds: b } = value;
  return (
    <>
      {b && (value.photo || value.roofs.length > 0) && (
        <figure class="plan">
          <svg viewBox={`0 0 ${b[2] - b[0]} ${b[3] - b[1]}`} role="img" aria-label={`Orthophoto with ${value.roofs.length} roof surfaces`}>
            {value.photo && <image href={value.photo} width={b[2] - b[0]} height={b[3] - b[1]} preserveAspectRatio="none" />}
            {value.roofs.map((roof, i) => (
              <path key={i} fill-rule="evenodd" fill={`hsl(${roof.azimuth ?? 0} ${roof.slope > 3 ? 65 : 0}% 55% / 0.45)`} stroke="#fff" stroke-width={0.35}
                d={roof.rings.map((ring) => `M${ring.map(([x, y]) => `${(x - b[0]).toFixed(2)} ${(b[3] - y).toFixed(2)}`).join('L')}Z`).join('')} />
            ))}
          </svg>
          <figcaption>Orthophoto and roof surfaces, coloured by where they face; flat ones are grey</figcaption>
        </figure>
      )}
      {value.labels && <figure class="plan"><img src={value.labels} alt="Labels" /><figcaption>Labels</figcaption></figure>}
      <p class="chips">
        <a class="button" href={link(['jobs', job, 'view'], { tile: name })}>Open in the viewer</a>
        {value.files.map((f) => (
          <button class="chip" key={f.path} onClick={() => void download(place.file(f.path), f.path.split('/').at(-1)!)}>{f.path.split('/').at(-1)}</button>
        ))}
      </p>
    </>
  );
}
