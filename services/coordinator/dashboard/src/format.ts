// Numbers and times as people read them.

export function seconds(value: number): string {
  if (value < 10) return `${value.toFixed(1)} s`;
  if (value < 90) return `${Math.round(value)} s`;
  if (value < 5400) return `${Math.round(value / 60)} min`;
  if (value < 172_800) return `${Math.floor(value / 3600)} h ${Math.round((value % 3600) / 60)} min`;
  return `${Math.round(value / 86_400)} days`;
}

export function ago(time: string, now = Date.now()): string {
  const passed = Math.round((now - Date.parse(time)) / 1000);
  return passed < 5 ? 'now' : `${passed < 10 ? `${passed} s` : seconds(passed)} ago`;
}

export const between = (from: string, to: string | undefined, now = Date.now()) =>
  seconds(((to ? Date.parse(to) : now) - Date.parse(from)) / 1000);

const clock = new Intl.DateTimeFormat(undefined, { dateStyle: 'medium', timeStyle: 'short' });
export const moment = (time: string) => clock.format(new Date(time));

const hour = new Intl.DateTimeFormat(undefined, { timeStyle: 'medium' });
export const timeOfDay = (time: string) => hour.format(new Date(time));

export function bytes(value: number): string {
  if (value < 1000) return `${value} B`;
  if (value < 1e6) return `${(value / 1e3).toFixed(0)} kB`;
  if (value < 1e9) return `${(value / 1e6).toFixed(1)} MB`;
  return `${(value / 1e9).toFixed(2)} GB`;
}

const grouped = new Intl.NumberFormat();
export const count = (value: number) => grouped.format(value);
/// The end of a path, which tells one from another.
export const tail = (path: string, most = 44) => (path.length > most ? `…${path.slice(1 - most)}` : path);

export const plural = (value: number, one: string, many = `${one}s`) => `${count(value)} ${value === 1 ? one : many}`;
