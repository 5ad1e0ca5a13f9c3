// One block of a job: its units, what happened to it, and pictures of what came of it.

import type { JobDetail, JobEvent, ResultFile, Unit } from '../api';
import { ApiError, download, filesOf, jobPlace, request } from '../api';
import { seconds } from '../format';
import { STAGES } from '../progress';
import { link } from '../router';
import { Columns, Failure, Loading, State, useGet } from '../ui';
import { useEffect, useRef, useState } from 'preact/hooks';
import { EventLine } from './job';
import { type Roof, photograph, roofsOf } from './pictures';

export function BlockPanel({ job, name, units, events, close }: { job: JobDetail; name: string; units: Unit[]; events: JobEvent[]; close: () => void }) {
  const own = units.filter((u) => u.unit === name).sort((a, b) => STAGES.indexOf(a.stage) - STAGES.indexOf(b.stage));
  const log = events.filter((e) => e.unit === name);
  // There would be a grey square.
  const seen = !own.some((u) => u.stage === 'sample' && u.state === 'failed');
  const panel = useRef<HTMLElement>(null);
  // On a narrow screen the panel is below the grid, out of sight.
  useEffect(() => panel.current?.scrollIntoView({ block: 'nearest', behavior: 'smooth' }), [name]);
  return (
    <section class="card block" ref={panel} aria-label={`Block ${name}`}>
      <div class="title small">
        <h2>Block {name.replace('_', ', ')}</h2>
        <button class="quiet" onClick={close} aria-label="Close">✕</button>
      </div>
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
      {own.filter((u) => u.reason).map((u) => <p class="bad" key={u.stage}>{u.reason}</p>)}
      {job.finished && (seen ? <Pictures job={job.id} name={name} /> : <p class="dim">There is no picture: the mesh of this block was not sampled.</p>)}
      <Said job={job.id} name={name} version={own.map((u) => u.state + u.attempts).join()} />
      <h3>Events</h3>
      <ol class="events short" tabIndex={0} aria-label="Events of the block">{log.map((e) => <EventLine key={e.number} event={e} />)}</ol>
      {!log.length && <p class="dim">No event of this block.</p>}
    </section>
  );
}

/// What the block's programs said, asked for when somebody wants to see it, and again when more of them have ended.
function Said({ job, name, version }: { job: string; name: string; version: string }) {
  const [open, setOpen] = useState(false);
  const path = open ? `/jobs/${job}/blocks/${encodeURIComponent(name)}/log#${version}` : null;
  const { value, error, again } = useGet<string>(path, async (at) => (await request(at)).text());
  return (
    <details onToggle={(e) => setOpen(e.currentTarget.open)}>
      <summary>Log</summary>
      {value !== undefined ? <pre class="log" tabIndex={0} aria-label="Log of the block">{value}</pre>
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
