import { memo } from 'preact/compat';
import { useEffect, useLayoutEffect, useRef, useState } from 'preact/hooks';
import { type Job, JOB_STATES, type JobDetail, get } from '../api';
import { ago, between, seconds, tail } from '../format';
import { fraction, left } from '../progress';
import { type Route, link, replaceQuery } from '../router';
import { Bar, Empty, Failure, Loading, State, useNow, usePoll } from '../ui';

const PAGE = 500;

interface JobPage {
  jobs: Job[];
  next?: string;
}

/// The newest jobs, polled, and the older ones as they are scrolled to.
function useJobs(query: string) {
  const path = `/jobs?limit=${PAGE}${query}`;
  const newest = usePoll<JobPage>(path, 3000);
  const [older, setOlder] = useState<{ query: string; jobs: Job[]; next?: string; busy: boolean }>({ query, jobs: [], busy: false });
  const mine = older.query === query ? older : { query, jobs: [], next: undefined, busy: false };
  const first = newest.value?.jobs ?? [];
  const lastOfFirst = first.at(-1)?.id;
  // Ids of later jobs sort later: what has moved out of the first page since is still there, once.
  const jobs = lastOfFirst ? [...first, ...mine.jobs.filter((job) => job.id < lastOfFirst)] : first;
  const next = mine.jobs.length ? mine.next : newest.value?.next;
  const more = () => {
    if (!next || mine.busy) return;
    setOlder({ ...mine, busy: true });
    get<JobPage>(`${path}&before=${encodeURIComponent(next)}`).then(
      (page) => setOlder({ query, jobs: [...mine.jobs, ...page.jobs], next: page.next, busy: false }),
      () => setOlder({ ...mine, busy: false }),
    );
  };
  return { jobs, error: newest.error, loaded: newest.value !== undefined, more, next };
}

export function Jobs({ route }: { route: Route }) {
  const [state, city, owner] = ['state', 'city', 'owner'].map((name) => route.query.get(name) ?? '');
  const query = [['state', state], ['city', city], ['owner', owner]]
    .filter(([, value]) => value)
    .map(([name, value]) => `&${name}=${encodeURIComponent(value)}`)
    .join('');
  const { jobs, error, loaded, more, next } = useJobs(query);
  const set = (name: string) => (event: Event) => replaceQuery(route, { [name]: (event.currentTarget as HTMLInputElement).value });
  return (
    <>
      <div class="title">
        <h1>Jobs</h1>
        <a class="button primary" href={link(['submit'])}>New job</a>
      </div>
      <form class="filters" role="search" aria-label="Filter jobs" onSubmit={(e) => e.preventDefault()}>
        <label>
          State
          <select value={state} onChange={set('state')}>
            <option value="">all</option>
            {JOB_STATES.map((name) => <option key={name}>{name}</option>)}
          </select>
        </label>
        <label>
          City
          <input type="search" value={city} onChange={set('city')} placeholder="any" />
        </label>
        <label>
          Who
          <input type="search" value={owner} onChange={set('owner')} placeholder="anyone" />
        </label>
        {loaded && <output aria-live="polite">{jobs.length}{next ? '+' : ''} {jobs.length === 1 ? 'job' : 'jobs'}</output>}
      </form>
      {error && <Failure error={error} />}
      {!loaded && !error && <Loading what="the jobs" />}
      {loaded && !jobs.length && (query
        ? <Empty title="No job matches">Take a filter away to see more.</Empty>
        : <Empty title="No job yet"><a href={link(['submit'])}>Submit the first one</a>, or send it to the <a href="docs">API</a>.</Empty>)}
      {jobs.length > 0 && <Table jobs={jobs} more={more} />}
    </>
  );
}

/// Only the rows in view are in the document.
function Table({ jobs, more }: { jobs: Job[]; more: () => void }) {
  const frame = useRef<HTMLDivElement>(null);
  const [view, setView] = useState({ top: 0, height: 800, row: 52 });
  const now = useNow(5000);
  useLayoutEffect(() => {
    const node = frame.current!;
    const measure = () => {
      const row = parseFloat(getComputedStyle(node).getPropertyValue('--row')) || 52;
      setView((old) => {
        const next = { top: node.scrollTop, height: node.clientHeight, row };
        return old.top === next.top && old.height === next.height && old.row === next.row ? old : next;
      });
    };
    measure();
    const observer = new ResizeObserver(measure);
    observer.observe(node);
    node.addEventListener('scroll', measure, { passive: true });
    return () => {
      observer.disconnect();
      node.removeEventListener('scroll', measure);
    };
  }, []);
  const begin = Math.max(0, Math.floor(view.top / view.row) - 6);
  const end = Math.min(jobs.length, Math.ceil((view.top + view.height) / view.row) + 6);
  useEffect(() => {
    if (end > jobs.length - 50) more();
  }, [end, jobs.length]);
  return (
    <div class="jobs" role="table" aria-label="Jobs, newest first" aria-rowcount={jobs.length + 1} style={{ '--rows': jobs.length }}>
      <div class="job head" role="row" aria-rowindex={1}>
        {['City', 'State', 'Progress', 'Left', 'Source', 'Who', 'Submitted'].map((name) => (
          <span role="columnheader" key={name}>{name}</span>
        ))}
      </div>
      <div class="rows" ref={frame} tabIndex={0} role="rowgroup" aria-label="Rows">
        <div style={{ height: `${jobs.length * view.row}px` }} role="presentation">
          <div style={{ transform: `translateY(${begin * view.row}px)` }} role="presentation">
            {jobs.slice(begin, end).map((job, i) => <Row key={job.id} job={job} index={begin + i + 2} now={now} />)}
          </div>
        </div>
      </div>
    </div>
  );
}

const Row = memo(
  ({ job, index, now }: { job: Job; index: number; now: number }) => {
    // The list does not tell how far a job is: those under way that are in view are asked for it.
    const asked = job.state === 'running' || job.state === 'paused';
    const { value, error } = usePoll<JobDetail>(asked ? `/jobs/${job.id}` : null, 3000);
    const done = value ? fraction(value) : job.state === 'successful' || job.state === 'partial' ? 1 : 0;
    const rest = value && left(value, now);
    return (
      <div class="job" role="row" aria-rowindex={index}>
        <span role="cell" class="name"><a href={link(['jobs', job.id])}>{job.city}</a></span>
        <span role="cell"><State state={job.state} />{job.reason && <small title={job.reason}> {job.reason}</small>}</span>
        <span role="cell" class="progress">
          <Bar value={done} label={`${Math.round(done * 100)} % done`} state={job.state} />
          <small>{asked && !error ? (value?.stage ?? job.stage) : job.finished && job.started ? between(job.started, job.finished) : ''}</small>
        </span>
        <span role="cell">{rest !== undefined ? `≈ ${seconds(rest)}` : ''}</span>
        <span role="cell" class="source" title={job.source}>{tail(job.source, 36)}</span>
        <span role="cell">{job.owner}</span>
        <span role="cell"><time dateTime={job.created}>{ago(job.created, now)}</time></span>
      </div>
    );
  },
  (old, next) =>
    old.index === next.index && old.now === next.now && old.job.id === next.job.id && old.job.events === next.job.events && old.job.state === next.job.state,
);

