import { memo } from 'preact/compat';
import { useCallback, useEffect, useMemo, useRef, useState } from 'preact/hooks';
import { type Job, type JobDetail, type JobEvent, type JobMap, type ResultFile, type Unit, download, filesOf, follow, jobPlace, send } from '../api';
import { useCaller } from '../caller';
import { ago, between, bytes, moment, plural, seconds, tail, timeOfDay } from '../format';
import { STAGES, fraction, left } from '../progress';
import { type Route, link, replaceQuery } from '../router';
import { Action, Bar, Columns, Failure, Loading, State, useGet, useNow, usePoll, useSeldom } from '../ui';
import { LAYERS, type Layer, METRICS, type Metric, UnitMap } from './map';
import { Priority } from './priority';
import { Seams } from './seams';
import { Timeline } from './timeline';
import { UnitPanel } from './unit';
import { placesOf, titleOf } from './units';

/// Most events that are kept.
const EVENTS = 2000;

export function JobPage({ id, route }: { id: string; route: Route }) {
  const { value: job, error } = usePoll<JobDetail>(`/jobs/${id}`, 2000);
  const { value: units } = usePoll<Unit[]>(`/jobs/${id}/blocks`, 2000);
  const [events, setEvents] = useState<JobEvent[]>([]);
  useEffect(() => follow(id, (more) => setEvents((old) => [...old, ...more].slice(-EVENTS))), [id]);
  const metric = (route.query.get('by') ?? 'state') as Metric;
  const chosen = route.query.get('unit');
  const written = STAGES.indexOf(job?.stage ?? '') >= STAGES.indexOf('model');
  const blocks = useMemo(() => placesOf(units ?? [], 'block', written), [units, written]);
  const patches = useMemo(() => placesOf(units ?? [], 'patch', false), [units]);
  // Where units lie is known when the mesh is split, the patches when all blocks are sampled.
  const ends = (stage: string) => units?.find((u) => u.stage === stage && (u.state === 'done' || u.state === 'reused'))?.started ?? '';
  const { value: newer } = useGet<JobMap>(units ? `/jobs/${id}/map#${ends('split')},${ends('terrain')}` : null);
  // What is known stays while more is asked for.
  const known = useRef<JobMap | undefined>(undefined);
  if (newer) known.current = newer;
  const map = known.current;
  // Parts that are drawn again only if they change keep it: it has to know where the page is now.
  const here = useRef(route);
  here.current = route;
  const choose = useCallback((name: string | null) => replaceQuery(here.current, { unit: name ?? undefined }), []);
  const drawn = useSeldom(units, 10_000, job?.finished !== undefined);
  if (!job) return error ? <Failure error={error}>{error.status === 404 && <a href={link(['jobs'])}>All jobs</a>}</Failure> : <Loading what="the job" />;
  const layer = (route.query.get('layer') ?? (job.stage === 'segment' && !job.finished ? 'patches' : 'blocks')) as Layer;
  // What is required of a job, and failed.
  const lost = job.state === 'failed' ? units?.find((u) => u.state === 'failed' && (u.kind === 'scene' || u.kind === 'city'))?.stage : undefined;
  return (
    <>
      <Head job={job} />
      {error && <Failure error={error} />}
      {(job.reason || job.failures) && <Failures job={job} choose={choose} />}
      <div class="columns">
        <div class="stack">
          <section class="card" aria-labelledby="grid-title">
            <div class="title small">
              <h2 id="grid-title">Map</h2>
              <span class="segments" role="group" aria-label="Units on the map">
                {LAYERS.map((l) => <button key={l} aria-pressed={layer === l} onClick={() => replaceQuery(route, { layer: l })}>{LAYER_NAMES[l]}</button>)}
              </span>
              <label class="row">
                by
                <select aria-label="Colour units by" value={metric} onChange={(e) => replaceQuery(route, { by: e.currentTarget.value })}>
                  {METRICS.map((m) => <option key={m}>{m}</option>)}
                </select>
              </label>
            </div>
            {units ? <UnitMap job={id} layer={layer} blocks={blocks} patches={patches} map={map} lost={lost} metric={metric} chosen={chosen} choose={choose} /> : <Loading what="the map" />}
          </section>
          {units && <Seams job={job} units={units} choose={choose} />}
        </div>
        <div class="stack">
          {chosen && <UnitPanel job={job} name={chosen} units={units ?? []} map={map} events={events} choose={choose} />}
          <section class="card" aria-labelledby="stages-title">
            <h2 id="stages-title">Stages</h2>
            <Stages job={job} />
            {drawn && job.started && <Timeline started={job.started} finished={job.finished} units={drawn} />}
          </section>
        </div>
      </div>
      <Events events={events} live={!job.finished} />
      {job.finished && <Files id={job.id} />}
      <Request job={job} />
    </>
  );
}

function Head({ job }: { job: JobDetail }) {
  const { maySteer } = useCaller();
  const now = useNow();
  const done = fraction(job);
  const rest = left(job, now);
  const steer = (what: string) => () => send<Job>('POST', `/jobs/${job.id}/${what}`);
  const may = maySteer(job.owner);
  return (
    <section class="job-head">
      <div class="title">
        <h1><a class="plain" href={link(['cities', job.city])}>{job.city}</a> <State state={job.state} /></h1>
        <div class="actions">
          {(job.state === 'successful' || job.state === 'partial') && <a class="button primary" href={link(['jobs', job.id, 'view'])}>Open the city</a>}
          {may && !job.finished && <Priority job={job} />}
          {may && job.state === 'running' && <Action label="Pause" run={steer('pause')} />}
          {may && job.state === 'paused' && <Action label="Resume" kind="primary" run={steer('resume')} />}
          {may && (job.state === 'partial' || job.state === 'failed') && !job.progress.some((p) => p.failed) && <Action label="Retry what failed" run={steer('retry')} />}
          {may && job.finished && <Action label="Delete" kind="danger" run={async () => { if (confirm('Delete this job with its events, logs and result for good? What it published stays.')) { await send('DELETE', `/jobs/${job.id}`); location.hash = '#/jobs'; } }} />}
          {may && !job.finished && <Action label="Cancel" kind="danger" run={async () => { if (confirm('Cancel this job for good?')) await steer('cancel')(); }} />}
        </div>
      </div>
      <Bar value={done} label="Work done" state={job.state} />
      <p class="facts">
        <span>{Math.round(done * 100)} %{!job.finished && <>, {job.stage}</>}</span>
        {rest !== undefined && <span>≈ {seconds(rest)} left</span>}
        {job.started && <span>{job.finished ? 'took' : 'under way for'} {between(job.started, job.finished, now)}</span>}
        <span>submitted {ago(job.created, now)} by {job.owner}</span>
        <span title={job.source}>{tail(job.source)}</span>
        {job.priority !== 0 && <span>priority {job.priority}</span>}
      </p>
    </section>
  );
}

const LAYER_NAMES: Record<Layer, string> = { blocks: 'Blocks and tiles', patches: 'Patches' };

/// Most units that are named for one reason.
const NAMED = 12;

/// What failed, each reason once.
function Failures({ job, choose }: { job: JobDetail; choose: (unit: string) => void }) {
  const { maySteer } = useCaller();
  const failures = job.failures ?? [];
  const count = failures.reduce((sum, f) => sum + f.count, 0);
  return (
    <section class="card failures" aria-labelledby="failures-title">
      <div class="title small">
        <h2 id="failures-title">{count ? `${plural(count, 'unit')} failed` : 'Failed'}</h2>
        {count > 0 && job.finished && maySteer(job.owner) && (
          <Action label="Retry" kind="primary" run={() => send('POST', `/jobs/${job.id}/retry`)} title="Do what failed again" />
        )}
      </div>
      {!failures.length && <p>{job.reason}</p>}
      <ul>
        {failures.map((f) => (
          <li key={f.reason}>
            <span class="reason">{f.reason}{f.count > 1 && <small> and {f.count - 1} alike</small>}</span>
            {f.what_to_do && <span class="what-to-do">{f.what_to_do}</span>}
            <span class="chips">
              {f.units.slice(0, NAMED).map((u) => (
                <button key={u.stage + u.unit} class="chip" onClick={() => choose(u.unit)}>{titleOf(u.kind, u.unit)} <small>{u.stage}{u.attempts > 1 ? `, ${u.attempts} attempts` : ''}</small></button>
              ))}
              {f.count > NAMED && <span class="dim">and {f.count - NAMED} more</span>}
            </span>
          </li>
        ))}
      </ul>
      {job.state === 'partial' && <p class="dim">The rest of the city is there. Retry does only what failed again, and what hangs on it.</p>}
    </section>
  );
}

const STAGE_COLUMNS = ['Stage', 'Done', 'Running', 'Waiting', 'Failed'];

const Stages = memo(({ job }: { job: JobDetail }) => {
  return (
    <table class="stages">
      <Columns names={STAGE_COLUMNS} numbers={STAGE_COLUMNS.slice(1)} />
      <tbody>
        {STAGES.map((name) => {
          const p = job.progress.find((stage) => stage.stage === name);
          const here = job.stage === name && !job.finished;
          return (
            <tr key={name} aria-current={here ? 'step' : undefined}>
              <th scope="row">{name}</th>
              <td class="number">{p?.done ?? ''}</td>
              <td class="number">{p?.running || ''}</td>
              <td class="number">{p?.ready || ''}</td>
              <td class={p?.failed ? 'number bad' : 'number'}>{p?.failed || ''}</td>
            </tr>
          );
        })}
      </tbody>
    </table>
  );
});

const Events = memo(({ events, live }: { events: JobEvent[]; live: boolean }) => {
  const [quiet, setQuiet] = useState(true);
  // Claims and completions come by the hundred; what an operator looks for is between them.
  const shown = quiet ? events.filter((e) => !['claimed', 'done', 'reused'].includes(e.kind)) : events;
  const list = useRef<HTMLOListElement>(null);
  return (
    <section class="card" aria-labelledby="events-title">
      <div class="title small">
        <h2 id="events-title">Events {live && <span class="live">live</span>}</h2>
        <label class="row"><input type="checkbox" checked={!quiet} onChange={(e) => setQuiet(!e.currentTarget.checked)} /> of single units too</label>
      </div>
      <ol class="events" ref={list} aria-live="polite" tabIndex={0} aria-label="Newest first">
        {shown.slice(-200).reverse().map((e) => <EventLine key={e.number} event={e} />)}
      </ol>
      {!shown.length && <p class="dim">Nothing happened yet.</p>}
    </section>
  );
});

export const EventLine = memo(({ event: e }: { event: JobEvent }) => (
  <li class={e.kind}>
    <time dateTime={e.at} title={moment(e.at)}>{timeOfDay(e.at)}</time> <b>{e.kind}</b> {e.stage} {e.unit} {e.message && <span class="dim">{e.message}</span>}
  </li>
));

const Files = memo(({ id }: { id: string }) => {
  const place = jobPlace(id);
  const { value: files, error, again } = useGet<ResultFile[]>(place.list, () => filesOf(place));
  return (
    <details class="card">
      <summary>Files {files && <span class="dim">{files.length}, {bytes(files.reduce((sum, f) => sum + f.bytes, 0))}</span>}</summary>
      {error && <Failure error={error} retry={again} />}
      <ul class="files">
        {files?.slice(0, 400).map((f) => (
          <li key={f.path}>
            <button class="linklike" onClick={() => void download(place.file(f.path), f.path.split('/').at(-1)!)}>{f.path}</button>
            <span class="dim">{bytes(f.bytes)}</span>
          </li>
        ))}
      </ul>
      {files && files.length > 400 && <p class="dim">and {files.length - 400} more, which the API lists</p>}
    </details>
  );
});

const Request = memo(({ job }: { job: JobDetail }) => {
  const set = Object.entries(job.request.parameters ?? {});
  return (
    <details class="card">
      <summary>Request</summary>
      <dl class="pairs">
        <dt>Id</dt><dd><code>{job.id}</code></dd>
        <dt>Source</dt><dd><code>{job.source}</code></dd>
        <dt>Preset</dt><dd>{job.request.preset ?? 'none'}</dd>
        {set.map(([name, value]) => [<dt key={name}>{name}</dt>, <dd key={`${name}=`}>{String(value)}</dd>])}
      </dl>
      <a class="button" href={link(['submit'], { source: job.source, city: job.city })}>Submit again</a>
    </details>
  );
}, (old, next) => old.job.id === next.job.id);
