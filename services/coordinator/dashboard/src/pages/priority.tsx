// Which of several jobs gets workers first, to be changed while it waits or runs.

import { useEffect, useState } from 'preact/hooks';
import { type Job, type JobDetail, send } from '../api';

export function Priority({ job }: { job: JobDetail }) {
  const [value, setValue] = useState(String(job.priority));
  const [state, set] = useState<{ busy?: boolean; done?: boolean; error?: Error }>({});
  // What someone else set meanwhile is shown, unless one is typing.
  useEffect(() => setValue(String(job.priority)), [job.priority]);
  const submit = (event: SubmitEvent) => {
    event.preventDefault();
    set({ busy: true });
    send<Job>('PUT', `/jobs/${job.id}/priority`, { priority: Number(value) }).then(
      () => set({ done: true }),
      (error) => set({ error }),
    );
  };
  const differs = Number(value) !== job.priority;
  return (
    <form class="priority" onSubmit={submit}>
      <label class="row" title="Jobs of higher priority get workers first">
        Priority
        <input type="number" name="priority" min={-100} max={100} step={1} required value={value} onInput={(e) => { setValue(e.currentTarget.value); set({}); }} />
      </label>
      {differs && <button disabled={state.busy} aria-busy={state.busy}>Set</button>}
      <span role="status" class={state.error ? 'inline-error' : 'dim'}>{state.error?.message ?? (state.done && !differs ? 'saved' : '')}</span>
    </form>
  );
}
