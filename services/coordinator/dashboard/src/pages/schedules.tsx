import { ApiError } from '../api';
import { ago, moment } from '../format';
import { link } from '../router';
import { Empty, Failure, Loading, useGet, useNow } from '../ui';

/// A schedule as the service tells it; what it does not tell is left blank.
interface Schedule {
  name?: string;
  id?: string;
  city?: string;
  every?: string;
  cron?: string;
  enabled?: boolean;
  paused?: boolean;
  next?: string;
  last?: string;
  last_job?: string;
  job?: string;
}

export function Schedules() {
  const { value, error, again } = useGet<Schedule[] | { schedules: Schedule[] }>('/schedules');
  const now = useNow(10_000);
  const list = Array.isArray(value) ? value : value?.schedules;
  const absent = error instanceof ApiError && error.status === 404;
  return (
    <>
      <h1>Schedules</h1>
      {absent && <Empty title="This service has no schedules">Refresh a city by submitting a job of its name, by hand or from cron.</Empty>}
      {error && !absent && <Failure error={error} retry={again} />}
      {!value && !error && <Loading what="the schedules" />}
      {list?.length === 0 && <Empty title="No schedule">The API takes them: see <a href="docs">/docs</a>.</Empty>}
      {!!list?.length && (
        <div class="scroll">
          <table>
            <thead><tr>{['Name', 'City', 'When', 'Next run', 'Last run'].map((t) => <th scope="col" key={t}>{t}</th>)}</tr></thead>
            <tbody>
              {list.map((s) => {
                const job = s.last_job ?? s.job;
                const off = s.enabled === false || s.paused === true;
                return (
                  <tr key={s.id ?? s.name}>
                    <th scope="row">{s.name ?? s.id}</th>
                    <td>{s.city && <a href={link(['cities', s.city])}>{s.city}</a>}</td>
                    <td><code>{s.cron ?? s.every}</code></td>
                    <td>{off ? <span class="dim">off</span> : s.next && moment(s.next)}</td>
                    <td>{job ? <a href={link(['jobs', job])}>{s.last ? ago(s.last, now) : job}</a> : s.last && ago(s.last, now)}</td>
                  </tr>
                );
              })}
            </tbody>
          </table>
        </div>
      )}
    </>
  );
}
