// A city: its generations, and what a refresh changed.

import { useMemo, useState } from 'preact/hooks';
import { ApiError, type Change, type City, type Generation, type Member, cityPlace, filesOf, pages } from '../api';
import { ago, count, plural } from '../format';
import { type Route, link, replaceQuery } from '../router';
import { Columns, Empty, Failure, Loading, useGet, useNow } from '../ui';
import { DeleteCity, DeleteGeneration, Members, RollBack, useOwns } from './members';
import { type Roof, roofsByBuilding } from './pictures';

export function CityPage({ name, route }: { name: string; route: Route }) {
  const path = `/cities/${encodeURIComponent(name)}`;
  const { value: city, error, again } = useGet<City>(path);
  const owns = useOwns(useGet<Member[]>(`${path}/members`).value);
  const { value: generations, again: reload } = useGet<Generation[]>(`${path}/generations`, (p) =>
    pages<Generation, { generations: Generation[]; next?: number }>(p, (page) => page.generations, 'before', 1000));
  const now = useNow(30_000);
  if (error instanceof ApiError && error.status === 404) return <Failure error={error}><a href={link(['cities'])}>All cities</a></Failure>;
  if (error) return <Failure error={error} retry={again} />;
  if (!city || !generations) return <Loading what={`the city ${name}`} />;
  const current = city.current;
  if (!current) return <Empty title="Nothing published yet">The first job of {name} that ends well publishes it: <a href={link(['jobs'], { city: name })}>its jobs</a>.</Empty>;
  const to = Number(route.query.get('to') ?? current.number);
  const from = Number(route.query.get('from') ?? generations.find((g) => g.number < to)?.number ?? 0);
  return (
    <>
      <div>
        <div class="title">
          <h1>{name}</h1>
          <div class="actions">
            <a class="button primary" href={link(['cities', name, 'view'])}>Open the city</a>
            <a class="button" href={link(['jobs'], { city: name })}>Jobs</a>
          </div>
        </div>
        <p class="facts">
          <span>{plural(current.buildings, 'building')}</span><span>{current.crs}</span>
          <span>generation {current.number}, published {ago(current.made, now)}</span>
          {current.partial && <span class="state partial">◒ partial</span>}
        </p>
      </div>
      <section class="card" aria-labelledby="generations-title">
        <h2 id="generations-title">Generations</h2>
        <div class="scroll">
          <table class="stacked">
            <Columns names={['Number', 'Published', 'Buildings', 'Added', 'Removed', 'Changed', '']} numbers={['Buildings', 'Added', 'Removed', 'Changed']} />
            <tbody>
              {generations.map((g) => (
                <tr key={g.number} aria-current={g.number === to ? 'true' : undefined}>
                  <th scope="row">{g.number}{g.partial && <small class="state partial"> ◒ partial</small>}{g.restored && <small class="dim"> as {g.restored} was</small>}</th>
                  <td data-label="Published"><time dateTime={g.made}>{ago(g.made, now)}</time></td>
                  <td class="number" data-label="Buildings">{count(g.buildings)}</td>
                  <td class="number added" data-label="Added">{g.added || ''}</td>
                  <td class="number removed" data-label="Removed">{g.removed || ''}</td>
                  <td class="number changed" data-label="Changed">{g.changed || ''}</td>
                  <td class="actions">
                    <button onClick={() => replaceQuery(route, { to: String(g.number), from: String(generations.find((o) => o.number < g.number)?.number ?? 0) })}>What changed</button>
                    <a class="button" href={link(['cities', name, 'view'], { generation: g.number })}>Open</a>
                    <a class="button" href={link(['jobs', g.job])}>Job</a>
                    {owns && g.number !== current.number && <RollBack city={name} generation={g.number} then={() => { again(); reload(); }} />}
                    {owns && g.number !== current.number && <DeleteGeneration city={name} generation={g.number} then={reload} />}
                  </td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      </section>
      <Members city={name} />
      <Changes key={`${from}-${to}`} name={name} from={from} to={to} />
      {owns && <DeleteCity city={name} />}
    </>
  );
}

const KINDS: Change['change'][] = ['added', 'removed', 'changed'];

interface Drawn {
  changes: Change[];
  /// Roofs of all buildings of the later generation, and of those that are gone from the earlier one, by building.
  plans: Map<string, Roof[]>;
}

/// The plans of the buildings of a generation: from the CityJSON of the tiles that hold them.
async function plansOf(name: string, generation: number, wanted: Set<string> | null): Promise<Map<string, Roof[]>> {
  const plans = new Map<string, Roof[]>();
  const place = cityPlace(name, generation);
  const tiles = (await filesOf(place)).filter((f) => /^tiles\/.*\.city\.json$/.test(f.path));
  await Promise.all(tiles.slice(0, 400).map(async (tile) => {
    for (const [id, roofs] of await roofsByBuilding(place.file(tile.path))) {
      if (!wanted || wanted.has(id)) plans.set(id, roofs);
    }
  }));
  return plans;
}

function Changes({ name, from, to }: { name: string; from: number; to: number }) {
  const [kind, setKind] = useState<Change['change'] | ''>('');
  const [chosen, choose] = useState<string | null>(null);
  const path = `/cities/${encodeURIComponent(name)}/changes?from=${from}&to=${to}`;
  const { value, error, again } = useGet<Drawn>(path, async (p) => {
    const changes = await pages<Change, { changes: Change[]; next?: string }>(p, (page) => page.changes, 'after', 20_000);
    const plans = await plansOf(name, to, null);
    const gone = new Set(changes.filter((c) => c.change === 'removed').map((c) => c.id));
    if (gone.size && from > 0) (await plansOf(name, from, gone)).forEach((roofs, id) => plans.set(id, roofs));
    return { changes, plans };
  });
  const shown = useMemo(() => value?.changes.filter((c) => !kind || c.change === kind) ?? [], [value, kind]);
  return (
    <section class="card" aria-labelledby="changes-title">
      <div class="title small">
        <h2 id="changes-title">{from > 0 ? `Changes from generation ${from} to ${to}` : `Buildings of generation ${to}`}</h2>
        <span class="chips" role="group" aria-label="Kinds of change">
          {KINDS.map((k) => (
            <button key={k} class={`chip ${k}`} aria-pressed={kind === k} onClick={() => setKind(kind === k ? '' : k)}>
              {value?.changes.filter((c) => c.change === k).length ?? '…'} {k}
            </button>
          ))}
        </span>
      </div>
      {error && <Failure error={error} retry={again} />}
      {!value && !error && <Loading what="the changes" />}
      {value && !value.changes.length && <p class="dim">Nothing changed: all buildings are the same.</p>}
      {value && (
        <div class="columns wide">
          <Plan drawn={value} kind={kind} chosen={chosen} choose={choose} />
          <ul class="changes" aria-label="Changed buildings">
            {shown.slice(0, 1000).map((c) => (
              <li key={c.id} class={c.change} aria-current={c.id === chosen ? 'true' : undefined}>
                <button class="linklike" onClick={() => choose(c.id === chosen ? null : c.id)}>{c.id}</button> {c.change}
                <a href={link(['cities', name, 'view'], { generation: c.change === 'removed' ? from : to, building: c.id })}>open</a>
              </li>
            ))}
            {shown.length > 1000 && <li class="dim">and {count(shown.length - 1000)} more</li>}
          </ul>
        </div>
      )}
    </section>
  );
}

function Plan({ drawn, kind, chosen, choose }: { drawn: Drawn; kind: string; chosen: string | null; choose: (id: string | null) => void }) {
  const changes = useMemo(() => new Map(drawn.changes.map((c) => [c.id, c.change])), [drawn]);
  const paths = useMemo(() => {
    let [w, s, e, n] = [Infinity, Infinity, -Infinity, -Infinity];
    for (const roofs of drawn.plans.values()) for (const roof of roofs) for (const [x, y] of roof.rings[0]) {
      [w, s, e, n] = [Math.min(w, x), Math.min(s, y), Math.max(e, x), Math.max(n, y)];
    }
    const d = (roofs: Roof[]) => roofs.flatMap((r) => r.rings).map((ring) => `M${ring.map(([x, y]) => `${(x - w).toFixed(1)} ${(n - y).toFixed(1)}`).join('L')}Z`).join('');
    // What is gone lies below what stands there now.
    const order = [...drawn.plans].sort((a, b) => Number(changes.get(b[0]) === 'removed') - Number(changes.get(a[0]) === 'removed'));
    return { size: [e - w, n - s], list: order.map(([id, roofs]) => [id, d(roofs)] as const) };
  }, [drawn]);
  if (!paths.list.length) return <p class="dim">No plan can be drawn: the job wrote no CityJSON.</p>;
  const [width, height] = paths.size;
  const margin = 0.02 * Math.max(width, height);
  return (
    <svg class="map" viewBox={`${-margin} ${-margin} ${width + 2 * margin} ${height + 2 * margin}`} role="img" aria-label="Plan of the city with its changes">
      {paths.list.map(([id, d]) => {
        const change = changes.get(id);
        const look = change && (!kind || kind === change) ? change : 'same';
        return (
          <path key={id} class={`${look}${id === chosen ? ' chosen' : ''}`} d={d} onClick={() => choose(id === chosen ? null : id)} data-building={id}>
            <title>{id}{change ? `: ${change}` : ''}</title>
          </path>
        );
      })}
    </svg>
  );
}

