// The city in the browser.

import { useEffect, useRef, useState } from 'preact/hooks';
import { type ResultFile, type ResultPlace, download, filesOf, request } from '../api';
import { plural } from '../format';
import { type Route, replaceQuery } from '../router';
import { Failure, Loading } from '../ui';
import { MODES, type Mode, type Properties, legendOf } from './features';
import { COMPARES, type Compare, type Lod, type Picked, Stage } from './stage';

const isDark = () => {
  const set = document.documentElement.dataset.theme;
  return set ? set === 'dark' : matchMedia('(prefers-color-scheme: dark)').matches;
};

export function Viewer({ place, back, route }: { place: ResultPlace; back: string; route: Route }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const stage = useRef<Stage | null>(null);
  const [files, setFiles] = useState<ResultFile[] | null>(null);
  const [error, setError] = useState<Error | null>(null);
  const [picked, setPicked] = useState<Picked | null>(null);
  const [state, setState] = useState({ loading: true, buildings: 0, mesh: 0 });
  const [border, setBorder] = useState(0.5);
  /// How often something was shown, from the first time on, and what at last.
  const [shows, setShows] = useState(0);
  const [shownLod, setShownLod] = useState('');
  const [missing, setMissing] = useState<string | null>(null);
  const [note, setNote] = useState('');
  const lod = (route.query.get('lod') ?? 'auto') as Lod;
  const mode = (route.query.get('colour') ?? 'semantics') as Mode;
  const ground = route.query.get('ground') !== 'off';
  const source = route.query.get('file');
  const building = route.query.get('building');
  const hasMesh = files?.some((f) => f.path === '3dtiles/mesh.json') ?? false;
  const compare = (hasMesh ? (route.query.get('compare') ?? 'model') : 'model') as Compare;
  const hasTiles = files?.some((f) => f.path === '3dtiles/tileset.json') ?? false;
  const hasGround = files?.some((f) => f.path.endsWith('.ground.glb')) ?? false;
  const cityJson = files?.filter((f) => f.path.endsWith('.city.json')).map((f) => f.path) ?? [];
  const set = (changes: Record<string, string | undefined>) => replaceQuery(route, changes);

  useEffect(() => {
    filesOf(place).then(setFiles, setError);
  }, []);
  useEffect(() => {
    let made: Stage;
    try {
      made = new Stage(canvas.current!, isDark());
    } catch (problem) {
      setError(new Error(`This browser shows no 3D here (WebGL): ${(problem as Error).message}`));
      return;
    }
    stage.current = made;
    (window as any).gableStage = made;
    made.onPick = setPicked;
    made.onError = setError;
    made.onChange = (next) => setState((old) => (old.loading === next.loading && old.buildings === next.buildings && old.mesh === next.mesh ? old : next));
    const scheme = matchMedia('(prefers-color-scheme: dark)');
    const changed = () => made.setDark(isDark());
    scheme.addEventListener('change', changed);
    const observer = new MutationObserver(changed);
    observer.observe(document.documentElement, { attributes: true, attributeFilter: ['data-theme'] });
    return () => {
      scheme.removeEventListener('change', changed);
      observer.disconnect();
      made.dispose();
      stage.current = null;
    };
  }, []);
  // Results of before 3D Tiles were always written are shown from their CityJSON files.
  const file = source ?? (files && !hasTiles && cityJson.length > 0);
  useEffect(() => {
    if (!files || !stage.current || (!file && !hasTiles)) return;
    let current = true;
    const show = async () => {
      const [paths, told] = source ? [[source], ''] : file ? await tilesToShow(place, files) : [[], ''];
      const json = async (path: string) => (await request(place.file(path))).json();
      if (file) {
        const cities = await Promise.all(paths.map(json));
        if (!current) return;
        stage.current?.showCityJson(cities, lod);
        setNote(told);
      } else {
        const built = await stage.current?.show(place, lod);
        if (!current) return;
        setNote(built === false ? 'No building was found in this city.' : '');
        const tile = route.query.get('tile');
        const entry = tile && !building && (await json('index.json')).tiles.find((t: { tile: number[] }) => t.tile.join('_') === tile);
        if (entry) stage.current?.lookAt(entry.bbox);
      }
      setState((old) => ({ ...old, loading: true, buildings: 0 }));
      setShownLod(lod);
      setShows((n) => n + 1);
    };
    setError(null);
    show().catch((problem) => current && setError(problem));
    return () => {
      current = false;
    };
  }, [files, file, lod]);
  // The building that the address names: its surroundings are looked at, so that its tile is loaded, then it is chosen.
  useEffect(() => {
    setMissing(null);
    if (!building || !shows) return;
    let current = true;
    const find = async () => {
      const box = source ? undefined : await place.building(building);
      if (!current || !stage.current) return;
      if (box) stage.current.lookAt(box);
      const found = box !== null && (await stage.current.seek(building));
      if (current && !found && !box) setMissing(building);
    };
    find().catch((problem) => current && setError(problem));
    return () => {
      current = false;
    };
  }, [building, shows]);
  useEffect(() => {
    if (hasGround && !file) stage.current?.showGround(place, ground).catch(setError);
  }, [hasGround, ground, file]);
  useEffect(() => {
    if (hasMesh) stage.current?.setCompare(place, compare).catch(setError);
  }, [hasMesh, compare]);
  useEffect(() => stage.current?.setBorder(border), [border, hasMesh]);
  // What colours mean is known when they are painted.
  const [, painted] = useState(0);
  useEffect(() => {
    stage.current?.setMode(mode);
    painted((n) => n + 1);
  }, [mode, files]);

  const openOwn = async (event: Event) => {
    const chosen = (event.currentTarget as HTMLInputElement).files?.[0];
    if (!chosen) return;
    try {
      stage.current?.showCityJson([JSON.parse(await chosen.text())], lod);
      setNote('');
      setError(null);
    } catch (problem) {
      setError(problem as Error);
    }
  };
  return (
    <div class="viewer" onKeyDown={(e) => { if (e.key === 'Escape') stage.current?.unchoose(); }}>
      <div class="viewer-head">
        <a href={back} class="button quiet" aria-label="Back">←</a>
        <h1>{place.title}</h1>
        <label class="row">
          Show
          <select aria-label="Show" value={source ?? ''} onChange={(e) => set({ file: e.currentTarget.value || undefined })}>
            <option value="">{hasTiles ? 'whole city (3D Tiles)' : 'tiles with buildings'}</option>
            {cityJson.map((path) => <option key={path} value={path}>{path.split('/').at(-1)}</option>)}
          </select>
        </label>
        <label class="button file">Open a CityJSON file<input type="file" accept=".json" onChange={openOwn} /></label>
      </div>
      <div class="viewer-tools" role="toolbar" aria-label="View">
        <span class="segments" role="group" aria-label="Level of detail">
          {(['auto', '0', '1', '2'] as Lod[]).map((l) => (
            <button key={l} aria-pressed={lod === l} onClick={() => set({ lod: l === 'auto' ? undefined : l })}>{l === 'auto' ? 'Auto' : `LOD${l}`}</button>
          ))}
        </span>
        <span class="segments" role="group" aria-label="Model or mesh" title={files && !hasMesh ? 'This result has no mesh to compare with: submit the job again with the format mesh-3dtiles.' : undefined}>
          {COMPARES.map((c) => (
            <button key={c} aria-pressed={compare === c} disabled={!hasMesh || !!file} onClick={() => set({ compare: c === 'model' ? undefined : c })}>{COMPARE_NAMES[c]}</button>
          ))}
        </span>
        <label class="row">
          Colour
          <select aria-label="Colour" value={mode} onChange={(e) => set({ colour: e.currentTarget.value })}>{MODES.map((m) => <option key={m}>{m}</option>)}</select>
        </label>
        <label class="row"><input type="checkbox" checked={ground} disabled={!hasGround || !!file || compare === 'mesh' || compare === 'both'} onChange={(e) => set({ ground: e.currentTarget.checked ? undefined : 'off' })} /> Orthophoto</label>
        <span class="segments" role="group" aria-label="Point of view">
          <button onClick={() => stage.current?.fromAbove()}>Above</button>
          <button onClick={() => stage.current?.aslant()}>Aslant</button>
          <button onClick={() => stage.current?.home()}>All</button>
        </span>
      </div>
      <div class="viewer-stage">
        <canvas ref={canvas} tabIndex={0} role="img" aria-label={`The city in three dimensions, ${state.buildings} buildings loaded. Arrow keys move the view.`} data-loading={state.loading} data-buildings={state.buildings} data-mesh={state.mesh} data-lod={shownLod} />
        {compare === 'swipe' && !file && <Swipe border={border} move={setBorder} />}
        {error && <div class="over"><Failure error={error} retry={() => location.reload()} /></div>}
        {missing && !error && (
          <div class="over">
            <div class="failure" role="alert">
              <strong>There is no building {missing} here</strong>
              <p>{source ? 'The file that is shown has no building of this id.' : 'This result has no building of this id: a later or an earlier generation of the city may have it.'}</p>
              <button onClick={() => set({ building: undefined })}>Look at the whole city</button>
            </div>
          </div>
        )}
        {note && !error && <p class="viewer-note" role="status">{note}</p>}
        {!files && !error && <div class="over"><Loading what="the city" /></div>}
        {files && !hasTiles && !cityJson.length && <div class="over"><Failure error={new Error('This result has neither 3D Tiles nor CityJSON: submit the job again with one of these formats.')} /></div>}
        <Key mode={mode} buildings={state.buildings} loading={state.loading} compare={file ? 'model' : compare} />
        {picked && <Attributes picked={picked} place={place} files={files ?? []} close={() => stage.current?.unchoose()} show={(path) => set({ file: path })} />}
      </div>
    </div>
  );
}

/// Most bytes of CityJSON that are shown at a time.
const MOST_JSON = 60e6;

/// The CityJSON files of the tiles with most buildings, as many as a browser can show; and what to say if those are not all.
async function tilesToShow(place: ResultPlace, files: ResultFile[]): Promise<[string[], string]> {
  const size = new Map(files.filter((f) => f.path.endsWith('.city.json')).map((f) => [f.path, f.bytes]));
  const index = size.size > 0 && files.some((f) => f.path === 'index.json') ? await (await request(place.file('index.json'))).json() : { tiles: [] };
  const tiles = index.tiles as { buildings: number; files: string[] }[];
  const built = tiles.filter((t) => t.buildings > 0).sort((a, b) => b.buildings - a.buildings).flatMap((t) => t.files.filter((f) => size.has(f)));
  const all = built.length ? built : [...size.keys()];
  let bytes = 0;
  const shown = all.filter((path, i) => (bytes += size.get(path)!) <= MOST_JSON || i === 0);
  const rest = shown.length < all.length ? `${shown.length} of ${all.length} tiles are shown. ` : '';
  return [shown, `${rest}This result has no 3D Tiles: the same job, submitted again, writes them.`];
}

const COMPARE_NAMES: Record<Compare, string> = { model: 'Model', mesh: 'Mesh', both: 'Both', swipe: 'Swipe' };

/// The border between mesh and model, to be moved by pointer or arrow keys.
function Swipe({ border, move }: { border: number; move: (part: number) => void }) {
  const handle = useRef<HTMLDivElement>(null);
  const to = (part: number) => move(Math.min(0.98, Math.max(0.02, part)));
  const drag = (event: PointerEvent) => {
    if (!(event.buttons & 1)) return;
    const frame = handle.current!.parentElement!.getBoundingClientRect();
    to((event.clientX - frame.left) / frame.width);
  };
  const key = (event: KeyboardEvent) => {
    const step = { ArrowLeft: -0.02, ArrowRight: 0.02, PageDown: -0.1, PageUp: 0.1 }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    to(border + step);
  };
  return (
    <div class="swipe" ref={handle} style={{ left: `${border * 100}%` }} role="slider" tabIndex={0} aria-label="Border between mesh and model" aria-orientation="horizontal"
      aria-valuemin={0} aria-valuemax={100} aria-valuenow={Math.round(border * 100)} aria-valuetext={`${Math.round(border * 100)} % mesh`}
      onPointerDown={(e) => handle.current!.setPointerCapture(e.pointerId)} onPointerMove={drag} onKeyDown={key}>
      <span aria-hidden="true">mesh</span>
      <i aria-hidden="true">⇔</i>
      <span aria-hidden="true">model</span>
    </div>
  );
}

function Key({ mode, buildings, loading, compare }: { mode: Mode; buildings: number; loading: boolean; compare: Compare }) {
  const legend = compare === 'mesh' ? {} : legendOf(mode);
  return (
    <div class="key">
      <strong>{compare === 'mesh' ? 'mesh' : mode}</strong>
      {legend.items?.map(([name, colour]) => <span key={name}><i style={{ background: colour }} /> {name}</span>)}
      {legend.ramp && <span>{legend.ramp.from} <i class="ramp" style={{ background: legend.ramp.css }} /> {legend.ramp.to}</span>}
      {compare !== 'model' && <span class="dim">{compare === 'mesh' ? '' : 'mesh: '}thinned out, its own colours</span>}
      <span class="dim" aria-live="polite">{compare === 'mesh' ? '' : plural(buildings, 'building')}{loading ? `${compare === 'mesh' ? '' : ', '}loading …` : ''}</span>
    </div>
  );
}

/// Names that are abbreviations.
const SHORT = ['lod', 'rmse'];

const UNITS: [RegExp, string][] = [[/(?<=^measuredHeight)$/, ' m'], [/_m2$/, ' m²'], [/_m3$/, ' m³'], [/_m$/, ' m'], [/_deg$/, '°']];

const title = (name: string) =>
  SHORT.includes(name) ? name.toUpperCase() : name.replace(/([a-z])([A-Z])/g, '$1 $2').toLowerCase().replaceAll('_', ' ');

function shown(name: string, value: string | number): [string, string] {
  for (const [ending, unit] of UNITS) {
    if (ending.test(name) && typeof value === 'number') return [title(name.replace(ending, '')), `${Number(value.toFixed(3))}${unit}`];
  }
  return [title(name), typeof value === 'number' ? String(Number(value.toFixed(4))) : String(value)];
}

const pairs = (properties: Properties, without: string[]) =>
  Object.entries(properties)
    .filter(([name, value]) => value !== null && value !== '' && value !== -9999 && !without.includes(name) && typeof value !== 'object')
    .map(([name, value]) => shown(name, value!));

function Attributes({ picked, place, files, close, show }: { picked: Picked; place: ResultPlace; files: ResultFile[]; close: () => void; show: (path: string) => void }) {
  const { building, surface } = picked;
  const tile = String(building.block ?? '');
  const own = files.filter((f) => tile && new RegExp(`/${tile}\\.(city\\.json|gml|lod2\\.glb)$`).test(f.path));
  const model = own.find((f) => f.path.endsWith('.city.json'));
  return (
    <aside class="attributes card" aria-label="Building">
      <div class="title small">
        <h2>{String(building.id)}</h2>
        <button class="quiet" onClick={close} aria-label="Close">✕</button>
      </div>
      <dl class="pairs">
        {pairs(building, ['id', 'block']).map(([name, value]) => [<dt key={name}>{name}</dt>, <dd key={`${name}=`}>{value}</dd>])}
      </dl>
      {surface && (
        <>
          <h3>{String(surface.kind ?? 'Surface')}</h3>
          <dl class="pairs">{pairs(surface, ['kind', 'type', 'building']).map(([name, value]) => [<dt key={name}>{name}</dt>, <dd key={`${name}=`}>{value}</dd>])}</dl>
        </>
      )}
      {own.length > 0 && (
        <>
          <h3>Its tile, {tile.replace('_', ', ')}</h3>
          <p class="chips">
            {own.map((f) => <button class="chip" key={f.path} onClick={() => void download(place.file(f.path), f.path.split('/').at(-1)!)}>{f.path.split('/').at(-1)}</button>)}
            {model && <button class="chip" onClick={() => show(model.path)}>show it alone</button>}
          </p>
        </>
      )}
    </aside>
  );
}
