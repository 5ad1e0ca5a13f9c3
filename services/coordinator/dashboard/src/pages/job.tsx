import { memo } from 'preact/compat';
import { useCallback, useEffect, useMemo, useRef, useState } from 'preact/hooks';
import { type Job, type JobDetail, type JobEvent, type ResultFile, type Unit, download, filesOf, follow, jobPlace, send } from '../api';
import { useCaller } from '../caller';
import { ago, between, bytes, moment, plural, seconds, tail, timeOfDay } from '../format';
import { STAGES, fraction, left } from '../progress';
import { type Route, link, replaceQuery } from '../router';
import { Action, Bar, Columns, Failure, Loading, State, useGet, useNow, usePoll, useSeldom } from '../ui';
import { BlockPanel } from './block';
import { Grid, METRICS, type Metric, blocksOf } from './grid';
import { Priority } from './priority';
import { Seams } from './seams';
import { Timeline } from './timeline';

/// Most events that are kept.
const EVENTS = 2000;

export function JobPage({ id, route }: { id: string; route: Route }) {
  const { value: job, error } = usePoll<JobDetail>(`/jobs/${id}`, 2000);
  const { value: units } = usePoll<Unit[]>(`/jobs/${id}/blocks`, 2000);
  const [events, setEvents] = useState<JobEvent[]>([]);
  useEffect(() => follow(id, (more) => setEvents((old) => [...old, ...more].slice(-EVENTS))), [id]);
  const metric = (route.query.get('by') ?? 'state') as Metric;
  const block = route.query.get('block');
  const blocks = useMemo(() => blocksOf(units ?? []), [units]);
  // Parts that are drawn again only if they change keep it: it has to know where the page is now.
  const here = useRef(route);
  here.current = route;
  const chooseBlock = useCallback((name: string | null) => replaceQuery(here.current, { block: name ?? undefined }), []);
  const drawn = useSeldom(units, 10_000, job?.finished !== undefined);
  if (!job) return error ? <Failure error={error}>{error.status === 404 && <a href={link(['jobs'])}>All jobs</a>}</Failure> : <Loading what="the job" />;
  const failed = (units ?? []).filter((u) => u.state === 'failed');
  return (
    <>
      <Head job={job} />
      {error && <Failure error={error} />}
      {(job.reason || failed.length > 0) && <Failures job={job} failed={failed} route={route} />}
      <div class="columns">
        <div class="stack">
          <section class="card" aria-labelledby="grid-title">
            <div class="title small">
              <h2 id="grid-title">Blocks</h2>
              <label class="row">
                by
                <select aria-label="Colour blocks by" value={metric} onChange={(e) => replaceQuery(route, { by: e.currentTarget.value })}>
                  {METRICS.map((m) => <option key={m}>{m}</option>)}
                </select>
              </label>
            </div>
            {units ? <Grid blocks={blocks} metric={metric} chosen={block} choose={chooseBlock} /> : <Loading what="the blocks" />}
          </section>
          {units && <Seams job={job} units={units} choose={chooseBlock} />}
        </div>
        <div class="stack">
          {block && <BlockPanel job={job} name={block} units={units ?? []} events={events} close={() => replaceQuery(route, { block: undefined })} />}
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

function Failures({ job, failed, route }: { job: JobDetail; failed: Unit[]; route: Route }) {
  const { maySteer } = useCaller();
  const reasons = new Map<string, Unit[]>();
  for (const unit of failed) {
    const reason = unit.reason ?? 'no reason is known';
    reasons.set(reason, [...(reasons.get(reason) ?? []), unit]);
  }
  return (
    <section class="card failures" aria-labelledby="failures-title">
      <div class="title small">
        <h2 id="failures-title">{failed.length ? `${plural(failed.length, 'unit')} failed` : 'Failed'}</h2>
        {failed.length > 0 && job.finished && maySteer(job.owner) && (
          <Action label="Retry" kind="primary" run={() => send('POST', `/jobs/${job.id}/retry`)} title="Do what failed again" />
        )}
      </div>
      {job.reason && <p>{job.reason}</p>}
      <ul>
        {[...reasons].map(([reason, units]) => (
          <li key={reason}>
            <span>{reason}</span>
            <span class="chips">
              {units.slice(0, 12).map((u) => (
                <button key={u.stage + u.unit} class="chip" onClick={() => replaceQuery(route, { block: u.unit })}>{u.stage} {u.unit}{u.attempts > 1 ? ` (${u.attempts} attempts)` : ''}</button>
              ))}
              {units.length > 12 && <span class="dim">and {units.length - 12} more</span>}
            </span>
          </li>
        ))}
      </ul>
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
