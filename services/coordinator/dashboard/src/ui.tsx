// What all pages are made of.

import type { ComponentChildren } from 'preact';
import { useEffect, useRef, useState } from 'preact/hooks';
import { ApiError, get, poll } from './api';

const GLYPH: Record<string, string> = {
  accepted: '○', ready: '○', running: '◐', paused: '‖', successful: '●', done: '●', reused: '↺', partial: '◒', failed: '✕', cancelled: '–',
};

export const State = ({ state }: { state: string }) => (
  <span class={`state ${state}`}>
    <span aria-hidden="true">{GLYPH[state] ?? '·'}</span> {state}
  </span>
);

/// The head of a table: its columns, those of numbers as numbers stand.
export const Columns = ({ names, numbers = [] }: { names: string[]; numbers?: string[] }) => (
  <thead>
    <tr>
      {names.map((name) => <th scope="col" key={name} class={numbers.includes(name) ? 'number' : undefined}>{name}</th>)}
    </tr>
  </thead>
);

export const Empty = ({ title, children }: { title: string; children?: ComponentChildren }) => (
  <div class="empty" role="status">
    <h2>{title}</h2>
    <p>{children}</p>
  </div>
);

export const Loading = ({ what }: { what: string }) => (
  <div class="loading" role="status" aria-live="polite">
    <span class="spinner" aria-hidden="true" /> Loading {what} …
  </div>
);

export function Failure({ error, retry, children }: { error: Error; retry?: () => void; children?: ComponentChildren }) {
  const title = error instanceof ApiError ? error.title : 'This page failed';
  const detail = error instanceof ApiError ? error.detail : error.message;
  return (
    <div class="failure" role="alert">
      <strong>{title}</strong>
      {detail && <p>{detail}</p>}
      {retry && <button onClick={retry}>Try again</button>}
      {children}
    </div>
  );
}

/// How far something is, in the colour of its state.
export const Bar = ({ value, label, state = '' }: { value: number; label: string; state?: string }) => (
  <div class={`bar ${state}`} role="progressbar" aria-label={label} aria-valuemin={0} aria-valuemax={100} aria-valuenow={Math.round(value * 100)}>
    <div style={{ width: `${value * 100}%` }} />
  </div>
);

/// A value that is asked for again and again.
export function usePoll<T>(path: string | null, every: number): { value?: T; error?: ApiError } {
  const [state, set] = useState<{ path?: string | null; value?: T; error?: ApiError }>({});
  useEffect(() => {
    if (path === null) return;
    return poll<T>(
      path,
      every,
      (value) => set({ path, value }),
      (error) => set((old) => ({ path, value: old.path === path ? old.value : undefined, error })),
    );
  }, [path, every]);
  return state.path === path ? state : {};
}

/// A value that is asked for once.
export function useGet<T>(path: string | null, load: (path: string) => Promise<T> = get): { value?: T; error?: Error; again: () => void } {
  const [state, set] = useState<{ path?: string | null; value?: T; error?: Error }>({});
  const [turn, again] = useState(0);
  useEffect(() => {
    if (path === null) return;
    let current = true;
    load(path).then(
      (value) => current && set({ path, value }),
      (error) => current && set({ path, error }),
    );
    return () => {
      current = false;
    };
  }, [path, turn]);
  return { ...(state.path === path ? state : {}), again: () => again((n) => n + 1) };
}

/// The latest value, but taken over only so often, when the browser has time: for what is dear to draw. At the end, at once.
export function useSeldom<T>(value: T, every: number, last: boolean): T {
  const [taken, take] = useState(value);
  const latest = useRef(value);
  latest.current = value;
  const none = taken === undefined;
  useEffect(() => {
    if (none || last) take(value);
  }, [none, last, none || last ? value : undefined]);
  useEffect(() => {
    const idle = window.requestIdleCallback ?? ((then: () => void) => setTimeout(then, 0));
    const timer = setInterval(() => idle(() => take(latest.current)), every);
    return () => clearInterval(timer);
  }, [every]);
  return taken;
}

/// The time, every so often, for what tells how long ago something was.
export function useNow(every = 1000): number {
  const [now, set] = useState(Date.now());
  useEffect(() => {
    const timer = setInterval(() => set(Date.now()), every);
    return () => clearInterval(timer);
  }, [every]);
  return now;
}

/// A button that does something at the service and says when it failed.
export function Action({ label, run, kind = '', title }: { label: string; run: () => Promise<unknown>; kind?: string; title?: string }) {
  const [state, set] = useState<{ busy?: boolean; error?: Error }>({});
  const click = () => {
    set({ busy: true });
    run().then(
      () => set({}),
      (error) => set({ error }),
    );
  };
  return (
    <>
      <button class={kind} disabled={state.busy} aria-busy={state.busy} title={title} onClick={click}>
        {label}
      </button>
      {state.error && (
        <span class="inline-error" role="alert">
          {state.error.message}
        </span>
      )}
    </>
  );
}
