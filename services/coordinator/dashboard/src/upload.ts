// Sends a mesh to the service in parts, each with its hash, so that a connection that breaks costs one of them, and the same file goes
// on where it was cut off.

import { ApiError, get, request, send } from './api';

export interface Upload {
  id: string;
  /// What a job names as its source.
  source: string;
  name: string;
  bytes: number;
  files: number;
}

interface OpenUpload {
  id: string;
  name: string;
  state: 'open' | 'completing' | 'done' | 'failed';
  part_bytes: number;
  largest_part_bytes: number;
  parts: { number: number; sha256: string }[];
}

/// Most parts of an upload.
const PARTS = 10_000;
/// How long a service that does not answer is waited for, and how long between two questions, milliseconds.
const OUTAGE = 300_000;
const PAUSE = 2000;

/// What may be sent: an archive of a folder of tiles, or a mesh in one file.
export const ENDS = ['.zip', '.ply', '.off', '.glb', '.obj'];

/// A name as the service takes it.
const plain = (name: string) => name.replace(/[^\p{L}\p{N}._\- ]/gu, '_').replace(/^\.+/, '').slice(-60);

const pause = () => new Promise((resolve) => setTimeout(resolve, PAUSE));

/// Asks again while the service does not answer.
async function patiently<T>(ask: () => Promise<T>): Promise<T> {
  const begin = Date.now();
  for (;;) {
    try {
      return await ask();
    } catch (error) {
      const away = error instanceof ApiError && (error.status === 0 || error.status === 408 || error.status >= 500);
      if (!away || Date.now() - begin > OUTAGE) throw error;
      await pause();
    }
  }
}

/// The SHA-256 of a part. Browsers make it for pages that came by HTTPS or from this machine only; without it, the service's own is
/// believed.
async function hashOf(bytes: ArrayBuffer): Promise<Uint8Array | null> {
  return crypto.subtle ? new Uint8Array(await crypto.subtle.digest('SHA-256', bytes)) : null;
}

const hex = (bytes: Uint8Array) => [...bytes].map((byte) => byte.toString(16).padStart(2, '0')).join('');

/// Sends a file; `told` gets the share that is there, 0 to 1.
export async function sendMesh(file: File, told: (share: number) => void, signal: AbortSignal): Promise<Upload> {
  const name = plain(file.name);
  const before = await patiently(() => get<OpenUpload[]>('/open-uploads', signal));
  const same = before.find((upload) => upload.name === name && upload.state === 'open');
  const open = await patiently(() =>
    same ? get<OpenUpload>(`/open-uploads/${same.id}`, signal) : send<OpenUpload>('POST', '/open-uploads', { name }),
  );
  const size = Math.min(open.largest_part_bytes, Math.max(open.part_bytes, Math.ceil(file.size / PARTS)));
  const parts: { number: number; sha256: string }[] = [];
  for (let begin = 0; begin < file.size; begin += size) {
    const number = parts.length + 1;
    const bytes = await file.slice(begin, begin + size).arrayBuffer();
    const hash = await hashOf(bytes);
    const known = open.parts.find((part) => part.number === number);
    if (!hash || known?.sha256 !== hex(hash)) {
      const headers: Record<string, string> = { 'Content-Type': 'application/octet-stream' };
      if (hash) headers['Content-Digest'] = `sha-256=:${btoa(String.fromCharCode(...hash))}:`;
      const path = `/open-uploads/${open.id}/parts/${number}`;
      const answer = await patiently(() => request(path, { method: 'PUT', body: bytes, headers, signal }));
      parts.push({ number, sha256: (await answer.json()).sha256 });
    } else {
      parts.push({ number, sha256: known.sha256 });
    }
    told(Math.min(1, (begin + size) / file.size));
  }
  for (;;) {
    const answer = await patiently(() => send<Partial<Upload>>('POST', `/open-uploads/${open.id}/complete`, { parts }));
    if (answer.source) return answer as Upload;
    await pause();
    signal.throwIfAborted();
  }
}
