import type { Worker } from '../api';
import { ago, bytes } from '../format';
import { Columns, Empty, Failure, Loading, useNow, usePoll } from '../ui';

/// A worker that was not seen for this long is taken for lost, seconds.
const LOST = 60;

export function Workers() {
  const { value, error } = usePoll<Worker[]>('/workers', 3000);
  const now = useNow();
  return (
    <>
      <h1>Workers</h1>
      {error && <Failure error={error} />}
      {!value && !error && <Loading what="the workers" />}
      {value?.length === 0 && <Empty title="No worker"><code>gable work</code> starts one; <code>gable serve --all</code> has them beside the service.</Empty>}
      {!!value?.length && (
        <div class="card scroll">
          <table class="stacked">
            <Columns names={['Host', 'Process', 'Task', 'Memory', 'Seen', 'Started', 'Version']} numbers={['Memory']} />
            <tbody>
              {value.map((w) => {
                const lost = now - Date.parse(w.seen) > LOST * 1000;
                return (
                  <tr key={w.id} class={lost ? 'lost' : ''}>
                    <th scope="row">{w.host}</th>
                    <td data-label="Process">{w.pid}</td>
                    <td class="long" data-label="Task">{w.task ?? <span class="dim">idle</span>}</td>
                    <td class="number" data-label="Memory">{w.memory ? bytes(w.memory) : ''}</td>
                    <td data-label="Seen"><span>{lost && <span class="state failed">lost</span>} {ago(w.seen, now)}</span></td>
                    <td data-label="Started">{ago(w.started, now)}</td>
                    <td data-label="Version">{w.version}</td>
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
