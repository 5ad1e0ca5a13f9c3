// The city viewer: its code is loaded when it is first shown.

import { useEffect, useState } from 'preact/hooks';
import { type City, type Job, cityPlace, get, jobPlace } from '../api';
import { type Route, link } from '../router';
import { Empty, Failure, Loading, useGet } from '../ui';

const viewer = () => import('../viewer/viewer');

type Viewer = Awaited<ReturnType<typeof viewer>>['Viewer'];

export function View({ route }: { route: Route }) {
  const [code, set] = useState<{ Viewer?: Viewer; error?: Error }>({});
  useEffect(() => {
    viewer().then(
      ({ Viewer }) => set({ Viewer }),
      (error) => set({ error }),
    );
  }, []);
  const [kind, id] = route.path;
  const asked = route.query.get('generation');
  // One generation is looked at, also if another is published meanwhile.
  const ofCity = kind === 'cities' && !asked;
  const current = useGet<City>(ofCity ? `/cities/${encodeURIComponent(id)}` : null, get);
  const job = useGet<Job>(kind === 'jobs' ? `/jobs/${id}` : null, get);
  const error = code.error ?? current.error ?? job.error;
  if (error) return <Failure error={error} retry={() => location.reload()} />;
  if (!code.Viewer || (ofCity && !current.value) || (kind === 'jobs' && !job.value)) return <Loading what="the viewer" />;
  const generation = asked ? Number(asked) : current.value?.generation;
  if (kind === 'cities' && generation === undefined) return <Empty title="Nothing published yet">The first job of {id} that ends well publishes it.</Empty>;
  const place = kind === 'jobs' ? jobPlace(id, `${job.value!.city}, job ${id.slice(-6)}`, job.value!.city) : cityPlace(id, generation);
  return <code.Viewer key={place.list} place={place} back={link([kind, id])} route={route} />;
}
