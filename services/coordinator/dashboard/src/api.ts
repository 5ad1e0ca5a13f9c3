// The coordinator's API: types of what is used of it, requests with the token, and polling by ETag.

export type JobState = 'accepted' | 'running' | 'paused' | 'successful' | 'partial' | 'failed' | 'cancelled';
export const JOB_STATES: JobState[] = ['accepted', 'running', 'paused', 'successful', 'partial', 'failed', 'cancelled'];

export interface Job {
  id: string;
  city: string;
  owner: string;
  source: string;
  state: JobState;
  reason?: string;
  priority: number;
  stage: string;
  events: number;
  created: string;
  started?: string;
  finished?: string;
}

export interface StageProgress {
  stage: string;
  ready: number;
  running: number;
  done: number;
  failed: number;
  cancelled: number;
}

export interface JobDetail extends Job {
  request: { source: string; city: string; preset?: string; parameters?: Record<string, string | number | boolean> };
  progress: StageProgress[];
  failures?: JobFailure[];
}

export type UnitKind = 'scene' | 'block' | 'patch' | 'tile' | 'city' | 'unknown';

/// A reason for which units failed.
export interface JobFailure {
  reason: string;
  what_to_do?: string;
  count: number;
  /// The first of them.
  units: { stage: string; kind: UnitKind; unit: string; attempts: number }[];
}

/// Where the units of a job lie.
export interface JobMap {
  crs?: string;
  /// West, south, east, north of all blocks, metres.
  bbox?: [number, number, number, number];
  picture: boolean;
  /// Blocks, and patches of the labelling; tiles lie where the blocks of the same name lie.
  units: { kind: 'block' | 'patch'; unit: string; bbox: [number, number, number, number] }[];
}

export interface Unit {
  stage: string;
  kind: UnitKind;
  unit: string;
  state: 'ready' | 'running' | 'done' | 'reused' | 'failed' | 'cancelled';
  attempts: number;
  worker?: string;
  phase?: string;
  reason?: string;
  started?: string;
  seconds?: number;
}

/// Blocks that have buildings in common.
export interface Seam {
  blocks: string[];
  /// The tile that models the buildings.
  owner: string;
  buildings: number;
}

export interface JobEvent {
  number: number;
  at: string;
  kind: string;
  stage?: string;
  unit?: string;
  message?: string;
}

export interface Parameter {
  name: string;
  group: string;
  kind: 'number' | 'integer' | 'switch' | 'choice' | 'list' | 'text' | 'file';
  unit: string;
  default: string;
  min?: number;
  max?: number;
  choices: string[];
  /// Choices that every job takes.
  always?: string[];
  help: string;
}

export interface Preset {
  name: string;
  help: string;
  values: Record<string, string>;
}

export interface Worker {
  id: string;
  host: string;
  pid: number;
  version: string;
  started: string;
  seen: string;
  task?: string;
  memory: number;
}

export interface ResultFile {
  path: string;
  bytes: number;
  hash: string;
}

export interface Generation {
  number: number;
  job: string;
  /// The earlier generation whose content it has anew, if the city was rolled back.
  restored?: number;
  partial: boolean;
  crs: string;
  made: string;
  buildings: number;
  added: number;
  removed: number;
  changed: number;
}

export interface City {
  name: string;
  generation?: number;
  created: string;
  current?: Generation;
}

export type Role = 'viewer' | 'editor' | 'owner';
export const ROLES: Role[] = ['viewer', 'editor', 'owner'];

export interface Member {
  name: string;
  role: Role;
}

export interface Change {
  id: string;
  change: 'added' | 'removed' | 'changed';
}

export interface Caller {
  name: string;
  scope: 'viewer' | 'submitter' | 'operator';
  tokens: boolean;
  signed_in: boolean;
}

export interface SignIn {
  /// Host of the provider, if people sign in.
  provider?: string;
}

/// What the service answered instead of what was asked for.
export class ApiError extends Error {
  constructor(
    readonly status: number,
    readonly title: string,
    readonly detail: string,
  ) {
    super(detail || title);
  }
}

const KEY = 'gable.token';
let onUnauthorised: () => void = () => {};

export const token = () => sessionStorage.getItem(KEY) ?? localStorage.getItem(KEY);

export function setToken(value: string | null, remember = false) {
  sessionStorage.removeItem(KEY);
  localStorage.removeItem(KEY);
  if (value) (remember ? localStorage : sessionStorage).setItem(KEY, value);
}

export function whenUnauthorised(then: () => void) {
  onUnauthorised = then;
}

export function authorisation(): Record<string, string> {
  const shown = token();
  return shown ? { Authorization: `Bearer ${shown}` } : {};
}

export const BASE = new URL('./api/v1', location.origin + location.pathname).pathname;
const AUTH = new URL('./auth', location.origin + location.pathname).pathname;
const RETURN = 'gable.return';

/// Goes to the provider; what was looked at is shown again after that.
export function signIn() {
  sessionStorage.setItem(RETURN, location.hash.replace(/[?&]sign-in=[a-z-]*/, ''));
  location.assign(`${AUTH}/login`);
}

/// Shows again what was looked at before somebody signed in.
export function returned() {
  const hash = sessionStorage.getItem(RETURN);
  sessionStorage.removeItem(RETURN);
  if (hash && !location.hash) location.replace(hash);
}

/// Ends the session in this browser; that at the provider goes on.
export async function signOut() {
  await request(`${AUTH}/logout`, { method: 'POST' });
}

async function failure(answer: Response): Promise<ApiError> {
  if (answer.status === 401) onUnauthorised();
  try {
    const problem = await answer.json();
    return new ApiError(answer.status, problem.title ?? answer.statusText, problem.detail ?? '');
  } catch {
    return new ApiError(answer.status, answer.statusText || `HTTP ${answer.status}`, '');
  }
}

export async function request(path: string, init: RequestInit = {}): Promise<Response> {
  let answer: Response;
  try {
    answer = await fetch(path.startsWith(BASE) || path.startsWith(AUTH) ? path : BASE + path, {
      ...init,
      headers: { ...authorisation(), ...(init.headers as Record<string, string>) },
    });
  } catch (error) {
    if ((error as Error).name === 'AbortError') throw error;
    throw new ApiError(0, 'The service does not answer', 'It may be restarting: this page tries again by itself.');
  }
  if (!answer.ok && answer.status !== 304) throw await failure(answer);
  return answer;
}

export async function get<T>(path: string, signal?: AbortSignal): Promise<T> {
  return (await request(path, { signal })).json();
}

export async function send<T>(method: string, path: string, body?: unknown, headers: Record<string, string> = {}): Promise<T> {
  const answer = await request(path, {
    method,
    headers: body === undefined ? headers : { 'Content-Type': 'application/json', ...headers },
    body: body === undefined ? undefined : JSON.stringify(body),
  });
  return answer.json();
}

/// All pages of a list, up to a number of rows.
export async function pages<T, P extends { next?: string | number }>(
  path: string,
  rows: (page: P) => T[],
  key: string,
  most: number,
  signal?: AbortSignal,
): Promise<T[]> {
  const out: T[] = [];
  let cursor: string | number | undefined;
  do {
    const join = path.includes('?') ? '&' : '?';
    const at = cursor === undefined ? '' : `&${key}=${encodeURIComponent(cursor)}`;
    const page = await get<P>(`${path}${join}limit=${Math.min(1000, most - out.length)}${at}`, signal);
    out.push(...rows(page));
    cursor = page.next;
  } while (cursor !== undefined && out.length < most);
  return out;
}

/// Script time of the last polls, milliseconds: what the tests measure.
export const pollCosts: { path: string; ms: number }[] = [];
(window as unknown as { gablePollCosts: typeof pollCosts }).gablePollCosts = pollCosts;

/// Asks again and again; what has not changed costs a 304 and no script. Gives a function that ends it.
export function poll<T>(path: string, every: number, take: (value: T) => void, fail: (error: ApiError) => void): () => void {
  const stop = new AbortController();
  let tag: string | null = null;
  let timer = 0;
  const ask = async () => {
    if (!document.hidden) {
      try {
        const answer = await request(path, {
          signal: stop.signal,
          cache: 'no-store',
          headers: tag ? { 'If-None-Match': tag } : {},
        });
        if (answer.status !== 304) {
          tag = answer.headers.get('etag');
          const text = await answer.text();
          const begin = performance.now();
          take(JSON.parse(text));
          // Rendering is batched into a microtask, so it has happened in the one after the next.
          queueMicrotask(() => queueMicrotask(() => {
            pollCosts.push({ path, ms: performance.now() - begin });
            if (pollCosts.length > 100) pollCosts.shift();
          }));
        }
      } catch (error) {
        if ((error as Error).name === 'AbortError') return;
        if (error instanceof ApiError) fail(error);
        else throw error;
      }
    }
    if (!stop.signal.aborted) timer = window.setTimeout(ask, every);
  };
  void ask();
  return () => {
    stop.abort();
    clearTimeout(timer);
  };
}

/// Follows the events of a job. EventSource cannot show a token, so the stream is read by fetch. Begins again where it was cut off.
export function follow(job: string, take: (events: JobEvent[]) => void): () => void {
  const stop = new AbortController();
  let last = 0;
  const read = async () => {
    while (!stop.signal.aborted) {
      let over = false;
      try {
        const headers: Record<string, string> = { Accept: 'text/event-stream' };
        if (last) headers['Last-Event-ID'] = String(last);
        const answer = await request(`/jobs/${job}/events/stream`, { signal: stop.signal, headers });
        const reader = answer.body!.pipeThrough(new TextDecoderStream()).getReader();
        let text = '';
        for (;;) {
          const { done, value } = await reader.read();
          if (done) break;
          text += value;
          const messages = text.split(/\r?\n\r?\n/);
          text = messages.pop() ?? '';
          const events: JobEvent[] = [];
          for (const message of messages) {
            const data = message.split('\n').filter((line) => line.startsWith('data:'));
            if (data.length) events.push(JSON.parse(data.map((line) => line.slice(5)).join('\n')));
          }
          if (events.length) {
            last = events[events.length - 1].number;
            take(events);
          }
        }
        // The service ends the stream of a job that is over.
        over = true;
      } catch (error) {
        if ((error as Error).name === 'AbortError') return;
      }
      await new Promise((resolve) => setTimeout(resolve, over ? 5000 : 2000));
    }
  };
  void read();
  return () => stop.abort();
}

/// Where the files of a result lie: those of a job, or of a generation of a city.
export interface ResultPlace {
  title: string;
  list: string;
  file: (path: string) => string;
  /// West, south, east, north of a building; null if there is none of this id, undefined if that cannot be told.
  building: (id: string) => Promise<number[] | null | undefined>;
}

async function buildingOf(city: string, which: string, id: string): Promise<number[] | null | undefined> {
  try {
    return (await get<{ bbox: number[] }>(`/cities/${city}/buildings/${encodeURIComponent(id)}${which}`)).bbox;
  } catch (error) {
    if (error instanceof ApiError) return error.status === 404 ? null : undefined;
    throw error;
  }
}

/// The result of a job; `city` is the city that it made, if that is known.
export const jobPlace = (id: string, title = id, city?: string): ResultPlace => ({
  title,
  list: `/jobs/${id}/files`,
  file: (path) => `${BASE}/jobs/${id}/files/${path}`,
  building: async (building) => {
    if (!city) return undefined;
    const name = encodeURIComponent(city);
    const all = await pages<Generation, { generations: Generation[]; next?: number }>(`/cities/${name}/generations`, (page) => page.generations, 'before', 1000);
    // A job that was mended has made several: the last is what its files are.
    const own = all.find((g) => g.job === id);
    return own && buildingOf(name, `?generation=${own.number}`, building);
  },
});

export const cityPlace = (name: string, generation?: number): ResultPlace => {
  const which = generation === undefined ? '' : `?generation=${generation}`;
  const city = encodeURIComponent(name);
  return {
    title: generation === undefined ? name : `${name}, generation ${generation}`,
    list: `/cities/${city}/files${which}`,
    file: (path) => `${BASE}/cities/${city}/files/${path}${which}`,
    building: (id) => buildingOf(city, which, id),
  };
};

export async function filesOf(place: ResultPlace): Promise<ResultFile[]> {
  const answer = await get<ResultFile[] | { files: ResultFile[] }>(place.list);
  return Array.isArray(answer) ? answer : answer.files;
}

/// Downloads through a request with the token, which a plain link could not show.
export async function download(url: string, name: string) {
  const answer = await request(url);
  const link = document.createElement('a');
  link.href = URL.createObjectURL(await answer.blob());
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
