import { useMemo, useState } from 'preact/hooks';
import { type Job, type Parameter, type Preset, send } from '../api';
import { useCaller } from '../caller';
import { type Route, link } from '../router';
import { Empty, Failure, Loading, useGet } from '../ui';
import { Drop } from './drop';

/// What jobs from here write besides, so that their city can be compared with its mesh.
const TO_COMPARE = 'mesh-3dtiles';
/// What is for the workers to say.
const NOT_FOR_JOBS = ['resources'];

export function Submit({ route }: { route: Route }) {
  const { maySubmit } = useCaller();
  const { value, error, again } = useGet<{ parameters: Parameter[]; presets: Preset[] }>('/parameters');
  if (!maySubmit) return <Empty title="Your token may look only">Ask an operator for one of scope submitter.</Empty>;
  if (error) return <Failure error={error} retry={again} />;
  if (!value) return <Loading what="the parameters" />;
  return <Form parameters={value.parameters} presets={value.presets} route={route} />;
}

function Form({ parameters, presets, route }: { parameters: Parameter[]; presets: Preset[]; route: Route }) {
  const [source, setSource] = useState(route.query.get('source') ?? '');
  const [city, setCity] = useState(route.query.get('city') ?? '');
  const [priority, setPriority] = useState('0');
  const [preset, setPreset] = useState('');
  const [changed, setChanged] = useState<Record<string, string>>({});
  const [sending, setSending] = useState<{ busy?: boolean; error?: Error }>({});
  // The same form sent twice is one job.
  const key = useMemo(() => crypto.randomUUID?.() ?? String(Math.random()), []);
  const groups = [...new Set(parameters.map((p) => p.group))].filter((group) => !NOT_FOR_JOBS.includes(group));
  const chosen = presets.find((p) => p.name === preset);
  const standing = (p: Parameter) => {
    const value = chosen?.values[p.name] ?? p.default;
    if (p.name !== 'output.formats') return value;
    // In the order of the choices, as the boxes below have them.
    const wanted = [...value.split(','), ...(p.always ?? []), TO_COMPARE];
    return p.choices.filter((choice) => wanted.includes(choice)).join(',');
  };
  const submit = (event: SubmitEvent) => {
    event.preventDefault();
    const values: Record<string, string> = { ...changed };
    for (const p of parameters) {
      if (!(p.name in values) && standing(p) !== (chosen?.values[p.name] ?? p.default)) values[p.name] = standing(p);
    }
    setSending({ busy: true });
    send<Job>('POST', '/jobs', {
      source: source.trim(),
      city: city.trim(),
      priority: Number(priority) || 0,
      ...(preset ? { preset } : {}),
      parameters: values,
    }, { 'Idempotency-Key': key }).then(
      (job) => { location.hash = link(['jobs', job.id]); },
      (error) => setSending({ error }),
    );
  };
  const set = (p: Parameter, value: string) =>
    setChanged((old) => {
      const next = { ...old, [p.name]: value };
      if (value === standing(p)) delete next[p.name];
      return next;
    });
  return (
    <form class="submit" onSubmit={submit}>
      <h1>New job</h1>
      <section class="card two">
        <div class="field">
          <label for="source">Mesh</label>
          <input id="source" name="source" required placeholder="delft/mesh.obj" value={source} onInput={(e) => setSource(e.currentTarget.value)} aria-describedby="source-help" />
          <small id="source-help">A file or a folder of tiles under a source root of the service</small>
          <Drop done={(upload) => setSource(upload.source)} />
        </div>
        <div class="field">
          <label for="city">City</label>
          <input id="city" name="city" required placeholder="delft" maxLength={200} value={city} onInput={(e) => setCity(e.currentTarget.value)} aria-describedby="city-help" />
          <small id="city-help">A later job of the same city refreshes it</small>
        </div>
        <div class="field">
          <label for="preset">Preset</label>
          <select id="preset" value={preset} onChange={(e) => setPreset(e.currentTarget.value)} aria-describedby="preset-help">
            <option value="">none</option>
            {presets.map((p) => <option key={p.name} value={p.name}>{p.name}</option>)}
          </select>
          <small id="preset-help">{chosen?.help ?? 'A named set of parameters; single ones can still be changed below'}</small>
        </div>
        <div class="field">
          <label for="priority">Priority</label>
          <input id="priority" name="priority" type="number" min={-100} max={100} step={1} value={priority} onInput={(e) => setPriority(e.currentTarget.value)} aria-describedby="priority-help" />
          <small id="priority-help">Jobs of higher priority get workers first</small>
        </div>
      </section>
      <div class="send">
        <button class="primary" disabled={sending.busy} aria-busy={sending.busy}>Submit</button>
        {Object.keys(changed).length > 0 && (
          <button type="button" class="quiet" onClick={() => setChanged({})}>Take {Object.keys(changed).length} changes back</button>
        )}
      </div>
      {sending.error && <Failure error={sending.error} />}
      <h2>Parameters</h2>
      {groups.map((group) => {
        const own = parameters.filter((p) => p.group === group);
        const differ = own.filter((p) => p.name in changed || chosen?.values[p.name] !== undefined).length;
        return (
          <details class="card" key={group} open={group === 'grid' || group === 'sampling' || group === 'output'}>
            <summary>{group} {differ > 0 && <span class="chip">{differ} set</span>}</summary>
            <div class="parameters">
              {own.map((p) => <Field key={p.name} parameter={p} value={changed[p.name] ?? standing(p)} changed={p.name in changed} set={(v) => set(p, v)} />)}
            </div>
          </details>
        );
      })}
    </form>
  );
}

function Field({ parameter: p, value, changed, set }: { parameter: Parameter; value: string; changed: boolean; set: (value: string) => void }) {
  const short = p.name.split('.')[1].replaceAll('_', ' ');
  const id = `p-${p.name}`;
  const read = (e: Event) => set((e.currentTarget as HTMLInputElement).value);
  const range = p.min !== undefined ? `${p.min} to ${p.max}` : '';
  let input;
  if (p.kind === 'switch') {
    input = <input id={id} type="checkbox" checked={value === 'true'} onChange={(e) => set(String(e.currentTarget.checked))} aria-describedby={`${id}-h`} />;
  } else if (p.kind === 'choice') {
    input = <select id={id} value={value} onChange={read} aria-describedby={`${id}-h`}>{p.choices.map((c) => <option key={c}>{c}</option>)}</select>;
  } else if (p.kind === 'list') {
    const on = value.split(',').filter(Boolean);
    const turn = (choice: string, checked: boolean) => set(p.choices.filter((c) => (c === choice ? checked : on.includes(c))).join(','));
    input = (
      <span class="choices" role="group" aria-label={short}>
        {p.choices.map((c) => (
          <label class="row" key={c} title={p.always?.includes(c) ? 'Always written: the viewer shows it' : undefined}>
            <input type="checkbox" checked={on.includes(c)} disabled={p.always?.includes(c)} onChange={(e) => turn(c, e.currentTarget.checked)} />{c}
          </label>
        ))}
      </span>
    );
  } else if (p.kind === 'number' || p.kind === 'integer') {
    input = <input id={id} type="number" required min={p.min} max={p.max} step={p.kind === 'integer' ? 1 : 'any'} value={value} onChange={read} aria-describedby={`${id}-h`} />;
  } else {
    input = <input id={id} type="text" value={value} onChange={read} aria-describedby={`${id}-h`} />;
  }
  return (
    <div class={changed ? 'parameter changed' : 'parameter'}>
      <label for={p.kind === 'list' ? undefined : id}>{short} {p.unit && <small>{p.unit}</small>}</label>
      {input}
      <small id={`${id}-h`}>{p.help} {range && <span class="dim">({range})</span>}</small>
    </div>
  );
}
