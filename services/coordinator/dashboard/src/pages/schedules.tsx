import { useState } from 'preact/hooks';
import { ApiError, get, send } from '../api';
import { useCaller } from '../caller';
import { ago, moment } from '../format';
import { link } from '../router';
import { Action, Columns, Empty, Failure, Loading, useGet, useNow } from '../ui';

interface Schedule {
  name: string;
  owner: string;
  cron: string;
  zone: string;
  enabled: boolean;
  job: { source: string; city: string };
  /// The next times, soonest first.
  next: string[];
  runs: number;
  last_job?: string;
}

interface Run {
  number: number;
  due: string;
  at: string;
  outcome: string;
  job?: string;
}

export function Schedules() {
  const { value, error, again } = useGet<Schedule[]>('/schedules?limit=1000');
  const [chosen, choose] = useState<string | null>(null);
  const { maySteer } = useCaller();
  const absent = error instanceof ApiError && error.status === 404;
  return (
    <>
      <h1>Schedules</h1>
      {absent && <Empty title="This service has no schedules">Refresh a city by submitting a job of its name.</Empty>}
      {error && !absent && <Failure error={error} retry={again} />}
      {!value && !error && <Loading what="the schedules" />}
      {value?.length === 0 && <Empty title="No schedule">A schedule refreshes a city by itself: <a href="docs">the API</a> takes them.</Empty>}
      {!!value?.length && (
        <div class="card scroll">
          <table class="stacked">
            <Columns names={['Name', 'City', 'When', 'Next run', 'Runs', 'Last job', '']} numbers={['Runs']} />
            <tbody>
              {value.map((s) => (
                <tr key={s.name} aria-current={s.name === chosen ? 'true' : undefined}>
                  <th scope="row">{s.name}</th>
                  <td data-label="City"><a href={link(['cities', s.job.city])}>{s.job.city}</a></td>
                  <td class="long" data-label="When"><span><code>{s.cron}</code> <small>{s.zone}</small></span></td>
                  <td class="long" data-label="Next run">{!s.enabled ? <span class="dim">off</span> : s.next[0] ? <time dateTime={s.next[0]} title={s.next.map(moment).join('\n')}>{moment(s.next[0])}</time> : 'never'}</td>
                  <td class="number" data-label="Runs">{s.runs}</td>
                  <td data-label="Last job">{s.last_job ? <a href={link(['jobs', s.last_job])}>open</a> : <span class="dim">none yet</span>}</td>
                  <td class="actions">
                    <button aria-expanded={s.name === chosen} onClick={() => choose(s.name === chosen ? null : s.name)}>History</button>
                    {maySteer(s.owner) && <Action label="Run now" run={() => send('POST', `/schedules/${encodeURIComponent(s.name)}/run`).then(again)} />}
                  </td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      )}
      {chosen && <History key={chosen} name={chosen} />}
    </>
  );
}

function History({ name }: { name: string }) {
  const { value, error, again } = useGet<Run[]>(`/schedules/${encodeURIComponent(name)}/runs?limit=100`, get);
  const now = useNow(10_000);
  return (
    <section class="card" aria-labelledby="history-title">
      <h2 id="history-title">Runs of {name}</h2>
      {error && <Failure error={error} retry={again} />}
      {!value && !error && <Loading what="the runs" />}
      {value?.length === 0 && <p class="dim">It has not run yet.</p>}
      {!!value?.length && (
        <div class="scroll">
          <table class="stacked">
            <Columns names={['Number', 'Due', 'Looked at', 'Outcome', 'Job']} />
            <tbody>
              {value.map((run) => (
                <tr key={run.number}>
                  <th scope="row">{run.number}</th>
                  <td class="long" data-label="Due">{moment(run.due)}</td>
                  <td data-label="Looked at">{ago(run.at, now)}</td>
                  <td class="long" data-label="Outcome">{run.outcome}</td>
                  <td data-label="Job">{run.job && <a href={link(['jobs', run.job])}>open</a>}</td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      )}
    </section>
  );
}
