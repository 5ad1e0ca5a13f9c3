// Addresses behind the hash: each thing has its own, and the server knows only one page.

import { useEffect, useState } from 'preact/hooks';

export interface Route {
  path: string[];
  query: URLSearchParams;
}

function read(): Route {
  const [path, query] = location.hash.replace(/^#\/?/, '').split('?');
  return { path: path.split('/').filter(Boolean).map(decodeURIComponent), query: new URLSearchParams(query) };
}

export function useRoute(): Route {
  const [route, set] = useState(read);
  useEffect(() => {
    const changed = () => set(read());
    addEventListener('hashchange', changed);
    return () => removeEventListener('hashchange', changed);
  }, []);
  return route;
}

export const link = (path: (string | number)[], query: Record<string, string | number | undefined> = {}) => {
  const given = Object.entries(query).filter(([, value]) => value !== undefined && value !== '');
  const text = new URLSearchParams(given.map(([key, value]) => [key, String(value)])).toString();
  return `#/${path.map((part) => encodeURIComponent(part)).join('/')}${text ? `?${text}` : ''}`;
};

/// Changes what is asked for without a new entry in the history.
export function replaceQuery(route: Route, changes: Record<string, string | undefined>) {
  const query = Object.fromEntries(route.query);
  history.replaceState(null, '', link(route.path, { ...query, ...changes }));
  dispatchEvent(new HashChangeEvent('hashchange'));
}
