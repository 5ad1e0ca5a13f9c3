import { useEffect, useRef, useState } from 'preact/hooks';
import { Bar } from '../ui';
import { ENDS, type Upload, sendMesh } from '../upload';

/// Where a mesh of the looker's machine is dropped or chosen, to be sent.
export function Drop({ done }: { done: (upload: Upload) => void }) {
  const [sending, setSending] = useState<{ name: string; share: number } | null>(null);
  const [error, setError] = useState('');
  const [over, setOver] = useState(false);
  const stop = useRef<AbortController | null>(null);
  useEffect(() => () => stop.current?.abort(), []);
  const take = (file: File | null | undefined) => {
    if (!file || sending) return;
    if (!ENDS.some((end) => file.name.toLowerCase().endsWith(end))) {
      setError(`${file.name} is no mesh that can be sent: pack a folder as .zip, or send it by gable submit`);
      return;
    }
    stop.current = new AbortController();
    setError('');
    setSending({ name: file.name, share: 0 });
    sendMesh(file, (share) => setSending({ name: file.name, share }), stop.current.signal)
      .then(done, (problem: Error) => {
        if (problem.name !== 'AbortError') setError(problem.message);
      })
      .finally(() => setSending(null));
  };
  return (
    <div
      class={over ? 'drop over' : 'drop'}
      onDragOver={(e) => {
        e.preventDefault();
        setOver(true);
      }}
      onDragLeave={() => setOver(false)}
      onDrop={(e) => {
        e.preventDefault();
        setOver(false);
        take(e.dataTransfer?.files[0]);
      }}
    >
      {sending ? (
        <>
          <span role="status">Sending {sending.name}: {Math.floor(sending.share * 100)} %</span>
          <Bar value={sending.share} label={`Sending ${sending.name}`} />
          <button type="button" class="quiet" onClick={() => stop.current?.abort()}>Stop</button>
        </>
      ) : (
        <label>
          Or drop a mesh of your machine here: {ENDS.join(', ')}
          <input type="file" accept={ENDS.join(',')} onChange={(e) => take(e.currentTarget.files?.[0])} />
        </label>
      )}
      {error && <p class="inline-error" role="alert">{error}</p>}
    </div>
  );
}
