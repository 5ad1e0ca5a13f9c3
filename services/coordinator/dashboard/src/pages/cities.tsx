import { type City, pages } from '../api';
import { ago } from '../format';
import { link } from '../router';
import { Empty, Failure, Loading, useGet, useNow } from '../ui';

export function Cities() {
  const { value, error, again } = useGet<City[]>('/cities', (path) =>
    pages<City, { cities: City[]; next?: string }>(path, (page) => page.cities, 'after', 5000));
  const now = useNow(30_000);
  return (
    <>
      <h1>Cities</h1>
      {error && <Failure error={error} retry={again} />}
      {!value && !error && <Loading what="the cities" />}
      {value?.length === 0 && <Empty title="No city yet">A job that ends well makes one: <a href={link(['submit'])}>submit a job</a>.</Empty>}
      {!!value?.length && (
        <ul class="cards">
          {value.map((city) => (
            <li class="card" key={city.name}>
              <h2><a class="plain" href={link(['cities', city.name])}>{city.name}</a></h2>
              <p class="dim">{city.generation ? `generation ${city.generation}` : 'nothing published yet'}, added {ago(city.created, now)}</p>
              <p class="actions">
                {city.generation && <a class="button primary" href={link(['cities', city.name, 'view'])}>Open</a>}
                {city.generation && <a class="button" href={link(['cities', city.name])}>Generations</a>}
                <a class="button" href={link(['jobs'], { city: city.name })}>Jobs</a>
              </p>
            </li>
          ))}
        </ul>
      )}
    </>
  );
}
